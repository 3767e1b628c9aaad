"""Path node: a place of a tool jog's path ahead, the cubic to the next, and the speed limits.

Owns the arithmetic of a cell. The joints follow the cubic that meets positions and rates at both
ends (Hermite); with dσ/dt as speed, x its square and u = d²σ/dt² constant over the cell,

    q' = r √x        q'' = r u + c x        x₁ = x₀ + 2 u h

for the rate r and the curvature c by σ. So |q''| ≤ a at both ends are linear inequalities in x₀ and
x₁, as in time-optimal path parameterisation by reachability (Pham & Pham, TOPP-RA, 2018, with its
interpolation scheme); `slowed` is one step of its backward pass.

Owns also what joint limits leave to one tick, the bounds between two set-points: |Δv| ≤ a dt,
|v| ≤ v_max, and a distance that differs from that of the mean velocity by at most a dt²/4, as it
does for a joint that obeys its acceleration limit at every moment. The server's set-point guard
checks these bounds again just before a set-point is sent.

Owns also what slows a path near other limits, and what ends it. A margin slows by the root of what
is left of it, which is an even deceleration: a joint before the end of its range, the condition
number from 17 to 30 (the figures of moveit_servo), bodies from 20 mm to 5 mm apart, a platform
before its borders. Each slows only while the limit comes nearer, so that leaving it is free.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TypeAlias

from ..description.limits import JointLimits
from ..pose import Array
from .collision_guard import Distances
from .jog_commands import JogCause, JogSlowdown
from .jog_model import JogModel
from .jog_robot import Posture

Inequality: TypeAlias = tuple[float, float, float]
"""α, β, a of |α x₀ + β x₁| ≤ a."""

Cubic: TypeAlias = tuple[float, float, float, float]
"""Coefficients of a joint's cubic, the constant first [rad or m], by σ from the node on."""

_HALVINGS = 12
_SLACK = 1.0 - 1e-6


@dataclass(slots=True)
class PathNode:
    """A place of the path, and the cell that begins there.

    Attributes:
        twist: (6,) of the tool by σ.
        condition: condition number of the Jacobian.
        posture: use of the limits that belong to no joint.
        distances: of the pairs that are near, as of `CollisionGuard.look`.
        top: greatest square of dσ/dt that joints, points and margins allow here.
        cause: what sets `top`.
        reach: greatest square of dσ/dt from which every limit ahead can be obeyed.
        reach_cause: what sets `reach`.
        open: True if the end of the known path sets `reach`.
        length: length of the cell by σ; 0 while there is none.
        cubics: (n,) cubics of the joints in the cell.
        steady: greatest square of a constant dσ/dt that the joints allow in the whole cell.
    """

    sigma: float
    position: list[float]
    rate: list[float]
    twist: Array
    condition: float
    posture: Posture | None = None
    distances: Distances | None = None
    top: float = 0.0
    cause: JogCause | None = None
    reach: float = 0.0
    reach_cause: JogCause | None = None
    open: bool = True
    length: float = 0.0
    cubics: list[Cubic] = field(default_factory=list)
    rows: list[Inequality] = field(default_factory=list)
    steady: float = 0.0

    def lead_to(self, after: PathNode, accelerations: Sequence[float]) -> None:
        """Build the cell to the next node, under (n,) acceleration limits."""
        h = self.length = after.sigma - self.sigma
        self.cubics, self.rows = [], []
        half = 0.5 / h
        joints = zip(
            self.position, after.position, self.rate, after.rate, accelerations, strict=True
        )
        for start, end, rate, rate_after, limit in joints:
            slope = (end - start) / h
            square = (3.0 * slope - 2.0 * rate - rate_after) / h
            cube = (rate + rate_after - 2.0 * slope) / (h * h)
            self.cubics.append((start, rate, square, cube))
            # u = (x₁ - x₀) / 2h put into |r u + c x| ≤ a, at the start of the cell and then at its
            # end.
            self.rows.append((2.0 * square - rate * half, rate * half, limit))
            bend = 2.0 * square + 6.0 * cube * h
            self.rows.append((-rate_after * half, rate_after * half + bend, limit))

    def bound_steady(self, velocities: Sequence[float], accelerations: Sequence[float]) -> None:
        """Compute `steady` of a cell from (n,) velocity and acceleration limits.

        At a constant dσ/dt = s a joint has the acceleration c s², and c is linear in σ, so greatest
        at an end. Its velocity r s is a quadratic, which lies within the hull of its control values
        r₀, r₀ + c₀ h/2 and r₁ (Bézier). Joints that obey both at every moment obey the bounds
        between two set-points in ticks of any length, across cells too: rates are the same on
        either side of a node.
        """
        h, steady = self.length, math.inf
        joints = zip(self.cubics, velocities, accelerations, strict=True)
        for (_, rate, square, cube), velocity, acceleration in joints:
            bend = 3.0 * cube * h
            sharpest = 2.0 * max(abs(square), abs(square + bend))
            middle = rate + square * h
            fastest = max(abs(rate), abs(middle), abs(middle + (square + bend) * h))
            if sharpest * steady > acceleration:
                steady = acceleration / sharpest
            if fastest * fastest * steady > velocity * velocity:
                steady = velocity * velocity / (fastest * fastest)
        self.steady = steady * _SLACK

    def state(self, ahead: float) -> tuple[list[float], list[float]]:
        """Return (n,) position and rate in the cell, at σ = sigma + ahead."""
        twice, thrice = 2.0 * ahead, 3.0 * ahead * ahead
        position, rate = [], []
        for p, r, s, c in self.cubics:
            position.append(p + ahead * (r + ahead * (s + ahead * c)))
            rate.append(r + twice * s + thrice * c)
        return position, rate

    def furthest(self, joint: int) -> float | None:
        """Return the position where a joint reverses inside the cell; None if it does not."""
        start, rate, square, cube = self.cubics[joint]
        after = rate + 2.0 * square * self.length + 3.0 * cube * self.length * self.length
        if rate * after >= 0.0:
            return None
        low, high = 0.0, self.length
        for _ in range(_HALVINGS):
            middle = 0.5 * (low + high)
            here = rate + 2.0 * square * middle + 3.0 * cube * middle * middle
            # Bisected: exact to a 2¹²th of the cell, and no division by a coefficient that may
            # vanish.
            low, high = (middle, high) if here * rate > 0.0 else (low, middle)
        return start + high * (rate + high * (square + high * cube))


def slowed(rows: Sequence[Inequality], after: float, top: float) -> float:
    """Return the greatest square of dσ/dt at the start of a cell.

    Every lesser one is allowed too, because x₀ = x₁ = 0 is and the inequalities are linear.

    Args:
        after: greatest square at its end.
        top: greatest square at its start, for other reasons.
    """
    return _greatest_of(rows, after, top)


def sped_up(rows: Sequence[Inequality], before: float, top: float) -> float:
    """Return the greatest square of dσ/dt at the end of a cell; every lesser one is allowed too.

    Args:
        before: greatest square at its start.
        top: greatest square at its end, for other reasons.
    """
    swapped = [(at_end, at_start, limit) for at_start, at_end, limit in rows]
    return _greatest_of(swapped, before, top)


def _greatest_of(rows: Sequence[Inequality], other: float, top: float) -> float:
    """Return the greatest value of one end that any allowed value of the other end permits."""
    found = _greatest(rows, other, top)
    if found is not None:
        return found
    # At its greatest value the other end permits none: bisect for the greatest that permits one.
    low, high, best = 0.0, other, 0.0
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        found = _greatest(rows, middle, top)
        if found is None:
            high = middle
        else:
            low, best = middle, max(best, found)
    return best


def _greatest(rows: Sequence[Inequality], after: float, top: float) -> float | None:
    least, most = 0.0, top
    for at_start, at_end, limit in rows:
        rest = at_end * after
        if at_start > 0.0:
            upper, lower = (limit - rest) / at_start, (-limit - rest) / at_start
        elif at_start < 0.0:
            upper, lower = (-limit - rest) / at_start, (limit - rest) / at_start
        elif rest > limit or rest < -limit:
            return None
        else:
            continue
        if upper < most:
            most = upper
        if lower > least:
            least = lower
    return most if least <= most else None


State: TypeAlias = tuple[Sequence[float], Sequence[float]]
"""(n,) position and (n,) velocity of a set-point."""

SPEED_RESERVE = 0.9995
"""Share of a joint's speed limit at set-points: between two it may be faster than at both."""

_STANDS = 1e-12  # by σ: a lesser rate is that of a joint at rest on the path
_TICK_SLACK = 1.0 - 1e-7


def speed_bounds(
    limits: JointLimits, rate: Sequence[float], before: Sequence[float], dt: float
) -> tuple[float, float]:
    """Return the least and the greatest dσ/dt; the least is the greater one if none is allowed.

    Args:
        rate: (n,) by σ where the tick ends.
        before: (n,) velocity where it begins [rad/s or m/s].
    """
    least, most = 0.0, math.inf
    joints = zip(rate, before, limits.acceleration, limits.velocity, strict=True)
    for each, velocity, acceleration, top in joints:
        gain, fastest = acceleration * dt, SPEED_RESERVE * top
        lower, upper = velocity - gain, velocity + gain
        if lower < -fastest:
            lower = -fastest
        if upper > fastest:
            upper = fastest
        if each > _STANDS:
            lower, upper = lower / each, upper / each
        elif each < -_STANDS:
            lower, upper = upper / each, lower / each
        elif lower > 0.0 or upper < 0.0:
            return math.inf, 0.0
        else:
            continue
        if lower > least:
            least = lower
        if upper < most:
            most = upper
    return least, most


def is_even(limits: JointLimits, before: State, after: State, dt: float) -> bool:
    """Return True if joints within their accelerations can go from one state to another."""
    most, half = 0.25 * _TICK_SLACK * dt * dt, 0.5 * dt
    joints = zip(*before, *after, limits.acceleration, strict=True)
    for start, speed, end, speed_after, limit in joints:
        way = end - start - half * (speed + speed_after)
        allowed = most * limit
        if way > allowed or way < -allowed:
            return False
    return True


SLOW_CONDITION, HALT_CONDITION = 17.0, 30.0
"""Condition numbers from which a tool jog slows and at which it halts."""

SLOW_POSTURE = 0.9
"""Use of a platform's own limits from which a jog slows; 1 is the limit."""

_RISING = 1.0 + 1e-4  # of the least condition number so far: beyond it, the number rises
_STEADY = 1.0 + 1e-5  # of a condition number from one node to the next: beyond it, the number rises


def stop(
    model: JogModel, last: PathNode, node: PathNode, least_condition: float
) -> JogCause | None:
    """Return what ends the path between two nodes; None if it may continue.

    Args:
        last: a node, with the cell to the next.
        node: the next node.
        least_condition: least condition number of the path so far.
    """
    places = zip(last.position, node.position, model.lower, model.upper, strict=True)
    for joint, (before, after, lower, upper) in enumerate(places):
        if (after > upper and after > before) or (after < lower and after < before):
            return _joint_limit(model, joint, before)
        if last.rate[joint] * node.rate[joint] < 0.0:
            # A joint that reverses inside the cell is farthest out between the nodes, not at one of
            # them.
            turn = last.furthest(joint)
            if turn is not None and (turn > max(upper, before) or turn < min(lower, before)):
                return _joint_limit(model, joint, before)
    # Compared with the least so far: an arm that starts inside a singularity's margin may leave it.
    condition = node.condition
    if condition >= HALT_CONDITION and condition > least_condition * _RISING:
        return JogCause(JogSlowdown.SINGULARITY, condition, HALT_CONDITION)
    if node.posture is not None and node.posture.use > 1.0 and _rises(last, node.posture):
        return node.posture.cause
    near = _nearing(model, last, node)
    return near[1] if near is not None and near[0] <= 0.0 else None


def scales(model: JogModel, last: PathNode | None, node: PathNode) -> list[tuple[float, JogCause]]:
    """Return for each margin that the path enters the speed dσ/dt that it leaves, and the cause.

    Args:
        last: the node before; None for the first, where only the joints' rates give a direction.
    """
    found = []
    joints = zip(node.position, node.rate, model.lower, model.upper, model.margin, strict=True)
    for joint, (place, rate, lower, upper, margin) in enumerate(joints):
        left = (upper - place if rate > 0.0 else place - lower) / margin
        if rate != 0.0 and left < 1.0:
            found.append((_even(left), _joint_limit(model, joint, place)))
    if last is None:
        return found
    if node.condition > SLOW_CONDITION and node.condition > last.condition * _STEADY:
        left = (HALT_CONDITION - node.condition) / (HALT_CONDITION - SLOW_CONDITION)
        found.append(
            (_even(left), JogCause(JogSlowdown.SINGULARITY, node.condition, HALT_CONDITION))
        )
    posture = node.posture
    if posture is not None and posture.use > SLOW_POSTURE and _rises(last, posture):
        left = (1.0 - posture.use) / (1.0 - SLOW_POSTURE)
        found.append((_even(left), posture.cause))
    near = _nearing(model, last, node)
    if near is not None:
        found.append(near)
    return found


def _nearing(model: JogModel, last: PathNode, node: PathNode) -> tuple[float, JogCause] | None:
    guard = model.guard
    if guard is None or node.distances is None:
        return None
    way = last.position, last.rate
    near = guard.nearing(last.distances, node.distances, way, last.length)
    if near is None and guard.in_contact(last.distances):
        # Bodies that are farther apart at the end may come nearer first.
        middle, _ = last.state(0.5 * last.length)
        near = guard.nearing(last.distances, guard.look(middle), way, 0.5 * last.length)
    return near


def _even(left: float) -> float:
    """Return the share of the speed from which an even deceleration ends with the margin."""
    return math.sqrt(max(left, 0.0))


def _rises(last: PathNode, posture: Posture) -> bool:
    return last.posture is None or posture.use > last.posture.use


def _joint_limit(model: JogModel, joint: int, place: float) -> JogCause:
    limits = model.limits
    upper = place > 0.5 * (limits.lower[joint] + limits.upper[joint])
    bound = limits.upper[joint] if upper else limits.lower[joint]
    return JogCause(JogSlowdown.JOINT_LIMIT, place, bound, joint)
