"""Blending: corners rounded within a zone, so that a motion need not stop at them.

Owns the formula by which one straight or curved leg changes into the next within a zone, the rules
for the size of a zone, and the path with zones in joint space. `path_chains` uses the formula in
space and between any two joint paths. Knows no segment and no time.

The formula of all zones. At a corner with a zone r the second leg begins before the first ends:
with a falling from r to 0 and b rising from 0 to r over a stretch 2r of the parameter,

    q(t) = first(end - a(t)) + second(b(t)) - corner,   a = r (1 - t)³ (1 + t),  b = r t³ (2 - t),

for t from 0 to 1. The rates of a and b by the parameter are -(1 - c) and c, with c = t² (3 - 2t):
the rate that the first leg loses the second gains. Between two straight lines of directions d and
d' it is a polynomial of the fourth degree; the slope is d + (d' - d) c, and the second derivative
(d' - d) 3t (1 - t) / r, which is 0 at both ends: neither slope nor curvature has a step where a
zone begins and ends. A step in the curvature would be a step in the acceleration between two
set-points, of which no controller is told. As a Bézier curve it has the control points -r and -r/2
on the first line, the corner, and r/2 and r on the second; so it lies in the triangle that the
corner cuts off. Where the path changes its direction by θ it passes the corner at (3r/8) sin(θ/2).

Mixed zones, where a line in joint space meets a curve of the tool: such a zone takes the same
distance r in joint space of both paths, no more than the whole of a leg that begins or ends at rest
and no more than half of one whose other end is rounded too. At the end of a PTP, r is the distance
asked for; at the end of a LIN or CIRC it is where the tool is as far from the target as asked for.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from ..description.limits import JointLimits
from ..errors import BadArgument, NoMotion, NotFinite, WrongJointCount, ZoneTooLarge
from ..pose import Array
from ..trajectory.joint_curves import COINCIDENT, Path, WaypointPath, check_extent, settle_start
from .tool_kinematics import ToolKinematics


def runs(t: Array, zone: float | Array) -> tuple[Array, Array]:
    """Return what is left of the first leg and what is covered of the second, by the zone."""
    return zone * (1.0 - t) ** 3 * (1.0 + t), zone * t**3 * (2.0 - t)


def rates(t: Array) -> tuple[Array, Array]:
    """Return the rates of the first and the second leg in a zone, by the parameter.

    They are the derivative of what is left, with its sign changed, and of what is covered; their
    sum is 1.
    """
    return (1.0 - t) ** 2 * (1.0 + 2.0 * t), t**2 * (3.0 - 2.0 * t)


def turning(t: Array, zone: float | Array) -> Array:
    """Return the derivative of the second leg's rate by the parameter."""
    turned: Array = 3.0 * t * (1.0 - t) / zone
    return turned


def place_of_rate(rate: Array) -> Array:
    """Return the t, 0 to 1, at which the second leg has a given rate, 0 to 1."""
    # With t = 1/2 + sin(φ), the rate t² (3 - 2t) is (1 + sin(3φ)) / 2.
    place: Array = 0.5 + np.sin(np.arcsin(2.0 * rate - 1.0) / 3.0)
    return place


LEAST_ZONE = 1e-4
"""Smallest zone [rad or m]; a path closer to its corner has to stop there."""

_ROUNDING = 1e-9  # of a zone that is exactly as large as allowed
_SHORT = 1e-5  # rad or m; a shorter rest of a leg has no knot of its own
_NEAR = 0.25  # of a zone before and after it; a knot on the line


def check_zones(
    lengths: Sequence[float],
    zones: Sequence[float],
    unit: str,
    first_waypoint: int = 0,
    *,
    rounded: tuple[bool, bool] = (False, False),
) -> None:
    """Check that no zone at the corners between legs is too large.

    The zones at both ends of a leg may meet but not overlap. Where they do, the one that is longer
    than half of the leg is refused, the first of two.

    Args:
        lengths: (k,) of the legs.
        zones: (k - 1,) at the corners between them, in the unit of the lengths.
        unit: that unit, for the refusal.
        first_waypoint: number of the first corner, for the refusal.
        rounded: for the start of the first leg and the end of the last, True if a zone of another
            kind is there; it takes half of that leg.

    Raises:
        ZoneTooLarge: with the waypoint and the largest zone that works.
        NotFinite: a zone is infinite or not a number.
        BadArgument: a zone is smaller than `LEAST_ZONE`, or there is not one for each corner.
    """
    if len(zones) != len(lengths) - 1:
        raise BadArgument("zones", len(zones), f"{len(lengths) - 1}, one for each inner waypoint")
    for index, zone in enumerate(zones):
        if not math.isfinite(zone):
            raise NotFinite("the zones", index)
        if zone < LEAST_ZONE:
            raise BadArgument("zone", zone, f"at least {LEAST_ZONE:g}, or a stop at the corner")
    around = [lengths[0] / 2.0 * rounded[0], *zones, lengths[-1] / 2.0 * rounded[1]]
    for index, zone in enumerate(zones):
        largest = math.inf
        for length, other in (
            (lengths[index], around[index]),
            (lengths[index + 1], around[index + 2]),
        ):
            largest = min(largest, max(length / 2.0, length - other))
        if zone > largest * (1.0 + _ROUNDING):
            reason = f"it meets a leg of {min(lengths[index : index + 2]):.6g} {unit}"
            if largest < min(lengths[index : index + 2]):
                reason = "it would overlap the zone at the other end of a leg"
            raise ZoneTooLarge(first_waypoint + index, zone, largest, unit, reason)


class JointPolyline(WaypointPath):
    """Straight lines in joint space, with a zone at each waypoint between.

    Every waypoint but the first and the last has a zone above 0, in the unit of the path's length.
    The second derivative is continuous.
    """

    def __init__(
        self,
        waypoints: Sequence[Sequence[float] | Array] | Array,
        zones: Sequence[float],
        limits: JointLimits | None = None,
        *,
        first_waypoint: int = 1,
        rounded: tuple[bool, bool] = (False, False),
    ) -> None:
        """Join the waypoints.

        Args:
            waypoints: (w, n), the first where the robot stands; see `settle_start`.
            zones: (w - 2,) at the waypoints between.
            limits: ranges that the waypoints must obey; the path between them then does too.
            first_waypoint: number of the second waypoint, for refusals.
            rounded: see `check_zones`.

        Raises:
            ZoneTooLarge: a zone does not fit on its legs.
            NoMotion: the waypoints are one place.
            OutOfRange: a waypoint is outside a joint's range.
            WrongJointCount: a waypoint does not have one value per joint.
            NotFinite: a waypoint or a zone is infinite or not a number.
            BadArgument: there are fewer than two waypoints, not one zone for each between, or a
                zone below `LEAST_ZONE`.
        """
        points = _checked_rows(waypoints, limits)
        chords = np.diff(points, axis=0)
        lengths = np.linalg.norm(chords, axis=1)
        lengths[np.abs(chords).max(axis=1) < COINCIDENT] = 0.0
        if not lengths.any():
            raise NoMotion
        check_zones(lengths.tolist(), zones, _unit(limits), first_waypoint, rounded=rounded)
        self._points = points
        self._directions: Array = chords / lengths[:, np.newaxis]
        self._zones: Array = np.array(zones, dtype=np.float64)
        pieces, passing = _pieces(points, self._directions, lengths, zones)
        spans = np.array([piece.span for piece in pieces])
        self._joins: Array = np.concatenate(([0.0], np.cumsum(spans)))
        self.knots = _knots(self._joins, pieces)
        self.waypoint_knots = np.searchsorted(self.knots, self._joins[passing])
        self._coefficients = tuple(np.stack([piece.coefficients for piece in pieces], axis=1))
        if limits is not None:
            check_extent(self, limits)

    def evaluate(self, s: Array, order: int = 0) -> Array:
        """Return the (m, n) position (order 0) or derivative by s (1, 2) at s: (m,)."""
        piece = np.searchsorted(self._joins[1:-1], s, side="right")
        u = (s - self._joins[piece])[:, np.newaxis]
        c0, c1, c2, c3, c4 = (coefficient[piece] for coefficient in self._coefficients)
        match order:
            case 0:
                position: Array = c0 + u * (c1 + u * (c2 + u * (c3 + u * c4)))
                position[s >= self.length] = self._points[-1]
                return position
            case 1:
                first: Array = c1 + u * (2.0 * c2 + u * (3.0 * c3 + u * 4.0 * c4))
                return first
            case 2:
                second: Array = 2.0 * c2 + u * (6.0 * c3 + u * 12.0 * c4)
                return second
        raise BadArgument("order", order, "0, 1 or 2")

    def extent(self) -> tuple[Array, Array]:
        """Return the least and the greatest position of each joint, each (n,), exactly.

        A joint reverses only in a zone, where its slope d + (d' - d) c is 0.
        """
        before, after = self._directions[:-1], self._directions[1:]
        turns = before * after < 0.0
        rate = np.divide(before, before - after, out=np.zeros_like(before), where=turns)
        left, gone = runs(place_of_rate(rate), self._zones[:, np.newaxis])
        corners = self._points[1:-1]
        crests = corners - before * left + after * gone
        # Where no joint reverses, the ends of a zone are the extremes of what it cuts off.
        edges = self._zones[:, np.newaxis]
        ends = (corners - before * edges, corners + after * edges)
        values = np.concatenate((crests, *ends, self._points[[0, -1]]))
        return values.min(axis=0), values.max(axis=0)


class _Piece(NamedTuple):
    """Polynomial from 0 to `span`.

    Attributes:
        span: in the path's parameter.
        coefficients: (5, n), of the powers 0 to 4.
        bends: True if it is part of a zone.
    """

    span: float
    coefficients: Array
    bends: bool


def _line(span: float, start: Array, direction: Array) -> _Piece:
    nothing = np.zeros_like(start)
    return _Piece(span, np.stack((start, direction, nothing, nothing, nothing)), False)


def _halves(corner: Array, zone: float, before: Array, after: Array) -> tuple[_Piece, _Piece]:
    """Return both halves of a zone, so that the waypoint is a join.

    The second derivative is (d' - d) / r by 3t (1 - t). With u from where each half begins that is
    3u/2r - 3u²/4r² for the first and 3/4 - 3u²/4r² for the second.

    Args:
        corner: (n,) the waypoint.
        zone: r, in the path's parameter.
        before: (n,) the direction d of the leg that ends there.
        after: (n,) the direction d' of the one that begins.
    """
    turn, nothing = after - before, np.zeros_like(corner)
    fourth = -turn / (16.0 * zone**3)
    middle, slope = corner + 3.0 * zone / 16.0 * turn, (before + after) / 2.0
    first = (corner - zone * before, before, nothing, turn / (4.0 * zone**2), fourth)
    second = (middle, slope, 3.0 / (8.0 * zone) * turn, nothing, fourth)
    return _Piece(zone, np.stack(first), True), _Piece(zone, np.stack(second), True)


def _pieces(
    points: Array, directions: Array, lengths: Array, zones: Sequence[float]
) -> tuple[list[_Piece], list[int]]:
    """Return the lines and the halves of the zones, and which of them begins at each waypoint.

    Args:
        points: (w, n) waypoints [rad or m].
        directions: (w - 1, n) unit vectors of the legs.
        lengths: (w - 1,) of the legs.
        zones: (w - 2,) at the waypoints between.
    """
    around = [0.0, *map(float, zones), 0.0]
    pieces: list[_Piece] = []
    passing = [0]
    for leg, direction in enumerate(directions):
        zone, next_zone = around[leg], around[leg + 1]
        left = float(lengths[leg]) - zone - next_zone
        if left > _ROUNDING * lengths[leg]:
            pieces.append(_line(left, points[leg] + zone * direction, direction))
        if next_zone:
            passing.append(len(pieces) + 1)
            pieces += _halves(points[leg + 1], next_zone, direction, directions[leg + 1])
    return pieces, [*passing, len(pieces)]


def _knots(joins: Array, pieces: Sequence[_Piece]) -> Array:
    """Return the joins, and places on the lines where a motion begins or ends to obey a zone.

    Timing imposes limits at places spread evenly between knots, so a long line needs some knots
    near its ends.
    """
    knots = [0.0]
    for index, (begin, end) in enumerate(pairwise(joins.tolist())):
        if pieces[index].bends:
            knots.append(end)
        elif end - begin > _SHORT:
            before = _NEAR * pieces[index - 1].span if index else math.inf
            after = _NEAR * pieces[index + 1].span if index + 1 < len(pieces) else math.inf
            quarter = (end - begin) / 4.0
            knots += [begin + before] * (before < quarter) + [end - after] * (after < quarter)
            knots.append(end)
    knots[-1] = float(joins[-1])
    return np.array(knots)


def _unit(limits: JointLimits | None) -> str:
    return "rad or m" if limits is not None and any(limits.prismatic) else "rad"


def _checked_rows(
    waypoints: Sequence[Sequence[float] | Array] | Array, limits: JointLimits | None
) -> Array:
    """Return the waypoints as (w, n), finite and inside the limits if there are any."""
    if len(waypoints) < 2:
        raise BadArgument("waypoints", len(waypoints), "at least two joint positions")
    rows = [[float(value) for value in waypoint] for waypoint in waypoints]
    for number, row in enumerate(rows):
        if len(row) != len(rows[0]):
            raise WrongJointCount(len(row), len(rows[0]))
        if not all(map(math.isfinite, row)):
            raise NotFinite("the waypoints", number)
    if limits is not None:
        rows[0] = settle_start(rows[0], limits)
        for row in rows[1:]:
            limits.check_position(row)
    return np.array(rows)


_SAMPLES = 512


def largest_joint_zone(before: Path, after: Path, *, rounded: tuple[bool, bool]) -> float:
    """Return the largest zone between two paths, in joint space.

    Args:
        before: the path that ends at the corner.
        after: the path that begins there.
        rounded: True if the last leg of the first path begins in a zone; and the same for the end
            of the first leg of the other path.
    """
    passed, next_passed = (path.knots[path.waypoint_knots] for path in (before, after))
    legs = (passed[-1] - passed[-2], next_passed[1] - next_passed[0])
    return min(
        float(leg) / (2.0 if other else 1.0) for leg, other in zip(legs, rounded, strict=True)
    )


def tool_zone(
    kinematics: ToolKinematics, before: Path, zone: float, largest: float, waypoint: int
) -> float:
    """Return the zone in joint space in which the tool covers a distance to the end of a path.

    Args:
        kinematics: the robot.
        before: the path that ends at the corner, a curve of the tool.
        zone: distance of the tool from the corner along the path [m].
        largest: the largest zone that fits, in joint space.
        waypoint: number of the corner, for the refusal.

    Raises:
        ZoneTooLarge: the tool covers less in the largest zone, or only rotates.
    """
    left = np.linspace(0.0, largest, _SAMPLES)
    positions = kinematics.places(before.evaluate(before.length - left)).position
    steps = np.linalg.norm(np.diff(positions, axis=0), axis=1)
    way = np.concatenate(([0.0], np.cumsum(steps)))
    if way[-1] < LEAST_ZONE:
        raise ZoneTooLarge(waypoint, zone, 0.0, "m", "the tool only turns on a leg there")
    if zone > way[-1] * (1.0 + _ROUNDING):
        reason = "it does not fit on the legs there"
        raise ZoneTooLarge(waypoint, zone, float(way[-1]), "m", reason)
    return float(np.interp(zone, way, left))
