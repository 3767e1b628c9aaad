"""Joint chain: joint paths of any kind in sequence, rounded where they meet.

Owns the curve of a zone between two joint paths, where a joint motion meets a line of the tool: it
uses the formula of `blending` in joint space. Neither slope nor curvature has a step at the ends of
a zone, and the slope does not vanish in it. Outside its zones each path is unchanged. Knows no
robot and no time.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..description.limits import JointLimits
from ..errors import BadArgument
from ..pose import Array
from ..trajectory.joint_curves import COINCIDENT, Indices, Path, check_extent, sampled_extent
from .blending import rates, runs, turning

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
