"""Escape directions: joint directions that lead away from what holds a jog, and the keys for them.

Owns the choice of the direction for each cause; the rule that a robot stands at a limit where
little is left of the margin in which a jog slows (`path_node`, `collision_guard`); and the check
that a tool jog leads away from that limit. It is asked once, when a robot has come to rest: a
direction costs some hundred microseconds, the keys up to 1 ms. Knows no names of keys or
directions; screens have the joints'. Positions are where the robot stands; rates are shares of full
speed, -1 to 1.

A key moves one joint. So of a direction that moves several joints, the one that leads out fastest
is kept. Keys out of a singularity are found by trying them: the fastest direction moves several
joints a little each, and where an arm stands at two singularities at once, the key that leaves one
of them stays at the other. So a key is named if a stretch of its joint ends where the arm is free;
otherwise two or three keys are, which have to be held together.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

from .collision_guard import CLEAR, SLOW
from .jog_commands import JogCause, JogEscape, JogSlowdown, ToolJog
from .jog_model import JogModel
from .jog_robot import Footing
from .path_node import HALT_CONDITION, SLOW_CONDITION
from .tool_path import JogTwist, ToolPath

FREE_CONDITION = HALT_CONDITION - 0.2 * (HALT_CONDITION - SLOW_CONDITION)
"""Condition number below which an arm counts as free: a fifth of the margin is left."""

_STRETCH = 0.6  # rad, or half the arm's size: how far a joint is moved on trial
_MOST_KEYS = 3
_LOST = 1e-3  # of the greatest gain: a direction with less counts as lost


def is_escape(model: JogModel, position: Sequence[float], rates: Sequence[float]) -> bool:
    """Return True if a stretch of a joint jog ends where the arm is free."""
    return model.arm.condition(_stretched(model, position, rates)) < FREE_CONDITION


def escape_keys(model: JogModel, position: Sequence[float]) -> tuple[float, ...] | None:
    """Return the joint jog of the fewest keys, 0, 1 or -1, that leads out; None if no three do.

    Each key is the one that, together with those before it, gives back most of the lost directions.
    """
    rates = (0.0,) * model.dof
    for _ in range(_MOST_KEYS):
        trials = [
            (model.arm.gains(_stretched(model, position, each)), each)
            for each in _with_another(rates)
        ]
        gains, rates = max(trials, key=lambda trial: _freedom(trial[0]))
        if gains[0] < FREE_CONDITION * gains[-1]:
            return rates
    return None


def _with_another(rates: tuple[float, ...]) -> Iterator[tuple[float, ...]]:
    """Yield a joint jog with one more key: each joint that does not move yet, either way."""
    for joint, rate in enumerate(rates):
        if rate == 0.0:
            for sign in (1.0, -1.0):
                yield (*rates[:joint], sign, *rates[joint + 1 :])


def _stretched(model: JogModel, position: Sequence[float], rates: Sequence[float]) -> list[float]:
    """Return the end of a stretch of a joint jog; a joint that reaches its limit rests there."""
    end = list(position)
    for joint, rate in enumerate(rates):
        if rate:
            limit = model.upper[joint] if rate > 0.0 else model.lower[joint]
            room = abs(limit - position[joint]) if (limit - position[joint]) * rate > 0.0 else 0.0
            end[joint] += rate * min(_STRETCH * model.unit[joint], room)
    return end


def _freedom(gains: Sequence[float]) -> float:
    """Return the logarithm of the volume that the gains span, lost directions counted alike."""
    return sum(math.log(max(gain / gains[0], _LOST)) for gain in gains)


def retreat(
    model: JogModel, position: Sequence[float], cause: JogCause, *, reverse: bool
) -> JogEscape | None:
    """Return the direction out of a cause at a joint position; None if none is needed.

    Args:
        cause: what holds it.
        reverse: True if the opposite of what was asked leads out.
    """
    match cause.reason:
        case JogSlowdown.JOINT_LIMIT:
            inward = 1.0 if position[cause.joint] < _middle(model, cause.joint) else -1.0
            joints = [inward if joint == cause.joint else 0.0 for joint in range(model.dof)]
            return JogEscape(tuple(joints), reverse)
        case JogSlowdown.COLLISION if model.guard is not None:
            apart = model.guard.separating_direction(position)
            return JogEscape(None if apart is None else tuple(apart), reverse)
        case JogSlowdown.SINGULARITY:
            found = model.arm.way_out(position)._replace(reverse=reverse)
            # Where an arm stands at two singularities, no small step leaves either, so stretches
            # are tried.
            return found._replace(joints=found.joints or escape_keys(model, position))
        case JogSlowdown.REACH | JogSlowdown.WORKSPACE:
            return model.arm.way_out(position)._replace(reverse=reverse)
    return None


def _middle(model: JogModel, joint: int) -> float:
    return 0.5 * (model.limits.lower[joint] + model.limits.upper[joint])


_LEFT = 0.2
"""Share of a margin below which a robot counts as standing at the end of the margin."""

_PROBE, _PROBE_TURN = 0.002, 0.005
"""Length of the trial step of a tool, and its rotation [m, rad]."""

_NOTABLE = 0.99  # of a condition number: below this share it has fallen
_MORE_STEPS = 4  # trial steps, each twice as long as the one before
_SINGULARITY = (JogSlowdown.SINGULARITY, -1)


class EscapeDirection(NamedTuple):
    """A limit that the robot stands at, and a joint jog that leads away from it.

    Attributes:
        rates: (n,) of the joint whose key leads out fastest, 1 towards its upper limit or -1; for
            two singularities at once, of the two or three keys that do together; None if none is
            known.
        singularity: name of the singularity; empty otherwise.
    """

    cause: JogCause
    rates: tuple[float, ...] | None
    singularity: str


def find_escapes(model: JogModel, position: Sequence[float]) -> list[EscapeDirection]:
    """Return every limit that a robot stands at, joints first; empty where it is free."""
    return [_way_out(model, position, cause) for cause in _causes(model, position)]


def _way_out(model: JogModel, position: Sequence[float], cause: JogCause) -> EscapeDirection:
    if cause.reason is JogSlowdown.SINGULARITY and not model.watches_posture:
        # Not for a platform: one leg alone takes it out of its workspace.
        way = model.arm.way_out(position)
        key = _fastest(way)
        if key is None or not is_escape(model, position, key):
            key = escape_keys(model, position)
        return EscapeDirection(cause, key, way.singularity)
    found = retreat(model, position, cause, reverse=False)
    return EscapeDirection(cause, _fastest(found), "" if found is None else found.singularity)


def _fastest(way: JogEscape | None) -> tuple[float, ...] | None:
    """Return the joint that moves most in a direction, alone and at full speed."""
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
            yield JogCause(JogSlowdown.JOINT_LIMIT, place, bound, joint)
    condition = model.arm.condition(position)
    if condition > FREE_CONDITION:
        yield JogCause(JogSlowdown.SINGULARITY, condition, HALT_CONDITION)
    nearest = None if model.guard is None else model.guard.nearest(position)
    if nearest is not None and nearest.value < CLEAR + _LEFT * (SLOW - CLEAR):
        yield nearest


def leads_out(model: JogModel, position: Sequence[float], target: ToolJog) -> bool:
    """Return True if a tool jog leads away from every limit that a robot stands at."""
    linear, angular = target.direction()
    twist = JogTwist(linear * _PROBE, angular * _PROBE_TURN, target.axes is None)
    return target.magnitude > 0.0 and leads_along(model, position, twist)


def leads_along(model: JogModel, position: Sequence[float], twist: JogTwist) -> bool:
    """Return True if a direction of the tool leads away from every limit that a robot stands at.

    Judged by one short trial step: it must lead away from each limit and towards no other. Where
    the condition number hardly falls, more steps follow, because it may soon rise again.

    Args:
        twist: the direction, at any speed but 0.
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
    """Return True if the condition number keeps falling until it has fallen noticeably."""
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


def _what(cause: JogCause) -> tuple[JogSlowdown, int]:
    return cause.reason, cause.joint


def _is_farther(end: JogCause, start: JogCause) -> bool:
    """Return True if a limit is farther away at the end of a step than at its start."""
    match end.reason:
        case JogSlowdown.SINGULARITY:
            return end.value < start.value
        case JogSlowdown.COLLISION:
            return end.value > start.value
    return abs(end.value - end.limit) > abs(start.value - start.limit)
