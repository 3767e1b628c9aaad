"""Upper bounds of the speed of tool and elbow along a straight line in joint space.

Owns the bound along the line, proven from few speeds, and the bound of a point's speed per joint
speed, valid for every joint position in range.

While joints follow q(σ) = q₀ + σ a, a point has the velocity w(σ) by σ, and the second derivative
of w is bounded: |w''| ≤ B, see `LinePoints.bends`. Between two places h apart a vector deviates
from the straight line through its values at both by at most B h²/8 (the error of linear
interpolation), and the norm is convex, so there

    |w(σ)| ≤ (1 - t) |w₀| + t |w₁| + B h²/8,   t from 0 to 1

Speeds are computed at nodes so close that the last term is small, one node for several ticks.
Between the nodes this line stands for them: never below the speed, and hardly above.

A stop scales the velocity by λ, from 1 to 0, and has then covered the share p = 1 - λ² of its
length W. The speed in a cell is therefore at most √(1 - p) (A + B p), whose maximum is at
p = (2B - A) / 3B where that lies in the cell, otherwise at its nearer end. So a stop never needs
more deceleration than the joints have, however the arm changes its shape during it.

Per joint, links being rigid: a revolute joint moves the origin of a link beyond it by at most the
lengths of what lies between them, per radian; a prismatic joint by its own travel. So a point's
speed need not be computed where even the sum of these is low.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..description.schema import Joint
from ..kinematics.pinocchio_model import greatest_travel, model_map
from ..kinematics.serial import Kinematics
from ..pose import Pose
from ..trajectory.point_speed import elbow_link

_TIGHT = 0.002  # of a speed, or of the allowed one: greatest excess of the bound
_LONGEST, _SHORTEST = 1.0, 1e-3  # s, by σ: length of a cell that no bend shortens


class LinePoints:
    """Tool centre point and elbow of a serial arm, with bounds of how their velocities bend."""

    def __init__(self, kinematics: Kinematics, tcp: Pose | None = None) -> None:
        """Choose the points; `tcp` is in the tool link's frame, its origin if None."""
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
        """Return an upper bound of |w''| of each point [m/s³], valid in all joint ranges.

        It is 0 for a point whose speed is the same everywhere.

        At a joint, r = l + R u is the point as seen from the joint's parent, u as seen from the
        joint itself, and l the joint's place. With the angle linear in σ, |dᵏR/dσᵏ| ≤ |a|ᵏ, so

            |r⁽ᵐ⁾| ≤ Σ over k of (m over k) |a|ᵏ |u⁽ᵐ⁻ᵏ⁾|,   |r| ≤ |l| + |u|

        from the point down to the base; a prismatic joint adds its rate to |u'| and its stroke to
        |u|.

        Args:
            rates: (n,) a [rad/s or m/s].
        """
        moving = np.abs(self._gain @ np.array(rates)).tolist()
        if self._kinematics.is_direct and moving.count(0.0) >= len(moving) - 1:
            # One joint alone moves every point on a circle about its axis, at a constant speed.
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
                    # The binomial sum of the docstring for m = 3, 2, 1, the highest first as it
                    # needs the others.
                    third += rate * (3.0 * second + rate * (3.0 * first + rate * reach))
                    second += rate * (2.0 * first + rate * reach)
                    first += rate * reach
            reach += math.hypot(*joint.origin.xyz)
        return third


class _Cell(NamedTuple):
    """Piece of the line between two nodes.

    Attributes:
        start: σ of its start.
        end: σ of its end.
        most: upper bound of the speeds of all points in it [m/s].
        lines: for each point the bound of its speed, as value at the start and slope.
    """

    start: float
    end: float
    most: float
    lines: list[tuple[float, float]]


class LineSpeeds:
    """Bounds of the points' speeds along one line."""

    def __init__(
        self,
        points: LinePoints,
        line: tuple[Sequence[float], Sequence[float]],
        until: float,
        allowed: float,
    ) -> None:
        """Start at σ = 0.

        Args:
            line: (n,) position at σ = 0 and (n,) rates by σ.
            until: greatest σ that is asked for; all joints are in their ranges up to there.
            allowed: the speed limit [m/s]; lower speeds need no tighter bound.
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
        """Return an upper bound of the points' speeds in a stop [m/s], and the index of that point.

        Args:
            sigma: where the stop begins.
            share: share of the rates that the velocity has there.
            way: length of the stop by σ.
            enough: a bound that is known to be below this need not be tight [m/s].
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
        # The usual case: the whole stop lies in one cell whose bound is low enough at full speed.
        if end <= cell.end and share * cell.most <= enough:
            return share * cell.most, 0
        worst, which = 0.0, 0
        while True:
            cell = cells[index]
            for point, (value, slope) in enumerate(cell.lines):
                p = (cell.start - sigma) / way if cell.start > sigma else 0.0
                here, rise = value + slope * (sigma - cell.start), slope * way
                # The derivative of √(1 - p) (A + B p) is positive at p = 0: the maximum lies inside
                # the stop.
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
        """Add a cell, as long as its error B h²/8 stays small."""
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


def lever_arms(kinematics: Kinematics, link: str, offset: float = 0.0) -> list[float]:
    """Return the greatest speed of a point of a link per speed of each joint, (n,) [m/rad or 1].

    Valid for all driven joints in their ranges.

    Args:
        link: the link that the point is fixed to.
        offset: distance of the point from the link's origin [m].
    """
    robot = kinematics.robot
    gain, _ = model_map(robot)
    travel = greatest_travel(robot)
    rows = np.zeros(len(gain))
    chain = robot.joints[: robot.links.index(link)]
    index = sum(isinstance(joint, Joint) for joint in chain)
    reach = offset
    for joint in reversed(chain):
        if isinstance(joint, Joint):
            index -= 1
            rows[index] = 1.0 if joint.prismatic else reach
            if joint.prismatic:
                reach += travel[index]
        reach += math.hypot(*joint.origin.xyz)
    found: list[float] = (rows @ np.abs(gain)).tolist()
    return found
