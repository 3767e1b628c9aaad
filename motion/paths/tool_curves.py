"""Tool curves in space: position and orientation over one parameter, without joints.

Owns the tool-curve protocol, the even rotation, and the straight line, the rotation in place, the
spline through poses, and arcs and full circles: their geometry, which data determine one, and the
tool's rotation on it. Knows no robot and no time. All poses and points [m] are of one frame, which
the curve does not name; the parameter s is the arc length [m], or the angle [rad] of a rotation in
place. A coordinate that is infinite or not a number raises `NotFinite`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import Enum
from itertools import pairwise
from typing import Protocol

import numpy as np

from ..errors import BadArgument, BadCircle, CircleFault, NoMotion
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
        """Join two poses, the rotation by the lesser angle; `NoMotion` if they are the same."""
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
        """Lead the curve through poses; `NoMotion` if all are the same, `BadArgument` for none."""
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
    for row, column, axis, sign in ((0, 1, 2, -1.0), (0, 2, 1, 1.0), (1, 2, 0, -1.0)):
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


LEAST_RADIUS = 1e-3
"""Least radius of a circle [m]."""
GREATEST_RADIUS = 100.0
"""Greatest radius of a circle; points of a greater one are nearly on a line [m]."""
COINCIDENT_POINTS = 1e-4
"""Least distance of points of a circle; closer ones do not determine its direction [m]."""
EQUIDISTANT = 1e-4
"""Greatest difference of the distances of a centre from both ends [m]."""

_COLLINEAR = 1e-6  # m: distance of a point from the line through the two others
_LEAST_NORMAL = 1e-9
_FULL_TURN = 2.0 * math.pi


class ToolTurn(Enum):
    """Rotation of the tool on a circle."""

    EVEN = "even"
    """Evenly from the start's orientation to the target's, by the lesser angle."""
    CONSTANT = "constant"
    """None: the start's orientation throughout."""
    WITH_THE_PATH = "with-the-path"
    """With the direction of travel, about the circle's axis."""


@dataclass(frozen=True, slots=True, eq=False)
class Circle:
    """Arc in space: centre + cos φ · first + sin φ · second, for φ from 0 to `sweep`.

    Attributes:
        centre: (3,) [m].
        first: (3,) from the centre to the start [m].
        normal: (3,) unit vector; seen against it the arc runs counter-clockwise.
        sweep: angle of the arc [rad], more than 0 and at most 2π.
    """

    centre: Array
    first: Array
    normal: Array
    sweep: float

    @property
    def radius(self) -> float:
        """Radius [m]."""
        return math.hypot(*self.first)

    @property
    def second(self) -> Array:
        """(3,) from the centre to the place a quarter circle after the start [m]."""
        return np.cross(self.normal, self.first)

    def positions(self, angles: Array) -> Array:
        """Return the (m, 3) points at angles: (m,) [rad] from the start."""
        turned = np.outer(np.cos(angles), self.first) + np.outer(np.sin(angles), self.second)
        points: Array = self.centre + turned
        return points

    def directions(self, angles: Array) -> Array:
        """Return the (m, 3) unit vectors of travel at angles: (m,) [rad] from the start."""
        turned = np.outer(np.cos(angles), self.second) - np.outer(np.sin(angles), self.first)
        directions: Array = turned / self.radius
        return directions


def arc_through(start: Array, via: Sequence[float] | Array, end: Array) -> Circle:
    """Return the arc from one point through a second to a third; each (3,) [m].

    It is the one of the two arcs that passes the second point.

    Raises:
        BadCircle: two points coincide, all lie on one line, or the radius is out of bounds.
    """
    via = check_point(via, "the via point")
    # The circumcentre of a triangle, after the first of its corners (Coxeter, *Introduction to
    # geometry*, 1.5, written with vectors).
    a, b = via - start, end - start
    for one, other in ((start, via), (via, end), (end, start)):
        _check_distinct(one, other)
    normal = np.cross(a, b)
    sides = [math.hypot(*side) for side in (a, b, end - via)]
    height = math.hypot(*normal) / max(sides)
    if height < _COLLINEAR:
        raise BadCircle(CircleFault.COLLINEAR, height, _COLLINEAR)
    square = float(normal @ normal)
    to_centre = float(b @ b) * np.cross(normal, a) + float(a @ a) * np.cross(b, normal)
    centre = start + to_centre / (2.0 * square)
    return _arc(start, centre, end, normal / math.sqrt(square))


def circle_through(
    start: Array, via: Sequence[float] | Array, second_via: Sequence[float] | Array
) -> Circle:
    """Return the full circle from a point through two others, in their order, back to it.

    Raises:
        BadCircle: two points coincide, all lie on one line, or the radius is out of bounds.
    """
    arc = arc_through(start, via, check_point(second_via, "the second via point"))
    return replace(arc, sweep=_FULL_TURN)


def arc_about(
    start: Array,
    centre: Sequence[float] | Array,
    end: Array,
    *,
    normal: Sequence[float] | Array | None = None,
    more_than_half: bool = False,
) -> Circle:
    """Return the arc from one point to another about a centre.

    The centre may be off by `EQUIDISTANT`; it is then moved to a point at the same distance from
    both ends.

    Args:
        normal: (3,) of any length, about which the arc runs counter-clockwise, so that it decides
            between the shorter and the longer arc; needed for half a circle, where the three points
            lie on one line.
        more_than_half: without a normal, True for the longer arc.

    Raises:
        BadCircle: the centre is not equally far from both ends, the ends coincide, the plane is not
            known, or the radius is out of bounds.
        BadArgument: the normal has no direction, is not at a right angle to the radii, or is given
            together with `more_than_half`.
    """
    centre = _centred(start, check_point(centre, "the centre"), end)
    across = np.cross(start - centre, end - centre)
    size = math.hypot(*across)
    height = size / math.dist(start, end)
    sign = -1.0 if more_than_half else 1.0
    if normal is not None:
        if more_than_half:
            raise BadArgument("more_than_half", True, "a normal, or the longer way, not both")
        asked = _normal(normal, start - centre, end - centre)
        if height < COINCIDENT_POINTS:
            return _arc(start, centre, end, asked)
        sign = math.copysign(1.0, float(asked @ across))
    if height < COINCIDENT_POINTS:
        raise BadCircle(CircleFault.NO_NORMAL, height, COINCIDENT_POINTS)
    return _arc(start, centre, end, sign * across / size)


def circle_about(
    start: Array, centre: Sequence[float] | Array, normal: Sequence[float] | Array
) -> Circle:
    """Return the full circle from a point about a centre, counter-clockwise about a normal.

    Args:
        normal: (3,) of any length, at a right angle to the radius.

    Raises:
        BadCircle: the radius is out of bounds.
        BadArgument: the normal has no direction, or is not at a right angle to the radius.
    """
    centre = check_point(centre, "the centre")
    _check_radius(math.dist(start, centre))
    first = start - centre
    return Circle(centre, first, _normal(normal, first), _FULL_TURN)


class ToolArc:
    """Curve of the tool along a circle, by its length s [m]; a `ToolCurve` without joins."""

    def __init__(
        self, circle: Circle, start: Pose, target: Pose, turn: ToolTurn = ToolTurn.EVEN
    ) -> None:
        """Lead the tool along a circle from where it is; the target is an orientation only."""
        self._circle = circle
        self._radius = circle.radius
        self.length = self._radius * circle.sweep
        self.joins: Array = np.array([0.0, self.length])
        self.waypoints: Array = self.joins
        match turn:
            case ToolTurn.EVEN:
                rate = rotation_between(start, target) / self.length
            case ToolTurn.CONSTANT:
                rate = np.zeros(3)
            case ToolTurn.WITH_THE_PATH:
                rate = circle.normal / self._radius
        self._turn = EvenTurn(start.rotation, rate)

    def place(self, s: Array) -> PoseArray:
        """Return where the tool is at s: (m,) [m]."""
        return PoseArray(self._turn.rotations(s), self._circle.positions(s / self._radius))

    def motion(self, s: Array) -> Array:
        """Return the (m, 6) derivative by s: (m,) [m], shift [no unit], then rotation [rad/m]."""
        directions = self._circle.directions(s / self._radius)
        return np.hstack((directions, np.tile(self._turn.rate, (len(s), 1))))


def _arc(start: Array, centre: Array, end: Array, normal: Array) -> Circle:
    """Return the arc about a (3,) unit normal between (3,) points [m] equally far from the centre.

    Its sweep is atan2 of the end's two coordinates in the circle's plane, counted from the start.
    """
    first = start - centre
    _check_radius(math.hypot(*first))
    to_end = end - centre
    angle = math.atan2(float(to_end @ np.cross(normal, first)), float(to_end @ first))
    return Circle(centre, first, normal, angle % _FULL_TURN)


def _centred(start: Array, centre: Array, end: Array) -> Array:
    """Return the (3,) point nearest to a centre that is equally far from both ends [m].

    Those points form the plane through the middle of the chord at a right angle to it, onto which
    the centre is projected.
    """
    radius, other = math.dist(start, centre), math.dist(end, centre)
    if abs(radius - other) > EQUIDISTANT:
        raise BadCircle(CircleFault.NOT_EQUIDISTANT, other, radius)
    _check_radius(radius)
    _check_distinct(start, end)
    along = (end - start) / math.dist(start, end)
    middle = (start + end) / 2.0
    moved: Array = centre + float((middle - centre) @ along) * along
    return moved


def _normal(normal: Sequence[float] | Array, *radii: Array) -> Array:
    """Return the (3,) unit normal that is asked for, at a right angle to the first (3,) radius."""
    direction = check_point(normal, "the normal")
    size = math.hypot(*direction)
    if size < _LEAST_NORMAL:
        raise BadArgument("normal", direction.tolist(), f"a length of {_LEAST_NORMAL:g} or more")
    unit: Array = direction / size
    for radius in radii:
        along = float(radius @ unit)
        if abs(along) > EQUIDISTANT:
            accepted = f"a vector at a right angle to the radius (it leaves it by {along:.3g} m)"
            raise BadArgument("normal", direction.tolist(), accepted)
    # Exactly at a right angle to the first radius, so that the circle passes the start.
    first = radii[0] / math.hypot(*radii[0])
    unit = unit - float(unit @ first) * first
    unit /= math.hypot(*unit)
    return unit


def _check_distinct(one: Array, other: Array) -> None:
    distance = math.dist(one, other)
    if distance < COINCIDENT_POINTS:
        raise BadCircle(CircleFault.COINCIDENT, distance, COINCIDENT_POINTS)


def _check_radius(radius: float) -> None:
    if radius < LEAST_RADIUS:
        raise BadCircle(CircleFault.TOO_SMALL, radius, LEAST_RADIUS)
    if radius > GREATEST_RADIUS:
        raise BadCircle(CircleFault.TOO_LARGE, radius, GREATEST_RADIUS)
