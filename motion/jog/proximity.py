"""Proximity to limits along a tool jog's path: what slows the path at a place, and what ends it.

Owns the thresholds. A margin slows by the root of what is left of it, which is an even
deceleration: a joint before the end of its range, the condition number from 17 to 30 (the figures
of moveit_servo), bodies from 20 mm to 5 mm apart, a platform before its borders. Each slows only
while the limit comes nearer, so that leaving it is free.
"""

from __future__ import annotations

import math

from .jog_commands import JogCause, JogSlowdown
from .jog_model import JogModel
from .jog_robot import Posture
from .path_node import PathNode

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
        model: the robot.
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
        model: the robot.
        last: the node before; None for the first, where only the joints' rates give a direction.
        node: the node.
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
