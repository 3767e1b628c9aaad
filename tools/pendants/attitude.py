"""Orientations as people read them: roll, pitch and yaw, and quaternions x, y, z, w.

R = Rz(yaw) Ry(pitch) Rx(roll), the convention of ROS and of RoboAnalyzer's A, B and C.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

Quaternion = tuple[float, float, float, float]


def roll_pitch_yaw(quaternion: Sequence[float]) -> tuple[float, float, float]:
    """Return roll, pitch, yaw [rad] of a unit quaternion; pitch is within ±π/2."""
    x, y, z, w = quaternion
    roll = math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))
    pitch = math.asin(max(-1.0, min(1.0, 2 * (w * y - z * x))))
    yaw = math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
    return roll, pitch, yaw


def quaternion_of(roll: float, pitch: float, yaw: float) -> Quaternion:
    """Return the unit quaternion of roll, pitch, yaw [rad]."""
    cr, sr = math.cos(roll / 2), math.sin(roll / 2)
    cp, sp = math.cos(pitch / 2), math.sin(pitch / 2)
    cy, sy = math.cos(yaw / 2), math.sin(yaw / 2)
    return (
        cy * cp * sr - sy * sp * cr,
        cy * sp * cr + sy * cp * sr,
        sy * cp * cr - cy * sp * sr,
        cy * cp * cr + sy * sp * sr,
    )
