"""Path chains: joint paths or tool curves in sequence, rounded where they meet.

Owns the curve of a zone between two joint paths, where a joint motion meets a line of the tool, and
between two curves of the tool: both use the formula of `blending`, the second in space, and
likewise for the rotations of both legs, one after the other. Neither slope nor curvature has a step
at the ends of a zone, so that a smooth joint path can follow it; in joint space the slope does not
vanish in it. Outside its zones each path is unchanged. Knows no robot and no time.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from ..description.limits import JointLimits
from ..errors import BadArgument, ZoneTooLarge
from ..pose import Array, PoseArray
from ..trajectory.joint_curves import COINCIDENT, Indices, Path, check_extent, sampled_extent
from .blending import check_zones, rates, runs, turning
from .tool_curves import LEAST_DISTANCE, ToolCurve

_SPANS = 8  # parts of a zone between knots; even, so that the corner is a knot
_NEAR = 0.5  # of a zone, before and after it: a knot, for motions that brake there
_ROUNDING = 1e-9  # of zones that are exactly as large as allowed


class JointChain:
    """Two paths or more, each beginning where the one before ends, with zones where they meet."""

    def __init__(
        self, paths: Sequence[Path], zones: Sequence[float], limits: JointLimits | None = None
    ) -> None:
        """Join the paths.

        Args:
            paths: at least two.
            zones: (paths - 1,) where they meet, each more than 0 and at most as long as the other
                zones leave of both paths; in the unit of the paths' parameter.
            limits: ranges that the zones must obey too.

        Raises:
            OutOfRange: a joint leaves its range in a zone.
            BadArgument: there is not one zone for each corner, or the zones do not fit.
        """
        if len(paths) < 2 or len(zones) != len(paths) - 1:
            raise BadArgument("zones", len(zones), "one for each two paths that meet")
        self._paths = tuple(paths)
        self._zones = (0.0, *map(float, zones), 0.0)
        for path, before, after in zip(paths, self._zones, self._zones[1:], strict=False):
            if before + after > path.length * (1.0 + _ROUNDING):
                raise BadArgument("zones", before + after, f"at most {path.length:g} in all")
        self._starts: Array = np.cumsum([0.0, *(path.length for path in paths)])
        self._corners = [path.evaluate(np.zeros(1))[0] for path in paths]
        inner = np.array(self._zones[1:-1])
        # Alternately the start and the end of a zone.
        self._edges: Array = np.stack(
            (self._starts[1:-1] - inner, self._starts[1:-1] + inner), axis=1
        ).ravel()
        self.knots: Array = self._all_knots()
        passed = np.concatenate([[0.0], *map(self._waypoints, range(len(paths)))])
        nearest = np.abs(self.knots - passed[:, np.newaxis]).argmin(axis=1)
        self.waypoint_knots: Indices = nearest
        if limits is not None:
            check_extent(self, limits)

    @property
    def length(self) -> float:
        """End of the domain of s: the sum of the paths' lengths."""
        return float(self._starts[-1])

    @property
    def dof(self) -> int:
        """Number of joints."""
        return self._paths[0].dof

    @property
    def goal(self) -> Array:
        """(n,) the end of the last path."""
        goal: Array = self.evaluate(np.array([self.length]))[0]
        return goal

    def evaluate(self, s: Array, order: int = 0) -> Array:
        """Return the (m, n) position (order 0) or derivative by s (1, 2) at s: (m,)."""
        if order not in (0, 1, 2):
            raise BadArgument("order", order, "0, 1 or 2")
        values = np.empty((len(s), self.dof))
        part = np.searchsorted(self._edges, s)
        for number in np.unique(part).tolist():
            rows = part == number
            if number % 2:
                values[rows] = self._in_zone((number + 1) // 2, s[rows], order)
            else:
                values[rows] = self._alone(number // 2, s[rows], order)
        return values

    def extent(self) -> tuple[Array, Array]:
        """Return a range of each joint that the path stays in, as two (n,).

        It includes what the zones cut off, since that is in the extents of the joined paths.
        """
        found = [path.extent() for path in self._paths]
        zones = self._edges.reshape(-1, 2).tolist()
        found += [sampled_extent(self, begin, end) for begin, end in zones]
        least, greatest = zip(*found, strict=True)
        return np.min(least, axis=0), np.max(greatest, axis=0)

    def _alone(self, number: int, s: Array, order: int) -> Array:
        path = self._paths[number]
        along = np.clip(s - self._starts[number], 0.0, path.length)
        if number == len(self._paths) - 1:
            along[s >= self.length] = path.length
        return path.evaluate(along, order)

    def _in_zone(self, corner: int, s: Array, order: int) -> Array:
        first, second, zone = self._paths[corner - 1], self._paths[corner], self._zones[corner]
        t = np.clip((s - self._starts[corner]) / (2.0 * zone) + 0.5, 0.0, 1.0)
        left, after = runs(t, zone)
        before = first.length - left
        if order == 0:
            position: Array = first.evaluate(before) + second.evaluate(after)
            position -= self._corners[corner]
            return position
        leaving, coming = (rate[:, np.newaxis] for rate in rates(t))
        slope, next_slope = first.evaluate(before, 1), second.evaluate(after, 1)
        if order == 1:
            blended: Array = leaving * slope + coming * next_slope
            return blended
        bend: Array = turning(t, zone)[:, np.newaxis] * (next_slope - slope)
        bend += leaving**2 * first.evaluate(before, 2) + coming**2 * second.evaluate(after, 2)
        return bend

    def _all_knots(self) -> Array:
        knots = [start + path.knots for path, start in zip(self._paths, self._starts, strict=False)]
        for begin, end in self._edges.reshape(-1, 2).tolist():
            near = _NEAR * (end - begin)
            knots.append(np.array([begin - near, end + near]))
            knots.append(np.linspace(begin, end, _SPANS + 1))
        every = np.sort(np.concatenate(knots))
        every = every[(every > COINCIDENT) & (every < self.length - COINCIDENT)]
        # Timing imposes limits at the knots; where knots nearly coincide one is enough, since
        # nothing has a step there.
        apart = np.diff(every, prepend=0.0) > COINCIDENT
        return np.concatenate(([0.0], every[apart], [self.length]))

    def _waypoints(self, number: int) -> Array:
        """Return where a path passes its waypoints, but for the first."""
        path = self._paths[number]
        passed: Array = self._starts[number] + path.knots[path.waypoint_knots[1:]]
        return passed


Rows: TypeAlias = NDArray[np.bool_]

_COUNTED_AS_ONE = 1e-9  # of the length; joins that are nearer count as one


class LegPlace(NamedTuple):
    """Place on a chain: the index of the leg, and how far along it, 0 to 1."""

    leg: int
    fraction: float


class ToolChain:
    """Tool curves in sequence, with zones at their corners.

    Legs with a zone between them must have length, each beginning at the pose where the one before
    ends.
    """

    def __init__(
        self,
        legs: Sequence[ToolCurve],
        zones: Sequence[float],
        *,
        first_waypoint: int = 1,
        rounded: tuple[bool, bool] = (False, False),
    ) -> None:
        """Join the legs.

        Args:
            legs: at least one.
            zones: (legs - 1,) at the corners between them [m].
            first_waypoint: number of the first corner, for refusals.
            rounded: see `blending.check_zones`.

        Raises:
            ZoneTooLarge: a zone does not fit on its legs, or a leg is a rotation in place.
            NotFinite: a zone is infinite or not a number.
            BadArgument: a zone is below `LEAST_ZONE`, or there is not one for each corner.
        """
        if not legs:
            raise BadArgument("legs", 0, "at least one")
        self._legs = tuple(legs)
        lengths = [leg.length for leg in legs]
        for index, zone in enumerate(zones):
            if any(_on_the_spot(leg) for leg in legs[index : index + 2]):
                reason = "a leg there is a turn on the spot"
                raise ZoneTooLarge(first_waypoint + index, zone, 0.0, "m", reason)
        check_zones(lengths, zones, "m", first_waypoint, rounded=rounded)
        # Along the chain a zone r has the length 2r: r of each leg.
        self._zones = np.concatenate(([0.0], zones, [0.0]))
        self.waypoints: Array = np.concatenate(([0.0], np.cumsum(lengths)))
        # Alternately the start and the end of a zone.
        around = np.stack((self.waypoints - self._zones, self.waypoints + self._zones), axis=1)
        self._edges: Array = around[1:-1].ravel()
        self.length = float(self.waypoints[-1])
        self.joins: Array = _distinct(
            np.concatenate(
                [self.waypoints, self._edges]
                + [leg.joins + begin for leg, begin in zip(legs, self.waypoints, strict=False)]
            ),
            self.length,
        )

    def place(self, s: Array) -> PoseArray:
        """Return the tool's pose at s: (m,)."""
        rotation, position = np.empty((len(s), 3, 3)), np.empty((len(s), 3))
        for leg, rows in self._alone(s):
            rotation[rows], position[rows] = self._legs[leg].place(self._along(leg, s[rows]))
        for corner, rows in self._in_zones(s):
            first, second = self._legs[corner - 1], self._legs[corner]
            left, gone = runs(*self._within(corner, s[rows]))
            one, other = first.place(first.length - left), second.place(gone)
            at_corner = second.place(np.zeros(1))
            position[rows] = one.position + other.position - at_corner.position
            rotation[rows] = other.rotation @ at_corner.rotation[0].T @ one.rotation
        return PoseArray(rotation, position)

    def motion(self, s: Array) -> Array:
        """Return the (m, 6) derivative of `place` by s."""
        motion = np.empty((len(s), 6))
        for leg, rows in self._alone(s):
            motion[rows] = self._legs[leg].motion(self._along(leg, s[rows]))
        for corner, rows in self._in_zones(s):
            first, second = self._legs[corner - 1], self._legs[corner]
            t, zone = self._within(corner, s[rows])
            (left, gone), (leaving, coming) = runs(t, zone), rates(t)
            one = leaving[:, np.newaxis] * first.motion(first.length - left)
            other = coming[:, np.newaxis] * second.motion(gone)
            # The rotation of the second leg so far also rotates that of the first.
            turned = second.place(gone).rotation @ second.place(np.zeros(1)).rotation[0].T
            one[:, 3:] = np.einsum("mij,mj->mi", turned, one[:, 3:])
            motion[rows] = one + other
        return motion

    def where(self, s: float) -> LegPlace:
        """Return the leg that a place of the chain belongs to, in a zone the nearer one."""
        leg = min(int(np.searchsorted(self.waypoints[1:], s)), len(self._legs) - 1)
        (along,) = self._along(leg, np.array([s]))
        return LegPlace(leg, float(along) / self._legs[leg].length)

    def _along(self, leg: int, s: Array) -> Array:
        """Return the leg's own parameter at places of the chain."""
        along: Array = np.clip(s - self.waypoints[leg], 0.0, self._legs[leg].length)
        return along

    def _alone(self, s: Array) -> Iterator[tuple[int, Rows]]:
        """Return for each leg which rows of s lie on it and in no zone."""
        part = np.searchsorted(self._edges, s)
        return ((int(place) // 2, part == place) for place in np.unique(part) if place % 2 == 0)

    def _in_zones(self, s: Array) -> Iterator[tuple[int, Rows]]:
        """Return for each corner, from 1, which rows of s lie inside its zone."""
        part = np.searchsorted(self._edges, s)
        return ((int(place + 1) // 2, part == place) for place in np.unique(part) if place % 2)

    def _within(self, corner: int, s: Array) -> tuple[Array, float]:
        """Return the share of a zone covered at places of the chain, 0 to 1, and the zone [m]."""
        zone = float(self._zones[corner])
        t: Array = (s - self.waypoints[corner]) / (2.0 * zone) + 0.5
        return t, zone


def _on_the_spot(leg: ToolCurve) -> bool:
    linear = leg.motion(np.array([0.0, leg.length / 2.0]))[:, :3]
    return float(np.linalg.norm(linear, axis=1).max()) * leg.length <= LEAST_DISTANCE


def _distinct(joins: Array, length: float) -> Array:
    """Return joins sorted, without those that differ by rounding, and exact at both ends."""
    joins = np.unique(np.clip(joins, 0.0, length))
    least = _COUNTED_AS_ONE * length
    inner = joins[(joins > least) & (joins < length - least)]
    apart = np.diff(inner, prepend=0.0) > least
    return np.concatenate(([0.0], inner[apart], [length]))
