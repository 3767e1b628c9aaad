"""Planning: a joint move on the event loop, joint paths to certified samples, a way round a pillar.

CPU time of this process, as in the planning process once it is warm.
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from itertools import pairwise

import numpy as np

from openpendant.motion.description.robot import serial_robot
from openpendant.motion.kinematics.serial import Kinematics
from openpendant.motion.planning.ompl_planner import ompl_is_installed
from openpendant.motion.planning.planner import DEFAULT_PLANNER, plan_free_path
from openpendant.motion.planning.rrt_connect import BUILT_IN
from openpendant.motion.scene.clearance import ClearPath
from openpendant.motion.scene.collision import CollisionModel
from openpendant.motion.scene.scene import Box, Scene, SceneObject
from openpendant.motion.trajectory.certificate import certify_straight_move
from openpendant.motion.trajectory.ptp import straight_move
from openpendant.server.planning.jobs import JointPathJob
from openpendant.server.planning.worker.job_planner import answer
from openpendant.server.refusal import Refusal

from .table import Benchmark, Bound, Judged, MissingRequirement, Sides

ROBOT = "ur5"
PATHS = 5
MOVES = 50
PILLAR_SEEDS = 9
PILLAR_SWING = 1.8  # rad of joint 1
AROUND_THE_PILLAR = Bound(60.0, aim=40.0, judged=Judged.VALUE)


def benchmarks() -> list[Benchmark]:
    """Return the joint move, the paths of 5, 50 and 500 poses, and the way around the pillar."""
    found = [
        Benchmark(
            "planning a joint move on the loop",
            "us CPU",
            _on_the_loop,
            Bound(450.0, aim=150.0, judged=Judged.VALUE),
        )
    ]
    for poses, bound in ((5, None), (50, Bound(50.0, aim=15.0, judged=Judged.VALUE)), (500, None)):
        found.append(
            Benchmark(
                f"planning {poses} poses, certified", "ms CPU", partial(_path, poses), bound, 9
            )
        )
    found += [
        Benchmark(
            "planning around a pillar, RRTConnect / built in",
            "ms CPU",
            partial(_around_the_pillar, DEFAULT_PLANNER),
            AROUND_THE_PILLAR,
            3,
        ),
        Benchmark(
            "planning around a pillar, built in",
            "ms CPU",
            partial(_around_the_pillar, BUILT_IN),
            AROUND_THE_PILLAR,
            3,
        ),
    ]
    return found


@contextmanager
def _on_the_loop() -> Iterator[Sides]:
    """Time, certify and prove free a walk of moves of up to 0.3 rad, over a table."""
    limits = serial_robot(ROBOT).limits
    table = SceneObject("table", Box((2.0, 2.0, 0.1)), (0.0, 0.0, -0.1))
    proof = ClearPath(CollisionModel(Kinematics(serial_robot(ROBOT)), Scene((table,))))
    home = np.array(serial_robot(ROBOT).home_position)
    rng = np.random.default_rng(2)
    places = [tuple(place) for place in (home + rng.uniform(-0.15, 0.15, (MOVES, 6))).tolist()]

    def subject() -> float:
        taken = []
        for start, goal in pairwise(places):
            began = time.process_time()
            move = straight_move(start, goal, limits)
            certify_straight_move(move, limits, start=start)
            proof.is_sure(move.start, move.goal)
            taken.append(time.process_time() - began)
        return statistics.median(taken) * 1e6

    yield Sides(subject)


@contextmanager
def _around_the_pillar(planner: str) -> Iterator[Sides]:
    """Swing a UR5 by 1.8 rad with a pillar in the middle; the planner checks its own path."""
    if planner != BUILT_IN and not ompl_is_installed():
        raise MissingRequirement("ompl is not installed")
    kinematics = Kinematics(serial_robot(ROBOT))
    pillar = SceneObject("pillar", Box((0.12, 0.12, 1.0)), (-0.45, 0.0, 0.5))
    table = SceneObject("table", Box((2.0, 2.0, 0.1)), (0.0, 0.0, -0.1))
    collision = CollisionModel(kinematics, Scene((pillar, table)))
    start, goal = np.array(kinematics.robot.home_position), np.array(kinematics.robot.home_position)
    start[0] -= PILLAR_SWING / 2.0
    goal[0] += PILLAR_SWING / 2.0

    def sample(name: str) -> float:
        taken = []
        for seed in range(PILLAR_SEEDS):
            began = time.process_time()
            plan_free_path(kinematics, collision, start, goal, planner=name, seed=seed)
            taken.append(time.process_time() - began)
        return statistics.median(taken) * 1e3

    baseline = None if planner == BUILT_IN else partial(sample, BUILT_IN)
    yield Sides(partial(sample, planner), baseline)


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
