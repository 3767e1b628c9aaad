"""Promise 17: an object added while the robot moves is looked for on the rest of its way."""

from __future__ import annotations

import pytest
from rigs.cells.scene_guard_rig import BOX, EMPTY, HIT, GuardedRig
from rigs.cells.server_rig import LIMITS, MS, ready

from openpendant.server.events.effects import SendStop
from openpendant.server.events.pending import Pending
from openpendant.server.planning.jobs import PathFree
from openpendant.server.refusal import Refusal
from openpendant.server.scene.scene_monitor import SceneMonitor
from openpendant.server.settings.cell_settings import ControllerLink
from openpendant.simplemsg.pendant import Activity
from openpendant.simplemsg.verdicts import VerdictCode as V


@pytest.fixture
def moving() -> GuardedRig:
    return GuardedRig()


def test_the_way_that_is_left_is_looked_at_and_nothing_before_it(moving: GuardedRig) -> None:
    job = moving.change()
    assert 0.0 < job.start[0] < 0.9
    assert len(job.positions) % (8 * LIMITS.dof) == 0


def test_a_free_way_is_gone_on_without_a_halt(moving: GuardedRig) -> None:
    job = moving.change()
    moving.wait(40)
    assert moving.answer(job, PathFree()) == []
    moving.wait(200)
    assert not moving.is_held
    assert moving.rig.activity() is Activity.MOVING


def test_what_would_touch_is_stopped_at_once(moving: GuardedRig) -> None:
    job = moving.change()
    moving.wait(40)
    out = moving.answer(job, HIT)
    assert isinstance(out[0], SendStop)
    assert moving.pendant.outcomes()[-1][1] is V.PATH_IN_COLLISION


def test_a_late_answer_holds_the_robot_within_fifty_milliseconds(moving: GuardedRig) -> None:
    moving.change()
    moving.wait(60)
    assert moving.is_held


def test_a_robot_that_was_held_goes_on_when_its_way_is_free(moving: GuardedRig) -> None:
    job = moving.change()
    moving.wait(500)
    moving.answer(job, PathFree())
    assert not moving.is_held


def test_a_planner_that_fails_stops_the_robot(moving: GuardedRig) -> None:
    job = moving.change()
    out = moving.answer(job, Refusal(V.PLANNER_FAILED))
    assert isinstance(out[0], SendStop)


def test_a_second_change_makes_the_first_look_worthless(moving: GuardedRig) -> None:
    first = moving.change()
    moving.change()
    assert moving.answer(first, HIT) == []
    assert moving.rig.activity() is Activity.MOVING


def test_nothing_is_asked_while_the_robot_stands() -> None:
    rig = ready()
    assert SceneMonitor(rig.core.cell, ControllerLink(), Pending()).changed(BOX, rig.now) == []


def planning() -> GuardedRig:
    rig = GuardedRig(plans_at_once=False)
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


def test_a_motion_that_began_in_the_scene_in_force_needs_no_look(moving: GuardedRig) -> None:
    assert moving.guard.motion_started(moving.rig.now) == []
