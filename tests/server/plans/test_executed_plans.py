"""What is executed is what was shown (promise 33), and a plan is executed at most once."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from promises.promise_table import figure
from rigs.cells.planning_pendants import PlansCell, notices
from rigs.data.example_counts import counts

from openpendant.motion.description.robot import robot_names, serial_robot
from openpendant.motion.errors import UnsupportedKind
from openpendant.simplemsg.pendant import (
    Activity,
    AuthorityBeat,
    EnablingPosition,
    MotionControl,
    MotionControlAction,
    OperatingMode,
    Outcome,
    PlanState,
)
from openpendant.simplemsg.verdicts import VerdictCode as V


@pytest.fixture
def cell() -> Iterator[PlansCell]:
    made = PlansCell()
    yield made
    assert made.controller.referee.total == 0


def handed(cell: PlansCell) -> list[tuple[float, ...]]:
    dof = cell.limits.dof
    return [point.positions[:dof] for point in cell.handed]


def assert_as_shown(cell: PlansCell, rows: list[list[float]]) -> None:
    dof = cell.limits.dof
    shown = np.array([row[1 : 1 + dof] for row in rows])
    sent = np.array(handed(cell))
    assert sent.shape == shown.shape
    assert np.abs(sent - shown).max() <= figure(33, "joint").bound
    times = [point.time for point in cell.handed]
    assert times == pytest.approx([row[0] for row in rows], abs=1e-9)


def test_promise_33_what_is_executed_is_what_was_shown(cell: PlansCell) -> None:
    plan = cell.plan()
    rows = cell.samples(plan)
    assert cell.execute(plan) is V.ACCEPTED
    planned = len(cell.jobs)
    cell.let_finish()
    assert_as_shown(cell, rows)
    assert len(cell.jobs) == planned
    assert cell.operator.outcomes()[-1][1] is V.ACCEPTED
    assert [state for state, _ in notices(cell.operator, plan)] == [
        PlanState.PLANNING,
        PlanState.READY,
        PlanState.RUNNING,
        PlanState.DONE,
    ]


GOALS: dict[str, Any] = {
    "lin": {
        "kind": "lin",
        "frame": "tool",
        "pose": {"position": [0.0, 0.0, -0.05], "orientation": [0.0, 0.0, 0.0, 1.0]},
    },
    "path": "three waypoints",
    "free": "around",
    "position": {"kind": "position", "name": "home"},
}


@pytest.mark.parametrize("kind", ["lin", "path", "free", "position"])
def test_promise_33_whatever_the_goal_it_is_executed_as_it_was_shown(
    cell: PlansCell, kind: str
) -> None:
    goal = GOALS[kind]
    if kind == "path":
        waypoints = [cell.turned(0.2), cell.turned(0.2, 5), cell.turned(-0.2)]
        goal = {"kind": "path", "waypoints": waypoints}
    if kind == "free":
        goal = {"kind": "free", "joints": cell.turned(0.3), "planner": "BuiltInRRTConnect"}
    if kind == "position":
        cell.operator.move(*cell.turned(0.2))
        cell.let_finish()
    plan = cell.plan(goal=goal)
    rows = cell.samples(plan)
    assert cell.execute(plan) is V.ACCEPTED
    cell.let_finish()
    assert_as_shown(cell, rows)


def serial_robots() -> list[str]:
    found = []
    for name in robot_names():
        try:
            serial_robot(name)
        except UnsupportedKind:
            continue
        found.append(name)
    return found


@pytest.mark.parametrize("plans", counts(3, 44))
@pytest.mark.parametrize("robot", serial_robots())
def test_promise_33_on_every_serial_robot(robot: str, plans: int) -> None:
    random = np.random.default_rng(33)
    cell = PlansCell(robot, has_surroundings=False)
    lower, upper = np.array(cell.limits.lower), np.array(cell.limits.upper)
    for number in range(plans):
        here = np.array(cell.position)
        goal = np.clip(here + random.uniform(-0.1, 0.1, len(here)), lower, upper).tolist()
        between = ((here + goal) / 2).tolist()
        curved = {"kind": "path", "waypoints": [between, goal]}
        made = cell.make(goal=curved if number % 2 else {"kind": "ptp", "joints": goal}, speed=1.0)
        rows = cell.samples(made["plan"])
        assert cell.execute(made["plan"], override_is_one=1) is V.ACCEPTED
        cell.let_finish()
        assert_as_shown(cell, rows)
    assert cell.controller.referee.total == 0


def test_at_half_the_override_it_lies_on_the_same_path(cell: PlansCell) -> None:
    goal = {"kind": "path", "waypoints": [cell.turned(0.3), cell.turned(0.3, 3)]}
    plan = cell.plan(goal=goal)
    rows = cell.samples(plan)
    assert cell.operator.speed(0.5) is V.ACCEPTED
    assert cell.execute(plan) is V.ACCEPTED
    cell.let_finish()
    assert len(cell.handed) > 1.7 * len(rows)
    assert farthest_from(rows, cell) < 2e-4


def test_paused_and_resumed_it_lies_on_the_same_path(cell: PlansCell) -> None:
    plan = cell.plan(goal={"kind": "ptp", "joints": cell.turned(1.0)})
    rows = cell.samples(plan)
    assert cell.execute(plan) is V.ACCEPTED
    cell.wait(300)
    for action in (MotionControlAction.PAUSE, MotionControlAction.RESUME):
        request = MotionControl(cell.operator._next(), action)
        assert cell.operator.code(request) is V.ACCEPTED
        for _ in range(10):
            cell.operator.send(AuthorityBeat())
            cell.wait(100)
    cell.let_finish()
    assert farthest_from(rows, cell) < 2e-4
    assert cell.position == pytest.approx(cell.turned(1.0), abs=1e-3)


def farthest_from(rows: list[list[float]], cell: PlansCell) -> float:
    """Return the greatest distance of a set-point from the line through the samples [rad]."""
    dof = cell.limits.dof
    shown = np.array([row[1 : 1 + dof] for row in rows])
    begin, way = shown[:-1], np.diff(shown, axis=0)
    lengths = (way**2).sum(axis=1)
    worst = 0.0
    for point in handed(cell):
        ahead = np.array(point) - begin
        share = np.clip((ahead * way).sum(axis=1) / np.maximum(lengths, 1e-30), 0.0, 1.0)
        gaps = np.abs(ahead - share[:, None] * way).max(axis=1)
        worst = max(worst, float(gaps.min()))
    return worst


def test_a_plan_made_under_a_cap_is_executed_as_it_was_shown(cell: PlansCell) -> None:
    assert cell.operator.mode(OperatingMode.MANUAL_HIGH) is V.ACCEPTED
    cell.operator.enable(EnablingPosition.RELEASED, EnablingPosition.HELD)
    plan = cell.plan()
    cell.operator.enable(EnablingPosition.HELD)
    rows = cell.samples(plan)
    cell.operator.enable(EnablingPosition.RELEASED, EnablingPosition.HELD)
    assert cell.execute(plan, override_is_one=1) is V.ACCEPTED
    while cell.is_executing:
        cell.operator.enable(EnablingPosition.HELD)
        cell.operator.send(AuthorityBeat())
        cell.wait(50)
    assert_as_shown(cell, rows)
    assert cell.operator.outcomes()[-1][1] is V.ACCEPTED


def test_a_plan_is_executed_once(cell: PlansCell) -> None:
    plan = cell.plan()
    assert cell.execute(plan) is V.ACCEPTED
    assert cell.execute(plan) is V.PLAN_STALE
    cell.let_finish()
    home = cell.plan(goal={"kind": "ptp", "joints": cell.turned(0.0)})
    assert cell.execute(home) is V.ACCEPTED
    cell.let_finish()
    assert cell.execute(plan) is V.PLAN_STALE
    assert cell.handed == []


def test_its_outcome_tells_how_long_it_was_planned_and_takes(cell: PlansCell) -> None:
    made = cell.make()
    assert cell.execute(made["plan"]) is V.ACCEPTED
    cell.let_finish()
    outcome = cell.operator.all(Outcome)[-1]
    assert outcome.motion_time == pytest.approx(made["duration"], abs=1e-6)
    assert outcome.plan_time == pytest.approx(made["plan_time"], abs=1e-6)


def test_another_connection_with_the_authority_executes_it_and_is_told(cell: PlansCell) -> None:
    maker = cell.other("teacher")
    plan = cell.plan(maker)
    assert cell.execute(plan, cell.operator) is V.ACCEPTED
    cell.let_finish()
    assert cell.operator.outcomes()[-1][1] is V.ACCEPTED
    assert maker.outcomes() == []


def test_one_whose_maker_leaves_goes_on(cell: PlansCell) -> None:
    maker = cell.other("teacher")
    made = cell.make(maker, goal={"kind": "ptp", "joints": cell.turned(1.0)})
    waiting = cell.plan(maker)
    assert cell.execute(made["plan"], cell.operator) is V.ACCEPTED
    cell.wait(100)
    maker.close()
    assert cell.core.cell.activity is Activity.MOVING
    assert cell.state_of(made["plan"]) == "running"
    assert cell.execute(waiting) is V.PLAN_STALE
    cell.let_finish()
    assert cell.position == pytest.approx(cell.turned(1.0), abs=1e-3)
    assert cell.operator.outcomes()[-1][1] is V.ACCEPTED


def test_one_whose_executor_leaves_is_stopped_and_done(cell: PlansCell) -> None:
    plan = cell.plan(goal={"kind": "ptp", "joints": cell.turned(1.0)})
    looking_on = cell.other()
    assert cell.execute(plan) is V.ACCEPTED
    cell.wait(200)
    cell.operator.close()
    cell.wait(1_000)
    assert cell.core.cell.activity is Activity.IDLE
    assert notices(looking_on, plan)[-1] == (PlanState.DONE, V.AUTHORITY_LOST)


def test_a_stop_ends_it_and_its_end_says_why(cell: PlansCell) -> None:
    plan = cell.plan(goal={"kind": "ptp", "joints": cell.turned(1.0)})
    assert cell.execute(plan) is V.ACCEPTED
    cell.wait(200)
    cell.operator.stop()
    cell.wait(1_000)
    assert notices(cell.operator, plan)[-1] == (PlanState.DONE, V.STOPPED)
