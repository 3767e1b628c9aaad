"""Tool curves in space: position and orientation over one parameter, without joints.

Owns the tool-curve protocol, the even rotation, and the straight line, the rotation in place and
the spline through poses. Knows no robot and no time. All poses are of one frame, which the curve
does not name; the parameter s is the arc length [m], or the angle [rad] of a rotation in place.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Protocol

import numpy as np

from ..errors import BadArgument, NoMotion
from ..pose import Array, Pose, PoseArray, quaternion_product
from ..trajectory.joint_curves import JointSpline

LEAST_DISTANCE = 1e-6
"""Least length of a line; a tool that moves by less is rotated in place [m]."""

_LEAST_ANGLE = 1e-9  # rad
_LENGTH_OF_A_TURN = 0.2  # m; what a rotation by 2 rad adds to a spline's parameter


class ToolCurve(Protocol):
    """Curve of the tool, once differentiable, over s from 0 to `length`."""

    @property
    def length(self) -> float:
        """End of the domain of s [m; rad for a rotation in place]."""

    @property
    def joins(self) -> Array:
        """(k,) values of s where pieces of different kind meet, increasing from 0 to `length`."""

    @property
    def waypoints(self) -> Array:
        """(w,) values of s at each pose asked for, from 0 to `length`."""

    def place(self, s: Array) -> PoseArray:
        """Return the tool's pose at s: (m,) in [0, length]."""

    def motion(self, s: Array) -> Array:
        """Return the (m, 6) derivative of `place` by s.

        Linear first [m], then angular [rad] about the frame's axes, both per unit of s.
        """


@dataclass(frozen=True, slots=True, eq=False)
class EvenTurn:
    """Rotation about one axis at an even rate, as slerp does between two orientations.

    Attributes:
        start: (3, 3) the orientation at s = 0.
        rate: (3,) rotation vector per unit of s, along the frame's axes.
    """

    start: Array
    rate: Array

    def rotations(self, s: Array) -> Array:
        """Return the (m, 3, 3) orientations exp([rate s]×) · start, at s: (m,)."""
        return turned_by(s[:, np.newaxis] * self.rate) @ self.start


class ToolLine:
    """Straight line of the tool with an even rotation; without distance, a rotation in place."""

    def __init__(self, start: Pose, target: Pose) -> None:
        """Join two poses, the rotation by the lesser angle.

        Raises:
            NoMotion: they are the same.
        """
        turn = rotation_between(start, target)
        self.distance = start.position_distance(target)
        angle = math.hypot(*turn)
        self.length = self.distance if self.distance > LEAST_DISTANCE else angle
        if self.length < _LEAST_ANGLE:
            raise NoMotion
        self.joins: Array = np.array([0.0, self.length])
        self.waypoints: Array = self.joins
        self._start = start.position
        self._along: Array = (target.position - start.position) / self.length
        self._turn = EvenTurn(start.rotation, turn / self.length)

    def place(self, s: Array) -> PoseArray:
        """Return the tool's pose at s: (m,)."""
        return PoseArray(self._turn.rotations(s), self._start + np.outer(s, self._along))

    def motion(self, s: Array) -> Array:
        """Return the (m, 6) derivative by s, the same everywhere."""
        return np.tile(np.concatenate((self._along, self._turn.rate)), (len(s), 1))


class ToolSpline:
    """Smooth curve of the tool through poses.

    Position and quaternion follow one cubic spline, twice continuously differentiable; the
    quaternion is normalised on it. Like every cubic spline it swings beyond its polyline.
    """

    def __init__(self, poses: Sequence[Pose]) -> None:
        """Lead the curve through two poses or more.

        Raises:
            NoMotion: there is one pose only, or all are the same.
            BadArgument: there is no pose.
        """
        rows = np.array([[*pose.position, *pose.quaternion] for pose in poses])
        # q and -q are one orientation: the one nearer to its predecessor takes the lesser angle.
        for before, row in pairwise(rows):
            if float(before[3:] @ row[3:]) < 0.0:
                row[3:] *= -1.0
        scaled = rows * np.repeat([1.0, _LENGTH_OF_A_TURN], [3, 4])
        self._curve = JointSpline(scaled)
        self.length = self._curve.length
        self.joins: Array = self._curve.knots
        self.waypoints: Array = self.joins[self._curve.waypoint_knots]

    def place(self, s: Array) -> PoseArray:
        """Return the tool's pose at s: (m,)."""
        values = self._curve.evaluate(s)
        quaternions = values[:, 3:] / np.linalg.norm(values[:, 3:], axis=1, keepdims=True)
        return PoseArray(_rotations(quaternions), values[:, :3])

    def motion(self, s: Array) -> Array:
        """Return the (m, 6) derivative by s.

        The angular part is twice the vector part of q' q*/|q|², for a quaternion of any length
        (Diebel, *Representing attitude*, 2006): the part of q' along q only changes the length.
        """
        values, slopes = self._curve.evaluate(s), self._curve.evaluate(s, 1)
        vector, scalar = values[:, 3:6], values[:, 6:]
        vector_slope, scalar_slope = slopes[:, 3:6], slopes[:, 6:]
        doubled = 2.0 * (
            scalar * vector_slope - scalar_slope * vector - np.cross(vector_slope, vector)
        )
        squares = np.einsum("ij,ij->i", values[:, 3:], values[:, 3:])[:, np.newaxis]
        return np.hstack((slopes[:, :3], doubled / squares))


def rotation_between(start: Pose, target: Pose) -> Array:
    """Return the (3,) rotation vector [rad], length 0 to π, from one orientation to another.

    It is expressed along the axes of the frame that both poses are given in.
    """
    conjugate = start.quaternion * np.array([-1.0, -1.0, -1.0, 1.0])
    turn = quaternion_product(target.quaternion, conjugate)
    vector, scalar = (turn[:3], float(turn[3])) if turn[3] >= 0.0 else (-turn[:3], -float(turn[3]))
    sine = math.hypot(*vector)
    if sine == 0.0:
        return np.zeros(3)
    scaled: Array = vector * (2.0 * math.atan2(sine, scalar) / sine)
    return scaled


def turned_by(vectors: Array) -> Array:
    """Return the (m, 3, 3) rotations of (m, 3) rotation vectors [rad], by Rodrigues' formula."""
    angles = np.linalg.norm(vectors, axis=1)
    axes = vectors / np.where(angles > 0.0, angles, 1.0)[:, np.newaxis]
    crosses = np.zeros((len(vectors), 3, 3))
    for row, column, axis, sign in (
        (0, 1, 2, -1.0),
        (0, 2, 1, 1.0),
        (1, 2, 0, -1.0),
    ):
        crosses[:, row, column] = sign * axes[:, axis]
        crosses[:, column, row] = -sign * axes[:, axis]
    sine, versine = np.sin(angles), 2.0 * np.sin(angles / 2.0) ** 2
    turned: Array = (
        np.eye(3)
        + sine[:, np.newaxis, np.newaxis] * crosses
        + versine[:, np.newaxis, np.newaxis] * (crosses @ crosses)
    )
    return turned


def check_point(point: Sequence[float] | Array, what: str) -> Array:
    """Return a point or direction as (3,) floats.

    Raises:
        BadArgument: it does not have three coordinates, or they are beyond a million metres.
        NotFinite: a coordinate is infinite or not a number.
    """
    if len(point) != 3:
        raise BadArgument(what, [float(value) for value in point], "three coordinates")
    position = Pose(np.asarray(point, dtype=np.float64), np.array([0.0, 0.0, 0.0, 1.0])).position
    return position


def _rotations(quaternions: Array) -> Array:
    """Return the (m, 3, 3) rotation matrices of (m, 4) unit quaternions."""
    x, y, z, w = quaternions.T
    rows = [
        [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - z * w), 2.0 * (x * z + y * w)],
        [2.0 * (x * y + z * w), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - x * w)],
        [2.0 * (x * z - y * w), 2.0 * (y * z + x * w), 1.0 - 2.0 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), 2, 0)
