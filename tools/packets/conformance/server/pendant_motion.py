"""Section P, second part: who may move the robot by the pendant port, and how motions end."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Callable

from openpendant.simplemsg import CommType, Message
from openpendant.simplemsg.pendant import (
    Authority,
    AuthorityAction,
    AuthorityBeat,
    AuthorityChanged,
    AuthorityReason,
    JointMove,
    JointPath,
    JointWaypoint,
    Motion,
    OutcomeKind,
    PoseMove,
    PosePath,
    PoseWaypoint,
    ResetStop,
    SoftwareStop,
    State,
    StopChanged,
)
from openpendant.simplemsg.verdicts import VerdictCode

from ..findings import PASSED, Finding, Section
from ..findings import Verdict as Judged
from .checks import check
from .pendant import OURS
from .pendant_moves import (
    ARRIVED,
    SLOW,
    SPEED,
    STOPPED_WITHIN,
    aside,
    dof,
    finished,
    holder,
    joint_move,
    judge_pace,
    judge_states,
    moved,
    position,
    refused_or_stopped,
    release,
    reset_and_return,
    shown,
    speed_for,
    standing,
    under_way,
)
from .pendant_talk import Talker, welcomed
from .target import Target
from .watch import distance
from .wire import CannotJudge, RuleBroken, Wire

_AUTHORITY = "docs/architecture.md: one motion authority, a lease that expires without beats"
_STOP = "docs/architecture.md: anyone may stop; only the authority may reset"
_OUTCOME = "docs/architecture.md: accepted, then completed or aborted, once"
_NOTHING_CLIPPED = "docs/architecture.md: nothing is clipped silently, nothing succeeds silently"
_LINK_LOSS = "docs/architecture.md: on FIN or RST the stop leaves within a tick"
_EXPIRES_WITHIN = 0.5
_LONGEST_LEASE = 10.0
_BEYOND = 0.1

_ENDS: tuple[tuple[str, Callable[[Wire], None]], ...] = (
    ("a reset", Wire.reset),
    ("an end of stream", Wire.half_close),
)


def _moving_requests(talker: Talker, state: State) -> list[Message]:
    """Return a request of each kind that moves the robot, to where it stands."""
    here = position(state, talker)
    place, turn = state.tool_position, state.tool_orientation
    waypoints = (JointWaypoint(state.positions),)
    poses = (PoseWaypoint(place, turn),)
    return [
        joint_move(talker, here),
        JointPath(talker.next_id(), SPEED, dof(talker), waypoints),
        PoseMove(talker.next_id(), Motion.PTP, SPEED, "base", place, turn),
        PosePath(talker.next_id(), Motion.PTP, SPEED, "base", poses),
    ]


@check("PS30", "motion without authority is refused", _AUTHORITY, Section.PENDANT, profiles=OURS)
async def _no_authority(target: Target) -> Finding:
    talker = await welcomed(target, rate=50.0)
    for request in _moving_requests(talker, await talker.state()):
        name = type(request).__name__
        await talker.refused(request, VerdictCode.NOT_IN_CONTROL, f"{name} without authority")
    await talker.refused(release(talker), VerdictCode.NOT_IN_CONTROL, "a release")
    return PASSED


@check("PS31", "the authority is granted and announced", _AUTHORITY, Section.PENDANT, profiles=OURS)
async def _granted(target: Target) -> Finding:
    witness = await welcomed(target)
    talker = await holder(target)
    assert talker.hello is not None
    session = talker.hello.session
    if not await witness.until(lambda: bool(witness.all(AuthorityChanged)), 1.0):
        raise RuleBroken("the grant was not announced to another pendant")
    change = witness.all(AuthorityChanged)[-1]
    if (change.holder, change.reason) != (session, AuthorityReason.GRANTED):
        raise RuleBroken(f"announced: {change}")
    if not await talker.until(lambda: talker.all(State)[-1].holder == session, 1.0):
        raise RuleBroken(f"state names holder {talker.all(State)[-1].holder}, not {session}")
    await talker.accepted(release(talker), "a release")
    await _announced(witness, AuthorityReason.RELEASED, 1.0)
    if not await talker.until(lambda: talker.all(State)[-1].holder == 0, 1.0):
        raise RuleBroken(f"after a release state names holder {talker.all(State)[-1].holder}")
    return PASSED


async def _announced(witness: Talker, reason: AuthorityReason, within: float) -> None:
    """Wait until a pendant is told that nobody holds the authority, and why.

    Raises:
        RuleBroken: it is not, or for another reason.
    """

    def ends() -> list[AuthorityChanged]:
        return [change for change in witness.all(AuthorityChanged) if change.holder == 0]

    if not await witness.until(lambda: bool(ends()), within):
        told = [int(change.reason) for change in witness.all(AuthorityChanged)]
        raise RuleBroken(f"no end of the authority within {within:g} s; reasons told: {told}")
    if ends()[0].reason != reason:
        raise RuleBroken(f"the authority ended for reason {ends()[0].reason}, expected {reason}")


@check("PS32", "the authority has one holder", _AUTHORITY, Section.PENDANT, profiles=OURS)
async def _one_holder(target: Target) -> Finding:
    await holder(target)
    other = await welcomed(target)
    request = Authority(other.next_id(), AuthorityAction.REQUEST)
    await other.refused(request, VerdictCode.HELD_BY_OTHER, "a second request for it")
    return PASSED


def _lease(talker: Talker) -> float:
    """Return how long the authority lasts without beats [s].

    Raises:
        CannotJudge: too long to wait for.
    """
    assert talker.hello is not None
    lease = talker.hello.authority_timeout
    if lease > _LONGEST_LEASE:
        raise CannotJudge(f"the lease lasts {lease:g} s")
    return lease


@check(
    "PS33",
    "the authority expires without beats and not with them",
    _AUTHORITY,
    Section.PENDANT,
    profiles=OURS,
    deadline=40.0,
)
async def _expires(target: Target) -> Finding:
    talker = await holder(target)
    lease = _lease(talker)
    for _ in range(4):
        await asyncio.sleep(lease / 2)
        talker.wire.send(AuthorityBeat())
    await asyncio.sleep(0.8 * lease)
    lost = [change.reason for change in talker.all(AuthorityChanged) if change.holder == 0]
    if lost:
        raise RuleBroken(f"the authority was lost although beats came within {lease:g} s")
    await _announced(talker, AuthorityReason.EXPIRED, 0.2 * lease + _EXPIRES_WITHIN)
    return PASSED


@check("PS34", "the authority ends with its connection", _AUTHORITY, Section.PENDANT, profiles=OURS)
async def _ends_with_link(target: Target) -> Finding:
    for name, end in _ENDS:
        talker = await holder(target)
        other = await welcomed(target)
        end(talker.wire)
        try:
            await _announced(other, AuthorityReason.CONNECTION_LOST, 1.0)
        except RuleBroken as broken:
            raise RuleBroken(f"after {name} of its holder: {broken}") from None
        await other.take_authority()
        await other.accepted(release(other), "a release")
    return PASSED


@check(
    "PS35",
    "targets that are none are refused with their reason",
    _NOTHING_CLIPPED,
    Section.PENDANT,
    moves=True,
    profiles=OURS,
)
async def _bad_targets(target: Target) -> Finding:
    talker = await holder(target)
    here = await standing(talker, target)
    cases: list[tuple[JointMove, VerdictCode, str]] = [
        (
            joint_move(talker, (*here[:-1], math.nan)),
            VerdictCode.NOT_FINITE,
            "a target that is no number",
        ),
        (
            joint_move(talker, (*here[:-1], 500.0), SLOW),
            VerdictCode.OUT_OF_RANGE,
            "a target of 500 rad",
        ),
    ]
    for speed in (0.0, -1.0, 1.5):
        what = f"a speed of {speed:g}"
        cases.append((joint_move(talker, here, speed), VerdictCode.BAD_ARGUMENT, what))
    short = joint_move(talker, here)
    short.joint_count -= 1
    cases.append((short, VerdictCode.WRONG_JOINT_COUNT, "one joint value too few"))
    for joint, value in _just_outside(target):
        goal = (*here[:joint], value, *here[joint + 1 :])
        what = f"a target of {value:.4g} for joint {joint + 1}"
        cases.append((joint_move(talker, goal, SLOW), VerdictCode.OUT_OF_RANGE, what))
    for move, code, what in cases:
        await refused_or_stopped(talker, target, move, code, what)
        talker.wire.send(AuthorityBeat())
    return PASSED


def _just_outside(target: Target) -> list[tuple[int, float]]:
    """Return joints and values a little beyond their range; nothing where that is not known."""
    limits = target.options.limits
    if limits is None:
        return []
    ranges = enumerate(zip(limits.lower, limits.upper, strict=True))
    return [
        (joint, value)
        for joint, (lower, upper) in ranges
        for value in (lower - _BEYOND, upper + _BEYOND)
    ]


@check(
    "PS36",
    "an accepted motion is moved, shown and completed",
    _OUTCOME,
    Section.PENDANT,
    moves=True,
    profiles=OURS,
)
async def _completed(target: Target) -> Finding:
    talker = await holder(target)
    here = await standing(talker, target)
    goal = aside(target, here)
    outcome = await moved(talker, target, goal)
    if outcome.outcome != OutcomeKind.COMPLETED:
        raise RuleBroken(f"it was aborted: {outcome.code} {outcome.text!r}")
    if distance(shown(talker), goal) > ARRIVED:
        raise RuleBroken("it was completed although the robot is not there")
    judge_states(talker, outcome.request_id)
    judge_pace(target, talker, outcome, distance(goal, here))
    back = await moved(talker, target, here)
    return Finding(Judged.PASSED, f"{outcome.motion_time:.2f} s there, {back.motion_time:.2f} back")


@check(
    "PS37",
    "a stop by another pendant aborts the motion and latches",
    _STOP,
    Section.PENDANT,
    moves=True,
    profiles=OURS,
)
async def _stopped(target: Target) -> Finding:
    return await _stop_of(target, SoftwareStop(0, "conformance"))


@check(
    "PS40",
    "a stop that comes as a topic is obeyed",
    "docs/architecture.md: better a stop without an answer than none",
    Section.PENDANT,
    moves=True,
    profiles=OURS,
)
async def _stopped_by_topic(target: Target) -> Finding:
    return await _stop_of(target, SoftwareStop(0, "conformance", comm_type=CommType.TOPIC))


async def _stop_of(target: Target, stop: SoftwareStop) -> Finding:
    """Have an observer stop a motion; see that all are told, and that it stays stopped."""
    talker = await holder(target)
    here, move = await under_way(talker, target)
    known_error = talker.all(State)[-1].error_code
    other, witness = await welcomed(target), await welcomed(target)
    try:
        if stop.comm_type == CommType.REQUEST:
            stop.request_id = other.next_id()
            await other.accepted(stop, "a stop by an observer")
        else:
            other.wire.send(stop)
        outcome = await finished(talker, move.request_id, 2.0)
        if (outcome.outcome, outcome.code) != (OutcomeKind.ABORTED, VerdictCode.STOPPED):
            raise RuleBroken(f"the motion ended with outcome {outcome.outcome}, {outcome.code}")
        stood = shown(talker)
        for told, who in ((talker, "holder"), (other, "sender"), (witness, "third pendant")):
            changes = [change.stop for change in told.all(StopChanged)]
            if changes != [1]:
                raise RuleBroken(f"the stop was told to the {who} as {changes}")
        state = talker.all(State)[-1]
        if state.stop != 1:
            raise RuleBroken(f"after the stop state shows {state.stop}")
        if state.error_code not in (0, known_error):
            raise RuleBroken(
                f"after the stop the controller is in error {state.error_code}, as one that runs"
                " out of points without a STOP"
            )
        again = joint_move(talker, here)
        await talker.refused(again, VerdictCode.STOP_LATCHED, "a motion under a latched stop")
        reset = ResetStop(other.next_id())
        await other.refused(reset, VerdictCode.HELD_BY_OTHER, "a reset by an observer")
        await asyncio.sleep(0.5)
        if distance(shown(talker), stood) > ARRIVED:
            raise RuleBroken(f"after the stop the robot moved by {distance(shown(talker), stood)}")
    finally:
        await target.close()
        await reset_and_return(target, here)
    return PASSED


@check(
    "PS41",
    "a stop is not reset while nobody holds the authority",
    _STOP,
    Section.PENDANT,
    moves=True,
    profiles=OURS,
)
async def _reset_by_nobody(target: Target) -> Finding:
    talker = await welcomed(target, rate=50.0)
    here = position(await talker.state(), talker)
    await talker.accepted(SoftwareStop(talker.next_id(), "conformance"), "a stop")
    try:
        reset = ResetStop(talker.next_id())
        await talker.refused(reset, VerdictCode.NOT_IN_CONTROL, "a reset without authority")
    finally:
        await target.close()
        await reset_and_return(target, here)
    return PASSED


async def _left_alone(target: Target, end: Callable[[Wire], None]) -> Finding:
    """End the connection that commands the robot; see that it stops on the way."""
    talker = await holder(target)
    here, _ = await under_way(talker, target)
    goal = aside(target, here)
    witness = await welcomed(target, rate=50.0)
    end(talker.wire)
    try:
        await asyncio.sleep(STOPPED_WITHIN)
        await witness.state()
        stood = shown(witness)
        await asyncio.sleep(STOPPED_WITHIN)
        if distance(shown(witness), stood) > 1e-3 or distance(shown(witness), goal) < ARRIVED:
            raise RuleBroken(f"the robot went on {STOPPED_WITHIN} s after its pendant was gone")
    finally:
        await target.close()
        await reset_and_return(target, here)
    return PASSED


@check(
    "PS38",
    "a motion ends when its pendant disappears",
    _LINK_LOSS,
    Section.PENDANT,
    moves=True,
    profiles=OURS,
)
async def _lost(target: Target) -> Finding:
    return await _left_alone(target, Wire.reset)


@check(
    "PS42",
    "a motion ends with the end of its pendant's stream",
    _LINK_LOSS,
    Section.PENDANT,
    moves=True,
    profiles=OURS,
)
async def _hung_up(target: Target) -> Finding:
    return await _left_alone(target, Wire.half_close)


@check(
    "PS39",
    "a second motion during the first is refused",
    _OUTCOME,
    Section.PENDANT,
    moves=True,
    profiles=OURS,
)
async def _busy(target: Target) -> Finding:
    talker = await holder(target)
    here, move = await under_way(talker, target)
    found = await talker.verdict(joint_move(talker, here), "a second motion")
    if found.code not in (VerdictCode.MOVING, VerdictCode.PLANNING):
        raise RuleBroken(f"a second motion during the first: verdict {found.code}")
    outcome = await finished(talker, move.request_id, 30.0)
    if outcome.outcome != OutcomeKind.COMPLETED:
        raise RuleBroken(f"the first motion was disturbed: {outcome.code} {outcome.text!r}")
    await moved(talker, target, here)
    return PASSED


@check(
    "PS43",
    "a motion ends when its lease expires",
    _AUTHORITY,
    Section.PENDANT,
    moves=True,
    profiles=OURS,
    deadline=60.0,
)
async def _expires_in_motion(target: Target) -> Finding:
    talker = await holder(target)
    lease = _lease(talker)
    here, move = await under_way(talker, target, speed_for(target, lease + 3.0))
    try:
        await _announced(talker, AuthorityReason.EXPIRED, lease + _EXPIRES_WITHIN)
        outcome = await finished(talker, move.request_id, 1.0)
        if outcome.outcome == OutcomeKind.COMPLETED:
            raise CannotJudge("the motion was over before its lease")
        if outcome.code != VerdictCode.AUTHORITY_LOST:
            raise RuleBroken(f"the motion ended for {outcome.code} {outcome.text!r}")
        stood = shown(talker)
        await asyncio.sleep(STOPPED_WITHIN)
        if distance(shown(talker), stood) > 1e-3:
            raise RuleBroken("the robot moves although the lease has expired")
    finally:
        await target.close()
        await reset_and_return(target, here)
    return PASSED


@check(
    "PS44",
    "only the holder's beats prolong the authority",
    _AUTHORITY,
    Section.PENDANT,
    profiles=OURS,
)
async def _beats_of_others(target: Target) -> Finding:
    talker, other = await holder(target), await welcomed(target)
    lease = _lease(talker)
    async with other.beating():
        await _announced(talker, AuthorityReason.EXPIRED, lease + _EXPIRES_WITHIN)
    return PASSED
