"""Anything in any order: an undo moves where the last motion that began was a jog, and only there.

The model remembers what began last and where that jog began; an undo leads there and nowhere else.
"""

from collections.abc import Callable

import pytest
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, precondition, rule
from rigs.cells.expectations import known, only
from rigs.cells.jog_undos import at_rest, refused_by_the_planner, step, undo
from rigs.cells.server_rig import ready
from rigs.data.example_counts import examples
from rigs.motion.jog_pad import JogPad

from openpendant.server.planning.jobs import JointPathJob
from openpendant.server.settings.cell_settings import ControllerPath
from openpendant.simplemsg.pendant import MotionControlAction, OperatingMode, Verdict
from openpendant.simplemsg.verdicts import VerdictCode as V

START, STEPPED = (0.0, 0.0), (0.3, 0.0)


@pytest.fixture
def pad() -> JogPad:
    """A pendant in T1 that enabled, at a robot that stands at `START`."""
    made = JogPad(ready(modes={"initial": "manual_reduced"}))
    made.squeeze()
    return made


@pytest.fixture
def stepped(pad: JogPad) -> JogPad:
    assert step(pad, *STEPPED) is V.ACCEPTED
    assert at_rest(pad) == pytest.approx(STEPPED)
    return pad


def test_after_a_refused_increment_the_next_motion_is_not_taken_back(stepped: JogPad) -> None:
    refused_by_the_planner(stepped.rig, lambda: step(stepped, 0.1, 0.0))
    assert stepped.pendant.move(0.3, 0.5) is V.ACCEPTED
    place = at_rest(stepped)
    assert undo(stepped) is V.NO_JOG_TO_UNDO
    assert at_rest(stepped) == place


REFUSED: dict[str, tuple[Callable[[JogPad], V | None], V | None]] = {
    "a step": (lambda pad: step(pad, 9.0, 0.0), V.OUT_OF_RANGE),
    "an undo": (lambda pad: undo(pad, speed=0.0), V.BAD_ARGUMENT),
    "a press": (lambda pad: pad.press(2.0, 0.0), V.BAD_ARGUMENT),
    "the plan of a step": (lambda pad: step(pad, 0.1, 0.0), None),
    "the plan of an undo": (undo, None),
    "the plan of a path": (lambda pad: pad.pendant.path((0.5, 0.5), (1.0, 1.0)), None),
}


@pytest.mark.parametrize(("ask", "code"), REFUSED.values(), ids=REFUSED)
def test_what_is_refused_leaves_the_way_back_of_the_jog_before_it(
    stepped: JogPad, ask: Callable[[JogPad], V | None], code: V | None
) -> None:
    if code is None:
        refused_by_the_planner(stepped.rig, lambda: ask(stepped))
    else:
        assert ask(stepped) is code
    assert undo(stepped) is V.ACCEPTED
    assert at_rest(stepped) == pytest.approx(START)


def test_a_step_that_was_ended_while_it_was_planned_leaves_the_way_back_of_the_jog_before_it(
    stepped: JogPad,
) -> None:
    stepped.rig.plans_at_once = False
    assert step(stepped, 0.1, 0.0) is None
    program_stop(stepped)
    stepped.rig.plan()
    stepped.rig.plans_at_once = True
    assert undo(stepped) is V.ACCEPTED
    assert at_rest(stepped) == pytest.approx(START)


def software_stop(pad: JogPad) -> None:
    pad.pendant.stop()
    pad.hold(300)
    assert pad.pendant.reset() is V.ACCEPTED


def program_stop(pad: JogPad) -> None:
    assert pad.control(MotionControlAction.PROGRAM_STOP) is V.ACCEPTED


def let_go(pad: JogPad) -> None:
    pad.let_go()
    pad.hold(20)


def enable(pad: JogPad) -> None:
    pad.let_go()
    pad.squeeze()


@pytest.mark.parametrize("ends", [software_stop, program_stop, let_go, lambda pad: pad.mode(2)])
def test_an_undo_that_was_ended_on_its_way_goes_on_where_it_is_asked_for_again(
    stepped: JogPad, ends: Callable[[JogPad], V | None]
) -> None:
    assert undo(stepped) is V.ACCEPTED
    stepped.hold(500)
    assert ends(stepped) in (V.ACCEPTED, None)
    halfway = at_rest(stepped)
    assert 0.0 < halfway[0] < 0.3
    enable(stepped)
    stepped.hold(500)
    assert stepped.rig.controller.position == halfway, "nothing resumes by itself"
    assert undo(stepped) is V.ACCEPTED
    assert at_rest(stepped) == pytest.approx(START)
    assert undo(stepped) is V.NO_JOG_TO_UNDO


def test_an_undo_that_is_stopped_after_its_last_set_point_can_still_be_ended_well(
    stepped: JogPad,
) -> None:
    assert undo(stepped) is V.ACCEPTED
    last = known(stepped.rig.core.cell.motions.playing)
    while last.next_time is not None:
        stepped.hold(10)
    software_stop(stepped)
    assert at_rest(stepped) != START
    enable(stepped)
    assert undo(stepped) is V.ACCEPTED
    assert at_rest(stepped) == pytest.approx(START)


def test_the_rest_of_an_undo_is_not_taken_back_after_another_motion(stepped: JogPad) -> None:
    assert undo(stepped) is V.ACCEPTED
    stepped.hold(500)
    program_stop(stepped)
    at_rest(stepped)
    assert stepped.pendant.move(0.5, 0.5) is V.ACCEPTED
    at_rest(stepped)
    assert undo(stepped) is V.NO_JOG_TO_UNDO


@pytest.mark.parametrize("stops", [False, True])
def test_a_robot_that_its_own_pendant_moved_away_is_not_led_back(
    stepped: JogPad, stops: bool
) -> None:
    stepped.rig.controller.be_moved((0.3, -0.02))
    stepped.hold(100)
    if stops:
        software_stop(stepped)
        enable(stepped)
    points = len(stepped.rig.points)
    assert undo(stepped) is V.NO_JOG_TO_UNDO
    verdict = stepped.pendant.all(Verdict)[-1]
    assert (verdict.joint, verdict.value, verdict.limit) == (1, -0.02, 0.0)
    stepped.hold(100)
    assert len(stepped.rig.points) == points


def test_a_robot_that_its_own_pendant_moved_away_and_back_is_led_back(stepped: JogPad) -> None:
    for place in ((0.5, 0.5), STEPPED):
        stepped.rig.controller.be_moved(place)
        stepped.hold(100)
    assert undo(stepped) is V.ACCEPTED
    assert at_rest(stepped) == pytest.approx(START)


def test_an_undo_goes_on_only_from_where_its_stop_left_the_robot(stepped: JogPad) -> None:
    assert undo(stepped) is V.ACCEPTED
    stepped.hold(500)
    software_stop(stepped)
    enable(stepped)
    x, y = at_rest(stepped)
    stepped.rig.controller.be_moved((x, y + 0.02))
    stepped.hold(100)
    assert undo(stepped) is V.NO_JOG_TO_UNDO
    stepped.rig.controller.be_moved((x, y))
    stepped.hold(100)
    assert undo(stepped) is V.ACCEPTED


def without_link(pad: JogPad, milliseconds: int) -> None:
    pad.rig.path(ControllerPath.STATE, False)
    pad.hold(milliseconds)
    pad.rig.path(ControllerPath.STATE, True)


def without_reports(pad: JogPad, milliseconds: int) -> None:
    pad.pendant.stop()
    pad.rig.controller.reports = False
    pad.hold(milliseconds)
    pad.rig.controller.reports = True


@pytest.mark.parametrize(
    ("happens", "milliseconds"),
    [(without_link, 1_000), (without_link, 6_000), (without_reports, 1_000)],
)
@pytest.mark.parametrize("stops", [False, True])
def test_a_jog_is_not_taken_back_where_nobody_saw_the_robot_come_to_rest(
    pad: JogPad, happens: Callable[[JogPad, int], None], milliseconds: int, stops: bool
) -> None:
    """Whoever moved it meanwhile, or is moving it when somebody presses a stop."""
    assert pad.press(1.0, 0.0) is V.ACCEPTED
    pad.hold(300)
    happens(pad, milliseconds)
    pad.is_pressed = False
    pad.rig.controller.be_moved((0.5, 0.5))
    pad.hold(100)
    if stops:
        pad.rig.controller.be_moved((0.5, 0.5), velocity=(0.2, 0.0))
        pad.hold(50)
        pad.pendant.stop()
    pad.hold(300)
    pad.pendant.reset()
    enable(pad)
    assert undo(pad) is V.NO_JOG_TO_UNDO


def test_two_presses_of_one_jog_are_taken_back_together(pad: JogPad) -> None:
    assert pad.press(1.0, 0.0) is V.ACCEPTED
    pad.hold(300)
    assert pad.press(0.0, 1.0) is V.ACCEPTED
    pad.hold(300)
    pad.release()
    at_rest(pad)
    pad.rig.plans_at_once = False
    undo(pad)
    job = only(JointPathJob, pad.rig.jobs)
    assert len(job.waypoints) > 1, "it goes back along the way, no straight line"
    assert job.waypoints[-1] == pytest.approx(START)


MODES = (OperatingMode.MANUAL_REDUCED, OperatingMode.MANUAL_HIGH, OperatingMode.RECOVERY)
ENDS = ("arrival", "software stop", "program stop", "mode", "enabling")

small = st.sampled_from((-0.3, -0.05, 0.05, 0.3))
increments = st.tuples(small, small)
rates = st.tuples(st.sampled_from((-1.0, 1.0)), st.sampled_from((-0.5, 0.0, 1.0)))
ends = st.sampled_from(ENDS)
while_ticks = st.integers(1, 60)


class Undo(RuleBasedStateMachine):
    @initialize(mode=st.sampled_from(MODES))
    def start(self, mode: OperatingMode) -> None:
        caps = {"joint_speed": 1.0, "tool_speed": 1.0}
        self.rig = ready(modes={"initial": mode.name.lower()}, jog=caps)
        self.pad = JogPad(self.rig)
        self.pad.squeeze()
        self.mode = mode
        self.last_began_at: tuple[float, ...] | None = None
        self.stood = self.rig.controller.position

    @property
    def here(self) -> tuple[float, ...]:
        return self.rig.controller.position

    def _end(self, how: str, ticks: int) -> bool:
        if how == "arrival":
            at_rest(self.pad)
            return True
        for _ in range(ticks):
            self.pad.hold(10)
        has_ended = not self.rig.core.cell.is_busy
        match how:
            case "software stop":
                software_stop(self.pad)
            case "program stop":
                self.pad.control(MotionControlAction.PROGRAM_STOP)
            case "mode":
                self._turn(MODES[(MODES.index(self.mode) + 1) % len(MODES)])
            case "enabling":
                let_go(self.pad)
        at_rest(self.pad)
        enable(self.pad)
        return has_ended

    def _turn(self, mode: OperatingMode) -> None:
        assert self.pad.mode(mode) is V.ACCEPTED
        self.mode = mode

    # Jogs.

    @rule(rates=rates, how=ends, ticks=while_ticks)
    def press(self, rates: tuple[float, float], how: str, ticks: int) -> None:
        began_at = self.here
        assert self.pad.press(*rates) is V.ACCEPTED
        self.last_began_at = began_at
        self.pad.hold(10 * ticks)
        if how == "arrival":
            self.pad.release()
        self._end(how, 1)
        self.pad.is_pressed = False

    @rule(increments=increments, how=ends, ticks=while_ticks)
    def step(self, increments: tuple[float, float], how: str, ticks: int) -> None:
        began_at = self.here
        code = step(self.pad, *increments)
        if code is V.OUT_OF_RANGE:
            return
        assert code is V.ACCEPTED
        self.last_began_at = began_at
        self._end(how, ticks)

    @rule(how=ends, ticks=while_ticks)
    def undo(self, how: str, ticks: int) -> None:
        code = undo(self.pad)
        if self.last_began_at is None:
            assert code is V.NO_JOG_TO_UNDO
            return
        if self.last_began_at == pytest.approx(self.here, abs=1e-6):
            # It was ended before it moved.
            assert code in (V.ACCEPTED, V.NO_MOTION)
        else:
            assert code is V.ACCEPTED
        if code is not V.ACCEPTED:
            return
        if self._end(how, ticks):
            assert self.here == pytest.approx(self.last_began_at, abs=2e-3)
            self.last_began_at = None

    # Anything else.

    @precondition(lambda self: self.mode is not OperatingMode.RECOVERY)
    @rule(goal=st.tuples(st.floats(-1.8, 1.8), st.floats(-1.8, 1.8)), how=ends, ticks=while_ticks)
    def move(self, goal: tuple[float, float], how: str, ticks: int) -> None:
        if self.pad.pendant.move(*goal) is V.ACCEPTED:
            self.last_began_at = None
            self._end(how, ticks)

    @rule(mode=st.sampled_from(MODES))
    def turn_selector(self, mode: OperatingMode) -> None:
        self._turn(mode)
        enable(self.pad)

    @rule()
    def stop_and_reset(self) -> None:
        self._end("software stop", 1)

    # What is refused.

    @rule(increments=increments)
    def step_that_the_planner_refuses(self, increments: tuple[float, float]) -> None:
        if all(-2.0 <= at + by <= 2.0 for at, by in zip(self.here, increments, strict=True)):
            refused_by_the_planner(self.rig, lambda: step(self.pad, *increments))

    @rule()
    def undo_that_the_planner_refuses(self) -> None:
        if self.last_began_at is not None:
            refused_by_the_planner(self.rig, lambda: undo(self.pad))

    @precondition(lambda self: self.mode is not OperatingMode.RECOVERY)
    @rule()
    def move_that_the_planner_refuses(self) -> None:
        refused_by_the_planner(self.rig, lambda: self.pad.pendant.path((0.5, 0.5), (1.0, 1.0)))

    @rule()
    def refused_before_it_is_planned(self) -> None:
        assert step(self.pad, 9.0, 0.0) is V.OUT_OF_RANGE
        assert step(self.pad, 0.1, 0.1, speed=0.0) is V.BAD_ARGUMENT
        assert undo(self.pad, speed=2.0) is V.BAD_ARGUMENT
        assert self.pad.press(1.5, 0.0) is V.BAD_ARGUMENT
        self.pad.let_go()
        assert step(self.pad, 0.1, 0.1) is V.NOT_ENABLED
        assert undo(self.pad) is V.NOT_ENABLED
        self.pad.squeeze()

    @invariant()
    def the_robot_stands_between_what_is_asked(self) -> None:
        self.pad.hold(20)
        assert not any(self.rig.controller.state(self.rig.now)[1])


TestUndo = Undo.TestCase
TestUndo.settings = settings(max_examples=examples(8, in_soak=600), stateful_step_count=25)
