"""Orientations as numbers: roll, pitch, yaw, their increments and rates, and rotation vectors.

Owns the formulas. Of the two things that pendants call A, B, C, `rpy_increment` is the one that
adds to the three values; rotations about the axes of a frame are `jog.jog_commands.turned`. They
agree only where roll, pitch and yaw are all 0, or the axis is that of the outermost rotation. Knows
no robot. Convention of `pose`: R = Rz(yaw) Ry(pitch) Rx(roll); quaternions x, y, z, w; radians.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from .errors import BadArgument
from .pose import Array, Pose

_GIMBAL = 1e-9
"""Cosine of the pitch below which roll and yaw are about one axis."""


def roll_pitch_yaw(rotation: Array) -> Array:
    """Return the roll, pitch and yaw of a (3, 3) rotation matrix.

    Returns:
        (3,) roll in (-π, π], pitch in [-π/2, π/2], yaw in (-π, π]. At a pitch of ±π/2, where only
        the sum or difference of roll and yaw is determined, the roll is 0.
    """
    cosine = math.hypot(rotation[0, 0], rotation[1, 0])
    pitch = math.atan2(-rotation[2, 0], cosine)
    if cosine < _GIMBAL:
        yaw = _half_open(math.atan2(-rotation[0, 1], rotation[1, 1]))
        return np.array([0.0, pitch, yaw]) + 0.0
    roll = _half_open(math.atan2(rotation[2, 1], rotation[2, 2]))
    yaw = _half_open(math.atan2(rotation[1, 0], rotation[0, 0]))
    return np.array([roll, pitch, yaw]) + 0.0  # makes -0.0 into 0.0


def are_angles_unique(rotation: Array) -> bool:
    """Return True if one roll and one yaw only make a (3, 3) rotation: the pitch is not ±π/2."""
    return math.hypot(rotation[0, 0], rotation[1, 0]) >= _GIMBAL


def _half_open(angle: float) -> float:
    """Return an angle of [-π, π] in (-π, π]."""
    return math.pi if angle == -math.pi else angle


def rpy_increment(pose: Pose, increment: Sequence[float] | Array) -> Pose:
    """Return the pose with its roll, pitch and yaw each changed by an amount; it stays in place.

    Args:
        pose: in any frame.
        increment: (3,) added to roll, pitch and yaw of that frame [rad].

    Raises:
        BadArgument, NotFinite: not three finite values.
    """
    change = np.array(increment, dtype=np.float64)
    if change.shape != (3,):
        raise BadArgument("increment", change.tolist(), "3 numbers")
    return Pose.from_rpy(pose.position, roll_pitch_yaw(pose.rotation) + change)


def quaternion_of_vector(vector: Array) -> Array:
    """Return the (4,) quaternion of a (3,) rotation vector: axis times angle [rad]."""
    half = 0.5 * math.sqrt(float(vector @ vector))
    # np.sinc(x) is sin(πx)/(πx): no division by a vanishing angle.
    return np.append(0.5 * float(np.sinc(half / math.pi)) * vector, math.cos(half))


def vector_of_quaternion(quaternion: Array) -> Array:
    """Return the (3,) rotation vector [rad], length 0 to π, of a unit quaternion."""
    sine = math.sqrt(float(quaternion[:3] @ quaternion[:3]))
    if sine == 0.0:
        return np.zeros(3)
    near = quaternion if quaternion[3] >= 0.0 else -quaternion
    vector: Array = (2.0 * math.atan2(sine, near[3]) / sine) * near[:3]
    return vector


def rotation_of_vector(vector: Array) -> Array:
    """Return the (3, 3) rotation matrix of a (3,) rotation vector, by Rodrigues' formula."""
    angle = math.sqrt(float(vector @ vector))
    cross = cross_matrix(vector)
    half = float(np.sinc(0.5 * angle / math.pi))
    matrix: Array = (
        np.eye(3) + float(np.sinc(angle / math.pi)) * cross + 0.5 * half * half * (cross @ cross)
    )
    return matrix


def cross_matrix(vector: Array) -> Array:
    """Return the (3, 3) matrix that takes w to vector × w."""
    x, y, z = (float(value) for value in vector)
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def angular_velocity_of_rpy_rates(rpy: Sequence[float] | Array) -> Array:
    """Return the (3, 3) matrix from the rates of roll, pitch, yaw to ω in the parent's axes.

    Its columns are the axes of the three rotations (Siciliano et al., Robotics, section 3.6):
    roll about the x axis after pitch and yaw, pitch about the y axis after yaw, yaw about z.

    Raises:
        BadArgument: there are not three values.
    """
    if len(rpy) != 3:
        raise BadArgument("rpy", list(rpy), "3 numbers")
    _, pitch, yaw = (float(value) for value in rpy)
    cp, sp, cy, sy = math.cos(pitch), math.sin(pitch), math.cos(yaw), math.sin(yaw)
    return np.array([[cy * cp, -sy, 0.0], [sy * cp, cy, 0.0], [-sp, 0.0, 1.0]])
