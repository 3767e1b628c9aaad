"""How fast tool and elbow get along a straight line of the joints, proven from few looks.

Owns that bound. While joints go along q(σ) = q₀ + σ a, a point has the velocity w(σ) by σ, and w
cannot bend more than |w''| ≤ B, see `LinePoints.bends`. Between two places h apart a vector is off
from the straight line through its values at both by at most B h²/8 (the error of linear
interpolation), and a length is convex, so there

    |w(σ)| ≤ (1 - t) |w₀| + t |w₁| + B h²/8,   t from 0 to 1

Speeds are looked at at nodes that keep the last term small, a node for several ticks, and between
the nodes this line stands for them: never below the speed, and hardly above.

A stop scales the velocity by λ, from 1 to 0, and has then gone the share p = 1 - λ² of its way W.
Above a cell the speed in it is so at most √(1 - p) (A + B p), whose maximum is at p = (2B - A) / 3B
where that lies in the cell, else at its nearer end. So a stop never has to be harder than the
joints can, however the arm changes its shape in it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..kinematics import Kinematics
from ..model_map import greatest_travel, model_map
from ..pose import Pose
from ..robot_schema import Joint
from ..tool_speed import elbow_link

_TIGHT = 0.002  # of a speed, or of what is allowed: what the bound may be above it
_LONGEST, _SHORTEST = 1.0, 1e-3  # s: of a cell that all bends leave alone, by σ


class LinePoints:
    """Tool centre point and elbow of a serial arm."""

    def __init__(self, kinematics: Kinematics, tcp: Pose | None = None) -> None:
        """Choose the points.

        Args:
            kinematics: the arm.
            tcp: the tool centre point in the tool link's frame; the link's origin if None.
        """
        self._kinematics = kinematics
        offset = (0.0, 0.0, 0.0) if tcp is None else tcp.position.tolist()
        self._points = [kinematics.link_point(offset=offset)]
        links = [(kinematics.robot.tool_link, math.hypot(*offset))]
        elbow = elbow_link(kinematics)
        if elbow is not None:
            self._points.append(kinematics.link_point(elbow))
            links.append((elbow, 0.0))
        self._links = links
        self._gain, _ = model_map(kinematics.robot)
        self._travel = greatest_travel(kinematics.robot)

    def speeds(self, position: Sequence[float], rates: Sequence[float]) -> list[float]:
        """Return the speed of each point [m/s]."""
        places = np.array(position), np.array(rates)
        return self._kinematics.point_speeds(*places, self._points)

    def bends(self, rates: Sequence[float]) -> list[float]:
        """Return what |w''| of each point is at most where its speed changes [m/s³].

        Wherever the driven joints are in their ranges; 0 for a point whose speed is the same
        everywhere.

        Where a joint is, r = l + R u is the point from its parent, u from itself and l its own
        place. With the angle growing evenly, |dᵏR/dσᵏ| ≤ |a|ᵏ, so

            |r⁽ᵐ⁾| ≤ Σ over k of (m over k) |a|ᵏ |u⁽ᵐ⁻ᵏ⁾|,   |r| ≤ |l| + |u|

        from the point down to the base; a slide adds its rate to |u'| and its stroke to |u|.

        Args:
            rates: (n,) a [rad/s or m/s].
        """
        moving = np.abs(self._gain @ np.array(rates)).tolist()
        if self._kinematics.is_direct and moving.count(0.0) >= len(moving) - 1:
            # One joint alone leads every point on a circle about its axis, always as fast.
            return [0.0] * len(self._links)
        return [self._bend(moving, link, reach) for link, reach in self._links]

    def _bend(self, rates: Sequence[float], link: str, reach: float) -> float:
        robot = self._kinematics.robot
        count = robot.links.index(link)
        left = len([joint for joint in robot.joints[:count] if isinstance(joint, Joint)])
        first = second = third = 0.0
        for joint in reversed(robot.joints[:count]):
            if isinstance(joint, Joint):
                left -= 1
                rate = rates[left]
                if joint.prismatic:
                    reach += self._travel[left]
                    first += rate
                else:
                    third += rate * (3.0 * second + rate * (3.0 * first + rate * reach))
                    second += rate * (2.0 * first + rate * reach)
                    first += rate * reach
            reach += math.hypot(*joint.origin.xyz)
        return third


class _Cell(NamedTuple):
    """Between two nodes.

    Attributes:
        start: where it begins, by σ.
        end: where it ends.
        most: what the speeds of all points are at most in it [m/s].
        lines: of each point the value at the start and the slope of what its speed is at most.
    """

    start: float
    end: float
    most: float
    lines: list[tuple[float, float]]


class LineSpeeds:
    """Speeds of the points along one line."""

    def __init__(
        self,
        points: LinePoints,
        line: tuple[Sequence[float], Sequence[float]],
        until: float,
        allowed: float,
    ) -> None:
        """Begin at σ = 0.

        Args:
            points: of the arm.
            line: (n,) place at σ = 0 and (n,) rates by σ.
            until: how far speeds are asked for, by σ; all joints are in their ranges there.
            allowed: the speed that matters [m/s].
        """
        self._points = points
        self._start, self._rates = line
        self._until, self._allowed = until, allowed
        self._bends = points.bends(self._rates)
        self._end = 0.0
        self._last = points.speeds(*line)
        self._cells: list[_Cell] = []
        self._index = 0

    def greatest(
        self, sigma: float, share: float, way: float, enough: float = 0.0
    ) -> tuple[float, int]:
        """Return the greatest speed of a point in a stop [m/s], or more, and which point's it is.

        Args:
            sigma: where the stop begins.
            share: of the rates, that the velocity is there.
            way: of the stop, by σ.
            enough: a bound that is known to be below this need not be the least.
        """
        end = sigma + way
        while self._end < end or not self._cells:
            self._extend()
        cells, index = self._cells, self._index
        while cells[index].end < sigma:
            index += 1
        while index and cells[index].start > sigma:
            index -= 1
        self._index = index
        cell = cells[index]
        if end <= cell.end and share * cell.most <= enough:
            return share * cell.most, 0
        worst, which = 0.0, 0
        while True:
            cell = cells[index]
            for point, (value, slope) in enumerate(cell.lines):
                p = (cell.start - sigma) / way if cell.start > sigma else 0.0
                here, rise = value + slope * (sigma - cell.start), slope * way
                if 2.0 * rise > here:
                    last = min((cell.end - sigma) / way, 1.0)
                    p = min(max((2.0 * rise - here) / (3.0 * rise), p), last)
                speed = here if p == 0.0 else math.sqrt(1.0 - p) * (here + rise * p)
                if speed > worst:
                    worst, which = speed, point
            if cell.end >= end:
                return share * worst, which
            index += 1

    def _extend(self) -> None:
        """Add a cell as long as its error is small."""
        start, allowed = self._end, self._allowed
        length = min(max(self._until - start, _SHORTEST), _LONGEST)
        for bend, speed in zip(self._bends, self._last, strict=True):
            error = _TIGHT * max(speed, allowed)
            if bend * length * length > 8.0 * error:
                length = math.sqrt(8.0 * error / bend)
        end = start + length
        place = [at + end * rate for at, rate in zip(self._start, self._rates, strict=True)]
        speeds = self._points.speeds(place, self._rates)
        lines, most = [], 0.0
        for before, after, bend in zip(self._last, speeds, self._bends, strict=True):
            error = bend * length * length / 8.0
            lines.append((before + error, (after - before) / length))
            most = max(most, before + error, after + error)
        self._cells.append(_Cell(start, end, most, lines))
        self._end, self._last = end, speeds
