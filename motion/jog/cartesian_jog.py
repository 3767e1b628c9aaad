"""Cartesian jog: one set-point a tick, at the greatest speed that the path ahead allows.

Owns the choice of dσ/dt for one tick, within what the joints allow at the exact place where the
tick ends. A release takes the least dσ/dt that they allow, so the velocity is scaled to zero on the
line in the least time. Knows no targets; `jogger` decides what is asked.

Owns also the reading of the reach of each path node, the greatest square of dσ/dt there. Within a
cell the reach is linear between those of its ends. This reading knows no joints.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from ..pose import Array
from .jog_commands import LONGEST_STEP, JogCause
from .jog_model import JogModel
from .lookahead import LookAhead
from .path_node import PathNode, is_even, speed_bounds
from .tool_path import JogTwist, ToolPath

_SLACK = 1.0 - 1e-7


class Here(NamedTuple):
    """Place and speed of a motion on its path.

    Attributes:
        speed: dσ/dt.
        cell: index of the cell that it is in.
    """

    sigma: float
    speed: float
    cell: int


Found = tuple[float, PathNode, bool]
"""A speed, the cell that sets it, and True if only the end of the known path does."""


def within_reach(nodes: Sequence[PathNode], here: Here, dt: float, asked: float) -> Found:
    """Return the greatest speed whose square is within reach where the tick ends.

    It is also within reach half a longest tick of that speed farther: a tick in which the tool
    comes to rest takes s dt/2, which is more than s² over twice the deceleration, the path of a
    stop that ends within the tick.

    Args:
        nodes: the places of the path, σ growing.
        asked: upper bound of the speed.
    """
    half = 0.5 * dt
    start = here.sigma + here.speed * half
    near = _after(nodes, here.cell, start, half, asked)
    far = _after(nodes, here.cell, start, half + 0.5 * LONGEST_STEP, asked)
    found = far if far[0] < near[0] else near
    passing = _passing(nodes, here, dt, found[0])
    return found if passing is None else passing


def _passing(nodes: Sequence[PathNode], here: Here, dt: float, speed: float) -> Found | None:
    """Return the greatest speed with which nodes inside the tick are passed no faster than allowed.

    `speed` is the one planned for the end of the tick; None if it obeys already. The square of the
    speed is linear in σ within a tick.
    """
    end = here.sigma + 0.5 * (here.speed + speed) * dt
    square = here.speed * here.speed
    found = None
    for index in range(here.cell + 1, len(nodes)):
        node = nodes[index]
        if node.sigma >= end:
            break
        if node.sigma <= here.sigma:
            continue
        gain = (node.reach - square) / (2.0 * (node.sigma - here.sigma))
        if here.speed + gain * dt < speed:
            speed = max(0.0, here.speed + gain * dt)
            found = speed, node, node.open
    return found


def _after(nodes: Sequence[PathNode], index: int, start: float, gain: float, asked: float) -> Found:
    """Return the greatest speed s with s² within reach at `start` + s · gain.

    In a cell the reach is a line k + g σ, so s is the positive root of a quadratic.
    """
    best, node = 0.0, nodes[index]
    for at in range(index + 1, len(nodes)):
        after = nodes[at]
        slope = (after.reach - node.reach) / node.length
        linear = 0.5 * slope * gain
        root = linear * linear + node.reach + slope * (start - node.sigma)
        speed = linear + math.sqrt(root) if root > 0.0 else 0.0
        speed = 0.0 if speed < 0.0 else asked if speed > asked else speed
        end = start + speed * gain
        if end <= after.sigma:
            unknown = node.open or after.open
            return (speed if end >= node.sigma else best), node, unknown
        # The root lies in a later cell, so the speed at this border is a lower bound of it.
        best = min(max(0.0, (after.sigma - start) / gain), asked)
        node = after
    return best, nodes[-2], nodes[-1].open


def steady_until(nodes: Sequence[PathNode], index: int, speed: float) -> float:
    """Return up to which σ a motion at a constant speed obeys every limit, from a cell on.

    The limits are the reach at every place of the path, and what the joints allow by
    `PathNode.steady`. So `within_reach` gives that speed for every tick that ends at least half a
    longest tick before this σ, and the bounds between two set-points (`speed_bounds`, `is_even`)
    hold up to there.
    """
    node, square = nodes[index], speed * speed
    until = node.sigma
    # The reach is linear in σ within a cell, so comparing it at the ends of each cell is enough.
    if node.reach < square:
        return until
    for at in range(index + 1, len(nodes)):
        if node.steady < square:
            break
        after = nodes[at]
        if after.reach < square:
            share = (node.reach - square) / (node.reach - after.reach)
            return node.sigma + _SLACK * share * node.length
        until, node = after.sigma, after
    return until


_CHUNK = 1  # cells added to the path ahead at a time
_MOST_CHUNKS = 6  # in one tick: bounds the time that a tick takes
_FORGET = 32  # nodes behind the robot that are kept at most
_CORRECTIONS = 24

_INSIDE = 1e-3  # share of the interval of speeds that the accelerations allow
_ELBOW_RESERVE = 0.999  # of the elbow's speed limit: within a tick it may be faster
_AS_ASKED = 0.99  # of the asked speed: a greater loss is reported with its cause
_STILL = 1e-4  # of each joint's speed limit: slower is creeping towards the end of a path
_BACKWARDS = -0.2  # cosine between two directions; below it the tool stops first
_BEND_SHARE = 0.4  # of the acceleration limits: the most that a bend may take
_SHORTEST_BEND = 0.02  # by σ
_BENDS = 4


class CartesianJogMotion:
    """Tool in Cartesian jog, moving or at rest.

    Attributes:
        speed: dσ/dt of the last set-point: share of the full speeds of the caps.
        twist: the direction at full speed.
        point_speed: greatest speed of tool centre point and elbow [m/s].
        scale: share of the asked speed that the path ahead allows.
        cause: what takes the rest of the asked speed.
        lost: True if no speed on the line obeys the accelerations, so the line must be left.
    """

    def __init__(
        self,
        model: JogModel,
        ahead: LookAhead,
        twist: JogTwist,
        point_speed: float,
        speed: float = 0.0,
    ) -> None:
        self._model, self._ahead = model, ahead
        self.point_speed = point_speed
        first = ahead.nodes[0]
        self.position = list(first.position)
        self.velocity = [rate * speed for rate in first.rate] if speed else [0.0] * model.dof
        self.speed = speed
        self.twist = twist
        self.scale = 1.0
        self.cause: JogCause | None = None
        self.lost = False
        self._sigma = 0.0
        self._index = 0
        self._steady = 0.0, 0.0  # a speed, and up to which σ it is known to obey every limit

    @classmethod
    def begin(
        cls, model: JogModel, twist: JogTwist, position: list[float], point_speed: float
    ) -> CartesianJogMotion:
        """Begin at rest."""
        rotation, point = model.arm.place(position)
        path = ToolPath(rotation, point, twist)
        return cls(model, LookAhead(model, path, position, point_speed), twist, point_speed)

    @property
    def at_rest(self) -> bool:
        """True while the robot stands still."""
        return self.speed == 0.0

    def bent(self, twist: JogTwist, point_speed: float) -> CartesianJogMotion | None:
        """Return the motion that continues from here into another direction.

        Returns:
            None where the new direction must begin at rest: the tool would reverse, or no length of
            bend is gentle enough for the speed.
        """
        model = self._model
        rotation, point = model.arm.place(self.position)
        if self.at_rest or self._cosine(twist, rotation) < _BACKWARDS:
            return None
        before = self._twist_here()
        rate = [value / self.speed for value in self.velocity]
        after = twist.in_base(rotation)
        # Joint rates are linear in the twist, so the rates for the change of twist are the change
        # of the rates; over a bend of length b the joints accelerate by about speed² · change / b.
        gain = model.arm.follow(self.position, rotation, point, after - before)
        if gain is None or model.arm.forbids(self.position, after) is not None:
            return None
        jumps = zip(gain.rate, model.limits.acceleration, strict=True)
        needed = max(abs(jump) / (_BEND_SHARE * limit) for jump, limit in jumps)
        bend = max(_SHORTEST_BEND, self.speed * self.speed * needed)
        for _ in range(_BENDS):
            path = ToolPath(rotation, point, twist, before, bend)
            ahead = LookAhead(model, path, self.position, point_speed, rate)
            first = ahead.nodes[0]
            # The bend is safe only if the path after it can be stopped on: look ahead until that is
            # known.
            while first.open and ahead.end is None and len(ahead.nodes) < _FORGET:
                ahead.extend(_CHUNK, 0)
                if first.reach >= self.speed * self.speed:
                    break
            if first.reach >= self.speed * self.speed:
                return CartesianJogMotion(model, ahead, twist, point_speed, self.speed)
            # A longer bend needs less acceleration.
            bend *= 2.0
        return None

    def step(self, dt: float, asked: float) -> None:
        """Advance by one tick."""
        if self.speed == 0.0 and not self.can_begin():
            self.velocity = [0.0] * self._model.dof
            self.scale, self.cause = 0.0, self._ahead.end
            return
        if self.speed == asked and self._goes_on(dt):
            return
        speed = self._allowed(dt, asked)
        limits, nodes = self._model.limits, self._ahead.nodes
        before, started = self.velocity, self.speed
        slowest, fastest = 0.0, speed
        # Where the tick ends depends on its speed, and the joints' bounds on where it ends. So the
        # speed is corrected against the bounds at its own end until both agree.
        for _ in range(_CORRECTIONS):
            sigma = self._sigma + 0.5 * (started + speed) * dt
            index = self._cell(sigma)
            node = nodes[index]
            position, rate = node.state(sigma - node.sigma)
            least, most = speed_bounds(limits, rate, before, dt)
            inside = _INSIDE * max(0.0, min(most - least, most))
            wanted = speed
            if least * _SLACK <= speed <= most / _SLACK:
                velocity = [each * speed for each in rate]
                if is_even(limits, (self.position, before), (position, velocity), dt):
                    allowed = _ELBOW_RESERVE * self.point_speed
                    elbow_speed = self._model.arm.elbow_speed(position, velocity, allowed)
                    too_fast = elbow_speed / allowed
                    if too_fast <= 1.0 or speed <= least + 2.0 * inside:
                        self._sigma, self._index, self.speed = sigma, index, speed
                        self.position, self.velocity = position, velocity
                        return
                    wanted = speed / too_fast
                else:
                    wanted = 0.5 * (slowest + speed)
            # A little inside, so that the bounds also hold at the place that this speed leads to.
            wanted = min(max(wanted, least + inside), most - inside)
            if wanted < speed:
                fastest = speed
            else:
                slowest = speed
                fastest = max(fastest, wanted)
            # Where rates change quickly within a tick the bounds do too, and the correction
            # oscillates. A speed between the too slow and the too fast one is neither: bisect.
            speed = wanted if slowest < wanted < fastest else 0.5 * (slowest + fastest)
        # No speed on the line obeys the accelerations. The line gives way to the joint limits,
        # never the other way round: the caller stops joint by joint.
        self.lost = True

    def _goes_on(self, dt: float) -> bool:
        """Advance by a tick at the present speed where the path is known to allow it; True if done.

        A shortcut of `step` with the same set-point as result: what `step` computes for a single
        tick, `steady_until` has proven for all ticks up to a σ. Only the elbow's speed is computed
        again.
        """
        speed, nodes = self.speed, self._ahead.nodes
        sigma = self._sigma + speed * dt
        # The end of the tick and half a longest tick beyond it, the same margin as in
        # `within_reach`.
        needed = sigma + 0.5 * LONGEST_STEP * speed
        if self._steady[0] != speed or self._steady[1] < needed:
            self._steady = speed, steady_until(nodes, self._index, speed)
            if self._steady[1] < needed:
                return False
        index = self._cell(sigma)
        node = nodes[index]
        position, rate = node.state(sigma - node.sigma)
        velocity = [each * speed for each in rate]
        allowed = _ELBOW_RESERVE * self.point_speed
        if self._model.arm.elbow_speed(position, velocity, allowed) > allowed:
            return False
        self._sigma, self._index = sigma, index
        self.position, self.velocity = position, velocity
        self.scale, self.cause = 1.0, None
        return True

    def can_begin(self) -> bool:
        """Return True if there is a path ahead, after looking for it if necessary."""
        if len(self._ahead.nodes) == 1:
            self._ahead.extend(_CHUNK, 0)
        return len(self._ahead.nodes) > 1

    def _allowed(self, dt: float, asked: float) -> float:
        """Return the speed that the path ahead allows at the end of the tick; set the cause."""
        self.scale, self.cause = 1.0, None
        if asked <= 0.0:
            return 0.0
        nodes = self._ahead.nodes
        speed, node, unknown = within_reach(nodes, self._here, dt, asked)
        for _ in range(_MOST_CHUNKS):
            # An unknown path counts as one that ends at rest, so looking further can only raise the
            # speed.
            if speed >= asked or not unknown:
                break
            self._look_further()
            speed, node, unknown = within_reach(nodes, self._here, dt, asked)
        if speed >= asked * _AS_ASKED or unknown:
            return speed
        self.scale, self.cause = speed / asked, node.reach_cause
        if self._ahead.end is not None and self._creeps(node, speed):
            # Each tick covers only a share of the distance left, so the last micrometres would
            # never end.
            self.scale, self.cause = 0.0, self._ahead.end
            return 0.0
        return speed

    @property
    def _here(self) -> Here:
        return Here(self._sigma, self.speed, self._index)

    def _creeps(self, node: PathNode, speed: float) -> bool:
        """Return True if every joint moves too slowly to be seen."""
        joints = zip(node.rate, self._model.limits.velocity, strict=True)
        return all(abs(rate) * speed <= _STILL * limit for rate, limit in joints)

    def _look_further(self) -> None:
        # Nodes are about to be dropped and reaches to change: what was proven of the old ones is
        # void.
        self._steady = 0.0, 0.0
        behind = self._index
        if behind > _FORGET:
            self._ahead.forget(behind)
            self._index = 0
        self._ahead.extend(_CHUNK, self._index)

    def _cell(self, sigma: float) -> int:
        """Return the index of the cell that σ lies in; the last one beyond the known path."""
        nodes = self._ahead.nodes
        index = self._index
        while index + 2 < len(nodes) and nodes[index + 1].sigma <= sigma:
            index += 1
        return index

    def _twist_here(self) -> Array:
        """Return the (6,) twist of the tool per σ, in the base frame."""
        nodes = self._ahead.nodes
        before, after = nodes[self._index], nodes[self._index + 1]
        share = (self._sigma - before.sigma) / before.length
        twist: Array = (1.0 - share) * before.twist + share * after.twist
        return twist

    def _cosine(self, twist: JogTwist, rotation: Array) -> float:
        """Return the cosine between a direction and the present one; 1 rad counts as 1 m."""
        one, other = twist.in_base(rotation), self._twist_here()
        size = math.sqrt(float(one @ one) * float(other @ other))
        return float(one @ other) / size if size > 0.0 else 0.0
