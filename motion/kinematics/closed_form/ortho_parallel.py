"""Ortho-parallel base: the first three axes of most industrial arms, 2 and 3 parallel and across 1.

Owns the frame in which such an arm is solved, its lengths, and the positions of the first three
joints that put the end of the forearm at a point. Both families use it. Knows no wrist.

The frame's origin lies on axis 1 at the height of axis 2; z is axis 1, y is along axis 2, and x
points to the side on which the arm's end stands at zero. Joint angles here are positive about z and
y; `sign2` and `sign3` give the joints' own directions. Naming follows Brandstötter, Angerer and
Hofbaur (2014).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ...pose import Array
from .geometry import ArmGeometry

EXACT = 1e-4
"""Tolerance of parallel, perpendicular and crossing axes [m or rad], corrected by polishing."""

_NO_LENGTH = 1e-6  # m


@dataclass(frozen=True, slots=True, eq=False)
class OrthoParallelBase:
    """Arm up to a point carried by its forearm, in the arm's own frame.

    Attributes:
        frame: (4, 4) placement of the arm's frame in the base frame.
        offset: distance of axis 2 from axis 1 along x [m].
        beside: distance of the forearm's end from the plane of axis 1 along y [m].
        upper_arm: length from axis 2 to axis 3 [m].
        upper_arm_angle: its angle from z towards x at zero [rad].
        forearm: length from axis 3 to the forearm's end [m].
        fold: angle from upper arm to forearm at zero [rad].
        sign2: 1 if joint 2 rotates positively about y, else -1.
        sign3: the same of joint 3.
    """

    frame: Array
    offset: float
    beside: float
    upper_arm: float
    upper_arm_angle: float
    forearm: float
    fold: float
    sign2: float
    sign3: float


def ortho_parallel_base(
    geometry: ArmGeometry, forearm_end: Array, forward: Array
) -> OrthoParallelBase | None:
    """Return the first three axes if they are of this kind, else None.

    Args:
        geometry: the arm; its first three joints revolute.
        forearm_end: (3,) the point that the third joint carries, in the base frame at zero [m].
        forward: (3,) a point in front of the arm at zero, which sets the direction of x [m].
    """
    first, second, third = geometry.axes[:3]
    if abs(float(first @ second)) > EXACT or not parallel(second, third):
        return None
    point1, point2, point3 = geometry.points[:3]
    origin = point1 + first * float((point2 - point1) @ first)
    y = second - first * float(first @ second)
    y /= np.linalg.norm(y)
    ahead = float((forward - origin) @ np.cross(y, first))
    if abs(ahead) <= EXACT:
        ahead = float((point2 - origin) @ np.cross(y, first))
    if ahead < -EXACT:
        y = -y
    frame = np.eye(4)
    frame[:3, :3] = np.column_stack((np.cross(y, first), y, first))
    frame[:3, 3] = origin
    shoulder, elbow, end = (np.stack((point2, point3, forearm_end)) - origin) @ frame[:3, :3]
    upper_arm = math.hypot(elbow[0] - shoulder[0], elbow[2] - shoulder[2])
    forearm = math.hypot(end[0] - elbow[0], end[2] - elbow[2])
    if min(upper_arm, forearm) < _NO_LENGTH:
        return None
    upper_arm_angle = math.atan2(elbow[0] - shoulder[0], elbow[2] - shoulder[2])
    return OrthoParallelBase(
        frame=frame,
        offset=float(shoulder[0]),
        beside=float(end[1]),
        upper_arm=upper_arm,
        upper_arm_angle=upper_arm_angle,
        forearm=forearm,
        fold=math.atan2(end[0] - elbow[0], end[2] - elbow[2]) - upper_arm_angle,
        sign2=math.copysign(1.0, float(second @ y)),
        sign3=math.copysign(1.0, float(third @ y)),
    )


def parallel(first: Array, second: Array) -> bool:
    """Return True if two unit vectors point along one line, either way."""
    return float(np.linalg.norm(np.cross(first, second))) <= EXACT


def perpendicular(first: Array, second: Array) -> bool:
    """Return True if two unit vectors are at a right angle."""
    return abs(float(first @ second)) <= EXACT
