from __future__ import annotations

from collections.abc import Callable

import pytest
from rigs.cells.jog_undos import at_rest, refused_by_the_planner, step, undo
from rigs.cells.server_rig import ready
from rigs.motion.jog_pad import JogPad

from openpendant.server.planning.jobs import JointPathJob
from openpendant.server.settings.cell_settings import ControllerPath
from openpendant.simplemsg.pendant import MotionControlAction, Verdict
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


def refused_step_plan(pad: JogPad) -> None:
    refused_by_the_planner(pad.rig, lambda: step(pad, 0.1, 0.0))


def refused_step(pad: JogPad) -> None:
    assert step(pad, 9.0, 0.0) is V.OUT_OF_RANGE


def refused_undo_plan(pad: JogPad) -> None:
    refused_by_the_planner(pad.rig, lambda: undo(pad))


def refused_undo(pad: JogPad) -> None:
    assert undo(pad, speed=0.0) is V.BAD_ARGUMENT


def refused_press(pad: JogPad) -> None:
    assert pad.press(2.0, 0.0) is V.BAD_ARGUMENT


def refused_move_plan(pad: JogPad) -> None:
    refused_by_the_planner(pad.rig, lambda: pad.pendant.path((0.5, 0.5), (1.0, 1.0)))


def ended_while_it_was_planned(pad: JogPad) -> None:
    pad.rig.plans_at_once = False
    assert step(pad, 0.1, 0.0) is None
    assert pad.control(MotionControlAction.PROGRAM_STOP) is V.ACCEPTED
    pad.rig.plan()
    pad.rig.plans_at_once = True


@pytest.mark.parametrize(
    "happens",
    [
        refused_step_plan,
        refused_step,
        refused_undo_plan,
        refused_undo,
        refused_press,
        refused_move_plan,
        ended_while_it_was_planned,
    ],
)
def test_what_is_refused_leaves_the_way_back_of_the_jog_before_it(
    stepped: JogPad, happens: Callable[[JogPad], None]
) -> None:
    happens(stepped)
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


def other_mode(pad: JogPad) -> None:
    assert pad.mode(2) is V.ACCEPTED


@pytest.mark.parametrize("ends", [software_stop, program_stop, let_go, other_mode])
def test_an_undo_that_was_ended_on_its_way_goes_on_where_it_is_asked_for_again(
    stepped: JogPad, ends: Callable[[JogPad], None]
) -> None:
    assert undo(stepped) is V.ACCEPTED
    stepped.hold(500)
    ends(stepped)
    halfway = at_rest(stepped)
    assert 0.0 < halfway[0] < 0.3
    stepped.let_go()
    stepped.squeeze()
    stepped.hold(500)
    assert stepped.rig.controller.position == halfway, "nothing resumes by itself"
    assert undo(stepped) is V.ACCEPTED
    assert at_rest(stepped) == pytest.approx(START)
    assert undo(stepped) is V.NO_JOG_TO_UNDO


def test_an_undo_that_is_stopped_after_its_last_set_point_can_still_be_ended_well(
    stepped: JogPad,
) -> None:
    assert undo(stepped) is V.ACCEPTED
    last = stepped.rig.core.cell.motions.playing
    assert last is not None
    while last.next_time is not None:
        stepped.hold(10)
    software_stop(stepped)
    assert at_rest(stepped) != START
    stepped.let_go()
    stepped.squeeze()
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
        stepped.let_go()
        stepped.squeeze()
    points = len(stepped.rig.points)
    assert undo(stepped) is V.NO_JOG_TO_UNDO
    (verdict,) = stepped.pendant.all(Verdict)[-1:]
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
    stepped.let_go()
    stepped.squeeze()
    x, y = at_rest(stepped)
    stepped.rig.controller.be_moved((x, y + 0.02))
    stepped.hold(100)
    assert undo(stepped) is V.NO_JOG_TO_UNDO
    stepped.rig.controller.be_moved((x, y))
    stepped.hold(100)
    assert undo(stepped) is V.ACCEPTED


def without_link(pad: JogPad) -> None:
    pad.rig.path(ControllerPath.STATE, False)
    pad.hold(1_000)
    pad.rig.path(ControllerPath.STATE, True)


def without_link_for_long(pad: JogPad) -> None:
    pad.rig.path(ControllerPath.STATE, False)
    pad.hold(6_000)
    pad.rig.path(ControllerPath.STATE, True)


def without_reports(pad: JogPad) -> None:
    pad.pendant.stop()
    pad.rig.controller.reports = False
    pad.hold(1_000)
    pad.rig.controller.reports = True


@pytest.mark.parametrize("happens", [without_link, without_link_for_long, without_reports])
@pytest.mark.parametrize("stops", [False, True])
def test_a_jog_is_not_taken_back_where_nobody_saw_the_robot_come_to_rest(
    pad: JogPad, happens: Callable[[JogPad], None], stops: bool
) -> None:
    """Whoever moved it meanwhile, or is moving it when somebody presses a stop."""
    assert pad.press(1.0, 0.0) is V.ACCEPTED
    pad.hold(300)
    happens(pad)
    pad.is_pressed = False
    pad.rig.controller.be_moved((0.5, 0.5))
    pad.hold(100)
    if stops:
        pad.rig.controller.be_moved((0.5, 0.5), velocity=(0.2, 0.0))
        pad.hold(50)
        pad.pendant.stop()
    pad.hold(300)
    pad.pendant.reset()
    pad.let_go()
    pad.squeeze()
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
    (job,) = pad.rig.jobs
    assert isinstance(job, JointPathJob)
    assert len(job.waypoints) > 1, "it goes back along the way, no straight line"
    assert job.waypoints[-1] == pytest.approx(START)
