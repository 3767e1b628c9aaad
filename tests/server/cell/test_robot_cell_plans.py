from __future__ import annotations

from collections.abc import Callable

import pytest
from rigs.cells.robot_cell_situations import GOAL, emergency_stop, error, no_power, stale
from rigs.cells.server_rig import ServerRig, ready
from rigs.peers.server_clients import Pendant

from openpendant.server.refusal import Refusal
from openpendant.simplemsg.pendant import Activity
from openpendant.simplemsg.verdicts import VerdictCode as V


def test_a_plan_that_is_refused_moves_nothing() -> None:
    rig = ready(plans_at_once=False)
    pendant = rig.holder()
    pendant.path((0.1, 0.1), GOAL)
    pendant.got.clear()
    rig.plan(Refusal(V.PLANNER_FAILED))
    assert pendant.verdicts() == [(pendant.last_request, V.PLANNER_FAILED)]
    assert rig.activity() is Activity.IDLE
    assert rig.points == []


def test_a_plan_is_worth_nothing_once_the_robot_stands_elsewhere() -> None:
    rig = ready(plans_at_once=False)
    pendant = rig.holder()
    pendant.path((0.1, 0.1), GOAL)
    rig.controller.position = (0.02, 0.0)
    rig.wait(20)
    pendant.got.clear()
    rig.plan()
    assert pendant.verdicts() == [(pendant.last_request, V.NOT_STANDING)]


@pytest.mark.parametrize("spoil", [emergency_stop, error, no_power, stale])
def test_a_plan_is_worth_nothing_once_a_condition_is_missing(
    spoil: Callable[[ServerRig, Pendant], None],
) -> None:
    rig = ready(plans_at_once=False)
    pendant = rig.holder()
    pendant.path((0.1, 0.1), GOAL)
    spoil(rig, pendant)
    rig.plan()
    assert rig.points == []
    assert rig.activity() is Activity.IDLE


def test_a_plan_that_comes_twice_starts_one_motion() -> None:
    rig = ready(plans_at_once=False)
    pendant = rig.holder()
    pendant.path((0.1, 0.1), GOAL)
    job = rig.jobs[0]
    planned = rig.plan_of(job)
    rig.plan()
    assert rig.planned(job, planned) == []


def test_an_answer_that_holds_the_plan_of_another_job_moves_nothing() -> None:
    rig = ready(plans_at_once=False)
    pendant = rig.holder()
    pendant.path((0.1, 0.1), GOAL)
    pendant.release()
    pendant.take()
    pendant.path((0.1, 0.1), (0.2, 0.2))
    first, second = rig.jobs
    assert rig.planned(second, rig.plan_of(first)) == []
    assert rig.activity() is Activity.PLANNING


def test_the_plan_of_a_refused_request_does_not_serve_the_next() -> None:
    rig = ready(plans_at_once=False)
    pendant = rig.holder()
    pendant.path((0.1, 0.1), GOAL)
    pendant.release()
    pendant.take()
    pendant.path((0.1, 0.1), (0.2, 0.2))
    assert rig.plan() == []
    rig.plan()
    assert rig.activity() is Activity.MOVING
