"""Section L: points that must not be moved: no numbers, out of range, too fast, without order.

The only checks that name a target outside the amplitude, or none at all; each is asked so slowly
that a robot which obeys is stopped before it gets anywhere. On a robot that goes by its own speed,
whatever the duration says, they are not run.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from functools import partial

from openpendant.motion.description.limits import JointLimits
from openpendant.simplemsg import ValidField, joint_array

from ..check import PASSED, CannotJudge, CheckFinding, CheckVerdict, RuleBroken, deviates, passed
from .answers import STOP, full_point, is_taken
from .checks import FULL, check, check_on
from .monitor import distance, rate
from .moving import LEAD_IN, SPEED, VERY_SLOW, Mover, ready
from .recordings import must_be_slow
from .target import Target
from .wire import ReceivedFrame

_UNCHECKED = "no vendor's server checks for numbers that are none"
_BEYOND = 0.1
_GENTLE = 0.2
"""Part of the amplitude by which a robot may jump, if it does [1]."""

_NAN, _INF = math.nan, math.inf


async def _limits(target: Target) -> JointLimits:
    if target.options.limits is None:
        raise CannotJudge("the robot's limits are not known without --robot")
    return target.options.limits


async def _refused_or_still(
    mover: Mover, reply: ReceivedFrame | None, what: str, habit: str
) -> CheckFinding:
    """Judge the answer to a point that must not be moved; watch, and stop the robot if it is."""
    taken = reply is not None and is_taken(reply)
    try:
        await mover.stays(0.5, what, mover.start)
    except RuleBroken:
        mover.wire.send(STOP)
        raise
    if taken:
        mover.wire.send(STOP)  # it may be on its way, too slowly to be seen
    if taken and mover.watch.says_motion():
        raise RuleBroken(f"{what} was taken, and STATUS says that the robot moves")
    if not all(map(math.isfinite, mover.watch.position)):
        raise RuleBroken(f"after {what} the robot reports positions that are no numbers")
    if taken and not habit:
        raise RuleBroken(f"{what} was taken: {reply}")
    if taken:
        return deviates(habit, f"{what} was taken, though not moved")
    if reply is None and not mover.wire.is_lost:
        raise RuleBroken(f"{what} was not answered; the real client waits for ever")
    return PASSED


async def _point(
    mover: Mover, joints: Sequence[float], what: str, habit: str = "", **how: float
) -> CheckFinding:
    """Send a first point that must not be moved."""
    duration, velocity = how.get("duration", VERY_SLOW), how.get("velocity", SPEED)
    try:
        reply: ReceivedFrame | None = await mover.point(
            0, joints, duration, velocity=velocity, within=1.0
        )
    except RuleBroken:
        reply = None
    return await _refused_or_still(mover, reply, what, habit)


def _with(mover: Mover, value: float) -> tuple[float, ...]:
    return tuple(value if slot == mover.joint else at for slot, at in enumerate(mover.start))


@check("LS01", moves=True, is_plain=True)
async def _nan(target: Target) -> CheckFinding:
    await must_be_slow(target)
    mover = await ready(target)
    return await _point(mover, _with(mover, _NAN), "a position that is no number", _UNCHECKED)


@check("LS02", moves=True, profiles=FULL, is_plain=True)
async def _infinite(target: Target) -> CheckFinding:
    await must_be_slow(target)
    mover = await ready(target)
    return await _point(mover, _with(mover, _INF), "an infinite position", _UNCHECKED)


async def _point_here(mover: Mover, what: str, habit: str, how: dict[str, float]) -> CheckFinding:
    return await _point(mover, mover.start, what, habit, **how)


for _number, _what, _habit, _how in (
    ("LS03", "a velocity that is no number", _UNCHECKED, {"velocity": _NAN}),
    ("LS04", "a duration that is no number", _UNCHECKED, {"duration": _NAN}),
    ("LS05", "a duration of -1 s", "Fanuc, Stäubli: the duration is not used", {"duration": -1.0}),
    (
        "LS06",
        "a velocity of 1.5",
        "Stäubli: the velocity is clipped; Fanuc: it is not used",
        {"velocity": 1.5},
    ),
):
    check_on(ready, _number, moves=True, profiles=FULL, is_plain=True)(
        partial(_point_here, what=_what, habit=_habit, how=_how)
    )


async def _out_of_range(target: Target, *, upper: bool) -> CheckFinding:
    limits = await _limits(target)
    await must_be_slow(target)
    mover = await ready(target)
    joint = mover.joint
    bound = limits.upper[joint] + _BEYOND if upper else limits.lower[joint] - _BEYOND
    what = f"a position of {bound:.4g}, {_BEYOND:g} beyond the range of joint {joint + 1},"
    # Only one who does not know PING is taken for ABB; elsewhere it is a fault like any other.
    habit = "" if target.knows_ping else "ABB: the range is not checked"
    try:
        return await _point(mover, _with(mover, bound), what, habit)
    except RuleBroken as error:
        if not habit:
            raise
        return deviates(habit, str(error))


check("LS07", moves=True, is_plain=True)(partial(_out_of_range, upper=True))
check("LS08", moves=True, is_plain=True)(partial(_out_of_range, upper=False))


@check("LS09", moves=True, profiles=FULL, is_plain=True)
async def _too_fast(target: Target) -> CheckFinding:
    limits = await _limits(target)
    mover = await ready(target)
    joint, most = mover.joint, limits.velocity[mover.joint]
    await mover.accepted(0, mover.start, LEAD_IN)
    reply = await mover.point(1, mover.goal, mover.amplitude / (3 * most))
    if not is_taken(reply):
        await mover.stays(0.5, "a refused point", mover.start)
        return passed("refused")
    await mover.watch.until(lambda: mover.has_left, 3.0)
    await mover.rests_within(5.0)
    reports = [(at.time, at.values[joint]) for at in mover.watch.joints]
    if rate([time for time, _ in reports]) < 40:
        raise CannotJudge("it was taken; the state port is too slow to see how fast it was")
    fastest = max(
        abs(b - a) / max(t2 - t1, 0.008) for (t1, a), (t2, b) in itertools.pairwise(reports)
    )
    if fastest > 1.2 * most:
        raise RuleBroken(f"it was moved at {fastest:.3g} of at most {most:.3g} rad/s")
    return passed(f"taken, and moved at {fastest:.3g} of {most:.3g} rad/s")


@check("LS10", moves=True, profiles=FULL, is_plain=True)
async def _rest_refused(target: Target) -> CheckFinding:
    await must_be_slow(target)
    mover = await ready(target)
    await mover.accepted(0, mover.start, LEAD_IN)
    refused = await mover.point(1, _with(mover, _NAN), VERY_SLOW)
    if is_taken(refused):
        mover.wire.send(STOP)
        raise RuleBroken("a position that is no number was taken at sequence 1")
    reply = await mover.point(2, mover.goal, 1.0)
    return await _refused_or_still(mover, reply, "a point behind a refused one", "")


async def _full(target: Target, what: str, habit: str, **changed: object) -> CheckFinding:
    """Send a full point that must be refused."""
    mover = await ready(target)
    point = full_point(0, mover.start)
    for name, value in changed.items():
        setattr(point, name, value)
    reply = await mover.wire.ask(point, what)
    return await _refused_or_still(mover, reply, what, habit)


@check("LS12", moves=True, profiles=FULL)
async def _full_nan(target: Target) -> CheckFinding:
    await must_be_slow(target)
    bad = (_NAN, *joint_array(())[1:])
    findings = []
    for name in ("time", "positions", "velocities", "accelerations"):
        what = f"a full point whose {name} is no number"
        values: dict[str, object] = {name: _NAN if name == "time" else bad}
        findings.append(
            await _full(target, what, _UNCHECKED, valid_fields=int(ValidField.ALL), **values)
        )
        await target.close()
    worst = [finding for finding in findings if finding.verdict is not CheckVerdict.PASSED]
    if worst and len(worst) < len(findings):
        raise RuleBroken(f"some fields are checked, not all: {worst[0].detail}")
    return worst[0] if worst else PASSED


check("LS11", moves=True, profiles=FULL)(
    partial(
        _full, what="a full point without a position", habit="", valid_fields=int(ValidField.TIME)
    )
)
check("LS13", moves=True, profiles=FULL)(
    partial(_full, what="a full point for robot 7", habit="", robot_id=7)
)


@check_on(ready, "LS14", moves=True, profiles=FULL)
async def _time_stands(mover: Mover) -> CheckFinding:
    if not is_taken(await mover.wire.ask(full_point(0, mover.start), "a full point")):
        raise CannotJudge("the target refuses full points, as it may")
    reply = await mover.wire.ask(full_point(1, mover.goal), "a second full point at time 0")
    habit = "Motoman: a time that does not advance is taken and not moved"
    return await _refused_or_still(mover, reply, "a second full point at time 0", habit)


@check_on(ready, "LS15", moves=True, profiles=FULL, is_plain=True)
async def _no_jump(mover: Mover) -> CheckFinding:
    near = mover.between(_GENTLE)
    way = _GENTLE * mover.amplitude
    reply = await mover.point(0, near, 0.0)
    before = [at.values for at in mover.watch.joints][-1]
    await mover.watch.until(lambda: mover.has_left, 1.5)
    await mover.rests_within(6.0)
    reports = [at.values for at in mover.watch.joints]
    steps = [distance(a, b) for a, b in itertools.pairwise(reports)]
    if rate([at.time for at in mover.watch.joints]) < 40:
        raise CannotJudge("the state port is too slow to tell a jump from a motion")
    if max(steps, default=0.0) > 0.5 * way:
        raise RuleBroken("the robot was at the point from one report to the next")
    moved = distance(mover.watch.position, before) > 0.1 * way
    if not is_taken(reply) and moved:
        raise RuleBroken("the point was refused and moved to all the same")
    return passed("moved to" if moved else "not moved to")


async def _all_refused(target: Target, value_of: Callable[[int], float], what: str) -> CheckFinding:
    """Try a value for every joint, as a first point and as a second one; all must be refused.

    Raises:
        RuleBroken: one was taken.
        CannotJudge: the first was, which is another check's business.
    """
    await must_be_slow(target)
    mover = await ready(target)
    joints = [mover.joint, *(joint for joint in range(target.dof) if joint != mover.joint)]
    for joint in joints:
        for sequence in (0, 1):
            wrong = tuple(
                value_of(joint) if slot == joint else at for slot, at in enumerate(mover.start)
            )
            if sequence:
                await mover.accepted(0, mover.start, LEAD_IN)
            reply = await mover.point(sequence, wrong, VERY_SLOW)
            if is_taken(reply):
                mover.wire.send(STOP)
                if (joint, sequence) == (mover.joint, 0):
                    raise CannotJudge(f"{what} was taken at once; LS01, LS07 and LS08 say so")
                raise RuleBroken(f"{what} was taken for joint {joint + 1} at sequence {sequence}")
            if not await mover.watch.standstill(2.0):
                raise RuleBroken(f"{what} for joint {joint + 1} was refused, and the robot moves")
    await mover.stays(0.2, what, mover.start)
    return passed(f"{len(joints)} joints, first and second points")


@check("LS16", moves=True, is_plain=True)
async def _nan_anywhere(target: Target) -> CheckFinding:
    return await _all_refused(target, lambda _: _NAN, "a position that is no number")


@check("LS17", moves=True, is_plain=True)
async def _range_anywhere(target: Target) -> CheckFinding:
    limits = await _limits(target)
    what = "a position a turn above the range"
    # A controller's own range may be wider than the robot's file says, but not by a turn.
    return await _all_refused(target, lambda joint: limits.upper[joint] + _BEYOND + math.tau, what)
