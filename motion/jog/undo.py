"""The way of the last jog, kept so that it can be gone back.

Owns what is kept: joint positions thinned so that the straight pieces between them are nowhere
farther from a set-point than a tolerance, by the longest piece that still fits (an opening window,
as of Douglas & Peucker in a stream). When there are too many, the tolerance doubles and what is
kept is thinned again, so memory is bounded and the error is stated. Knows no motion.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeAlias

from ..errors import BadArgument

Position: TypeAlias = tuple[float, ...]

TOLERANCE = 1e-3
"""Greatest distance of a joint from what is kept [rad, or arm's lengths], until it must double."""

MOST_POINTS = 512

_MOST_PENDING = 16
"""Set-points in a piece: each is looked at again for every one that follows."""


class JogWay:
    """The way of one jog.

    Attributes:
        tolerance: how far a set-point is from what is kept, at most, in units of each joint.
    """

    def __init__(
        self, start: Sequence[float], units: Sequence[float], tolerance: float = TOLERANCE
    ) -> None:
        """Begin a way.

        Args:
            start: (n,) where the robot stands [rad or m].
            units: (n,) what each joint's travel is measured in, as `JogModel.unit`.
            tolerance: in those units.

        Raises:
            BadArgument: the tolerance is not more than 0.
        """
        if not tolerance > 0.0:
            raise BadArgument("tolerance", tolerance, "more than 0")
        self.tolerance = tolerance
        self._units = tuple(units)
        self._kept: list[Position] = [tuple(start)]
        self._pending: list[Position] = []

    def add(self, position: Sequence[float]) -> None:
        """Note a set-point."""
        place = tuple(position)
        last = self._pending[-1] if self._pending else self._kept[-1]
        if place == last:
            return
        fits = self._fits(self._kept[-1], self._pending, place)
        if not fits or len(self._pending) >= _MOST_PENDING:
            self._keep(last)
        self._pending.append(place)

    def waypoints(self) -> list[Position]:
        """Return the way from its start to its end; a single point where nothing moved."""
        return [*self._kept, *self._pending[-1:]]

    def way_back(self) -> list[Position]:
        """Return the way from its end to its start."""
        return self.waypoints()[::-1]

    def _keep(self, place: Position) -> None:
        self._kept.append(place)
        self._pending = []
        if len(self._kept) <= MOST_POINTS:
            return
        # The second thinning is of points that are off by the first already: errors add up.
        coarser = JogWay(self._kept[0], self._units, self.tolerance)
        for each in self._kept[1:]:
            coarser.add(each)
        kept = coarser.waypoints()
        self.tolerance *= 2.0
        self._kept = kept if len(kept) <= MOST_POINTS // 2 else self._every_second(kept)

    def _every_second(self, kept: list[Position]) -> list[Position]:
        """Drop every second point of a way that no tolerance makes shorter, and say how far off."""
        thinned = [*kept[:-1:2], kept[-1]]
        triples = zip(kept[::2], kept[1::2], kept[2::2], strict=False)
        self.tolerance += max(self._distance(*triple) for triple in triples)
        return thinned

    def _fits(self, start: Position, between: Sequence[Position], end: Position) -> bool:
        return all(self._distance(start, each, end) <= self.tolerance for each in between)

    def _distance(self, start: Position, place: Position, end: Position) -> float:
        """Return the greatest distance of a joint from the nearest place of a straight piece."""
        square = along = 0.0
        for a, p, b, unit in zip(start, place, end, self._units, strict=True):
            square += ((b - a) / unit) ** 2
            along += ((b - a) / unit) * ((p - a) / unit)
        share = min(max(along / square, 0.0), 1.0) if square > 0.0 else 0.0
        joints = zip(start, place, end, self._units, strict=True)
        return max(abs(p - a - share * (b - a)) / unit for a, p, b, unit in joints)
