"""A joint position for a tool pose that touches nothing.

Owns the choice between the joint positions that reach one pose: the one that inverse kinematics
finds from where the robot stands if it is free, else the first free one from random seeds.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .collision import CollisionModel
from .errors import GoalInCollision, Unreachable
from .ik import solve
from .kinematics import Array
from .pose import Pose

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
    """Return an (n,) joint position that reaches a pose and touches nothing.

    Args:
        collision: robot and scene.
        pose: where the tool is to be, in `frame`.
        near: (n,) where the robot comes from.
        frame: `base` or `root`.
        random_seed: same number, same answer.

    Raises:
        Unreachable: no joint position reaches the pose.
        GoalInCollision: those that were found all touch; of the nearest.
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
        except Unreachable:
            continue
        if not collision.collides(found.joint_position):
            return found.joint_position
    contact = collision.contacts(first)[0]
    raise GoalInCollision(contact.first, contact.second, contact.distance)
