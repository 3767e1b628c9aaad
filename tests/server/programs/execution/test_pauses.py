from collections.abc import Callable

import pytest
from rigs.cells.program_cell import ProgramCell
from rigs.cells.robot_cell_situations import at_a_pad, enabled
from rigs.cells.server_rig import LIMITS, ServerRig, ready
from rigs.motion.jog_pad import JogPad

from openpendant.server.events.effects import Ask, Effect, SendToController
from openpendant.server.planning.jobs import BlockJob
from openpendant.simplemsg import JointTrajPtFull, joint_array
from openpendant.simplemsg import pendant as messages
from openpendant.simplemsg.pendant import Activity, MotionControlAction, ProgramState, RunKind
from openpendant.simplemsg.verdicts import VerdictCode as V

PAUSE, RESUME, STOP = MotionControlAction
GOAL = (1.5, -1.0)


def moving() -> tuple[ServerRig, JogPad]:
    rig, pad = at_a_pad()
    assert pad.pendant.path((0.5, 0.5), GOAL, speed=0.5) is V.ACCEPTED
    pad.hold(200)
    assert rig.activity() is Activity.MOVING
    return rig, pad


def executed(rig: ServerRig) -> list[JointTrajPtFull]:
    return [
        item.message
        for _, item in rig.log
        if isinstance(item, SendToController) and isinstance(item.message, JointTrajPtFull)
    ]


def test_a_pause_comes_to_rest_and_holds_for_as_long_as_it_lasts() -> None:
    rig, pad = moving()
    pad.control(PAUSE)
    assert rig.activity() is Activity.PAUSING
    pad.hold(1_000)
    assert rig.activity() is Activity.PAUSED
    stood = rig.controller.position
    pad.hold(1_500)
    assert rig.controller.position == stood
    assert pad.pendant.move(0.0, 0.0) is V.PAUSED


def test_an_override_slows_down_and_the_limits_hold() -> None:
    rig, pad = moving()
    for override in (0.3, 1.0, 0.05, 0.7, 1.0):
        assert pad.speed(override) is V.ACCEPTED
        pad.hold(200)
    pad.hold(6_000)
    assert rig.controller.position == pytest.approx(GOAL, abs=1e-6)
    before = executed(rig)[0]
    for point in executed(rig)[1:]:
        step = point.time - before.time
        for joint in range(2):
            assert abs(point.velocities[joint]) <= LIMITS.velocity[joint] * (1 + 1e-6)
            gain = abs(point.velocities[joint] - before.velocities[joint])
            assert gain <= LIMITS.acceleration[joint] * step * (1 + 1e-3) + 1e-6
        before = point


@pytest.mark.parametrize("override", [0.01, 0.3, 0.99])
def test_a_motion_that_begins_under_an_override_begins_at_rest(override: float) -> None:
    rig, pad = at_a_pad()
    assert pad.speed(override) is V.ACCEPTED
    assert pad.pendant.move(0.02, 0.0) is V.ACCEPTED
    pad.hold(100)
    first = executed(rig)[0]
    assert (first.time, first.velocities[:2]) == (0.0, (0.0, 0.0))


def test_promise_32_an_override_of_0_pauses_and_raised_again_it_resumes_nothing_by_itself() -> None:
    rig, pad = moving()
    assert pad.speed(0.0) is V.ACCEPTED
    pad.hold(700)
    assert rig.activity() is Activity.PAUSED
    assert pad.control(RESUME) is V.OVERRIDE_ZERO
    stood = rig.controller.position
    assert pad.speed(1.0) is V.ACCEPTED
    pad.hold(1_000)
    assert (rig.activity(), rig.controller.position) == (Activity.PAUSED, stood)
    assert pad.control(RESUME) is V.ACCEPTED
    pad.hold(4_000)
    assert rig.controller.position == pytest.approx(GOAL, abs=1e-6)


def test_a_resume_goes_on_at_the_override_that_was_set_meanwhile() -> None:
    rig, pad = moving()
    pad.speed(0.0)
    pad.hold(500)
    pad.speed(0.1)
    pad.control(RESUME)
    pad.hold(400)
    assert 0.0 < abs(executed(rig)[-1].velocities[0]) <= 0.1 * LIMITS.velocity[0] * (1 + 1e-6)


STEP = messages.JogStep(7, 0.5, messages.JogSpace.JOINTS, "", 2, joint_array((0.1, 0.0)))
ASKED: dict[str, Callable[[JogPad], V | None]] = {
    "move": lambda pad: pad.pendant.move(0.5, 0.5),
    "path": lambda pad: pad.pendant.path((0.5, 0.5)),
    "home": lambda pad: pad.home(),
    "step": lambda pad: pad.pendant.code(STEP),
    "press": lambda pad: pad.press(1.0, 0.0),
    "run": lambda pad: pad.pendant.code(messages.ProgramRun(7, 1, 0, 1, 0, 1.0, "main")),
}


@pytest.mark.parametrize("kind", ASKED)
def test_nothing_that_cannot_move_is_accepted_at_an_override_of_0(kind: str) -> None:
    rig, pad = enabled()
    assert pad.speed(0.0) is V.ACCEPTED
    assert ASKED[kind](pad) is V.OVERRIDE_ZERO
    pad.hold(200)
    assert (rig.activity(), rig.points, rig.jobs) == (Activity.IDLE, [], [])


def test_a_motion_that_is_planned_while_the_override_falls_to_0_is_refused() -> None:
    rig, pad = at_a_pad(plans_at_once=False)
    assert pad.pendant.path(GOAL) is None
    assert pad.speed(0.0) is V.ACCEPTED
    rig.plan()
    assert pad.pendant.verdicts()[-1][1] is V.OVERRIDE_ZERO
    assert rig.activity() is Activity.IDLE


def test_a_lower_cap_slows_what_moves_and_a_higher_one_makes_nothing_faster_than_planned() -> None:
    rig, pad = enabled()
    assert pad.pendant.path(GOAL, speed=0.5) is V.ACCEPTED
    pad.hold(200)
    assert pad.speed(1.0, 0.125) is V.ACCEPTED
    pad.hold(500)
    assert abs(executed(rig)[-1].velocities[0]) == pytest.approx(0.5 * LIMITS.velocity[0], rel=0.02)
    assert pad.speed(1.0, 0.25) is V.ACCEPTED
    pad.hold(300)
    assert abs(executed(rig)[-1].velocities[0]) <= LIMITS.velocity[0] * (1 + 1e-6)


@pytest.mark.parametrize("action", [PAUSE, RESUME, STOP])
def test_with_nothing_under_way_there_is_nothing_to_control(action: MotionControlAction) -> None:
    assert JogPad(ready()).control(action) is V.NOTHING_TO_CONTROL


@pytest.mark.parametrize("action", [PAUSE, RESUME, STOP])
def test_an_observer_controls_nothing_but_the_stop(action: MotionControlAction) -> None:
    rig, _ = moving()
    observer = JogPad(rig, "observer", takes=False)
    assert observer.control(action) is V.HELD_BY_OTHER
    assert observer.speed(0.1) is V.HELD_BY_OTHER
    assert observer.mode(1) is V.HELD_BY_OTHER
    assert observer.pendant.stop() is V.ACCEPTED


def test_promise_32_in_manual_a_pause_may_let_go_but_a_resume_asks_for_enabling() -> None:
    rig, pad = enabled()
    pad.pendant.path(GOAL)
    pad.hold(100)
    pad.control(PAUSE)
    pad.hold(700)
    pad.let_go()
    pad.hold(500)
    assert rig.activity() is Activity.PAUSED
    assert pad.control(RESUME) is V.NOT_ENABLED
    pad.squeeze()
    assert pad.control(RESUME) is V.ACCEPTED
    pad.hold(100)
    pad.let_go()
    pad.hold(20)
    assert pad.pendant.outcomes()[-1][1] is V.ENABLING_LOST


def test_a_program_stop_ends_without_a_latch() -> None:
    rig, pad = moving()
    assert pad.control(STOP) is V.ACCEPTED
    assert pad.pendant.outcomes()[-1][1] is V.PROGRAM_STOPPED
    pad.hold(200)
    assert rig.core.cell.stop is None
    assert pad.pendant.move(0.0, 0.0) is V.ACCEPTED


def test_who_lets_go_while_the_robot_still_brakes_for_a_pause_stops_it() -> None:
    rig, pad = enabled("manual_high")
    assert pad.pendant.move(1.5, 0.0) is V.ACCEPTED
    pad.hold(600)
    assert pad.control(MotionControlAction.PAUSE) is V.ACCEPTED
    pad.hold(30)
    assert rig.activity() is Activity.PAUSING
    pad.let_go()
    rig.wait(10)
    assert len(rig.stops) == 1
    assert pad.pendant.outcomes()[-1][1] is V.ENABLING_LOST


ALL, FORWARD, BACKWARD = RunKind
THERE_AND_BACK = "move PTP a\nmove PTP b\nmove PTP c\nmove PTP a\n"


def activity(cell: ProgramCell) -> Activity:
    return cell.core.cell.activity


class SlowPlanning(ProgramCell):
    def __init__(self, **programs: str) -> None:
        self.unplanned: list[Effect] = []
        super().__init__(**programs)

    def perform(self, outgoing: list[Effect]) -> list[Effect]:
        self.unplanned = [each for each in outgoing if _plans_motion(each)] or self.unplanned
        return super().perform([each for each in outgoing if not _plans_motion(each)])

    def plan(self) -> None:
        held, self.unplanned = self.unplanned, []
        super().perform(held)


def _plans_motion(item: Effect) -> bool:
    return isinstance(item, Ask) and isinstance(item.question, BlockJob)


@pytest.mark.parametrize("state", [ProgramState.PAUSED, ProgramState.AT_BREAKPOINT])
def test_a_program_that_is_paused_between_motions_shows_paused(state: ProgramState) -> None:
    cell = ProgramCell(main="wait 0.1 s\nwait 9 s\n")
    if state is ProgramState.AT_BREAKPOINT:
        cell.user.ask("programs.breakpoints", name="main", statements=[1])
    cell.run()
    cell.pass_time(300)
    if state is ProgramState.PAUSED:
        cell.control(PAUSE)
    assert cell.reports()[-1].state == state
    assert activity(cell) is Activity.PAUSED
    assert cell.user.ask("snapshot")["activity"] == "paused"
    assert cell.control(RESUME) is V.ACCEPTED
    assert activity(cell) is Activity.IDLE
    assert cell.control(STOP) is V.ACCEPTED
    assert activity(cell) is Activity.IDLE


@pytest.mark.parametrize("statements", ["wait 2 s\n", THERE_AND_BACK])
def test_promise_32_an_override_of_0_pauses_a_program_which_then_waits_for_its_resume(
    statements: str,
) -> None:
    cell = ProgramCell(main=statements)
    cell.run()
    cell.pass_time(300)
    assert cell.user.speed(0.0) is V.ACCEPTED
    cell.pass_time(1_000)
    assert activity(cell) is Activity.PAUSED
    assert cell.reports()[-1].state == ProgramState.PAUSED
    for kind in (ALL, FORWARD):
        assert cell.run(kind=kind) is V.OVERRIDE_ZERO
    assert cell.control(RESUME) is V.OVERRIDE_ZERO
    stood = cell.position
    assert cell.user.speed(1.0) is V.ACCEPTED
    cell.pass_time(3_000)
    assert (activity(cell), cell.position) == (Activity.PAUSED, stood)
    assert cell.control(RESUME) is V.ACCEPTED
    assert cell.until_outcomes() == [V.ACCEPTED]
    assert not any(cell.controller.referee.counts.values())


def test_a_point_is_taught_while_a_motion_of_a_program_is_paused() -> None:
    cell = ProgramCell(main=THERE_AND_BACK)
    cell.run()
    cell.pass_time(500)
    cell.control(PAUSE)
    moving = cell.user.ask("programs.record", name="main", expected_revision=1, point="here")
    assert moving["code"] == V.MOVING
    cell.pass_time(1_000)
    assert activity(cell) is Activity.PAUSED
    kept = cell.user.ask("programs.record", name="main", expected_revision=1, point="here")
    assert kept["revision"] == 2
    assert cell.control(RESUME) is V.ACCEPTED


def test_a_step_back_inside_a_statement_says_what_is_accepted() -> None:
    cell = ProgramCell(main=THERE_AND_BACK)
    assert cell.run(kind=BACKWARD) is V.PROGRAM_NOT_RUNNING
    assert "paused between two statements" in cell.user.all(messages.Verdict)[-1].text
    cell.run(kind=FORWARD)
    cell.until_outcomes(1)
    cell.run(kind=FORWARD, speed=0.05)
    cell.pass_time(200)
    cell.control(PAUSE)
    cell.pass_time(500)
    assert cell.run(kind=BACKWARD) is V.STEP_BACK_REFUSED
    assert "accepted: step forward, then back" in cell.user.all(messages.Verdict)[-1].text
    assert cell.run(kind=FORWARD) is V.ACCEPTED
    cell.until_outcomes(2)
    assert cell.run(kind=BACKWARD) is V.ACCEPTED


@pytest.mark.parametrize(
    "pause",
    [lambda cell: cell.control(PAUSE), lambda cell: cell.user.speed(0.0)],
    ids=["a pause", "an override of 0"],
)
def test_a_program_that_is_paused_while_its_block_is_planned_does_not_leave_the_start(
    pause: Callable[[ProgramCell], V],
) -> None:
    cell = SlowPlanning(main=THERE_AND_BACK)
    cell.run()
    assert cell.unplanned
    start = cell.position
    assert pause(cell) is V.ACCEPTED
    cell.plan()
    cell.pass_time(1_000)
    assert cell.position == pytest.approx(start, abs=1e-6)
    assert (activity(cell), cell.user.outcomes()) == (Activity.PAUSED, [])
    cell.user.speed(1.0)
    assert cell.control(RESUME) is V.ACCEPTED
    cell.pass_time(1_000)
    assert cell.position != pytest.approx(start, abs=1e-3)
