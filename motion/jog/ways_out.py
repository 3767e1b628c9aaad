"""At what a robot stands that holds a jog, and which key leads out of each.

Owns when a robot counts as standing at something: where little is left of the margin in which a jog
slows down (`nearness`, `collision_guard`). Which way leads out is `retreat`'s choice; of a way that
moves several joints it keeps the one that leads out fastest, because a key moves one. Asked once,
at rest: it costs up to a millisecond. Knows no names of keys.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

from .collision_guard import CLEAR, SLOW
from .model import JogModel
from .nearness import HALT_CONDITION, SLOW_CONDITION
from .reasons import JogCause, JogReason
from .retreat import retreat
from .targets import ToolJog
from .tool_path import JogTwist, ToolPath

_LEFT = 0.2
"""Share of a margin that is left where a robot counts as standing at its end."""

_PROBE, _PROBE_TURN = 0.002, 0.005
"""How far a tool is thought to go on, and to turn, to see where that leads [m, rad]."""


class WayOut(NamedTuple):
    """What the robot stands at, and a joint jog that leads out.

    Attributes:
        cause: what it is, with its numbers.
        joint: the joint whose key leads out fastest; None where no joint's does.
        sign: 1.0 towards its upper limit, -1.0 towards its lower; 0.0 where no joint's does.
        singularity: name of the singularity; empty otherwise.
    """

    cause: JogCause
    joint: int | None
    sign: float
    singularity: str


def ways_out(model: JogModel, position: Sequence[float]) -> list[WayOut]:
    """Return all that a robot stands at, joints first; empty where it stands free.

    Args:
        model: the robot.
        position: (n,) where it stands.
    """
    found = []
    for cause in _causes(model, position):
        way = retreat(model, position, cause, reverse=False)
        rates = None if way is None else way.joints
        joint = None if rates is None else max(range(len(rates)), key=lambda at: abs(rates[at]))
        sign = 0.0 if rates is None or joint is None else math.copysign(1.0, rates[joint])
        found.append(WayOut(cause, joint, sign, "" if way is None else way.singularity))
    return found


def _causes(model: JogModel, position: Sequence[float]) -> Iterator[JogCause]:
    limits = model.limits
    places = zip(position, limits.lower, limits.upper, model.margin, strict=True)
    for joint, (place, lower, upper, margin) in enumerate(places):
        bound = upper if upper - place < place - lower else lower
        if min(upper - place, place - lower) < _LEFT * margin:
            yield JogCause(JogReason.JOINT_LIMIT, place, bound, joint)
    condition = model.arm.condition(position)
    if condition > HALT_CONDITION - _LEFT * (HALT_CONDITION - SLOW_CONDITION):
        yield JogCause(JogReason.SINGULARITY, condition, HALT_CONDITION)
    nearest = None if model.guard is None else model.guard.nearest(position)
    if nearest is not None and nearest.value < CLEAR + _LEFT * (SLOW - CLEAR):
        yield nearest


def leads_out(model: JogModel, position: Sequence[float], target: ToolJog) -> bool:
    """Return whether a tool jog leads out of all that a robot stands at.

    By one short step: it must lead away from each, and to nothing else.

    Args:
        model: the robot.
        position: (n,) where it stands.
        target: the jog.
    """
    linear, angular = target.direction()
    twist = JogTwist(linear * _PROBE, angular * _PROBE_TURN, target.axes is None)
    path = ToolPath(*model.arm.place(position), twist).advanced(1.0)
    there = model.arm.follow(position, path.rotation, path.point, path.twist())
    if there is None:
        return False
    ends = list(_causes(model, there.position))
    starts = {_what(cause): cause for cause in _causes(model, position)}
    return all(_what(end) in starts and _is_farther(end, starts[_what(end)]) for end in ends)


def _what(cause: JogCause) -> tuple[JogReason, int]:
    return cause.reason, cause.joint


def _is_farther(end: JogCause, start: JogCause) -> bool:
    """Return whether a cause holds less at the end of a step than it did at its start."""
    match end.reason:
        case JogReason.SINGULARITY:
            return end.value < start.value
        case JogReason.COLLISION:
            return end.value > start.value
    return abs(end.value - end.limit) > abs(start.value - start.limit)
