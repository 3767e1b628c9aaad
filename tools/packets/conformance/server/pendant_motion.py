"""Section P, second part: who may move the robot by the pendant port, and how motions end.

Owns how a motion is asked for, awaited and undone, small ones there and back, and what its states
must have in common with it.
"""

from __future__ import annotations

import asyncio
import itertools
import math
from collections.abc import AsyncIterator, Callable, Iterator, Sequence
from contextlib import asynccontextmanager
from functools import partial

from openpendant.simplemsg import CommType, Message, joint_array
from openpendant.simplemsg.pendant import (
    Activity,
    Authority,
    AuthorityAction,
    AuthorityBeat,
    AuthorityChanged,
    AuthorityReason,
    JointMove,
    JointPath,
    JointWaypoint,
    Motion,
    Outcome,
    OutcomeKind,
    PoseMove,
    PosePath,
    PoseWaypoint,
    ResetStop,
    SoftwareStop,
    State,
    StateField,
    StopChanged,
)
from openpendant.simplemsg.verdicts import VerdictCode

from ..check import CannotJudge, CheckFinding, RuleBroken, passed
from .checks import check, check_on
from .monitor import distance
from .pendant import OURS, PendantConversation, welcomed
from .target import Target
from .wire import Wire

SPEED = 0.05
"""Fraction of the joints' largest speed for motions that have to arrive."""

SLOW = 0.01
"""The same for motions that are broken off."""

ARRIVED = 2e-3
"""A joint this close to its goal has arrived [rad or m]."""

STOPPED_WITHIN = 0.6
"""A robot that is stopped stands by then [s]."""

_GUESSED_VELOCITY = math.pi
_WINDOW = 0.1
_AGAIN_WITHIN = 0.8


def release(pendant: PendantConversation) -> Authority:
    """Return a request that gives the authority back."""
    return Authority(pendant.next_id(), AuthorityAction.RELEASE)


async def holder(target: Target) -> PendantConversation:
    """Connect, have state at 50 Hz, and take the authority; CannotJudge where either is not had."""
    pendant = await welcomed(target, rate=50.0)
    await pendant.state()
    await pendant.take_authority()
    return pendant


def dof(pendant: PendantConversation) -> int:
    """Return how many joints the server says the robot has."""
    return pendant.hello.dof


def position(state: State, pendant: PendantConversation) -> tuple[float, ...]:
    """Return the driven joints of a state, (n,) [rad or m]."""
    return tuple(state.positions[: dof(pendant)])


def shown(pendant: PendantConversation) -> tuple[float, ...]:
    """Return where the newest state shows the joints, (n,) [rad or m]."""
    return position(pendant.all(State)[-1], pendant)


async def standing(pendant: PendantConversation, target: Target) -> tuple[float, ...]:
    """Return where the robot stands, before it is moved from there, (n,) [rad or m].

    Raises:
        CannotJudge: the ROS-Industrial port shows it elsewhere; a goal near the wrong place is far.
    """
    here = position(await pendant.state(), pendant)
    home = target.home
    if home is not None and distance(here, home[: len(here)]) > target.reach:
        raise CannotJudge("the pendant port shows the robot elsewhere than the state port")
    return here


def joint_move(
    pendant: PendantConversation, joints: Sequence[float], speed: float = SPEED
) -> JointMove:
    """Return a request to move the joints, (n,) [rad or m]."""
    return JointMove(pendant.next_id(), speed, dof(pendant), joint_array(joints))


def aside(target: Target, here: Sequence[float]) -> tuple[float, ...]:
    """Return a goal that differs in the last joint by the amplitude, towards its middle."""
    joint = len(here) - 1
    limits = target.options.limits
    middle = 0.0 if limits is None else (limits.lower[joint] + limits.upper[joint]) / 2
    way = math.copysign(target.options.amplitude, middle - here[joint])
    return (*here[:-1], here[-1] + way)


def speed_for(target: Target, seconds: float) -> float:
    """Return the speed at which a motion by the amplitude takes about so long, or a little more."""
    limits = target.options.limits
    fastest = _GUESSED_VELOCITY if limits is None else limits.velocity[-1]
    return min(SLOW, target.options.amplitude / (fastest * seconds))


async def finished(pendant: PendantConversation, request_id: int, within: float) -> Outcome:
    """Wait, with beats, for the one outcome of a request; RuleBroken for none or more than one."""

    def ended() -> list[Outcome]:
        return [found for found in pendant.all(Outcome) if found.request_id == request_id]

    async with pendant.beating():
        if not await pendant.until(lambda: bool(ended()), within):
            raise RuleBroken(f"request {request_id} was accepted, no outcome in {within:g} s")
        await pendant.until(lambda: len(ended()) > 1, _AGAIN_WITHIN)
    if len(ended()) != 1:
        raise RuleBroken(f"request {request_id} had {len(ended())} outcomes")
    return ended()[0]


async def moved(
    pendant: PendantConversation, target: Target, goal: Sequence[float], speed: float = SPEED
) -> Outcome:
    """Move to a goal and return the outcome."""
    target.may_have_moved = True
    move = joint_move(pendant, goal, speed)
    await pendant.accepted(move, "a joint move")
    return await finished(pendant, move.request_id, 20.0)


async def under_way(
    pendant: PendantConversation, target: Target, speed: float = SLOW
) -> tuple[tuple[float, ...], JointMove]:
    """Start a slow motion; return start position and request. CannotJudge where nothing moves."""
    here = await standing(pendant, target)
    move = joint_move(pendant, aside(target, here), speed)
    target.may_have_moved = True
    await pendant.accepted(move, "a slow joint move")
    if not await pendant.until(lambda: distance(shown(pendant), here) > ARRIVED, 5.0):
        raise CannotJudge("the robot did not move")
    return here, move


async def reset_and_return(target: Target, here: Sequence[float]) -> None:
    """Reset a latched stop and go back to where the robot was."""
    pendant = await holder(target)
    await pendant.until(lambda: pendant.all(State)[-1].activity == Activity.IDLE, 3.0)
    await pendant.accepted(ResetStop(pendant.next_id()), "the reset of a stop")
    if distance(shown(pendant), here) > ARRIVED:
        await moved(pendant, target, here)


@asynccontextmanager
async def put_back(target: Target, here: Sequence[float]) -> AsyncIterator[None]:
    """Close all connections after the context, reset the stop and go back to where it was."""
    try:
        yield
    finally:
        await target.close()
        await reset_and_return(target, here)


async def refused_or_stopped(
    pendant: PendantConversation, target: Target, move: JointMove, code: VerdictCode, what: str
) -> None:
    """Send a move that must be refused; a robot that sets out for it is stopped and brought back.

    Raises:
        RuleBroken: it is accepted, or refused for another reason.
    """
    here = shown(pendant)
    found = await pendant.verdict(move, what)
    if not found.code:
        target.may_have_moved = True
        await pendant.accepted(SoftwareStop(pendant.next_id(), "conformance"), "a stop")
        await target.close()
        await reset_and_return(target, here)
    if found.code != code:
        raise RuleBroken(f"{what}: verdict {found.code} ({found.text!r}), expected {code}")


def judge_states(pendant: PendantConversation, request_id: int) -> None:
    """Raise RuleBroken unless the states of one motion belong to it and to each other."""
    states = pendant.all(State)
    activities = {state.activity for state in states}
    if Activity.MOVING not in activities or states[-1].activity != Activity.IDLE:
        raise RuleBroken(f"activities shown: {sorted(activities)}, at last {states[-1].activity}")
    for state in states:
        due = 0 if state.activity == Activity.IDLE else request_id
        if state.activity in (Activity.IDLE, Activity.MOVING) and state.request_id != due:
            raise RuleBroken(
                f"request {state.request_id} shown in activity {state.activity}, not {due}"
            )
    last = dof(pendant) - 1
    led = sum(
        (before.velocities[last] + after.velocities[last]) / 2 * step
        for before, after, step in _steps(states)
    )
    went = states[-1].positions[last] - states[0].positions[last]
    if states[-1].valid_fields & StateField.VELOCITY and not abs(led - went) <= 0.25 * abs(went):
        raise RuleBroken(f"the joint went {went:.4f} rad, its velocities add up to {led:.4f}")


def _steps(states: Sequence[State]) -> Iterator[tuple[State, State, float]]:
    for before, after in itertools.pairwise(states):
        yield before, after, seconds(after) - seconds(before)


def seconds(state: State) -> float:
    """Return the server's time of a state [s]."""
    return state.time_s + state.time_ns * 1e-9


def judge_pace(target: Target, pendant: PendantConversation, outcome: Outcome, way: float) -> None:
    """Raise RuleBroken where a motion of the last joint was faster than speed and limit allow."""
    taken = outcome.motion_time
    if not taken > 0.0:
        raise RuleBroken(f"a motion of {way:.3f} rad is said to have taken {taken:g} s")
    limits = target.options.limits
    if limits is None:
        return
    most = SPEED * limits.velocity[-1]
    if taken < 0.95 * way / most:
        raise RuleBroken(
            f"{way:.3f} rad at {SPEED:g} of the speed took {taken:.3f} s, less than"
            f" {way / most:.3f} s"
        )
    fastest = _fastest(pendant.all(State), dof(pendant) - 1)
    if fastest > 1.2 * most:
        raise RuleBroken(
            f"the joint moved at {fastest:.3f} rad/s, {SPEED:g} of its speed is {most:.3f}"
        )


def _fastest(states: Sequence[State], joint: int) -> float:
    """Return the largest mean speed of a joint over a tenth of a second [rad/s or m/s]."""
    fastest, first = 0.0, 0
    for index, state in enumerate(states):
        while seconds(state) - seconds(states[first]) > _WINDOW and first < index - 1:
            first += 1
        step = seconds(state) - seconds(states[first])
        if step >= 0.5 * _WINDOW:
            way = abs(state.positions[joint] - states[first].positions[joint])
            fastest = max(fastest, way / step)
    return fastest


_EXPIRES_WITHIN = 0.5
_LONGEST_LEASE = 10.0
_BEYOND = 0.1

_ENDS: tuple[tuple[str, Callable[[Wire], None]], ...] = (
    ("a reset", Wire.reset),
    ("an end of stream", Wire.half_close),
)


def _moving_requests(pendant: PendantConversation, state: State) -> list[Message]:
    """Return a request of each kind that moves the robot, to where it stands."""
    here = position(state, pendant)
    place, turn = state.tool_position, state.tool_orientation
    waypoints = (JointWaypoint(state.positions),)
    poses = (PoseWaypoint(place, turn),)
    return [
        joint_move(pendant, here),
        JointPath(pendant.next_id(), SPEED, dof(pendant), waypoints),
        PoseMove(pendant.next_id(), Motion.PTP, SPEED, "base", place, turn),
        PosePath(pendant.next_id(), Motion.PTP, SPEED, "base", poses),
    ]


@check("PS30", profiles=OURS)
async def _no_authority(target: Target) -> None:
    pendant = await welcomed(target, rate=50.0)
    for request in _moving_requests(pendant, await pendant.state()):
        name = type(request).__name__
        await pendant.refused(request, VerdictCode.NOT_IN_CONTROL, f"{name} without authority")
    await pendant.refused(release(pendant), VerdictCode.NOT_IN_CONTROL, "a release")


@check("PS31", profiles=OURS)
async def _granted(target: Target) -> None:
    witness = await welcomed(target)
    pendant = await holder(target)
    session = pendant.hello.session
    if not await witness.until(lambda: bool(witness.all(AuthorityChanged)), 1.0):
        raise RuleBroken("the grant was not announced to another pendant")
    change = witness.all(AuthorityChanged)[-1]
    if (change.holder, change.reason) != (session, AuthorityReason.GRANTED):
        raise RuleBroken(f"announced: {change}")
    if not await pendant.until(lambda: pendant.all(State)[-1].holder == session, 1.0):
        raise RuleBroken(f"state names holder {pendant.all(State)[-1].holder}, not {session}")
    await pendant.accepted(release(pendant), "a release")
    await _announced(witness, AuthorityReason.RELEASED, 1.0)
    if not await pendant.until(lambda: pendant.all(State)[-1].holder == 0, 1.0):
        raise RuleBroken(f"after a release state names holder {pendant.all(State)[-1].holder}")


async def _announced(witness: PendantConversation, reason: AuthorityReason, within: float) -> None:
    """Raise RuleBroken unless a pendant is told that nobody holds the authority, and why."""

    def ends() -> list[AuthorityChanged]:
        return [change for change in witness.all(AuthorityChanged) if change.holder == 0]

    if not await witness.until(lambda: bool(ends()), within):
        told = [int(change.reason) for change in witness.all(AuthorityChanged)]
        raise RuleBroken(f"no end of the authority within {within:g} s; reasons told: {told}")
    if ends()[0].reason != reason:
        raise RuleBroken(f"the authority ended for reason {ends()[0].reason}, expected {reason}")


@check("PS32", profiles=OURS)
async def _one_holder(target: Target) -> None:
    await holder(target)
    other = await welcomed(target)
    request = Authority(other.next_id(), AuthorityAction.REQUEST)
    await other.refused(request, VerdictCode.HELD_BY_OTHER, "a second request for it")


def _lease(pendant: PendantConversation) -> float:
    """Return the time of the authority without beats [s]; CannotJudge where it is long."""
    lease = pendant.hello.authority_timeout
    if lease > _LONGEST_LEASE:
        raise CannotJudge(f"the lease lasts {lease:g} s")
    return lease


@check_on(holder, "PS33", profiles=OURS, deadline=40.0)
async def _expires(pendant: PendantConversation) -> None:
    lease = _lease(pendant)
    for _ in range(4):
        await asyncio.sleep(lease / 2)
        pendant.wire.send(AuthorityBeat())
    await asyncio.sleep(0.8 * lease)
    lost = [change.reason for change in pendant.all(AuthorityChanged) if change.holder == 0]
    if lost:
        raise RuleBroken(f"the authority was lost although beats came within {lease:g} s")
    await _announced(pendant, AuthorityReason.EXPIRED, 0.2 * lease + _EXPIRES_WITHIN)


@check("PS34", profiles=OURS)
async def _ends_with_link(target: Target) -> None:
    for name, end in _ENDS:
        pendant = await holder(target)
        other = await welcomed(target)
        end(pendant.wire)
        try:
            await _announced(other, AuthorityReason.CONNECTION_LOST, 1.0)
        except RuleBroken as broken:
            raise RuleBroken(f"after {name} of its holder: {broken}") from None
        await other.take_authority()
        await other.accepted(release(other), "a release")


@check("PS35", moves=True, profiles=OURS)
async def _bad_targets(target: Target) -> None:
    pendant = await holder(target)
    here = await standing(pendant, target)
    cases: list[tuple[JointMove, VerdictCode, str]] = [
        (
            joint_move(pendant, (*here[:-1], math.nan)),
            VerdictCode.NOT_FINITE,
            "a target that is no number",
        ),
        (
            joint_move(pendant, (*here[:-1], 500.0), SLOW),
            VerdictCode.OUT_OF_RANGE,
            "a target of 500 rad",
        ),
    ]
    for speed in (0.0, -1.0, 1.5):
        what = f"a speed of {speed:g}"
        cases.append((joint_move(pendant, here, speed), VerdictCode.BAD_ARGUMENT, what))
    short = joint_move(pendant, here)
    short.joint_count -= 1
    cases.append((short, VerdictCode.WRONG_JOINT_COUNT, "one joint value too few"))
    for joint, value in _just_outside(target):
        goal = (*here[:joint], value, *here[joint + 1 :])
        what = f"a target of {value:.4g} for joint {joint + 1}"
        cases.append((joint_move(pendant, goal, SLOW), VerdictCode.OUT_OF_RANGE, what))
    for move, code, what in cases:
        await refused_or_stopped(pendant, target, move, code, what)
        pendant.wire.send(AuthorityBeat())


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


@check("PS36", moves=True, profiles=OURS)
async def _completed(target: Target) -> CheckFinding:
    pendant = await holder(target)
    here = await standing(pendant, target)
    goal = aside(target, here)
    outcome = await moved(pendant, target, goal)
    if outcome.outcome != OutcomeKind.COMPLETED:
        raise RuleBroken(f"it was aborted: {outcome.code} {outcome.text!r}")
    if distance(shown(pendant), goal) > ARRIVED:
        raise RuleBroken("it was completed although the robot is not there")
    judge_states(pendant, outcome.request_id)
    judge_pace(target, pendant, outcome, distance(goal, here))
    back = await moved(pendant, target, here)
    return passed(f"{outcome.motion_time:.2f} s there, {back.motion_time:.2f} back")


async def _stop_of(target: Target, comm_type: CommType) -> None:
    """Have an observer stop a motion; make sure that all are told, and that it stays stopped."""
    pendant = await holder(target)
    here, move = await under_way(pendant, target)
    known_error = pendant.all(State)[-1].error_code
    other, witness = await welcomed(target), await welcomed(target)
    stop = SoftwareStop(0, "conformance", comm_type=comm_type)
    async with put_back(target, here):
        if comm_type == CommType.REQUEST:
            stop.request_id = other.next_id()
            await other.accepted(stop, "a stop by an observer")
        else:
            other.wire.send(stop)
        outcome = await finished(pendant, move.request_id, 2.0)
        if (outcome.outcome, outcome.code) != (OutcomeKind.ABORTED, VerdictCode.STOPPED):
            raise RuleBroken(f"the motion ended with outcome {outcome.outcome}, {outcome.code}")
        stood = shown(pendant)
        for told, who in ((pendant, "holder"), (other, "sender"), (witness, "third pendant")):
            changes = [change.stop for change in told.all(StopChanged)]
            if changes != [1]:
                raise RuleBroken(f"the stop was told to the {who} as {changes}")
        state = pendant.all(State)[-1]
        if state.stop != 1:
            raise RuleBroken(f"after the stop state shows {state.stop}")
        if state.error_code not in (0, known_error):
            raise RuleBroken(
                f"after the stop the controller is in error {state.error_code}, as one that runs"
                " out of points without a STOP"
            )
        again = joint_move(pendant, here)
        await pendant.refused(again, VerdictCode.STOP_LATCHED, "a motion under a latched stop")
        reset = ResetStop(other.next_id())
        await other.refused(reset, VerdictCode.HELD_BY_OTHER, "a reset by an observer")
        await asyncio.sleep(0.5)
        if distance(shown(pendant), stood) > ARRIVED:
            raise RuleBroken(f"after the stop the robot moved by {distance(shown(pendant), stood)}")


check("PS37", moves=True, profiles=OURS)(partial(_stop_of, comm_type=CommType.REQUEST))
check("PS40", moves=True, profiles=OURS)(partial(_stop_of, comm_type=CommType.TOPIC))


@check("PS41", moves=True, profiles=OURS)
async def _reset_by_nobody(target: Target) -> None:
    pendant = await welcomed(target, rate=50.0)
    here = position(await pendant.state(), pendant)
    await pendant.accepted(SoftwareStop(pendant.next_id(), "conformance"), "a stop")
    async with put_back(target, here):
        reset = ResetStop(pendant.next_id())
        await pendant.refused(reset, VerdictCode.NOT_IN_CONTROL, "a reset without authority")


async def _left_alone(target: Target, end: Callable[[Wire], None]) -> None:
    """End the connection that commands the robot; make sure that it stops on the way."""
    pendant = await holder(target)
    here, _ = await under_way(pendant, target)
    goal = aside(target, here)
    witness = await welcomed(target, rate=50.0)
    end(pendant.wire)
    async with put_back(target, here):
        await asyncio.sleep(STOPPED_WITHIN)
        await witness.state()
        stood = shown(witness)
        await asyncio.sleep(STOPPED_WITHIN)
        if distance(shown(witness), stood) > 1e-3 or distance(shown(witness), goal) < ARRIVED:
            raise RuleBroken(f"the robot went on {STOPPED_WITHIN} s after its pendant was gone")


check("PS38", moves=True, profiles=OURS)(partial(_left_alone, end=Wire.reset))
check("PS42", moves=True, profiles=OURS)(partial(_left_alone, end=Wire.half_close))


@check("PS39", moves=True, profiles=OURS)
async def _busy(target: Target) -> None:
    pendant = await holder(target)
    here, move = await under_way(pendant, target)
    found = await pendant.verdict(joint_move(pendant, here), "a second motion")
    if found.code not in (VerdictCode.MOVING, VerdictCode.PLANNING):
        raise RuleBroken(f"a second motion during the first: verdict {found.code}")
    outcome = await finished(pendant, move.request_id, 30.0)
    if outcome.outcome != OutcomeKind.COMPLETED:
        raise RuleBroken(f"the first motion was disturbed: {outcome.code} {outcome.text!r}")
    await moved(pendant, target, here)


@check("PS43", moves=True, profiles=OURS, deadline=60.0)
async def _expires_in_motion(target: Target) -> None:
    pendant = await holder(target)
    lease = _lease(pendant)
    here, move = await under_way(pendant, target, speed_for(target, lease + 3.0))
    async with put_back(target, here):
        await _announced(pendant, AuthorityReason.EXPIRED, lease + _EXPIRES_WITHIN)
        outcome = await finished(pendant, move.request_id, 1.0)
        if outcome.outcome == OutcomeKind.COMPLETED:
            raise CannotJudge("the motion was over before its lease")
        if outcome.code != VerdictCode.AUTHORITY_LOST:
            raise RuleBroken(f"the motion ended for {outcome.code} {outcome.text!r}")
        stood = shown(pendant)
        await asyncio.sleep(STOPPED_WITHIN)
        if distance(shown(pendant), stood) > 1e-3:
            raise RuleBroken("the robot moves although the lease has expired")


@check("PS44", profiles=OURS)
async def _beats_of_others(target: Target) -> None:
    pendant, other = await holder(target), await welcomed(target)
    lease = _lease(pendant)
    async with other.beating():
        await _announced(pendant, AuthorityReason.EXPIRED, lease + _EXPIRES_WITHIN)
