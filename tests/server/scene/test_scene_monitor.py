"""Promise 17: an object added while the robot moves is looked for on the rest of its way."""

from collections.abc import Callable

import pytest
from rigs.cells.expectations import known, only
from rigs.cells.program_cell import ProgramCell
from rigs.cells.scene_monitor_rig import BOX, EMPTY, HIT, MonitoredRig
from rigs.cells.server_rig import LIMITS, MS, ready
from rigs.motion.jog_pad import JogPad

from openpendant.server.events.effects import Ask, SendStop
from openpendant.server.events.pending import Pending
from openpendant.server.planning.jobs import PathFree, PlanAnswer, WayCheckJob
from openpendant.server.refusal import Refusal
from openpendant.server.scene.scene_monitor import DEADLINE_NS, SceneMonitor
from openpendant.server.settings.cell_settings import ControllerLink
from openpendant.simplemsg.pendant import Activity, MotionControlAction, ProgramState, Verdict
from openpendant.simplemsg.verdicts import VerdictCode as V

PAUSE, RESUME = MotionControlAction.PAUSE, MotionControlAction.RESUME


@pytest.fixture
def moving() -> MonitoredRig:
    return MonitoredRig()


def held(mode: str = "automatic") -> tuple[MonitoredRig, WayCheckJob]:
    """Return a robot that stands on its path because nobody knows yet whether its way is free."""
    rig = MonitoredRig(mode=mode)
    job = rig.change()
    rig.wait(1_500)
    assert rig.rig.activity() is Activity.PAUSED
    return rig, job


def moves(rig: MonitoredRig) -> bool:
    before = rig.rig.controller.position
    rig.wait(500)
    return rig.rig.controller.position != before


@pytest.mark.parametrize(
    "stop",
    [lambda pad: pad.control(PAUSE), lambda pad: pad.speed(0.0)],
    ids=["a pause", "an override of 0"],
)
def test_what_somebody_paused_while_it_was_held_waits_for_its_resume(
    stop: Callable[[JogPad], V | None],
) -> None:
    rig, job = held()
    assert stop(rig.pad) is V.ACCEPTED
    rig.answer(job, PathFree())
    assert not moves(rig)
    assert rig.rig.activity() is Activity.PAUSED
    rig.pad.speed(1.0)
    assert not moves(rig)
    assert rig.pad.control(RESUME) is V.ACCEPTED
    assert moves(rig)


def test_a_resume_does_not_move_a_robot_whose_way_nobody_has_looked_at() -> None:
    rig, job = held()
    rig.pad.control(PAUSE)
    assert rig.pad.control(RESUME) is V.ACCEPTED
    assert "whether the way" in rig.pendant.all(Verdict)[-1].text
    assert not moves(rig)
    assert rig.rig.activity() is Activity.PAUSED
    rig.answer(job, PathFree())
    assert moves(rig)


def test_where_nobody_paused_there_is_nothing_to_resume_and_it_is_said_why_it_stands() -> None:
    rig, job = held()
    assert rig.pad.control(RESUME) is V.NOTHING_TO_CONTROL
    assert "whether the way" in rig.pendant.all(Verdict)[-1].text
    assert not moves(rig)
    assert rig.pendant.move(0.0, 0.0) is V.PAUSED
    assert "whether the way" in rig.pendant.all(Verdict)[-1].text
    rig.answer(job, PathFree())
    assert moves(rig)


def test_a_resume_of_what_nobody_holds_says_nothing_more(moving: MonitoredRig) -> None:
    moving.pad.control(PAUSE)
    assert moving.pad.control(RESUME) is V.ACCEPTED
    assert moving.pendant.all(Verdict)[-1].text == ""


def test_a_resume_while_the_answer_is_late_moves_nothing(moving: MonitoredRig) -> None:
    moving.pad.control(PAUSE)
    moving.wait(1_500)
    moving.change()
    moving.wait(100)
    assert moving.pad.control(RESUME) is V.ACCEPTED
    assert not moves(moving)


def test_a_second_change_of_the_scene_holds_on() -> None:
    rig, first = held()
    second = rig.change()
    rig.answer(first, PathFree())
    assert not moves(rig)
    rig.answer(second, PathFree())
    assert moves(rig)


def test_to_let_go_of_enabling_ends_what_is_held_and_was_paused_by_nobody() -> None:
    rig, job = held("manual_reduced")
    rig.pad.let_go()
    rig.wait(10)
    assert rig.pendant.outcomes()[-1][1] is V.ENABLING_LOST
    rig.pad.squeeze()
    rig.answer(job, PathFree())
    assert not moves(rig)


def test_a_way_that_is_free_moves_nothing_that_is_not_enabled_any_more() -> None:
    """Its device fell silent, and no tick has come between."""
    rig, job = held("manual_reduced")
    rig.rig.now += 250 * MS
    before = len(rig.rig.points)
    assert isinstance(rig.answer(job, PathFree())[0], SendStop)
    assert rig.pendant.outcomes()[-1][1] is V.ENABLING_LOST
    assert len(rig.rig.points) == before


def test_promise_32_what_somebody_paused_may_be_let_go_while_it_is_held_too() -> None:
    rig, job = held("manual_reduced")
    rig.pad.control(PAUSE)
    rig.pad.let_go()
    rig.wait(100)
    rig.answer(job, PathFree())
    assert not moves(rig)
    assert rig.pad.control(RESUME) is V.NOT_ENABLED
    rig.pad.squeeze()
    assert rig.pad.control(RESUME) is V.ACCEPTED
    assert moves(rig)


def test_a_robot_to_which_all_was_sent_cannot_be_held_and_is_stopped() -> None:
    """Slowed down, too, when it has a path to be held on until then."""
    rig = MonitoredRig()
    rig.pad.speed(0.5)
    playing = known(rig.rig.core.cell.motions.playing)
    while playing.next_time is not None:
        rig.wait(10)
    rig.change()
    rig.rig.now += DEADLINE_NS
    out = rig.guard.tick(rig.rig.now)
    assert isinstance(out[0], SendStop)


def test_a_program_that_is_paused_while_its_robot_is_held_stays_paused() -> None:
    cell = ProgramCell(main="move PTP b speed 5 %\nmove PTP a speed 5 %\n")
    pending = Pending()
    guard = SceneMonitor(cell.core.cell, ControllerLink(), pending)
    cell.run()
    cell.pass_time(300)
    asked = only(Ask, guard.changed(BOX, cell.now))
    for _ in range(100):
        cell.wait(10)
        cell.perform(guard.tick(cell.now))
    before = cell.position
    assert cell.control(PAUSE) is V.ACCEPTED
    cell.perform(pending.resume(asked, PlanAnswer(asked.id, PathFree(), 0.01), cell.now))
    cell.pass_time(500)
    assert (cell.position, cell.reports()[-1].state) == (before, ProgramState.PAUSED)
    assert cell.control(RESUME) is V.ACCEPTED
    cell.pass_time(500)
    assert cell.position != before


def test_the_way_that_is_left_is_looked_at_and_nothing_before_it(moving: MonitoredRig) -> None:
    job = moving.change()
    assert 0.0 < job.start[0] < 0.9
    assert len(job.positions) % (8 * LIMITS.dof) == 0


def test_a_free_way_is_gone_on_without_a_halt(moving: MonitoredRig) -> None:
    job = moving.change()
    moving.wait(40)
    assert moving.answer(job, PathFree()) == []
    moving.wait(200)
    assert (moving.is_held, moving.rig.activity()) == (False, Activity.MOVING)


def test_a_late_answer_holds_the_robot_within_fifty_milliseconds(moving: MonitoredRig) -> None:
    moving.change()
    moving.wait(60)
    assert moving.is_held


@pytest.mark.parametrize("refusal", [HIT, Refusal(V.PLANNER_FAILED)], ids=["a hit", "no answer"])
def test_a_hit_or_a_failed_planner_stops_the_robot(moving: MonitoredRig, refusal: Refusal) -> None:
    job = moving.change()
    moving.wait(40)
    assert isinstance(moving.answer(job, refusal)[0], SendStop)
    assert moving.pendant.outcomes()[-1][1] is refusal.code


def test_a_second_change_makes_the_first_look_worthless(moving: MonitoredRig) -> None:
    first = moving.change()
    moving.change()
    assert moving.answer(first, HIT) == []
    assert moving.rig.activity() is Activity.MOVING


def test_nothing_is_asked_while_the_robot_stands() -> None:
    rig = ready()
    assert SceneMonitor(rig.core.cell, ControllerLink(), Pending()).changed(BOX, rig.now) == []


def planning() -> MonitoredRig:
    rig = MonitoredRig(plans_at_once=False)
    assert rig.change_scene(EMPTY) == []
    return rig


def test_a_motion_planned_for_the_scene_of_before_is_looked_at_when_it_begins() -> None:
    rig = planning()
    rig.rig.plan()
    assert rig.job(rig.guard.motion_started(rig.rig.now + MS)).scene is EMPTY


def test_an_answer_that_nobody_waits_for_does_not_spare_the_next_motion_its_look() -> None:
    rig = planning()
    assert rig.guard.motion_started(rig.rig.now) == []
    rig.rig.plan()
    assert rig.job(rig.guard.motion_started(rig.rig.now)).scene is EMPTY


def test_a_look_is_in_the_scene_in_force_whatever_was_planned_before_it() -> None:
    rig = planning()
    rig.rig.plan()
    assert rig.job(rig.change_scene(BOX)).scene is BOX
    assert rig.job(rig.guard.motion_started(rig.rig.now)).scene is BOX


def test_a_motion_that_began_in_the_scene_in_force_needs_no_look(moving: MonitoredRig) -> None:
    assert moving.guard.motion_started(moving.rig.now) == []
