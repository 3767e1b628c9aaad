"""What a place of a tool jog's way is near to: what slows the way there, and what ends it.

Owns the thresholds. Nearness of a limit slows by the root of what is left of its margin, which is
an even deceleration: a joint before the end of its range, the condition number from 17 to 30 (the
figures of moveit_servo), bodies from 20 mm to 5 mm apart, a platform before its borders; each only
while it grows nearer, so leaving is free.
"""

from __future__ import annotations

import math

from .arm import Posture
from .model import JogModel
from .reasons import JogCause, JogReason
from .way_node import WayNode

SLOW_CONDITION, HALT_CONDITION = 17.0, 30.0
"""Condition numbers from which a tool jog slows and at which it halts."""

SLOW_POSTURE = 0.9
"""Use of a platform's own limits from which a jog slows; 1 is the limit."""

_RISING = 1.0 + 1e-4  # of a condition number, over the least so far
_STEADY = 1.0 + 1e-5  # of a condition number, from one place to the next


def stop(model: JogModel, last: WayNode, node: WayNode, least_condition: float) -> JogCause | None:
    """Return why a way must not go on from one place to the next; None if it may.

    Args:
        model: the robot.
        last: a place, with the cell to the next.
        node: the next place.
        least_condition: least condition number of the way so far.
    """
    places = zip(last.position, node.position, model.lower, model.upper, strict=True)
    for joint, (before, after, lower, upper) in enumerate(places):
        if (after > upper and after > before) or (after < lower and after < before):
            return _joint_limit(model, joint, before)
        if last.rate[joint] * node.rate[joint] < 0.0:
            turn = last.furthest(joint)
            if turn is not None and (turn > max(upper, before) or turn < min(lower, before)):
                return _joint_limit(model, joint, before)
    condition = node.condition
    if condition >= HALT_CONDITION and condition > least_condition * _RISING:
        return JogCause(JogReason.SINGULARITY, condition, HALT_CONDITION)
    if node.posture is not None and node.posture.use > 1.0 and _rises(last, node.posture):
        return node.posture.cause
    near = _nearing(model, last, node)
    return near[1] if near is not None and near[0] <= 0.0 else None


def scales(model: JogModel, last: WayNode | None, node: WayNode) -> list[tuple[float, JogCause]]:
    """Return the speeds dσ/dt that each margin leaves which a way goes into, and what it is of.

    Args:
        model: the robot.
        last: the place before; None for the first, of which only the joints tell where it goes.
        node: the place.
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
        found.append((_even(left), JogCause(JogReason.SINGULARITY, node.condition, HALT_CONDITION)))
    posture = node.posture
    if posture is not None and posture.use > SLOW_POSTURE and _rises(last, posture):
        left = (1.0 - posture.use) / (1.0 - SLOW_POSTURE)
        found.append((_even(left), posture.cause))
    near = _nearing(model, last, node)
    if near is not None:
        found.append(near)
    return found


def _nearing(model: JogModel, last: WayNode, node: WayNode) -> tuple[float, JogCause] | None:
    guard = model.guard
    if guard is None or node.distances is None:
        return None
    way = last.position, last.rate
    near = guard.nearing(last.distances, node.distances, way, last.length)
    if near is None and guard.in_contact(last.distances):
        # What parts in the end might first come nearer.
        middle, _ = last.state(0.5 * last.length)
        near = guard.nearing(last.distances, guard.look(middle), way, 0.5 * last.length)
    return near


def _even(left: float) -> float:
    """Return the share of the speed at which an even deceleration has that much way left."""
    return math.sqrt(max(left, 0.0))


def _rises(last: WayNode, posture: Posture) -> bool:
    return last.posture is None or posture.use > last.posture.use


def _joint_limit(model: JogModel, joint: int, place: float) -> JogCause:
    limits = model.limits
    upper = place > 0.5 * (limits.lower[joint] + limits.upper[joint])
    bound = limits.upper[joint] if upper else limits.lower[joint]
    return JogCause(JogReason.JOINT_LIMIT, place, bound, joint)
