"""Lookahead of a tool jog: nodes along the path ahead, their limits, and the speed they allow.

Owns the step from node to node (as long as the cubic between them is exact enough), what ends the
path, what slows it, and the backward pass that turns both into the speed from which every limit
ahead can be obeyed. So a jog is scaled before it meets a limit, and does not have to leave its line
to obey one.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from ..pose import Array
from .collision_guard import SLOW
from .jog_commands import JogCause, JogSlowdown
from .jog_model import JogModel
from .jog_robot import Footing
from .path_node import (
    HALT_CONDITION,
    SLOW_CONDITION,
    SPEED_RESERVE,
    PathNode,
    scales,
    slowed,
    sped_up,
    stop,
)
from .tool_path import ToolPath

_JOINT_STEP = 0.06  # rad, or share of the arm's length: longest cell
_TOOL_STEP, _NEAR_STEP = 8e-3, 3e-3  # m: longest cell, and longest where bodies are near
_TURN_STEP = 0.06  # rad: longest cell
_FIRST_SHARE = 0.25  # of a cell: the first one, when nothing is known of the curvature
_GROWTH = 2.0  # of a cell over the one before
_TRUE = 3e-3  # rad, or share of the length: greatest error of an extrapolated position
_FITTING = 5e-4  # likewise: greatest difference of mean rates from positions over a cell
_SHORTENINGS = 7
_SHORTEST = 1e-7  # by σ: a shorter cell counts as the end of the path
_LEAST_SCALE = 0.05  # so that the end of a path is reached in finite time
_DYNAMIC_RESERVE = 0.9  # of the accelerations: the rest is for what ticks add to cells
_POINT_RESERVE = 0.998  # of the speed of points, likewise
_JOINT_RESERVE = 0.998  # of the speed of joints, likewise


class LookAhead:
    """Path ahead of a tool jog, as far as it is known.

    Attributes:
        nodes: the nodes, σ growing.
        end: what the path ends at; None while it continues.
    """

    def __init__(
        self,
        model: JogModel,
        path: ToolPath,
        position: Sequence[float],
        point_speed: float,
        rate: list[float] | None = None,
    ) -> None:
        """Start a path.

        Args:
            path: pose and direction at σ = 0.
            point_speed: greatest speed of tool centre point and elbow [m/s].
            rate: (n,) by σ, of a robot that moves; None for one at rest.
        """
        self.model = model
        self._path = path
        self._point_speed = point_speed * _POINT_RESERVE
        self._speeds = [_JOINT_RESERVE * v for v in model.limits.velocity]
        self._accelerations = [a * _DYNAMIC_RESERVE for a in model.limits.acceleration]
        self._steady_speeds = [SPEED_RESERVE * v for v in model.limits.velocity]
        self._step = math.inf
        twist = path.twist()
        start = list(position)
        self.end: JogCause | None = model.arm.forbids(start, twist)
        footing = model.arm.follow(start, path.rotation, path.point, twist)
        if footing is None:
            condition = model.arm.condition(start)
            singular = JogCause(JogSlowdown.SINGULARITY, condition, HALT_CONDITION)
            outside = JogCause(JogSlowdown.REACH, 1.0, 0.0)
            self.end = self.end or (singular if condition >= HALT_CONDITION else outside)
            # A node is needed even where no motion is possible: the jog then reports the cause at
            # rest.
            footing = Footing(start, [0.0] * model.dof, condition)
        first = PathNode(0.0, start, rate or footing.rate, twist, footing.condition)
        first.posture = model.arm.posture(start)
        first.distances = None if model.guard is None else model.guard.look(start)
        self._least_condition = first.condition
        margins = scales(model, None, first)
        first.top, first.cause = self._top(start, first.rate, _tool_speed(twist), margins)
        self.nodes = [first]
        self._settle(0)

    def extend(self, count: int, current: int) -> None:
        """Add some cells, or all up to the end of the path.

        Args:
            count: greatest number of cells.
            current: index of the cell that the robot is in.
        """
        for _ in range(count):
            if self.end is not None:
                break
            self._go_on()
        self._settle(current)

    def forget(self, count: int) -> None:
        """Drop the first nodes."""
        del self.nodes[:count]

    def _go_on(self) -> None:
        last = self.nodes[-1]
        guess, twist = last.position, last.twist
        step = self._longest(last)
        cause = JogCause(JogSlowdown.REACH, 1.0, 0.0)
        for _ in range(_SHORTENINGS):
            if step < _SHORTEST:
                break
            path = self._path.advanced(step)
            guess = self._guess(step)
            twist = path.twist()
            footing = self.model.arm.follow(guess, path.rotation, path.point, twist)
            if footing is not None:
                node = self._node(last.sigma + step, footing, twist)
                last.lead_to(node, self._accelerations)
                ending = stop(self.model, last, node, self._least_condition)
                if ending is None and self._is_true(last, guess, footing):
                    self._path, self._step = path, step
                    self._least_condition = min(self._least_condition, node.condition)
                    last.bound_steady(self._steady_speeds, self.model.limits.acceleration)
                    self._slow(last, node)
                    self.nodes.append(node)
                    return
                cause = ending or cause
            # The limit, or the end of what can be followed, lies inside the cell: shorter cells
            # close in on it, so that the path ends just before it.
            step *= 0.5
        if cause.reason is JogSlowdown.REACH:
            if last.condition > SLOW_CONDITION:
                cause = JogCause(JogSlowdown.SINGULARITY, last.condition, HALT_CONDITION)
            else:
                # An arm of few axes may do a twist at one place and not a little farther.
                cause = self.model.arm.forbids(guess, twist) or cause
        last.length = 0.0
        self.end = cause

    def _longest(self, last: PathNode) -> float:
        """Return the length of the longest cell that may begin at the last node, by σ."""
        step = min(self._path.left, _GROWTH * self._step)
        guard, distances, near = self.model.guard, last.distances, False
        if guard is not None and distances is not None:
            near = min(distances.values()) < SLOW
            if not near:
                # Distances are known at nodes only: no cell may be so long that a body is passed
                # inside it.
                step = min(step, guard.unseen_distance(distances, last.rate))
        x, y, z, a, b, c = last.twist.tolist()
        speed, turn = math.sqrt(x * x + y * y + z * z), math.sqrt(a * a + b * b + c * c)
        joints = zip(last.rate, self.model.unit, strict=True)
        greatest = max([abs(rate) / unit for rate, unit in joints])
        share = _FIRST_SHARE if len(self.nodes) == 1 and self._step == math.inf else 1.0
        for value, most in (
            (speed, _NEAR_STEP if near else _TOOL_STEP),
            (turn, _TURN_STEP),
            (greatest, _JOINT_STEP),
        ):
            if value * step > most * share:
                step = most * share / value
        return step

    def _guess(self, step: float) -> list[float]:
        """Return where the joints will be, by the rates at the last two nodes (Adams-Bashforth).

        Not from the curvature of the last cell: the motion of spare axes is set by the guess alone,
        and an extrapolated cubic of extrapolated cubics diverges.
        """
        last = self.nodes[-1]
        if len(self.nodes) == 1:
            return [p + step * r for p, r in zip(last.position, last.rate, strict=True)]
        before = self.nodes[-2]
        gain = 0.5 * step / before.length
        state = zip(last.position, last.rate, before.rate, strict=True)
        return [p + step * (r + gain * (r - b)) for p, r, b in state]

    def _is_true(self, last: PathNode, guess: list[float], footing: Footing) -> bool:
        """Return True if the cubic to a node is exact enough: it was foreseen, and rates fit it."""
        half = 0.5 * last.length
        joints = zip(
            guess,
            last.position,
            footing.position,
            last.rate,
            footing.rate,
            self.model.unit,
            strict=True,
        )
        for guessed, before, after, rate, rate_after, unit in joints:
            # Far from the guess the arm may have taken another branch, or the cell is too long for
            # a cubic.
            if abs(guessed - after) > _TRUE * unit:
                return False
            if abs(after - before - half * (rate + rate_after)) > _FITTING * unit:
                return False
        return True

    def _node(self, sigma: float, footing: Footing, twist: Array) -> PathNode:
        position, rate, condition = footing
        node = PathNode(sigma, position, rate, twist, condition)
        node.posture = self.model.arm.posture(position)
        if self.model.guard is not None:
            node.distances = self.model.guard.look(position)
        return node

    def _slow(self, last: PathNode, node: PathNode) -> None:
        """Set the greatest speed at a new node, and lower it at both ends of the cell before it.

        The ends are lowered to what joints and points allow in the cell's middle, which may be
        faster than both ends.
        """
        margins, tool_speed = scales(self.model, last, node), _tool_speed(node.twist)
        node.top, node.cause = self._top(node.position, node.rate, tool_speed, margins)
        position, rate = last.state(0.5 * last.length)
        top, cause = self._top(position, rate, tool_speed)
        for end in (last, node):
            if top < end.top:
                end.top, end.cause = top, cause

    def _top(
        self,
        position: list[float],
        rate: list[float],
        tool_speed: float,
        margins: Sequence[tuple[float, JogCause]] = (),
    ) -> tuple[float, JogCause | None]:
        """Return the greatest square of dσ/dt at a place, and what sets it."""
        model = self.model
        top, slowest = math.inf, -1
        for joint, (each, limit) in enumerate(zip(rate, self._speeds, strict=True)):
            speed = each if each > 0.0 else -each
            if speed * top > limit:
                top, slowest = limit / speed, joint
        cause = None
        if slowest >= 0:
            limit = model.limits.velocity[slowest]
            cause = JogCause(JogSlowdown.JOINT_SPEED, abs(rate[slowest]), limit, slowest)
        limit = self._point_speed
        if tool_speed * top > limit:
            top = limit / tool_speed
            cause = JogCause(JogSlowdown.TOOL_SPEED, tool_speed, limit / _POINT_RESERVE)
        # The elbow matters only where it is the slowest: below `limit / top` a cheaper upper bound
        # of its speed is enough.
        elbow_speed = model.arm.elbow_speed(position, rate, limit / top)
        if elbow_speed * top > limit:
            top = limit / elbow_speed
            cause = JogCause(JogSlowdown.ELBOW_SPEED, elbow_speed, limit / _POINT_RESERVE)
        for scale, near in margins:
            if scale < top:
                top, cause = max(scale, _LEAST_SCALE), near
        return top * top, cause

    def _settle(self, current: int) -> None:
        """Run the backward pass from the end of the known path to the current cell."""
        after = self.nodes[-1]
        # Whatever lies beyond is unknown, so the known path must be stoppable: rest at its end.
        after.reach, after.reach_cause, after.open = 0.0, self.end, self.end is None
        for index in range(len(self.nodes) - 2, current - 1, -1):
            node = self.nodes[index]
            reach = slowed(node.rows, after.reach, node.top)
            if reach < node.top * (1.0 - 1e-9):
                node.reach_cause, node.open = after.reach_cause, after.open
            else:
                node.reach_cause, node.open = node.cause, False
            node.reach = reach
            after = node
        self._limit_gains(current)

    def _limit_gains(self, current: int) -> None:
        """Lower each reach to what can be accelerated to from the node before.

        The robot follows the line between the reaches of a cell's ends, so this line has to be a
        motion that the accelerations allow.
        """
        before = self.nodes[current]
        for node in self.nodes[current + 1 :]:
            if node.reach > before.reach:
                node.reach = sped_up(before.rows, before.reach, node.reach)
            before = node


def _tool_speed(twist: Array) -> float:
    """Return the speed of the tool centre point by σ, of a (6,) twist."""
    x, y, z, *_ = twist.tolist()
    return math.sqrt(x * x + y * y + z * z)
