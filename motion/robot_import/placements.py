"""Placements of the robot schema as matrices, and back.

Owns the one place where roll, pitch and yaw are taken out of a rotation: R = Rz(yaw) Ry(pitch)
Rx(roll), with yaw 0 where the pitch is a quarter turn and roll and yaw cannot be told apart.
"""

from __future__ import annotations

import math

from ..pose import Array, Pose
from ..robot_schema import Placement

_ROUNDING = 1e-15  # m or rad: what remains of a zero after a few products


def to_matrix(placement: Placement) -> Array:
    """Return a placement's (4, 4) homogeneous matrix."""
    return Pose.from_rpy(placement.xyz, placement.rpy).to_matrix()


def to_placement(matrix: Array) -> Placement:
    """Return the placement of a (4, 4) homogeneous matrix."""
    x, y, z = (_without_noise(float(value)) for value in matrix[:3, 3])
    roll, pitch, yaw = (_without_noise(value) for value in _roll_pitch_yaw(matrix[:3, :3]))
    return Placement(xyz=(x, y, z), rpy=(roll, pitch, yaw))


def compose(outer: Placement, inner: Placement) -> Placement:
    """Return where `inner`, given in the frame `outer`, stands in the frame of `outer`'s parent."""
    return to_placement(to_matrix(outer) @ to_matrix(inner))


def _roll_pitch_yaw(rotation: Array) -> tuple[float, float, float]:
    # Roll is taken after the yaw found is undone, so that what rounding does to the one near a
    # quarter turn of pitch is made good by the other.
    (a, b, c), (d, e, f), (g, _, _) = rotation.tolist()
    yaw = math.atan2(d, a) if math.hypot(a, d) > _ROUNDING else 0.0
    sine, cosine = math.sin(yaw), math.cos(yaw)
    roll = math.atan2(sine * c - cosine * f, cosine * e - sine * b)
    return roll, math.atan2(-g, math.hypot(a, d)), yaw


def _without_noise(value: float) -> float:
    return 0.0 if abs(value) < _ROUNDING else value
