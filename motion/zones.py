"""Zones: corners rounded within a distance, so that a motion need not stop at them.

Owns the rule how large a zone may be, and the path with zones in joint space. At a corner with a
zone r the second leg begins before the first ends: with a falling from r to 0 and b rising from 0
to r over a stretch 2r of the parameter,

    q(t) = first(end - a(t)) + second(b(t)) - corner,   t from 0 to 1.

Here a = r (1 - t)² and b = r t²: between two straight lines a parabola, whose second derivative is
constant. Where the way turns by θ it passes the corner at (r/2) sin(θ/2), up to a right angle at
most (r/4) sin θ off the legs. It lies in the triangle that the corner cuts off, and meets the lines
without a step in its slope. (`tool_chain` does the same in space and `joint_chain` between any two
joint paths, with another a and b.)
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

LEAST_ZONE = 1e-4
"""The smallest zone [rad or m]; a corner that is to be met more closely is to be stopped at."""

_ROUNDING = 1e-9  # of a zone that is exactly as large as it may be
_SHORT = 1e-5  # rad or m; what is left of a leg and shorter has no knot of its own
_NEAR = 0.25  # of a zone before and after its parabola; a knot on the line


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
    """Straight lines in joint space, joined by parabolas at the waypoints between.

    Every waypoint but the first and the last has a zone above 0, in the unit of the path's length.
    The second derivative is piecewise constant; at a join it is the parabola's.
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
        pieces, passing = _pieces(points, chords / lengths[:, np.newaxis], lengths, zones)
        spans = np.array([piece.span for piece in pieces])
        self._joins: Array = np.concatenate(([0.0], np.cumsum(spans)))
        self.knots: Array = _knots(self._joins, pieces)
        self.waypoint_knots: Indices = np.searchsorted(self.knots, self._joins[passing])
        self._start = np.array([piece.start for piece in pieces])
        self._slope = np.array([piece.slope for piece in pieces])
        self._bend = np.array([piece.bend for piece in pieces])
        self._at_join = _sharper(self._bend)
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
        slope, bend = self._slope[piece], self._bend[piece]
        match order:
            case 0:
                position: Array = self._start[piece] + u * (slope + u * bend / 2.0)
                position[s >= self.length] = self._points[-1]
                return position
            case 1:
                first: Array = slope + u * bend
                return first
            case 2:
                join = np.minimum(np.searchsorted(self._joins, s), len(self._joins) - 1)
                piece = np.where(self._joins[join] == s, self._at_join[join], piece)
                second: Array = self._bend[piece]
                return second
        raise BadArgument("order", order, "0, 1 or 2")

    def extent(self) -> tuple[Array, Array]:
        """Return the least and the greatest position of each joint, each (n,), exactly."""
        end = np.diff(self._joins)[:, np.newaxis]
        with np.errstate(divide="ignore", invalid="ignore"):
            turns = -self._slope / self._bend
        turns = np.where((turns > 0.0) & (turns < end), turns, 0.0)
        crests = self._start + turns * (self._slope + turns * self._bend / 2.0)
        values = np.concatenate((crests, self._start, self._points[-1:]))
        return values.min(axis=0), values.max(axis=0)


class _Piece(NamedTuple):
    """start + slope u + bend u²/2, for u from 0 to `span`; each array is (n,)."""

    span: float
    start: Array
    slope: Array
    bend: Array


def _pieces(
    points: Array, directions: Array, lengths: Array, zones: Sequence[float]
) -> tuple[list[_Piece], list[int]]:
    """Return the lines and half parabolas, and which of them begins at each waypoint.

    Half a parabola of a zone r spans r: from the line's end inward its slope goes from the line's
    direction d to the mean of both, (d + d') / 2, so its second derivative is (d' - d) / 2r, and
    in the middle it passes the corner at (d' - d) r/4.

    Args:
        points: (w, n) waypoints [rad or m].
        directions: (w - 1, n) unit vectors of the legs.
        lengths: (w - 1,) of the legs.
        zones: (w - 2,) at the waypoints between.
    """
    around = [0.0, *map(float, zones), 0.0]
    straight = np.zeros(points.shape[1])
    pieces: list[_Piece] = []
    passing = []
    for leg, direction in enumerate(directions):
        zone, corner = around[leg], points[leg]
        passing.append(len(pieces))
        if zone:
            before = directions[leg - 1]
            bend = (direction - before) / (2.0 * zone)
            middle = corner + zone / 4.0 * (direction - before)
            pieces.append(_Piece(zone, middle, (before + direction) / 2.0, bend))
        left = float(lengths[leg]) - zone - around[leg + 1]
        if left > _ROUNDING * lengths[leg]:
            pieces.append(_Piece(left, corner + zone * direction, direction, straight))
        if zone := around[leg + 1]:
            bend = (directions[leg + 1] - direction) / (2.0 * zone)
            pieces.append(_Piece(zone, points[leg + 1] - zone * direction, direction, bend))
    return pieces, [*passing, len(pieces)]


def _knots(joins: Array, pieces: Sequence[_Piece]) -> Array:
    """Return the joins, and places on the lines where a motion begins or ends to obey a zone.

    Whoever times the path imposes limits at places that are spread evenly between knots, so a long
    line needs some near its ends.
    """
    knots = [0.0]
    for index, (begin, end) in enumerate(pairwise(joins.tolist())):
        if pieces[index].bend.any():
            knots.append(end)
        elif end - begin > _SHORT:
            before = _NEAR * pieces[index - 1].span if index else math.inf
            after = _NEAR * pieces[index + 1].span if index + 1 < len(pieces) else math.inf
            quarter = (end - begin) / 4.0
            knots += [begin + before] * (before < quarter) + [end - after] * (after < quarter)
            knots.append(end)
    knots[-1] = float(joins[-1])
    return np.array(knots)


def _sharper(bend: Array) -> Indices:
    """Return for each of pieces + 1 joins the piece beside it that bends more.

    Args:
        bend: (pieces, n) second derivatives by the path parameter.
    """
    sharpness = np.abs(bend).max(axis=1)
    after = np.arange(1, len(bend))
    inner = np.where(sharpness[1:] >= sharpness[:-1], after, after - 1)
    chosen: Indices = np.concatenate(([0], inner, [len(bend) - 1]))
    return chosen


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
