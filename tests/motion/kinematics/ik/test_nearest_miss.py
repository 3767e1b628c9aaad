"""How near a refused pose is missed: told at once, and not much farther than a search finds."""

import numpy as np
import pytest
from rigs.motion.loaded_robots import serial_robot

from openpendant.motion.errors import MotionError, PoseUnreachable
from openpendant.motion.kinematics.ik import ik
from openpendant.motion.kinematics.ik.ik_problem import Budget, IkProblem
from openpendant.motion.kinematics.serial import Kinematics
from openpendant.motion.pose import Pose

POSES = 12
STARTS = 4
FACTOR = 6.0
"""A search, which takes a hundred times as long, comes nearer by less than that."""


def refused(kinematics: Kinematics) -> list[tuple[Pose, PoseUnreachable]]:
    """Return poses around the edge of the reach, turned any way, that are refused."""
    random = np.random.default_rng(3)
    found: list[tuple[Pose, PoseUnreachable]] = []
    while len(found) < POSES:
        towards, turn = random.normal(size=3), random.normal(size=4)
        towards *= random.uniform(0.6, 1.5) * kinematics.size / np.linalg.norm(towards)
        pose = Pose(towards, turn / np.linalg.norm(turn))
        try:
            ik.solve(kinematics, pose, kinematics.robot.home_position)
        except PoseUnreachable as refusal:
            found.append((pose, refusal))
        except MotionError:
            continue
    return found


def searched(kinematics: Kinematics, pose: Pose) -> float:
    """Return how near a numeric search comes, in units of the arm's size."""
    home, budget = kinematics.robot.home_position, Budget(0, 30, 0, None)
    question = IkProblem(
        kinematics, pose, "base", home, None, (1e-5, 1e-4), budget, expired=lambda: False
    )
    random = np.random.default_rng(4)
    for _ in range(STARTS):
        question.search.polished(random.uniform(kinematics.lower, kinematics.upper))
    assert question.search.best is not None
    return question.search.score(question.search.best)


@pytest.mark.parametrize(
    "robot", ["ur5", "abb_irb120", "abb_irb2400", "puma560", "fanuc_m10ia", "kuka_kr5_arc"]
)
def test_a_refusal_tells_a_miss_near_to_the_best(robot: str) -> None:
    kinematics = Kinematics(serial_robot(robot))
    for pose, refusal in refused(kinematics):
        told = refusal.best_position_error / kinematics.size + refusal.best_rotation_error
        assert told <= FACTOR * searched(kinematics, pose), pose
