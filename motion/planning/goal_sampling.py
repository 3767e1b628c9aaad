"""Goal sampling: a collision-free joint position for a tool pose.

Owns the choice among the joint positions that reach one pose: the one that inverse kinematics finds
from where the robot stands if it is free, else the first free one from random seeds.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..errors import GoalInCollision, PoseUnreachable
from ..kinematics.ik.ik import solve
from ..kinematics.serial import Array
from ..pose import Pose
from ..scene.collision import CollisionModel

SEEDS = 16
"""Random joint positions from which further solutions are sought."""


def free_joint_position(
    collision: CollisionModel,
    pose: Pose,
    near: Sequence[float] | Array,
    *,
    frame: str = "base",
    random_seed: int = 0,
) -> Array:
    """Return an (n,) joint position that reaches a pose without contact.

    Args:
        collision: robot and scene.
        pose: target pose of the tool, in `frame`.
        near: (n,) joint position that the robot comes from.
        frame: `base` or `root`.
        random_seed: the same number gives the same answer.

    Raises:
        PoseUnreachable: no joint position reaches the pose.
        GoalInCollision: all that were found touch; of the nearest one.
        FrameUnknown: there is no such frame.
    """
    kinematics = collision.kinematics
    first = solve(kinematics, pose, near, frame=frame, random_seed=random_seed).joint_position
    if not collision.collides(first):
        return first
    random = np.random.default_rng(random_seed)
    for _ in range(SEEDS):
        seed = random.uniform(kinematics.lower, kinematics.upper)
        try:
            found = solve(kinematics, pose, seed, frame=frame, random_seed=random_seed)
        except PoseUnreachable:
            continue
        if not collision.collides(found.joint_position):
            return found.joint_position
    contact = collision.contacts(first)[0]
    raise GoalInCollision(contact.first, contact.second, contact.distance)
