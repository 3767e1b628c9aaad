"""At what a robot stands that holds a jog, and which keys lead out of each.

Owns when a robot counts as standing at something: where little is left of the margin in which a jog
slows down (`nearness`, `collision_guard`), and whether a tool jog leads away from that. Which way
leads out is `retreat`'s choice; of a way that moves several joints it keeps the one that leads out
fastest, because a key moves one. Asked once, at rest: it costs up to a millisecond. Knows no names
of keys.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

from .arm import Footing
from .collision_guard import CLEAR, SLOW
from .model import JogModel
from .nearness import HALT_CONDITION
from .reasons import JogCause, JogReason, Retreat
from .retreat import retreat
from .singular_keys import FREE_CONDITION, is_way_out, keys_out
from .targets import ToolJog
from .tool_path import JogTwist, ToolPath

_LEFT = 0.2
"""Share of a margin that is left where a robot counts as standing at its end."""

_PROBE, _PROBE_TURN = 0.002, 0.005
"""How far a tool is thought to go on, and to turn, to see where that leads [m, rad]."""

_NOTABLE = 0.99  # share of a condition number: less has fallen
_MORE_STEPS = 4  # each twice as long as the one before
_SINGULARITY = (JogReason.SINGULARITY, -1)


class WayOut(NamedTuple):
    """What the robot stands at, and a joint jog that leads out.

    Attributes:
        cause: what it is, with its numbers.
        rates: (n,) of the joint whose key leads out fastest, 1 towards its upper limit or -1; out
            of two singularities at once of the two or three whose keys do together; None where
            none is known.
        singularity: name of the singularity; empty otherwise.
    """

    cause: JogCause
    rates: tuple[float, ...] | None
    singularity: str


def ways_out(model: JogModel, position: Sequence[float]) -> list[WayOut]:
    """Return all that a robot stands at, joints first; empty where it stands free.

    Args:
        model: the robot.
        position: (n,) where it stands.
    """
    return [_way_out(model, position, cause) for cause in _causes(model, position)]


def _way_out(model: JogModel, position: Sequence[float], cause: JogCause) -> WayOut:
    if cause.reason is JogReason.SINGULARITY and not model.watches_posture:
        # Not of a platform, which a leg by itself takes out of its workspace.
        way = model.arm.way_out(position)
        key = _fastest(way)
        if key is None or not is_way_out(model, position, key):
            key = keys_out(model, position)
        return WayOut(cause, key, way.singularity)
    found = retreat(model, position, cause, reverse=False)
    return WayOut(cause, _fastest(found), "" if found is None else found.singularity)


def _fastest(way: Retreat | None) -> tuple[float, ...] | None:
    """Return the joint that moves most on a way, alone and at full speed."""
    rates = None if way is None else way.joints
    if rates is None:
        return None
    most = max(map(abs, rates))
    fastest = [abs(rate) for rate in rates].index(most)
    return tuple(rate / most if joint == fastest else 0.0 for joint, rate in enumerate(rates))


def _causes(model: JogModel, position: Sequence[float]) -> Iterator[JogCause]:
    limits = model.limits
    places = zip(position, limits.lower, limits.upper, model.margin, strict=True)
    for joint, (place, lower, upper, margin) in enumerate(places):
        bound = upper if upper - place < place - lower else lower
        if min(upper - place, place - lower) < _LEFT * margin:
            yield JogCause(JogReason.JOINT_LIMIT, place, bound, joint)
    condition = model.arm.condition(position)
    if condition > FREE_CONDITION:
        yield JogCause(JogReason.SINGULARITY, condition, HALT_CONDITION)
    nearest = None if model.guard is None else model.guard.nearest(position)
    if nearest is not None and nearest.value < CLEAR + _LEFT * (SLOW - CLEAR):
        yield nearest


def leads_out(model: JogModel, position: Sequence[float], target: ToolJog) -> bool:
    """Return whether a tool jog leads out of all that a robot stands at.

    Args:
        model: the robot.
        position: (n,) where it stands.
        target: the jog.
    """
    linear, angular = target.direction()
    twist = JogTwist(linear * _PROBE, angular * _PROBE_TURN, target.axes is None)
    return target.magnitude > 0.0 and leads_along(model, position, twist)


def leads_along(model: JogModel, position: Sequence[float], twist: JogTwist) -> bool:
    """Return whether a direction of the tool leads out of all that a robot stands at.

    By one short step: it must lead away from each, and to nothing else. Where a condition number
    hardly falls, more steps are taken, because it may soon rise again.

    Args:
        model: the robot.
        position: (n,) where it stands.
        twist: the direction, at whatever speed but none.
    """
    sizes = (math.hypot(*twist.linear.tolist()), math.hypot(*twist.angular.tolist()))
    step = 1.0 / max(sizes[0] / _PROBE, sizes[1] / _PROBE_TURN)
    path = ToolPath(*model.arm.place(position), twist).advanced(step)
    there = model.arm.follow(position, path.rotation, path.point, path.twist())
    if there is None:
        return False
    ends = list(_causes(model, there.position))
    starts = {_what(cause): cause for cause in _causes(model, position)}
    if not all(_what(end) in starts and _is_farther(end, starts[_what(end)]) for end in ends):
        return False
    singular = starts.get(_SINGULARITY)
    return singular is None or _falls(model, there, path, step, singular.value)


def _falls(model: JogModel, there: Footing, path: ToolPath, step: float, start: float) -> bool:
    """Return whether the condition number goes on falling until that can be noticed."""
    for _ in range(_MORE_STEPS):
        if there.condition < max(FREE_CONDITION, _NOTABLE * start):
            return True
        step *= 2.0
        path = path.advanced(step)
        further = model.arm.follow(there.position, path.rotation, path.point, path.twist())
        if further is None or further.condition > there.condition:
            return False
        there = further
    return there.condition < _NOTABLE * start


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
