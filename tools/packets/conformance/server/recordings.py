"""Recorded motions: each is made once and judged by many checks.

A robot should not be moved for every question. Owns what is done to the robot in each recording and
what is kept of it; the checks only look.
"""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Sequence
from dataclasses import dataclass
from typing import TypeVar

from openpendant.simplemsg import CommType, JointFeedback, MsgType, Ping

from ..check import CannotJudge
from .answers import STOP
from .monitor import STEADY, FrameSummary, ReportedJoints, ReportedStatus, distance
from .moving import LEAD_IN, SPEED, START_WITHIN, Mover, ready
from .target import Target
from .wire import ReceivedFrame, raw_frame

SAMPLE = 2.2
"""Time for which the state port is observed at rest [s]."""

SLOW = 2.0
"""Duration of a motion that is to be interrupted [s]."""

UNDISTURBED = 1.5
"""Duration of a motion that is not, at least: long enough to tell its pace [s]."""

LOSS_SEEN = 0.8
"""So long after the loss of a link the robot is judged, before a new link is made [s]."""

_Made = TypeVar("_Made")

_SETTLING = 0.3
_SPEED_OVER = 0.05


@dataclass(frozen=True, slots=True)
class Sample:
    """Reports of a resting robot's state port within `SAMPLE` seconds.

    Attributes:
        opened: when the connection was made [s].
        feedback: type 15 with its times of arrival.
        stray: bytes that are no frame.
    """

    opened: float
    frames: tuple[FrameSummary, ...]
    joints: tuple[ReportedJoints, ...]
    feedback: tuple[tuple[float, JointFeedback], ...]
    statuses: tuple[ReportedStatus, ...]
    stray: bytes


@dataclass(frozen=True, slots=True)
class RecordedMotion:
    """One recorded motion.

    Attributes:
        start: all slots before it [rad or m].
        goal: all slots where it should have ended.
        duration: what was asked for [s].
        sent: when the last point was sent [s].
        event: when the motion was interrupted, or when the last point was answered [s].
        event_reply: answer to the interruption; None where there was none.
        joints: joint values from just before it to the end.
    """

    joint: int
    start: tuple[float, ...]
    goal: tuple[float, ...]
    duration: float
    sent: float
    event: float
    replies: tuple[ReceivedFrame, ...]
    event_reply: ReceivedFrame | None
    joints: tuple[ReportedJoints, ...]
    feedback: tuple[tuple[float, JointFeedback], ...]
    statuses: tuple[ReportedStatus, ...]

    @property
    def tolerance(self) -> float:
        """Least distance that counts as motion [rad or m]."""
        return 0.04 * abs(self.goal[self.joint] - self.start[self.joint])

    @property
    def end(self) -> tuple[float, ...]:
        """Last reported position of the robot."""
        return self.joints[-1].values

    def progress(self, position: Sequence[float]) -> float:
        """Return which part of the way to the goal a position is."""
        start, goal = self.start[self.joint], self.goal[self.joint]
        return (position[self.joint] - start) / (goal - start)

    def moving(self, by: float | None = None) -> tuple[ReportedJoints, ...]:
        """Return the reports between leaving the start and being where the robot ended.

        Args:
            by: what counts as away from either [rad or m]; `tolerance` by default.
        """
        by = self.tolerance if by is None else by
        away = [n for n, at in enumerate(self.joints) if distance(at.values, self.start) > by]
        left = [n for n, at in enumerate(self.joints) if distance(at.values, self.end) > by]
        if not away or not left:
            return ()
        return self.joints[away[0] : left[-1] + 1]

    def visibly_moving(self) -> tuple[ReportedJoints, ...]:
        """Return the reports from first to last visible motion; CannotJudge where nothing moved."""
        self.must_have_moved()
        return self.moving(2 * STEADY)

    def speed_before(self, time: float) -> float:
        """Return the joint's speed in the quarter of a second before a time [rad/s or m/s]."""
        before = [at for at in self.joints if time - 0.25 <= at.time <= time]
        if len(before) < 2:
            raise CannotJudge("the state port is too slow to see the speed before")
        way = abs(before[-1].values[self.joint] - before[0].values[self.joint])
        return way / (before[-1].time - before[0].time)

    def must_have_moved(self) -> tuple[ReportedJoints, ...]:
        """Return `moving`; raise CannotJudge where nothing moved."""
        moving = self.moving()
        if len(moving) < 2:
            raise CannotJudge("no motion was reported; MS02 says so")
        return moving

    def fastest(self, since: float) -> float:
        """Return the largest speed of the joint since a time, over 50 ms each [rad/s or m/s]."""
        reports = [at for at in self.joints if at.time >= since]
        fastest = 0.0
        for report in reports:
            earlier = [at for at in reports if at.time <= report.time - _SPEED_OVER]
            if earlier:
                way = abs(report.values[self.joint] - earlier[-1].values[self.joint])
                fastest = max(fastest, way / (report.time - earlier[-1].time))
        return fastest

    def at(self, time: float) -> tuple[float, ...]:
        """Return the joint values of the last report up to a time."""
        before = [report.values for report in self.joints if report.time <= time]
        return before[-1] if before else self.joints[0].values


async def sample(target: Target) -> Sample:
    """Listen to the state port of a resting robot."""
    watch = await target.state()
    await asyncio.sleep(SAMPLE)
    return Sample(
        watch.began,
        tuple(watch.frames),
        tuple(watch.joints),
        tuple(watch.feedback),
        tuple(watch.statuses),
        watch.wire.stray,
    )


async def reference(target: Target) -> RecordedMotion:
    """Move to the goal by two points, undisturbed."""
    mover = await ready(target)
    watch, duration = mover.watch, max(UNDISTURBED, mover.amplitude / SPEED)
    replies = [await mover.point(0, mover.start, LEAD_IN)]
    sent = _now()
    replies.append(await mover.point(1, mover.goal, duration))
    answered = _now()
    await watch.until(lambda: mover.has_left, START_WITHIN)
    await watch.standstill(duration + 4)
    await asyncio.sleep(_SETTLING)
    return _motion(mover, duration, sent, answered, replies, None)


async def must_be_slow(target: Target) -> None:
    """Raise CannotJudge unless the robot is seen to move as slowly as it is asked to."""
    motion = await undisturbed(target)
    moving = motion.must_have_moved()
    if moving[-1].time - moving[0].time < 0.4 * motion.duration:
        raise CannotJudge(
            "the robot does not keep to durations, so no way out of its range is slow"
        )


async def stopped(target: Target) -> RecordedMotion:
    """Send STOP in the middle of a slow motion."""
    mover = await ready(target)
    await mover.set_off(SLOW)
    # In the middle of the way, so that motion onward and motion back would both show.
    await mover.watch.until(lambda: mover.progress(mover.watch.position) > 0.2, SLOW)
    sent = _now()
    mover.wire.send(STOP)
    reply = await mover.wire.poll(1.0)
    await _wait_until(sent + 1.2)
    return _motion(mover, SLOW, sent, sent, [], reply)


@dataclass(frozen=True, slots=True)
class Questions:
    """Replies of a moving robot's controller.

    Attributes:
        ping: the answer to a PING; None where there was none within half a second.
        status: the answer to a request for STATUS, if one was sent; None where there was none.
    """

    ping: ReceivedFrame | None
    status: ReceivedFrame | None
    was_moving: bool


async def questioned(target: Target) -> Questions:
    """Ask in the middle of a slow motion."""
    mover = await ready(target)
    await mover.set_off(SLOW)
    before = mover.watch.position
    mover.wire.send(Ping())
    ping = await mover.wire.poll(0.5)
    status = None
    if not target.is_minimum:
        mover.wire.send(raw_frame(mover.wire.codec, MsgType.STATUS, CommType.REQUEST))
        status = await mover.wire.poll(0.5)
    await asyncio.sleep(0.2)
    was_moving = distance(mover.watch.position, before) > 2 * STEADY
    return Questions(ping, status, was_moving)


async def lost(target: Target) -> RecordedMotion:
    """Close the motion connection in the middle of a slow motion, and connect again later."""
    mover = await ready(target)
    await mover.set_off(SLOW)
    event = _now()
    mover.wire.close()
    await _wait_until(event + LOSS_SEEN)
    wire = await target.motion()
    wire.send(target.probe.message)
    reply = await wire.poll(1.0)
    await _wait_until(event + LOSS_SEEN + 0.6)
    return _motion(mover, SLOW, event, event, [], reply)


async def lost_by_reset(target: Target) -> RecordedMotion:
    """End the motion connection by a TCP reset in the middle of a slow motion."""
    mover = await ready(target)
    await mover.set_off(SLOW)
    event = _now()
    mover.wire.reset()
    await _wait_until(event + LOSS_SEEN)
    return _motion(mover, SLOW, event, event, [], None)


async def _wait_until(time: float) -> None:
    await asyncio.sleep(max(0.0, time - _now()))


def _motion(
    mover: Mover,
    duration: float,
    sent: float,
    event: float,
    replies: Sequence[ReceivedFrame],
    event_reply: ReceivedFrame | None,
) -> RecordedMotion:
    watch = mover.watch
    return RecordedMotion(
        mover.joint,
        mover.start,
        mover.goal,
        duration,
        sent,
        event,
        tuple(replies),
        event_reply,
        tuple(watch.joints),
        tuple(watch.feedback),
        tuple(watch.statuses),
    )


def _now() -> float:
    return asyncio.get_running_loop().time()


def _once(
    name: str, make: Callable[[Target], Awaitable[_Made]]
) -> Callable[[Target], Awaitable[_Made]]:
    """Return what makes an observation once in a run, and gives it to every check that asks."""

    async def made(target: Target) -> _Made:
        return await target.once(name, make)

    return made


at_rest = _once("the state at rest", sample)
undisturbed = _once("a motion", reference)
stopped_motion = _once("a stopped motion", stopped)
lost_link = _once("a lost link", lost)
reset_link = _once("a reset link", lost_by_reset)
asked_in_motion = _once("answers in motion", questioned)
