"""How fast tool and elbow get by a joint velocity: at the end of a tick, and in a stop after it.

Owns the rule that keeps a joint jog within a speed of points although the arm changes its shape. A
stop scales a velocity by λ, from 1 to 0, and has then gone the share 1 - λ² of its way; between the
speed S where it begins and S' where it ends, both for the whole velocity, the speed is

    λ (S + (S' - S)(1 - λ²))

The greatest of it must be within the limit, so a stop never has to be harder than the joints can: a
stretching arm gets faster by itself. Likewise without the joints whose range ends first, which may
have taken from the speed. Knows no tick and no target.
"""

from __future__ import annotations

from collections.abc import Sequence

from ..errors import NoAssembly
from .model import JogModel
from .reasons import JogCause, JogReason

_RESERVE = 0.998  # of the limit, for what a speed changes within a tick
_REASONS = (JogReason.TOOL_SPEED, JogReason.ELBOW_SPEED)
_LAMBDAS = (0.9, 0.75, 0.577, 0.4)
_GROWTH = 1.5  # of S' over S, up to which the greatest is S


def point_excess(
    model: JogModel,
    here: list[float],
    there: list[float],
    velocity: list[float],
    limit: float,
    time: float,
) -> tuple[float, JogCause | None]:
    """Return how much faster than allowed a point gets, 1 being just allowed, and which.

    Args:
        model: the robot.
        here: (n,) where the tick ends [rad or m].
        there: (n,) where a stop from there ends.
        velocity: (n,) at the end of the tick [rad/s or m/s].
        limit: greatest speed of tool centre point and elbow [m/s].
        time: `stop_time` of the velocity [s].
    """
    # One joint alone leads every point on a circle about its axis, always as fast.
    steady = model.arm.rigid and sum(1 for each in velocity if each) == 1
    begin = model.arm.point_speeds(here, velocity)
    end = begin if steady else _at_rest(model, there, velocity, begin)
    points = list(zip(_REASONS, begin, end, strict=True))
    for others in _without_ending(model, here, velocity, time):
        without = model.arm.point_speeds(here, others)
        points += zip(_REASONS, without, (0.0, 0.0), strict=True)
    worst, found = 0.0, None
    for reason, now, then in points:
        greatest = now
        if then > _GROWTH * now:
            growth = then - now
            for share in _LAMBDAS:
                greatest = max(greatest, share * (now + growth * (1.0 - share * share)))
        if greatest > worst * _RESERVE * limit:
            worst = greatest / (_RESERVE * limit)
            found = JogCause(reason, greatest, limit)
    return worst, found


def stop_time(model: JogModel, velocity: Sequence[float]) -> float:
    """Return the least time [s] in which all joints can stop together from a (n,) velocity."""
    time = 0.0
    for each, acceleration in zip(velocity, model.limits.acceleration, strict=True):
        needed = (each if each > 0.0 else -each) / acceleration
        if needed > time:
            time = needed
    return time


def _without_ending(
    model: JogModel, place: list[float], velocity: list[float], time: float
) -> list[list[float]]:
    """Return the velocity without the joints whose range ends before a stop would.

    They brake by themselves, and what they took from the speed of a point is then missing. The
    speed is convex in theirs, so it is greatest with or without them.
    """
    ending = []
    joints = zip(velocity, place, model.lower, model.upper, model.margin, strict=True)
    for joint, (each, here, lower, upper, margin) in enumerate(joints):
        if each > 0.0:
            ends = upper - here < each * time + margin
        else:
            ends = each < 0.0 and here - lower < margin - each * time
        if ends:
            ending.append(joint)
    if not ending or sum(1 for each in velocity if each) == 1:
        return []
    groups = [ending] if len(ending) == 1 else [ending, *([joint] for joint in ending)]
    return [
        [0.0 if joint in group else each for joint, each in enumerate(velocity)] for group in groups
    ]


def _at_rest(
    model: JogModel,
    place: Sequence[float],
    velocity: Sequence[float],
    otherwise: tuple[float, float],
) -> tuple[float, float]:
    """Return S' of both points; what it is otherwise, where a platform cannot stand there."""
    try:
        return model.arm.point_speeds(place, velocity)
    except NoAssembly:
        return otherwise
