"""Circles of the tool: arcs and full circles, from points, a centre and a normal.

Owns the geometry of a circle in space, which data determine one, and the tool curve along it. Knows
no robot and no time. All points are of one frame [m].
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import Enum

import numpy as np

from ..errors import BadArgument, BadCircle, CircleFault
from ..pose import Array, Pose, PoseArray
from .tool_curves import EvenTurn, check_point, rotation_between

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

    Args:
        start: first point of the arc.
        via: a point between.
        end: last point of the arc.

    Raises:
        BadCircle: two points coincide, all lie on one line, or the radius is out of bounds.
        NotFinite: a coordinate is infinite or not a number.
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

    Args:
        start: (3,) where the circle begins and ends [m].
        via: (3,) the first point that it passes [m].
        second_via: (3,) the second point that it passes [m].

    Raises:
        BadCircle: two points coincide, all lie on one line, or the radius is out of bounds.
        NotFinite: a coordinate is infinite or not a number.
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
        start: (3,) [m].
        centre: (3,) [m].
        end: (3,) [m].
        normal: (3,) of any length, about which the arc runs counter-clockwise, so that it decides
            between the shorter and the longer arc; needed for half a circle, where the three points
            lie on one line.
        more_than_half: without a normal, True for the longer arc.

    Raises:
        BadCircle: the centre is not equally far from both ends, the ends coincide, the plane is not
            known, or the radius is out of bounds.
        BadArgument: the normal has no direction, is not at a right angle to the radii, or is given
            together with `more_than_half`.
        NotFinite: a coordinate is infinite or not a number.
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
        start: (3,) where the circle begins and ends [m].
        centre: (3,) [m].
        normal: (3,) of any length, at a right angle to the radius.

    Raises:
        BadCircle: the radius is out of bounds.
        BadArgument: the normal has no direction, or is not at a right angle to the radius.
        NotFinite: a coordinate is infinite or not a number.
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
        """Lead the tool along a circle from where it is.

        Args:
            circle: it begins at the start's position.
            start: present pose of the tool.
            target: its orientation ends an even rotation; its position is not used.
            turn: rotation of the tool.
        """
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
