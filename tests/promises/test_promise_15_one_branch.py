"""Promise 15: a line is looked at in full before it begins, and no joint jumps on it."""

from collections import Counter

import numpy as np
import pytest
from promises.promise_figures import tell

from openpendant.motion.description.robot import serial_robot
from openpendant.motion.kinematics.serial import Kinematics
from openpendant.server.planning.jobs import PoseGoal, PoseJob
from openpendant.server.planning.worker.job_planner import answer
from openpendant.server.refusal import Refusal
from openpendant.simplemsg.pendant import Motion
from openpendant.simplemsg.verdicts import VerdictCode as V

ROBOTS = ("ur5", "abb_irb2400")

LINE = 1e-4
"""How far the tool may be off its line between samples [m]."""


def follow_lines(name: str, seed: int, count: int) -> Counter[V]:
    """Plan lines between random places of all branches; judge those that are not refused.

    Returns:
        How often a line was taken, and refused by which code.
    """
    kinematics = Kinematics(serial_robot(name))
    limits = kinematics.robot.limits
    random = np.random.default_rng([15, seed])
    ends: Counter[V] = Counter()
    for number in range(count):
        low, high = np.maximum(limits.lower, -np.pi), np.minimum(limits.upper, np.pi)
        start, other = random.uniform(low, high, (2, limits.dof))
        # Some lines begin and end near one another, across whatever lies between.
        if number % 2:
            other = np.clip(start + random.normal(0.0, 0.3, limits.dof), low, high)
        began, goal = kinematics.forward(start), kinematics.forward(other)
        target = PoseGoal(tuple(goal.position.tolist()), tuple(goal.quaternion.tolist()))
        job = PoseJob(number, tuple(start.tolist()), (target,), "base", Motion.LIN, 0.5)
        result = answer(name, job).result
        if isinstance(result, Refusal):
            ends[result.code] += 1
            continue
        assert isinstance(result, tuple)
        ends[V.ACCEPTED] += 1
        trajectory = result[0]
        steps = np.abs(np.diff(trajectory.position, axis=0))
        periods = np.diff(trajectory.times)[:, None]
        assert np.all(steps <= np.array(limits.velocity) * periods * (1 + 1e-6) + 1e-12)
        way = goal.position - began.position
        length = float(np.linalg.norm(way))
        for row in trajectory.position[:: max(len(trajectory.position) // 25, 1)]:
            off = kinematics.forward(row).position - began.position
            along = (off @ way) / length**2
            assert np.linalg.norm(off - along * way) <= LINE
            assert -LINE <= along * length <= length + LINE
    return ends


@pytest.mark.parametrize("name", ROBOTS)
def test_promise_15_a_line_is_followed_without_a_jump_or_refused(name: str) -> None:
    ends = follow_lines(name, 0, 6)
    assert ends[V.ACCEPTED] > 2
    assert sum(ends.values()) - ends[V.ACCEPTED] > 2


@pytest.mark.soak
@pytest.mark.parametrize("seed", range(1, 6))
@pytest.mark.parametrize("name", ROBOTS)
def test_promise_15_a_thousand_lines_are_followed_or_refused(name: str, seed: int) -> None:
    ends = follow_lines(name, seed, 100)
    tell(f"promise 15, {name}: {dict(ends)}")
    assert sum(ends.values()) == 100


def test_promise_15_a_joint_that_goes_round_takes_the_short_way_within_its_limits() -> None:
    """The last joint of the UR5 turns twice; a pose half a turn on is reached the near way."""
    kinematics = Kinematics(serial_robot("ur5"))
    start = [0.3, -1.2, 1.4, -1.0, -1.2, 3.0]
    goal = kinematics.forward([*start[:5], start[5] + 0.5])
    target = PoseGoal(tuple(goal.position.tolist()), tuple(goal.quaternion.tolist()))
    for motion in (Motion.LIN, Motion.PTP):
        job = PoseJob(1, tuple(start), (target,), "base", motion, 0.5)
        result = answer("ur5", job).result
        assert isinstance(result, tuple), result
        ends = result[0].position[-1]
        assert ends[5] == pytest.approx(start[5] + 0.5, abs=1e-3)
