"""Zones: corners rounded within a distance, so that a motion need not stop at them.

Owns the rule how large a zone may be, and the path with zones in joint space. Between straight
lines the law of `zone_law` is a polynomial of the fourth degree. (`tool_chain` obeys it in space,
and `joint_chain` between any two joint paths.)
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from .errors import BadArgument, NoMotion, NotFinite, WrongJointCount, ZoneTooLarge
from .joint_curves import COINCIDENT, Indices, check_extent, settle_start
from .limits import JointLimits
from .trajectory import Array
from .zone_law import place_of_rate, runs

LEAST_ZONE = 1e-4
"""The smallest zone [rad or m]; a corner that is to be met more closely is to be stopped at."""

_ROUNDING = 1e-9  # of a zone that is exactly as large as it may be
_SHORT = 1e-5  # rad or m; what is left of a leg and shorter has no knot of its own
_NEAR = 0.25  # of a zone before and after it; a knot on the line


def check_zones(
    lengths: Sequence[float],
    zones: Sequence[float],
    unit: str,
    first_waypoint: int = 0,
    *,
    rounded: tuple[bool, bool] = (False, False),
) -> None:
    """Check that the zones at the corners between legs are none too large.

    The zones at both ends of a leg may meet but not overlap. Where they do, the one that is longer
    than half of the leg is refused, the first of two.

    Args:
        lengths: (k,) of the legs.
        zones: (k - 1,) at the corners between them, in the unit of the lengths.
        unit: that unit, for the refusal.
        first_waypoint: number of the first corner, for the refusal.
        rounded: whether a zone of another kind is at the start of the first leg, and at the end of
            the last; it takes half of that leg.

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


class JointPolyline:
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
            limits: the ranges that the waypoints must keep; the path between them then does.
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
        self.knots: Array = _knots(self._joins, pieces)
        self.waypoint_knots: Indices = np.searchsorted(self.knots, self._joins[passing])
        self._coefficients = tuple(np.stack([piece.coefficients for piece in pieces], axis=1))
        if limits is not None:
            check_extent(self, limits)

    @property
    def length(self) -> float:
        """End of the domain of s."""
        return float(self.knots[-1])

    @property
    def dof(self) -> int:
        """Number of joints."""
        return int(self._points.shape[1])

    @property
    def goal(self) -> Array:
        """(n,) the last waypoint."""
        goal: Array = self._points[-1]
        return goal

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

        A joint turns back in a zone alone, where its slope d + (d' - d) c is 0.
        """
        before, after = self._directions[:-1], self._directions[1:]
        turns = before * after < 0.0
        rate = np.divide(before, before - after, out=np.zeros_like(before), where=turns)
        left, gone = runs(place_of_rate(rate), self._zones[:, np.newaxis])
        corners = self._points[1:-1]
        crests = corners - before * left + after * gone
        # Where no joint turns back, the ends of a zone are the extremes of what it cuts off.
        edges = self._zones[:, np.newaxis]
        ends = (corners - before * edges, corners + after * edges)
        values = np.concatenate((crests, *ends, self._points[[0, -1]]))
        return values.min(axis=0), values.max(axis=0)


class _Piece(NamedTuple):
    """A polynomial from 0 to `span`.

    Attributes:
        span: in the path's parameter.
        coefficients: (5, n), of the powers 0 to 4.
        bends: whether it is part of a zone.
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

    Whoever times the path imposes limits at places that are spread evenly between knots, so a long
    line needs some near its ends.
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
