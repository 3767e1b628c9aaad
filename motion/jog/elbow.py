"""How fast the elbow is: velocity of a link's origin, in plain floats.

Owns the recursion from that link down to the root. At each joint a vector x of the link beyond is
turned by Rodrigues' formula, R x = x cos φ + (a × x) sin φ + a (a · x)(1 - cos φ), and the point's
velocity gains a × p φ'. A speed is the same in every frame, so the way ends at the first joint.
Plain floats, because it is asked at every set-point: numpy would take five times as long.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple, TypeAlias

import numpy as np

from ..kinematics import model_map
from ..pose import Array, Pose
from ..robot import SerialRobot
from ..robot_schema import Joint

Vector: TypeAlias = tuple[float, float, float]

_ON_AXIS = 1e-9  # m


class _Link(NamedTuple):
    """A moving joint, and where its frame is in that of the moving joint before it."""

    axis: Vector
    prismatic: bool
    gains: tuple[tuple[int, float], ...]
    offset: float
    rotation: tuple[Vector, Vector, Vector]
    shift: Vector


class LinkPoint:
    """The origin of a link's frame, as something that has a speed."""

    def __init__(self, robot: SerialRobot, link: str) -> None:
        """Choose a link; it must be one of the robot's."""
        gain, offset = model_map(robot)
        chain: list[_Link] = []
        before = np.eye(4)
        moving = 0
        for joint in () if link == robot.root_link else robot.joints:
            before = before @ Pose.from_rpy(joint.origin.xyz, joint.origin.rpy).to_matrix()
            if isinstance(joint, Joint):
                axis = np.array(joint.axis) / np.linalg.norm(joint.axis)
                used = ((i, float(g)) for i, g in enumerate(gain[moving]) if g != 0.0)
                chain.append(
                    _Link(
                        _vector(axis.tolist()),
                        joint.prismatic,
                        tuple(used),
                        float(offset[moving]),
                        _rows(before[:3, :3].tolist()),
                        _vector(before[:3, 3].tolist()),
                    )
                )
                before = np.eye(4)
                moving += 1
            if joint.child == link:
                break
        point = before[:3, 3]
        while chain and _turns_about(chain[-1], point):
            # An elbow lies on its own axis, which then moves it nowhere.
            own = chain.pop()
            point = np.array(own.rotation) @ point + np.array(own.shift)
        self._point = _vector(point.tolist())
        self._chain = tuple(reversed(chain))

    def speed(self, position: Sequence[float], velocity: Sequence[float]) -> float:
        """Return the speed [m/s] at (n,) controller-side joint position and velocity."""
        px, py, pz = self._point
        vx = vy = vz = 0.0
        for axis, prismatic, gains, offset, rotation, shift in self._chain:
            ax, ay, az = axis
            angle, rate = offset, 0.0
            for index, gain in gains:
                angle += gain * position[index]
                rate += gain * velocity[index]
            if prismatic:
                px, py, pz = px + ax * angle, py + ay * angle, pz + az * angle
                vx, vy, vz = vx + ax * rate, vy + ay * rate, vz + az * rate
            else:
                sine, cosine = math.sin(angle), math.cos(angle)
                along = (ax * px + ay * py + az * pz) * (1.0 - cosine)
                px, py, pz = (
                    px * cosine + (ay * pz - az * py) * sine + ax * along,
                    py * cosine + (az * px - ax * pz) * sine + ay * along,
                    pz * cosine + (ax * py - ay * px) * sine + az * along,
                )
                along = (ax * vx + ay * vy + az * vz) * (1.0 - cosine)
                vx, vy, vz = (
                    vx * cosine + (ay * vz - az * vy) * sine + ax * along,
                    vy * cosine + (az * vx - ax * vz) * sine + ay * along,
                    vz * cosine + (ax * vy - ay * vx) * sine + az * along,
                )
                vx += (ay * pz - az * py) * rate
                vy += (az * px - ax * pz) * rate
                vz += (ax * py - ay * px) * rate
            (a, b, c), (d, e, f), (g, h, i) = rotation
            sx, sy, sz = shift
            px, py, pz = (
                a * px + b * py + c * pz + sx,
                d * px + e * py + f * pz + sy,
                g * px + h * py + i * pz + sz,
            )
            vx, vy, vz = (
                a * vx + b * vy + c * vz,
                d * vx + e * vy + f * vz,
                g * vx + h * vy + i * vz,
            )
        return math.sqrt(vx * vx + vy * vy + vz * vz)


def _turns_about(link: _Link, point: Array) -> bool:
    return not link.prismatic and float(np.linalg.norm(np.cross(link.axis, point))) < _ON_AXIS


def _vector(values: Sequence[float]) -> Vector:
    x, y, z = values
    return x, y, z


def _rows(rows: Sequence[Sequence[float]]) -> tuple[Vector, Vector, Vector]:
    first, second, third = rows
    return _vector(first), _vector(second), _vector(third)
