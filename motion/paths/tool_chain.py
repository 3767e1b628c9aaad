"""Tool chain: tool curves in sequence, rounded at their corners.

Owns the curve that uses the formula of `blending` in space, and likewise for the rotations of both
legs, one after the other. Neither slope nor curvature has a step at the ends of a zone, so that a
smooth joint path can follow it. Knows no robot and no time.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from ..errors import BadArgument, ZoneTooLarge
from ..pose import Array, PoseArray
from .blending import check_zones, rates, runs
from .tool_curves import LEAST_DISTANCE, ToolCurve

Rows: TypeAlias = NDArray[np.bool_]

_ROUNDING = 1e-9  # of the length; joins that are nearer count as one


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
    least = _ROUNDING * length
    inner = joins[(joins > least) & (joins < length - least)]
    apart = np.diff(inner, prepend=0.0) > least
    return np.concatenate(([0.0], inner[apart], [length]))
