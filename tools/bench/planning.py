"""Planning: inverse kinematics, and joint paths through many poses to certified samples.

CPU time of this process, as in the planning process once it is warm.
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial

import numpy as np

from openpendant.motion import ik
from openpendant.motion.kinematics import Kinematics
from openpendant.motion.robot import serial_robot
from openpendant.server.jobs import JointPathJob
from openpendant.server.planning import answer
from openpendant.server.refusal import Refusal

from .table import Benchmark, Bound, Judged, Sides

ROBOT = "ur5"
IK_POSES = 100
PATHS = 5


def benchmarks() -> list[Benchmark]:
    """Return IK and the paths of 5, 50 and 500 poses."""
    found = [Benchmark("planning IK, random far seed", "us", _ik, None, 5)]
    for poses, bound in (
        (5, None),
        (50, Bound(50.0, aim=15.0, judged=Judged.VALUE)),
        (500, None),
    ):
        found.append(
            Benchmark(
                f"planning {poses} poses, certified",
                "ms CPU",
                partial(_path, poses),
                bound,
                9,
            )
        )
    return found


@contextmanager
def _ik() -> Iterator[Sides]:
    kinematics = Kinematics(serial_robot(ROBOT))
    rng = np.random.default_rng(5)
    lower, upper = np.array(kinematics.limits.lower), np.array(kinematics.limits.upper)
    cases = [
        (kinematics.forward(rng.uniform(lower, upper)), rng.uniform(lower, upper))
        for _ in range(IK_POSES)
    ]

    def subject() -> float:
        taken = []
        for pose, seed in cases:
            began = time.process_time()
            ik.solve(kinematics, pose, seed)
            taken.append(time.process_time() - began)
        return statistics.median(taken) * 1e6

    yield Sides(subject)


@contextmanager
def _path(poses: int) -> Iterator[Sides]:
    robot = serial_robot(ROBOT)
    rng = np.random.default_rng(poses)
    jobs = []
    for number in range(PATHS):
        # A wandering path: neighbours are near, as taught points are.
        steps = rng.normal(0.0, 0.15, (poses, robot.dof))
        waypoints = np.array(robot.home_position) + np.cumsum(steps, axis=0) * 0.5
        jobs.append(
            JointPathJob(
                number,
                robot.home_position,
                tuple(tuple(point) for point in waypoints.clip(-3.0, 3.0).tolist()),
                speed=1.0,
            )
        )

    def subject() -> float:
        taken = []
        for job in jobs:
            began = time.process_time()
            planned = answer(ROBOT, job)
            taken.append(time.process_time() - began)
            if isinstance(planned.result, Refusal):
                raise RuntimeError(planned.result.sentence)
        return statistics.median(taken) * 1e3

    yield Sides(subject)
