"""Section P, second part: who may move the robot by the pendant port, and how motions end."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Sequence

from openpendant.simplemsg import joint_array
from openpendant.simplemsg.pendant import (
    Activity,
    Authority,
    AuthorityAction,
    AuthorityBeat,
    AuthorityChanged,
    AuthorityReason,
    JointMove,
    Outcome,
    OutcomeKind,
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
from .pendant_talk import Talker, welcomed
from .target import Target
from .watch import distance
from .wire import CannotJudge, RuleBroken

_AUTHORITY = "docs/architecture.md: one motion authority, a lease that expires without beats"
_STOP = "docs/architecture.md: anyone may stop; only the authority may reset"
_OUTCOME = "docs/architecture.md: accepted, then completed or aborted, once"
_NOTHING_CLIPPED = "docs/architecture.md: nothing is clipped silently, nothing succeeds silently"
_SPEED = 0.05
_ARRIVED = 2e-3


def _release(talker: Talker) -> Authority:
    return Authority(talker.next_id(), AuthorityAction.RELEASE)


async def _holder(target: Target) -> Talker:
    talker = await welcomed(target, rate=50.0)
    await talker.state()
    await talker.take_authority()
    return talker


def _dof(talker: Talker) -> int:
    assert talker.hello is not None
    return talker.hello.dof


def _position(state: State, talker: Talker) -> tuple[float, ...]:
    return tuple(state.positions[: _dof(talker)])


def _move(talker: Talker, joints: Sequence[float], speed: float = _SPEED) -> JointMove:
    return JointMove(talker.next_id(), speed, _dof(talker), joint_array(joints))


@check("PS30", "motion without authority is refused", _AUTHORITY, Section.PENDANT, profiles=OURS)
async def _no_authority(target: Target) -> Finding:
    talker = await welcomed(target, rate=50.0)
    here = _position(await talker.state(), talker)
    await talker.refused(_move(talker, here), VerdictCode.NOT_IN_CONTROL, "a motion")
    await talker.refused(_release(talker), VerdictCode.NOT_IN_CONTROL, "a release")
    return PASSED


@check("PS31", "the authority is granted and announced", _AUTHORITY, Section.PENDANT, profiles=OURS)
async def _granted(target: Target) -> Finding:
    witness = await welcomed(target)
    talker = await _holder(target)
    assert talker.hello is not None
    if not await witness.until(lambda: bool(witness.all(AuthorityChanged)), 1.0):
        raise RuleBroken("the grant was not announced to another pendant")
    change = witness.all(AuthorityChanged)[-1]
    if (change.holder, change.reason) != (talker.hello.session, AuthorityReason.GRANTED):
        raise RuleBroken(f"announced: {change}")
    await talker.accepted(_release(talker), "a release")
    if not await witness.until(lambda: witness.all(AuthorityChanged)[-1].holder == 0, 1.0):
        raise RuleBroken("the release was not announced")
    return PASSED


@check("PS32", "the authority has one holder", _AUTHORITY, Section.PENDANT, profiles=OURS)
async def _one_holder(target: Target) -> Finding:
    await _holder(target)
    other = await welcomed(target)
    request = Authority(other.next_id(), AuthorityAction.REQUEST)
    await other.refused(request, VerdictCode.HELD_BY_OTHER, "a second request for it")
    return PASSED


@check(
    "PS33",
    "the authority expires without beats and not with them",
    _AUTHORITY,
    Section.PENDANT,
    profiles=OURS,
)
async def _expires(target: Target) -> Finding:
    talker = await _holder(target)
    assert talker.hello is not None
    timeout = talker.hello.authority_timeout
    for _ in range(4):
        await asyncio.sleep(timeout / 2)
        talker.wire.send(AuthorityBeat())
    lost = [change.reason for change in talker.all(AuthorityChanged) if change.holder == 0]
    if lost:
        raise RuleBroken("the authority was lost although beats came")
    await talker.until(
        lambda: any(change.holder == 0 for change in talker.all(AuthorityChanged)), timeout + 1.0
    )
    last = talker.all(AuthorityChanged)[-1]
    if (last.holder, last.reason) != (0, AuthorityReason.EXPIRED):
        raise RuleBroken(f"{timeout + 1:g} s without a beat: {last}")
    return PASSED


@check("PS34", "the authority ends with its connection", _AUTHORITY, Section.PENDANT, profiles=OURS)
async def _ends_with_link(target: Target) -> Finding:
    talker = await _holder(target)
    other = await welcomed(target)
    talker.wire.reset()
    if not await other.until(lambda: bool(other.all(AuthorityChanged)), 2.0):
        raise RuleBroken("the authority of a lost connection was not ended")
    await other.take_authority()
    await other.accepted(_release(other), "a release")
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
    talker = await _holder(target)
    here = _position(await talker.state(), talker)
    bad = (*here[:-1], math.nan)
    await talker.refused(_move(talker, bad), VerdictCode.NOT_FINITE, "a target that is no number")
    for speed in (0.0, -1.0, 1.5):
        move = _move(talker, here, speed)
        await talker.refused(move, VerdictCode.BAD_ARGUMENT, f"a speed of {speed:g}")
    count = JointMove(talker.next_id(), _SPEED, _dof(talker) - 1, joint_array(here))
    await talker.refused(count, VerdictCode.WRONG_JOINT_COUNT, "one joint value too few")
    far = (*here[:-1], 500.0)
    await talker.refused(_move(talker, far), VerdictCode.OUT_OF_RANGE, "a target of 500 rad")
    return PASSED


def _aside(target: Target, here: Sequence[float]) -> tuple[float, ...]:
    joint = len(here) - 1
    limits = target.options.limits
    middle = 0.0 if limits is None else (limits.lower[joint] + limits.upper[joint]) / 2
    way = math.copysign(target.options.amplitude, middle - here[joint])
    return (*here[:-1], here[-1] + way)


async def _finished(talker: Talker, request_id: int, within: float) -> Outcome:
    def ended() -> list[Outcome]:
        return [found for found in talker.all(Outcome) if found.request_id == request_id]

    if not await talker.until(lambda: bool(ended()), within):
        raise RuleBroken(f"request {request_id} was accepted and had no outcome in {within:g} s")
    await asyncio.sleep(0.3)
    if len(ended()) != 1:
        raise RuleBroken(f"request {request_id} had {len(ended())} outcomes")
    return ended()[0]


async def _moves(talker: Talker, goal: Sequence[float], speed: float = _SPEED) -> Outcome:
    move = _move(talker, goal, speed)
    await talker.accepted(move, "a joint move")
    return await _finished(talker, move.request_id, 20.0)


@check(
    "PS36",
    "an accepted motion is moved, shown and completed",
    _OUTCOME,
    Section.PENDANT,
    moves=True,
    profiles=OURS,
)
async def _completed(target: Target) -> Finding:
    talker = await _holder(target)
    here = _position(await talker.state(), talker)
    goal = _aside(target, here)
    outcome = await _moves(talker, goal)
    if outcome.outcome != OutcomeKind.COMPLETED:
        raise RuleBroken(f"it was aborted: {outcome.code} {outcome.text!r}")
    state = await talker.state()
    if distance(_position(state, talker), goal) > _ARRIVED:
        raise RuleBroken("it was completed although the robot is not there")
    shown = {found.activity for found in talker.all(State)}
    if Activity.MOVING not in shown or state.activity != Activity.IDLE:
        raise RuleBroken(f"activities shown: {sorted(shown)}, at last {state.activity}")
    back = await _moves(talker, here)
    return Finding(Judged.PASSED, f"{outcome.motion_time:.2f} s there, {back.motion_time:.2f} back")


async def _under_way(talker: Talker, target: Target) -> tuple[tuple[float, ...], JointMove]:
    """Start a slow motion; return where it began and its request."""
    here = _position(await talker.state(), talker)
    move = _move(talker, _aside(target, here), 0.01)
    await talker.accepted(move, "a slow joint move")

    def has_left() -> bool:
        return distance(_position(talker.all(State)[-1], talker), here) > 0.002

    if not await talker.until(has_left, 5.0):
        raise CannotJudge("the robot did not move")
    return here, move


async def _reset_and_return(target: Target, here: Sequence[float]) -> None:
    """Reset a latched stop and go back to where the robot was."""
    talker = await _holder(target)
    await talker.until(lambda: talker.all(State)[-1].activity == Activity.IDLE, 3.0)
    await talker.accepted(ResetStop(talker.next_id()), "the reset of a stop")
    if distance(_position(talker.all(State)[-1], talker), here) > _ARRIVED:
        await _moves(talker, here)


@check(
    "PS37",
    "a stop by another pendant aborts the motion and latches",
    _STOP,
    Section.PENDANT,
    moves=True,
    profiles=OURS,
)
async def _stopped(target: Target) -> Finding:
    talker = await _holder(target)
    here, move = await _under_way(talker, target)
    other = await welcomed(target)
    try:
        await other.accepted(SoftwareStop(other.next_id(), "conformance"), "a stop by an observer")
        outcome = await _finished(talker, move.request_id, 2.0)
        if (outcome.outcome, outcome.code) != (OutcomeKind.ABORTED, VerdictCode.STOPPED):
            raise RuleBroken(f"the motion ended with outcome {outcome.outcome}, {outcome.code}")
        stood = _position(talker.all(State)[-1], talker)
        told = [change.stop for change in talker.all(StopChanged)]
        if told != [1] or talker.all(State)[-1].stop != 1:
            raise RuleBroken(f"the stop was told as {told}, state {talker.all(State)[-1].stop}")
        again = _move(talker, here)
        await talker.refused(again, VerdictCode.STOP_LATCHED, "a motion under a latched stop")
        reset = ResetStop(other.next_id())
        await other.refused(reset, VerdictCode.HELD_BY_OTHER, "a reset by an observer")
        await asyncio.sleep(0.5)
        off = distance(_position(talker.all(State)[-1], talker), stood)
        if off > _ARRIVED:
            raise RuleBroken(f"after the stop the robot moved by {off:.3g}")
    finally:
        await target.close()
        await _reset_and_return(target, here)
    return PASSED


@check(
    "PS38",
    "a motion ends when its pendant disappears",
    "docs/architecture.md: on FIN or RST the stop leaves within a tick",
    Section.PENDANT,
    moves=True,
    profiles=OURS,
)
async def _lost(target: Target) -> Finding:
    talker = await _holder(target)
    here, _ = await _under_way(talker, target)
    goal = _aside(target, here)
    witness = await welcomed(target, rate=50.0)
    talker.wire.reset()
    try:
        await asyncio.sleep(0.6)
        stood = _position(await witness.state(), witness)
        await asyncio.sleep(0.6)
        now = _position(await witness.state(), witness)
        if distance(now, stood) > 1e-3 or distance(now, goal) < _ARRIVED:
            raise RuleBroken("the robot went on 0.6 s after its pendant had disappeared")
    finally:
        await target.close()
        await _reset_and_return(target, here)
    return PASSED


@check(
    "PS39",
    "a second motion during the first is refused",
    _OUTCOME,
    Section.PENDANT,
    moves=True,
    profiles=OURS,
)
async def _busy(target: Target) -> Finding:
    talker = await _holder(target)
    here, move = await _under_way(talker, target)
    found = await talker.verdict(_move(talker, here), "a second motion")
    if found.code not in (VerdictCode.MOVING, VerdictCode.PLANNING):
        raise RuleBroken(f"a second motion during the first: verdict {found.code}")
    outcome = await _finished(talker, move.request_id, 30.0)
    if outcome.outcome != OutcomeKind.COMPLETED:
        raise RuleBroken(f"the first motion was disturbed: {outcome.code} {outcome.text!r}")
    await _moves(talker, here)
    return PASSED
