"""A tool jog as set-points: the greatest speed that the way ahead allows, tick after tick.

Owns the choice of dσ/dt for one tick, within what the joints allow at the very place where the tick
ends. A release takes the least that they allow, so the whole velocity is scaled to zero on the line
in the least time. Knows no aims; `jogger` decides what is asked.
"""

from __future__ import annotations

import math

from ..pose import Array
from .look_ahead import LookAhead
from .model import JogModel
from .reach import Here, steady_until, within_reach
from .reasons import JogCause
from .targets import LONGEST_STEP
from .tick_bounds import is_even, speed_bounds
from .tool_path import JogTwist, ToolPath
from .way_node import WayNode

_CHUNK = 1  # cells that are looked ahead at a time
_MOST_CHUNKS = 6  # in one tick
_FORGET = 32  # places behind
_CORRECTIONS = 24
_SLACK = 1.0 - 1e-7
_INSIDE = 1e-3  # of what accelerations leave
_ELBOW_RESERVE = 0.999  # of the elbow's speed at a set-point: within a tick it may be faster
_AS_ASKED = 0.99  # of the asked speed: what is lost beyond is told
_STILL = 1e-4  # of each joint's speed limit: slower is creeping towards the end of a way
_BACKWARDS = -0.2  # cosine between directions from which a bend is a turn-round
_BEND_SHARE = 0.4  # of the accelerations, that a bend may take
_SHORTEST_BEND = 0.02  # of σ
_BENDS = 4


class ToolMotion:
    """A moving tool.

    Attributes:
        position: (n,) the last set-point [rad or m].
        velocity: (n,) of it.
        speed: dσ/dt of it: share of the full speeds of the caps.
        twist: the direction at full speed.
        point_speed: greatest speed of tool centre point and elbow [m/s].
        scale: what the way ahead leaves of the asked speed.
        cause: what takes the rest.
        lost: whether no speed on the line keeps to the accelerations, so it must be left.
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
        self._steady = 0.0, 0.0  # a speed, and up to which σ it is known to be kept to

    @classmethod
    def begin(
        cls, model: JogModel, twist: JogTwist, position: list[float], point_speed: float
    ) -> ToolMotion:
        """Begin at rest."""
        rotation, point = model.arm.place(position)
        path = ToolPath(rotation, point, twist)
        return cls(model, LookAhead(model, path, position, point_speed), twist, point_speed)

    @property
    def at_rest(self) -> bool:
        """Whether the robot stands."""
        return self.speed == 0.0

    def bent(self, twist: JogTwist, point_speed: float) -> ToolMotion | None:
        """Return the motion that goes on from here into another direction.

        Returns:
            None where the way there must begin at rest: a turn-round, or a bend that no length
            makes even enough for the speed.
        """
        model = self._model
        rotation, point = model.arm.place(self.position)
        if self.at_rest or self._cosine(twist, rotation) < _BACKWARDS:
            return None
        before = self._twist_here()
        rate = [value / self.speed for value in self.velocity]
        after = twist.in_base(rotation)
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
            while first.open and ahead.end is None and len(ahead.nodes) < _FORGET:
                ahead.extend(_CHUNK, 0)
                if first.reach >= self.speed * self.speed:
                    break
            if first.reach >= self.speed * self.speed:
                return ToolMotion(model, ahead, twist, point_speed, self.speed)
            bend *= 2.0
        return None

    def step(self, dt: float, asked: float) -> None:
        """Move on by one tick.

        Args:
            dt: since the last set-point [s].
            asked: dσ/dt that is asked for.
        """
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
            # A little inside, so that the bounds of the place that it leads to hold as well.
            wanted = min(max(wanted, least + inside), most - inside)
            if wanted < speed:
                fastest = speed
            else:
                slowest = speed
                fastest = max(fastest, wanted)
            # Where rates change quickly within a tick the bounds do too, and this goes to and fro;
            # between too slow and too fast there is a speed that is neither.
            speed = wanted if slowest < wanted < fastest else 0.5 * (slowest + fastest)
        self.lost = True

    def _goes_on(self, dt: float) -> bool:
        """Go on by a tick at the speed that one has, where the way is known to leave it.

        What `step` finds out anew for a tick holds for all up to there at once, see `steady_until`;
        it would come to the very same set-point. The elbow's speed alone is asked for.
        """
        speed, nodes = self.speed, self._ahead.nodes
        sigma = self._sigma + speed * dt
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
        """Return whether there is a way ahead at all, looking for it if need be."""
        if len(self._ahead.nodes) == 1:
            self._ahead.extend(_CHUNK, 0)
        return len(self._ahead.nodes) > 1

    def _allowed(self, dt: float, asked: float) -> float:
        """Return the speed at the end of the tick that the way ahead allows; sets the cause."""
        self.scale, self.cause = 1.0, None
        if asked <= 0.0:
            return 0.0
        nodes = self._ahead.nodes
        speed, node, unknown = within_reach(nodes, self._here, dt, asked)
        for _ in range(_MOST_CHUNKS):
            if speed >= asked or not unknown:
                break
            self._look_further()
            speed, node, unknown = within_reach(nodes, self._here, dt, asked)
        if speed >= asked * _AS_ASKED or unknown:
            return speed
        self.scale, self.cause = speed / asked, node.reach_cause
        if self._ahead.end is not None and self._creeps(node, speed):
            # The last micrometres before the end of a way would take for ever.
            self.scale, self.cause = 0.0, self._ahead.end
            return 0.0
        return speed

    @property
    def _here(self) -> Here:
        return Here(self._sigma, self.speed, self._index)

    def _creeps(self, node: WayNode, speed: float) -> bool:
        """Return whether no joint can be seen to move at a speed."""
        joints = zip(node.rate, self._model.limits.velocity, strict=True)
        return all(abs(rate) * speed <= _STILL * limit for rate, limit in joints)

    def _look_further(self) -> None:
        self._steady = 0.0, 0.0
        behind = self._index
        if behind > _FORGET:
            self._ahead.forget(behind)
            self._index = 0
        self._ahead.extend(_CHUNK, self._index)

    def _cell(self, sigma: float) -> int:
        """Return the index of the cell that σ lies in; the last one beyond the known way."""
        nodes = self._ahead.nodes
        index = self._index
        while index + 2 < len(nodes) and nodes[index + 1].sigma <= sigma:
            index += 1
        return index

    def _twist_here(self) -> Array:
        """Return the (6,) direction of the tool by σ, in the base frame."""
        nodes = self._ahead.nodes
        before, after = nodes[self._index], nodes[self._index + 1]
        share = (self._sigma - before.sigma) / before.length
        twist: Array = (1.0 - share) * before.twist + share * after.twist
        return twist

    def _cosine(self, twist: JogTwist, rotation: Array) -> float:
        """Return the cosine between a direction and this one, turns in radians by metres."""
        one, other = twist.in_base(rotation), self._twist_here()
        size = math.sqrt(float(one @ one) * float(other @ other))
        return float(one @ other) / size if size > 0.0 else 0.0
