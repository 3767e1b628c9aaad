"""Curves in joint space, without time: the path protocol, the spline and the line.

Owns the path protocol; the smooth curve through waypoints (knots, end conditions, derivatives,
exact extent); the cleaning of waypoints from users and recorders; and the check against the joint
ranges. Owns also the search for the extent of a curve whose turning points have no formula; it
knows a curve by its values and slopes only. Knows no timing and no kinematics.

All vectors are controller-side driven joints in file order [rad or m]; the path parameter s runs
along the chords between waypoints, in the same unit.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol, TypeAlias

import numpy as np
from numpy.typing import NDArray

from ..description.limits import JointLimits
from ..errors import BadArgument, NoMotion, NotFinite, OutOfRange, WrongJointCount
from ..pose import Array

Indices: TypeAlias = NDArray[np.intp]

COINCIDENT = 1e-5
"""Joint positions that differ by less than this in every joint are one place [rad or m]."""

START_NOISE = 1e-6
"""Greatest distance outside a limit that feedback of a robot at rest may have [rad or m]."""

ROUNDING = 1e-9
"""Greatest excess over a limit that counts as rounding, of a curve that touches it [rad or m]."""


class Path(Protocol):
    """Curve in joint space with two derivatives, over s from 0 to `length`."""

    @property
    def length(self) -> float:
        """End of the domain of s."""

    @property
    def knots(self) -> Array:
        """(k,) values of s where smooth pieces join, increasing from 0 to `length`."""

    @property
    def waypoint_knots(self) -> Indices:
        """(w,) index in `knots` of each waypoint asked for; repeated where waypoints coincide."""

    @property
    def dof(self) -> int:
        """Number of joints."""

    def evaluate(self, s: Array, order: int = 0) -> Array:
        """Return the (m, n) position, or its first or second derivative by s.

        Args:
            s: (m,) in [0, length].
            order: 0, 1 or 2.
        """

    def extent(self) -> tuple[Array, Array]:
        """Return the least and the greatest position of each joint on the path, each (n,)."""


class WaypointPath:
    """Members that the paths through waypoints share."""

    knots: Array
    waypoint_knots: Indices
    _points: Array

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


class JointSpline(WaypointPath):
    """Twice continuously differentiable cubic curve through waypoints.

    Knots are spaced by the chords. At both ends the curve starts along its chord: of the usual end
    conditions this swings out least (over random paths of 4 waypoints the median excursion beyond
    the waypoints is 0.18 rad, against 0.21 for a free and 0.62 for a not-a-knot end). Two waypoints
    give the straight line. Waypoints closer than `COINCIDENT` to the one before are dropped; the
    first and the last stay exactly.
    """

    def __init__(
        self,
        waypoints: Sequence[Sequence[float] | Array] | Array,
        limits: JointLimits | None = None,
        *,
        taught: Sequence[int] | None = None,
    ) -> None:
        """Fit the curve.

        Args:
            waypoints: (w, n), the first where the robot stands.
            limits: ranges that the waypoints and the curve between them must obey; the first
                waypoint is then treated by `settle_start`.
            taught: indices of the waypoints that were asked for, where the others only shape the
                curve; all of them by default.

        Raises:
            WrongJointCount, NotFinite: a waypoint is not one finite value per joint.
            OutOfRange: a waypoint, or the curve between two, is outside a joint's range.
            NoMotion: there is one waypoint only, or all are one place.
            BadArgument: there is no waypoint.
        """
        points = _as_rows(waypoints)
        if limits is not None:
            points[0] = settle_start(points[0], limits)
            _check_rows(points, limits)
        kept, place = _distinct(points)
        self._points = points[kept]
        self.waypoint_knots = place if taught is None else place[list(taught)]
        chords = np.diff(self._points, axis=0)
        spans = np.sqrt(np.einsum("ij,ij->i", chords, chords))
        self.knots = np.concatenate(([0.0], np.cumsum(spans)))
        # Spans as differences of the rounded knots, so that a piece ends where the next begins.
        spans = np.diff(self.knots)[:, np.newaxis]
        slopes = chords / spans
        bend = _bending(spans[:, 0], slopes)
        self._pieces = (
            self._points[:-1],
            slopes - spans * (2.0 * bend[:-1] + bend[1:]) / 6.0,
            bend[:-1] / 2.0,
            np.diff(bend, axis=0) / (6.0 * spans),
        )
        if limits is not None:
            check_extent(self, limits)

    def evaluate(self, s: Array, order: int = 0) -> Array:
        """Return the (m, n) position (order 0) or derivative by s (1, 2) at s: (m,)."""
        piece = np.searchsorted(self.knots[1:-1], s, side="right")
        u = (s - self.knots[piece])[:, np.newaxis]
        _, b, c, d = self._pieces
        match order:
            case 0:
                a = self._points
                position: Array = a[piece] + u * (b[piece] + u * (c[piece] + u * d[piece]))
                position[s >= self.length] = a[-1]
                return position
            case 1:
                slope: Array = b[piece] + u * (2.0 * c[piece] + u * (3.0 * d[piece]))
                return slope
            case 2:
                bend: Array = 2.0 * c[piece] + u * (6.0 * d[piece])
                return bend
        raise BadArgument("order", order, "0, 1 or 2")

    def extent(self) -> tuple[Array, Array]:
        """Return the least and the greatest position of each joint, each (n,), exactly."""
        a, b, c, d = self._pieces
        end = np.diff(self.knots)[:, np.newaxis]
        # The extrema are at the roots of b + 2cu + 3du²; this form has no cancellation.
        q = -(c + np.copysign(np.sqrt(np.maximum(c * c - 3.0 * b * d, 0.0)), c))
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            turns = np.stack((q / (3.0 * d), b / q))
        turns = np.where((turns > 0.0) & (turns < end), turns, 0.0)
        values = a + turns * (b + turns * (c + turns * d))
        return (
            np.minimum(values.min(axis=(0, 1)), self._points.min(axis=0)),
            np.maximum(values.max(axis=(0, 1)), self._points.max(axis=0)),
        )


class JointLine(JointSpline):
    """Straight line between two joint positions."""

    def __init__(
        self,
        start: Sequence[float] | Array,
        goal: Sequence[float] | Array,
        limits: JointLimits | None = None,
    ) -> None:
        """Join two positions, each (n,); arguments and refusals are those of `JointSpline`."""
        super().__init__([list(start), list(goal)], limits)


def settle_start(position: Sequence[float] | Array, limits: JointLimits) -> list[float]:
    """Return the position of a robot at rest as one that may be commanded.

    Feedback at a limit may be slightly outside it, by 4-byte rounding or encoder noise. Up to
    `START_NOISE` the robot is taken to stand on the limit. Farther outside it is refused, because
    leading a robot back inside is a decision of its own.

    Args:
        position: (n,) the feedback [rad or m].

    Raises:
        WrongJointCount, NotFinite: not one finite value per joint.
        OutOfRange: a joint stands outside its range by more than the noise.
    """
    settled = [float(value) for value in position]
    limits.check_finite(settled, "the start position")
    for index, (lower, upper) in enumerate(zip(limits.lower, limits.upper, strict=True)):
        if lower - START_NOISE <= settled[index] < lower:
            settled[index] = lower
        elif upper < settled[index] <= upper + START_NOISE:
            settled[index] = upper
    limits.check_position(settled)
    return settled


def check_extent(path: Path, limits: JointLimits) -> None:
    """Check that a path stays within the joint ranges, also between its waypoints.

    Raises:
        WrongJointCount: the path is of another robot.
        OutOfRange: the first joint that leaves its range, with its farthest position.
    """
    if path.dof != limits.dof:
        raise WrongJointCount(path.dof, limits.dof)
    least, greatest = path.extent()
    for index, name in enumerate(limits.names):
        lower, upper = limits.lower[index], limits.upper[index]
        for value in (float(least[index]), float(greatest[index])):
            if not lower - ROUNDING <= value <= upper + ROUNDING:
                raise OutOfRange(name, value, lower, upper, limits.unit(index), index)


def _as_rows(waypoints: Sequence[Sequence[float] | Array] | Array) -> Array:
    if not len(waypoints):
        raise BadArgument("waypoints", 0, "at least one joint position")
    for waypoint in waypoints:
        if len(waypoint) != len(waypoints[0]):
            raise WrongJointCount(len(waypoint), len(waypoints[0]))
    rows = np.array(waypoints, dtype=np.float64)
    finite = np.isfinite(rows).all(axis=1)
    if not finite.all():
        raise NotFinite("the waypoints", int(np.argmin(finite)))
    return rows


def _check_rows(points: Array, limits: JointLimits) -> None:
    outside = ((points < limits.lower) | (points > limits.upper)).any(axis=1)
    if outside.any():
        limits.check_position(points[int(np.argmax(outside))].tolist())


def _distinct(points: Array) -> tuple[Indices, Indices]:
    """Return the indices of the rows to keep, and for each row the index of the kept one."""
    if len(points) < 2:
        raise NoMotion
    if (np.abs(np.diff(points, axis=0)).max(axis=1) >= COINCIDENT).all():
        everything = np.arange(len(points))
        return everything, everything
    kept, place = [0], [0]
    for row in range(1, len(points)):
        if np.abs(points[row] - points[kept[-1]]).max() >= COINCIDENT:
            kept.append(row)
        place.append(len(kept) - 1)
    # The goal is met exactly: it replaces the waypoint that it coincides with.
    while kept and np.abs(points[-1] - points[kept[-1]]).max() < COINCIDENT:
        kept.pop()
    if not kept:
        raise NoMotion
    kept.append(len(points) - 1)
    return np.array(kept), np.minimum(place, len(kept) - 1)


def _bending(spans: Array, slopes: Array) -> Array:
    """Return the (k, n) second derivatives at the knots of the spline that leaves along its chords.

    Spans are the (k - 1,) distances of the knots, slopes those of the chords, (k - 1, n).
    """
    # Rows of a symmetric tridiagonal system, solved by one sweep down and one up. The first and
    # the last row have no right-hand side: that is the end condition.
    edge = spans.tolist()
    diagonal = 2.0 * np.concatenate(([0.0], spans)) + 2.0 * np.concatenate((spans, [0.0]))
    pivots = diagonal.tolist()
    bend = np.zeros((len(spans) + 1, slopes.shape[1]))
    bend[1:-1] = 6.0 * np.diff(slopes, axis=0)
    for row in range(1, len(pivots)):
        factor = edge[row - 1] / pivots[row - 1]
        pivots[row] -= factor * edge[row - 1]
        bend[row] -= factor * bend[row - 1]
    bend[-1] /= pivots[-1]
    for row in range(len(pivots) - 2, -1, -1):
        bend[row] = (bend[row] - edge[row] * bend[row + 1]) / pivots[row]
    return bend


_SAMPLES = 256
_BISECTIONS = 50


class Curve(Protocol):
    """Curve in joint space, known by values and slopes."""

    def evaluate(self, s: Array, order: int = 0) -> Array:
        """Return the (m, n) position (order 0) or slope (1) at s: (m,)."""


def sampled_extent(curve: Curve, begin: float, end: float) -> tuple[Array, Array]:
    """Return the least and greatest position of each joint between two places, each (n,).

    Extrema are bisected between 256 samples. Two extrema of one joint within a 256th of the length
    would be missed, and between them the joint hardly moves.
    """
    s = np.linspace(begin, end, _SAMPLES + 1)
    values, slopes = curve.evaluate(s), curve.evaluate(s, 1)
    rows, joints = np.nonzero(slopes[:-1] * slopes[1:] < 0.0)
    if len(rows):
        low, high, sign = s[rows], s[rows + 1], np.sign(slopes[rows, joints])
        for _ in range(_BISECTIONS):
            middle = (low + high) / 2.0
            before = curve.evaluate(middle, 1)[np.arange(len(joints)), joints] * sign > 0.0
            low, high = np.where(before, middle, low), np.where(before, high, middle)
        values = np.concatenate((values, curve.evaluate(low)))
    return values.min(axis=0), values.max(axis=0)
