"""Small motions of one joint, from the present position and back.

Owns how far, how slowly and when the tester moves a robot: by the amplitude and no farther, after
making sure that the robot stands where it stood at first and says that it can move. Verdicts are
the checks' business.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from openpendant.simplemsg import JointTrajPt, TriState

from ..check import CannotJudge, RuleBroken
from .answers import STOP, is_taken
from .monitor import Watch, distance
from .target import FENCE_TOLERANCE, Target
from .wire import ReceivedFrame, Wire

ARRIVED = 0.005
"""So close to a goal the ROS-I action server counts a joint as arrived [rad or m]."""

ARRIVED_EXACTLY = 0.001
"""So close must a minimum controller come: docs/minimum-controller.md [rad or m]."""

LEAD_IN = 0.1
"""Duration of a first point, which is where the robot stands [s]."""

SPEED = 0.1
"""Speed of the tester's ordinary motions [rad/s or m/s], and their `velocity` field."""

STOP_WITHIN = 0.5
"""A robot that is told to stop stands so long after at the latest [s]; these motions are slow."""

VERY_SLOW = 60.0
"""Duration asked for where a robot is not to obey: one that does is seen and stopped first [s]."""

START_WITHIN = 3.0
"""Longest time from the last point of a trajectory to the start of its motion [s]."""

_READY_WITHIN = 12.0
_POINT_WITHIN = 4.0


class Restored(NamedTuple):
    """Result of bringing a robot back to its start.

    Attributes:
        reason: why it was not; empty where it was.
        away: how far from its start it was found standing [rad or m].
    """

    reason: str
    away: float


class Mover:
    """A motion connection and a state connection, ready to move one joint.

    Attributes:
        start: all slots where the robot stands [rad or m].
        goal: all slots with the joint moved by the amplitude [rad or m].
        arrival: so close to a goal counts as arrived [rad or m].
    """

    def __init__(
        self,
        wire: Wire,
        watch: Watch,
        start: tuple[float, ...],
        joint: int,
        way: float,
        arrival: float,
    ) -> None:
        self.arrival = arrival
        self.wire = wire
        self.watch = watch
        self.start = start
        self.joint = joint
        self.goal = shifted(start, joint, way)
        self._way = way

    @property
    def amplitude(self) -> float:
        """Distance of the goal [rad or m]."""
        return abs(self._way)

    def seconds(self, at_least: float) -> float:
        """Return a duration for the whole way that is not faster than the tester may move [s]."""
        return max(at_least, self.amplitude / SPEED)

    def between(self, part: float) -> tuple[float, ...]:
        """Return the position at a part of the way, 0 to 1."""
        return shifted(self.start, self.joint, part * self._way)

    def progress(self, position: Sequence[float]) -> float:
        """Return which part of the way to the goal a position is."""
        return (position[self.joint] - self.start[self.joint]) / self._way

    @property
    def has_left(self) -> bool:
        """True once the robot has visibly left its start."""
        return distance(self.watch.position, self.start) > 0.04 * self.amplitude

    async def point(
        self,
        sequence: int,
        joints: Sequence[float],
        duration: float,
        *,
        velocity: float = SPEED,
        within: float = _POINT_WITHIN,
    ) -> ReceivedFrame:
        """Send a point as a request and return the frame that answers it."""
        message = JointTrajPt(sequence, tuple(joints), velocity, duration)
        return await self.wire.ask(message, f"a point of sequence {sequence}", within)

    async def go(self, duration: float) -> None:
        """Send a point where the robot stands, then the goal; RuleBroken unless both are taken."""
        await self.accepted(0, self.start, LEAD_IN)
        await self.accepted(1, self.goal, duration)

    async def accepted(self, sequence: int, joints: Sequence[float], duration: float) -> None:
        """Send a point as a request; raise RuleBroken where it is refused or not answered."""
        reply = await self.point(sequence, joints, duration)
        if not is_taken(reply):
            raise RuleBroken(f"the point of sequence {sequence} was refused: {reply}")

    async def set_off(self, duration: float) -> None:
        """Send the robot to the goal and wait until it has visibly left, else raise CannotJudge."""
        try:
            await self.go(duration)
        except RuleBroken as error:
            raise CannotJudge(f"the robot could not be moved: {error}") from None
        if not await self.watch.until(lambda: self.has_left, START_WITHIN):
            raise CannotJudge("the robot did not move")

    async def rests_within(self, within: float) -> tuple[float, ...]:
        """Return where the robot comes to stand; RuleBroken where it is not at rest in time."""
        if not await self.watch.standstill(within):
            raise RuleBroken(f"the robot did not come to rest within {within:g} s")
        return self.watch.position

    async def stays(self, seconds: float, after: str, since: Sequence[float]) -> None:
        """Raise RuleBroken if the robot moves from where it is."""
        tolerance = 0.04 * self.amplitude
        if await self.watch.until(
            lambda: distance(self.watch.position, since) > tolerance, seconds
        ):
            off = distance(self.watch.position, since)
            raise RuleBroken(f"after {after} the robot moved by {off:.4g} rad or m")


def shifted(position: Sequence[float], joint: int, way: float) -> tuple[float, ...]:
    """Return a position with one joint moved [rad or m]."""
    return tuple(value + way * (slot == joint) for slot, value in enumerate(position))


async def ready(target: Target) -> Mover:
    """Connect to a robot that stands at its first position; bring it back there if need be.

    Raises:
        CannotJudge: the robot may not be moved, or is not ready.
    """
    if target.home is None:
        raise CannotJudge("without joint positions on a state port nobody can see a motion")
    if target.blocked:
        raise CannotJudge(f"the robot is not where it was: {target.blocked}")
    watch, wire = await target.state(), await target.motion()
    if not await watch.begin():
        raise CannotJudge("the state port does not report joint positions and STATUS")
    await _go_home(target, wire, watch)
    target.may_have_moved = True
    joint = target.moved_joint
    if joint is None:
        joint = target.moved_joint = _joint_to_move(target, target.home)
    way = _direction(target, target.home[joint], joint) * target.options.amplitude
    arrival = ARRIVED_EXACTLY if target.is_minimum else ARRIVED
    return Mover(wire, watch, watch.position, joint, way, arrival)


async def _go_home(target: Target, wire: Wire, watch: Watch) -> None:
    """Wait for a robot that stands and can move, and bring it to its start."""
    if not await watch.standstill(_READY_WITHIN):
        raise CannotJudge("the robot does not stand, or its STATUS says that it moves")
    await _wait_until_possible(watch)
    await _bring_home(target, wire, watch)


async def _wait_until_possible(watch: Watch) -> None:
    def possible() -> bool:
        return watch.status is not None and watch.status.motion_possible != TriState.FALSE

    if not await watch.until(possible, 3.0):
        code = watch.status.error_code if watch.status else 0
        raise CannotJudge(f"the robot says that motion is not possible, error code {code}")


async def _bring_home(target: Target, wire: Wire, watch: Watch) -> None:
    """Move the robot back to where it stood at first, if the tester has moved it."""
    assert target.home is not None
    away = distance(watch.position, target.home)
    if away <= ARRIVED / 5:
        return
    if not away <= 2 * target.options.amplitude + ARRIVED:
        raise CannotJudge(
            f"the robot stands {away:.4g} rad or m from where it was; the tester leaves it there"
        )
    there = watch.position
    for sequence, joints, seconds in (
        (0, there, LEAD_IN / 2),
        (1, target.home, max(0.25, away / SPEED)),
    ):
        message = JointTrajPt(sequence, joints, SPEED, seconds)
        reply = await wire.ask(message, "a point of the way back", _POINT_WITHIN)
        if not is_taken(reply):
            raise CannotJudge(f"the robot refuses the way back to its start: {reply}")
    await watch.until(lambda: distance(watch.position, there) > away / 4, START_WITHIN)
    await watch.standstill(_READY_WITHIN)
    left = distance(watch.position, target.home)
    if left > ARRIVED:
        raise CannotJudge(f"the robot did not come back to its start: {left:.4g} rad or m are left")


def _joint_to_move(target: Target, home: Sequence[float]) -> int:
    if target.options.joint is not None:
        return target.options.joint
    limits, amplitude = target.options.limits, target.options.amplitude
    for joint in reversed(range(target.dof)):
        if limits is None or limits.upper[joint] - limits.lower[joint] > 2 * amplitude:
            return joint
    raise CannotJudge(f"no joint can be moved by {amplitude:g} rad or m inside its range")


def _direction(target: Target, value: float, joint: int) -> float:
    """Return the sign of the way that leads to the middle of the range, or towards 0."""
    limits = target.options.limits
    middle = 0.0 if limits is None else (limits.lower[joint] + limits.upper[joint]) / 2
    return math.copysign(1.0, middle - value)


async def restore(target: Target) -> Restored:
    """Stop the robot, wait until it stands and bring it back to its start."""
    if target.home is None:
        return Restored("", 0.0)  # nobody could see it move, so nothing was moved on these ports
    away = 0.0
    target.guard.fence = None
    try:
        watch = await target.state()
        wire = await target.motion()
        await watch.begin()
        if not await watch.standstill(0.5):
            wire.send(STOP)
            await wire.poll(1.0)
        if not await watch.standstill(_READY_WITHIN):
            wire.send(STOP)
        away = distance(watch.position, target.home)
        # From wherever it stands the way leads home, and not farther off.
        target.guard.put_up(target.home, max(target.reach, away + FENCE_TOLERANCE))
        await _go_home(target, wire, watch)
        target.may_have_moved = False
    except (CannotJudge, RuleBroken) as error:
        return Restored(str(error), away)
    finally:
        await target.close()
    return Restored("", away)
