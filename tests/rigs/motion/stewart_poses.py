"""The classroom platform, and poses of its workspace by random number and by hypothesis."""

from typing import Any

import numpy as np
from hypothesis import strategies as st
from rigs.motion.loaded_robots import load_robot

from openpendant.motion.description.robot import ParallelRobot
from openpendant.motion.kinematics.stewart.platform import StewartKinematics
from openpendant.motion.pose import Array, Pose


def platform_robot(**changes: Any) -> ParallelRobot:
    """Return the classroom platform, with fields changed; `leg` and `workspace` are merged."""
    robot = load_robot("stewart_classroom")
    assert isinstance(robot, ParallelRobot)
    content = robot.model_dump(mode="json", by_alias=True)
    for field, value in changes.items():
        content[field] = {**content[field], **value} if isinstance(value, dict) else value
    return ParallelRobot.model_validate(content)


PLATFORM = StewartKinematics(platform_robot())


def pose_of_shares(shares: Array | list[float]) -> Pose:
    """Return the pose at signed shares of the workspace bounds (x, y, z, roll, pitch, yaw)."""
    return PLATFORM.workspace.pose(np.asarray(shares) * PLATFORM.workspace.bounds)


def _inside(values: list[float]) -> Pose:
    shares = np.array(values)
    return pose_of_shares(shares / max(1.0, float(np.abs(shares).sum())))


poses_inside = st.lists(st.floats(-1.0, 1.0), min_size=6, max_size=6).map(_inside)
"""Poses of the workspace, most of them on its border."""


def random_poses(count: int, seed: int = 0) -> list[Pose]:
    """Return poses of the workspace; every second one lies on its border."""
    random = np.random.default_rng(seed)
    shares = random.dirichlet(np.full(6, 0.5), count) * random.choice((-1.0, 1.0), (count, 6))
    shares[::2] *= random.uniform(0.0, 1.0, (len(shares[::2]), 1))
    return [pose_of_shares(share) for share in shares]
