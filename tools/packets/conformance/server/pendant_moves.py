"""The tester as a pendant that moves the robot: small motions there and back, and what was shown.

Owns how a motion is asked for, awaited and undone, and what its states must have in common with it.
Knows no check by its number.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence

from openpendant.simplemsg import joint_array
from openpendant.simplemsg.pendant import (
    Activity,
    Authority,
    AuthorityAction,
    JointMove,
    Outcome,
    ResetStop,
    SoftwareStop,
    State,
    StateField,
)
from openpendant.simplemsg.verdicts import VerdictCode

from .pendant_talk import Talker, welcomed
from .target import Target
from .watch import distance
from .wire import CannotJudge, RuleBroken

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


def release(talker: Talker) -> Authority:
    """Return a request that gives the authority back."""
    return Authority(talker.next_id(), AuthorityAction.RELEASE)


async def holder(target: Target) -> Talker:
    """Connect, have state at 50 Hz, and take the authority.

    Raises:
        CannotJudge: somebody else has it, or no state comes.
    """
    talker = await welcomed(target, rate=50.0)
    await talker.state()
    await talker.take_authority()
    return talker


def dof(talker: Talker) -> int:
    """Return how many joints the server says the robot has."""
    assert talker.hello is not None
    return talker.hello.dof


def position(state: State, talker: Talker) -> tuple[float, ...]:
    """Return the driven joints of a state, (n,) [rad or m]."""
    return tuple(state.positions[: dof(talker)])


def shown(talker: Talker) -> tuple[float, ...]:
    """Return where the newest state shows the joints, (n,) [rad or m]."""
    return position(talker.all(State)[-1], talker)


async def standing(talker: Talker, target: Target) -> tuple[float, ...]:
    """Return where the robot stands, before it is moved from there, (n,) [rad or m].

    Raises:
        CannotJudge: the ROS-Industrial port shows it elsewhere; a goal near the wrong place is far.
    """
    here = position(await talker.state(), talker)
    home = target.home
    if home is not None and distance(here, home[: len(here)]) > target.reach:
        raise CannotJudge("the pendant port shows the robot elsewhere than the state port")
    return here


def joint_move(talker: Talker, joints: Sequence[float], speed: float = SPEED) -> JointMove:
    """Return a request to move the joints, (n,) [rad or m]."""
    return JointMove(talker.next_id(), speed, dof(talker), joint_array(joints))


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


async def finished(talker: Talker, request_id: int, within: float) -> Outcome:
    """Wait for the one outcome of a request, with beats.

    Raises:
        RuleBroken: there is none, or more than one.
    """

    def ended() -> list[Outcome]:
        return [found for found in talker.all(Outcome) if found.request_id == request_id]

    async with talker.beating():
        if not await talker.until(lambda: bool(ended()), within):
            raise RuleBroken(f"request {request_id} was accepted, no outcome in {within:g} s")
        await talker.until(lambda: len(ended()) > 1, _AGAIN_WITHIN)
    if len(ended()) != 1:
        raise RuleBroken(f"request {request_id} had {len(ended())} outcomes")
    return ended()[0]


async def moved(
    talker: Talker, target: Target, goal: Sequence[float], speed: float = SPEED
) -> Outcome:
    """Move to a goal and return the outcome."""
    target.may_have_moved = True
    move = joint_move(talker, goal, speed)
    await talker.accepted(move, "a joint move")
    return await finished(talker, move.request_id, 20.0)


async def under_way(
    talker: Talker, target: Target, speed: float = SLOW
) -> tuple[tuple[float, ...], JointMove]:
    """Start a slow motion; return where it began and its request.

    Raises:
        CannotJudge: the robot does not move.
    """
    here = await standing(talker, target)
    move = joint_move(talker, aside(target, here), speed)
    target.may_have_moved = True
    await talker.accepted(move, "a slow joint move")
    if not await talker.until(lambda: distance(shown(talker), here) > ARRIVED, 5.0):
        raise CannotJudge("the robot did not move")
    return here, move


async def reset_and_return(target: Target, here: Sequence[float]) -> None:
    """Reset a latched stop and go back to where the robot was."""
    talker = await holder(target)
    await talker.until(lambda: talker.all(State)[-1].activity == Activity.IDLE, 3.0)
    await talker.accepted(ResetStop(talker.next_id()), "the reset of a stop")
    if distance(shown(talker), here) > ARRIVED:
        await moved(talker, target, here)


async def refused_or_stopped(
    talker: Talker, target: Target, move: JointMove, code: VerdictCode, what: str
) -> None:
    """Send a move that must be refused; a robot that sets out for it is stopped and brought back.

    Raises:
        RuleBroken: it is accepted, or refused for another reason.
    """
    here = shown(talker)
    found = await talker.verdict(move, what)
    if not found.code:
        target.may_have_moved = True
        await talker.accepted(SoftwareStop(talker.next_id(), "conformance"), "a stop")
        await target.close()
        await reset_and_return(target, here)
    if found.code != code:
        raise RuleBroken(f"{what}: verdict {found.code} ({found.text!r}), expected {code}")


def judge_states(talker: Talker, request_id: int) -> None:
    """See that the states shown during one motion belong to it and to each other.

    Raises:
        RuleBroken: a wrong request or activity, or velocities that do not lead where it went.
    """
    states = talker.all(State)
    activities = {state.activity for state in states}
    if Activity.MOVING not in activities or states[-1].activity != Activity.IDLE:
        raise RuleBroken(f"activities shown: {sorted(activities)}, at last {states[-1].activity}")
    for state in states:
        due = 0 if state.activity == Activity.IDLE else request_id
        if state.activity in (Activity.IDLE, Activity.MOVING) and state.request_id != due:
            raise RuleBroken(
                f"request {state.request_id} shown in activity {state.activity}, not {due}"
            )
    last = dof(talker) - 1
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


def judge_pace(target: Target, talker: Talker, outcome: Outcome, way: float) -> None:
    """See that a motion of the last joint took as long as its speed and its limit demand.

    Raises:
        RuleBroken: it was faster, or its duration is none.
    """
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
    fastest = _fastest(talker.all(State), dof(talker) - 1)
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
