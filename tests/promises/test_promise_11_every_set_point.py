"""Promise 11: what is sent keeps position, velocity and acceleration of every joint.

Judged with arithmetic of its own, and with that of the emulated controller's referee.
"""

from __future__ import annotations

import numpy as np
import pytest
from emulated_cell import EmulatedCell
from server_clients import Pendant

from openpendant.motion.errors import MotionError
from openpendant.motion.limits import JointLimits
from openpendant.motion.ptp import plan_joint_move
from openpendant.motion.robot import robot_names, serial_robot
from openpendant.motion.trajectory import Trajectory
from openpendant.server.planning.jobs import JointPathJob
from openpendant.server.planning.planner import answer
from openpendant.server.refusal import Refusal
from openpendant.simplemsg.pendant import Activity, AuthorityBeat
from openpendant.simplemsg.verdicts import VerdictCode as V

SERIAL = [name for name in robot_names() if name != "stewart_classroom"]

STRAIGHT, PLANNED = 42, 2
"""Trajectories of each robot: 1,000 of all, in closed form and by TOPP-RA."""


def judge(trajectory: Trajectory, limits: JointLimits) -> None:
    """Fail where a sample, or a difference between two, breaks a limit."""
    lower, upper = np.array(limits.lower), np.array(limits.upper)
    assert np.all(np.isfinite(trajectory.position))
    assert np.all((lower <= trajectory.position) & (trajectory.position <= upper))
    assert np.all(np.abs(trajectory.velocity) <= np.array(limits.velocity) * (1 + 1e-6))
    assert np.all(np.abs(trajectory.acceleration) <= np.array(limits.acceleration) * (1 + 1e-3))
    steps = np.diff(trajectory.position, axis=0) / np.diff(trajectory.times)[:, None]
    assert np.all(np.abs(steps) <= np.array(limits.velocity) * (1 + 1e-6))


def judge_many(name: str, seed: int, straight: int, planned: int) -> None:
    limits = serial_robot(name).limits
    random = np.random.default_rng([11, seed])
    for number in range(straight + planned):
        count = 2 if number < straight else 4
        places = random.uniform(limits.lower, limits.upper, (count, limits.dof)).tolist()
        speed = float(random.uniform(0.05, 1.0))
        if count == 2:
            judge(plan_joint_move(places[0], places[1], limits, speed=speed), limits)
            continue
        job = JointPathJob(1, tuple(places[0]), tuple(map(tuple, places[1:])), speed)
        result = answer(name, job).result
        if isinstance(result, Refusal):
            # A curve through points near a limit may swing beyond: all of it is refused, by name.
            assert result.code is V.OUT_OF_RANGE
            assert limits.names[result.joint] in result.text
            assert not limits.lower[result.joint] <= result.value <= limits.upper[result.joint]
            continue
        assert isinstance(result, tuple)
        judge(result[0], limits)


@pytest.mark.parametrize("name", SERIAL)
def test_promise_11_holds_in_a_thousand_random_trajectories(name: str) -> None:
    judge_many(name, 0, STRAIGHT, PLANNED)


@pytest.mark.soak
@pytest.mark.parametrize("seed", range(1, 11))
@pytest.mark.parametrize("name", SERIAL)
def test_promise_11_holds_in_a_hundred_thousand_random_trajectories(name: str, seed: int) -> None:
    judge_many(name, seed, 400, 35)


@pytest.mark.parametrize("name", SERIAL)
def test_promise_11_a_goal_beyond_a_limit_is_refused_with_joint_value_and_limit(name: str) -> None:
    limits = serial_robot(name).limits
    home = list(serial_robot(name).home_position)
    for joint in range(limits.dof):
        goal = list(home)
        goal[joint] = float(np.nextafter(limits.upper[joint], np.inf))
        with pytest.raises(MotionError) as refused:
            plan_joint_move(home, goal, limits)
        assert limits.names[joint] in str(refused.value)
        assert getattr(refused.value, "value", None) == goal[joint]
        assert getattr(refused.value, "upper", None) == limits.upper[joint]


def finish(cell: EmulatedCell, pendant: Pendant) -> None:
    for _ in range(600):
        pendant.send(AuthorityBeat())
        cell.wait(50)
        if cell.core.cell.activity is Activity.IDLE:
            return
    raise AssertionError("the motion does not end")


def test_promise_11_the_controllers_own_referee_finds_nothing() -> None:
    cell = EmulatedCell("ur5")
    pendant = cell.holder()
    random = np.random.default_rng(11)
    for _ in range(5):
        goal = np.array(cell.position) + random.uniform(-0.4, 0.4, 6)
        assert pendant.path(tuple(0.5 * (goal + cell.position)), tuple(goal)) is V.ACCEPTED
        finish(cell, pendant)
    assert [code for _, code in pendant.outcomes()] == [V.ACCEPTED] * 5
    assert cell.controller.referee.total == 0
