from __future__ import annotations

import numpy as np
import pytest
from rigs.cells.server_rig import LIMITS

from openpendant.server.cell.joint_slots import JointSlots
from openpendant.server.endpoints.ros.ros_trajectory import Collection
from openpendant.server.planning.jobs import RosPathJob
from openpendant.server.planning.worker.job_planner import plan_ros_path
from openpendant.simplemsg import JointTrajPt, joint_array

START, GOAL = (0.0, 0.0), (0.5, 0.2)


def approach_time(duration: float, velocity: float = 1.0) -> float:
    collection = Collection(JointSlots(LIMITS), 100)
    assert collection.take(JointTrajPt(0, joint_array(GOAL), velocity, duration)) is None
    job = RosPathJob(1, START, tuple(collection.points), 0.1, 0.01)
    return float(plan_ros_path(job, LIMITS).duration)


@pytest.mark.parametrize("duration", [8.0, 12.0])
def test_a_real_duration_binds(duration: float) -> None:
    assert duration <= approach_time(duration) < duration + 0.1


def test_10_s_are_a_placeholder_and_10_percent_bind() -> None:
    free = approach_time(0.0)
    assert approach_time(10.0) == free
    assert approach_time(0.01) == pytest.approx(free)
    slowest = max(abs(b - a) / v for a, b, v in zip(START, GOAL, LIMITS.velocity, strict=True))
    assert slowest / 0.1 <= free < 8.0


def test_a_slower_point_is_approached_at_its_own_speed() -> None:
    assert approach_time(0.0, velocity=0.05) > 1.5 * approach_time(0.0)


def test_a_robot_that_stands_elsewhere_comes_to_rest_at_the_first_point_before_it_goes_on() -> None:
    collection = Collection(JointSlots(LIMITS), 100)
    for number, joints in enumerate((GOAL, (0.6, 0.2), (0.7, 0.2))):
        assert collection.take(JointTrajPt(number, joint_array(joints), 0.5, 0.0)) is None
    job = RosPathJob(1, START, tuple(collection.points), 0.1, 0.01)
    trajectory = plan_ros_path(job, LIMITS)
    gaps = abs(trajectory.position - np.array(GOAL)).max(axis=1)
    there = int(gaps.argmin())
    assert gaps[there] < 1e-9
    assert not trajectory.velocity[there].any()
    assert abs(trajectory.velocity[:there] / LIMITS.velocity).max() <= 0.1 + 1e-9
