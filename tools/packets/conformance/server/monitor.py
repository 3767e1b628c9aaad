"""Monitor of the robot under test: the reports of its state port, and the fence around its start.

Owns the reading of joint positions and STATUS out of the stream, kept with their times so that
checks can judge them afterwards, the meaning of "stands", and the one way in which a check is cut
short: STOP leaves first, then the check is cancelled. Knows no verdicts; how STOP is sent is the
target's business.
"""

from __future__ import annotations

import asyncio
import itertools
import math
from collections import deque
from collections.abc import Callable, Coroutine, Sequence
from typing import Any, NamedTuple, TypeVar

from openpendant.simplemsg import (
    JointFeedback,
    JointPosition,
    MessageFault,
    Status,
    TriState,
    ValidField,
)

from ..check import RuleBroken
from .wire import Arrivals, ReceivedFrame, Wire

STEADY = 2e-4
"""A joint that changes by less between reports stands [rad or m]; real encoders flicker."""

STEADY_FOR = 0.1
"""So long must it change by less before the robot counts as standing [s]."""

_HISTORY = 8192


class FrameSummary(NamedTuple):
    """Header of a received frame; bodies are dropped, so that a peer cannot fill the memory.

    Attributes:
        time: when its last byte came [s].
        size: its length, prefix included [bytes].
    """

    time: float
    msg_type: int
    comm_type: int
    reply_code: int
    size: int

    def __str__(self) -> str:
        return (
            f"type {self.msg_type}, comm {self.comm_type}, code {self.reply_code},"
            f" {self.size} bytes"
        )


class ReportedJoints(NamedTuple):
    """One received report of joint values.

    Attributes:
        time: when it came [s].
        values: all ten slots [rad or m].
        sequence: what stands in front of them; 0 where nothing does.
    """

    time: float
    values: tuple[float, ...]
    sequence: int = 0


class ReportedStatus(NamedTuple):
    """One received STATUS.

    Attributes:
        time: when it came [s].
    """

    time: float
    status: Status


class Watch:
    """A state connection and the reports received on it.

    Attributes:
        positions: joint values of type 10.
        feedback: joint values with velocity, of type 15; the times are those of arrival.
        statuses: STATUS, type 13.
    """

    def __init__(self, wire: Wire, look: Callable[[Sequence[float]], None] | None = None) -> None:
        """Watch a connection from now on; `look` is told every reported position [rad or m]."""
        self.wire = wire
        self._look = look
        self.began = asyncio.get_running_loop().time()
        self.frames: deque[FrameSummary] = deque(maxlen=_HISTORY)
        self.positions: deque[ReportedJoints] = deque(maxlen=_HISTORY)
        self.feedback: deque[tuple[float, JointFeedback]] = deque(maxlen=_HISTORY)
        self.statuses: deque[ReportedStatus] = deque(maxlen=_HISTORY)
        self._news = Arrivals()
        wire.listener = self._take

    def _take(self, frame: ReceivedFrame) -> None:
        header = (frame.msg_type, frame.comm_type, frame.reply_code)
        self.frames.append(FrameSummary(frame.time, *header, len(frame.data)))
        try:
            message = frame.codec.decode(frame.data)
        except MessageFault:
            self._news.came()
            return  # checks on framing look at `frames`
        match message:
            case JointPosition():
                self.positions.append(ReportedJoints(frame.time, message.joints, message.sequence))
                self._show(message.joints)
            case JointFeedback():
                self.feedback.append((frame.time, message))
                if message.valid_fields & ValidField.POSITION:
                    self._show(message.positions)
            case Status() if message.comm_type == 1:
                self.statuses.append(ReportedStatus(frame.time, message))
        self._news.came()

    def _show(self, position: Sequence[float]) -> None:
        if self._look is not None:
            self._look(position)

    @property
    def joints(self) -> Sequence[ReportedJoints]:
        """Joint values from whatever message carries them, oldest first."""
        if self.positions:
            return self.positions
        return [
            ReportedJoints(time, message.positions)
            for time, message in self.feedback
            if message.valid_fields & ValidField.POSITION
        ]

    @property
    def position(self) -> tuple[float, ...]:
        """Present position of the joints, all slots; RuleBroken where nothing was reported yet."""
        if self.positions:
            return self.positions[-1].values
        if self.feedback:
            return self.feedback[-1][1].positions
        raise RuleBroken("the state port has reported no joint positions")

    @property
    def status(self) -> Status | None:
        """The last STATUS."""
        return self.statuses[-1].status if self.statuses else None

    async def until(self, condition: Callable[[], bool], within: float) -> bool:
        """Wait for a condition on the received reports; return True if it holds in time."""
        return await self._news.until(condition, within)

    async def begin(self, within: float = 2.5) -> bool:
        """Wait for the first joint values and STATUS; return True if both came."""
        return await self.until(lambda: bool(self.joints and self.statuses), within)

    def is_steady(self, since: float) -> bool:
        """Return True if reports came since a time [s], and the joints have not changed of late."""
        joints = self.joints
        if not joints:
            return False
        newest = joints[-1]
        for report in reversed(joints):
            if report.time < since:
                return False
            # At rest they are equal, which is seen sooner than how far apart they are.
            at_rest = report.values == newest.values
            if not at_rest and _distance(report.values, newest.values) > STEADY:
                return False
            if newest.time - report.time >= STEADY_FOR:
                return True
        return False

    def says_motion(self) -> bool:
        """Return True if the last STATUS says that the robot moves."""
        return self.status is not None and self.status.in_motion == TriState.TRUE

    async def standstill(self, within: float) -> bool:
        """Wait until the robot stands by joints and STATUS; return True if it does in time."""
        since = asyncio.get_running_loop().time() - STEADY_FOR
        return await self.until(lambda: self.is_steady(since) and not self.says_motion(), within)


def _distance(one: Sequence[float], other: Sequence[float]) -> float:
    return max(abs(a - b) for a, b in zip(one, other, strict=True))


def distance(one: Sequence[float], other: Sequence[float]) -> float:
    """Return the largest difference of two joint positions [rad or m]; inf where one is none."""
    if not all(map(math.isfinite, (*one, *other))):
        return math.inf  # a comparison with what is no number is false either way
    return _distance(one, other)


def rate(times: Sequence[float]) -> float:
    """Return the mean rate of some times of arrival [Hz]; 0 for less than two."""
    if len(times) < 2 or times[-1] <= times[0]:
        return 0.0
    return (len(times) - 1) / (times[-1] - times[0])


def longest_gap(times: Sequence[float]) -> float:
    """Return the longest pause between two times [s]; inf for less than two."""
    return max((b - a for a, b in itertools.pairwise(times)), default=math.inf)


_Result = TypeVar("_Result")

INTERRUPTED = "interrupted"
"""Text for a check that was cut short by a signal, or not started because of it."""


class MotionInterrupted(Exception):
    """The check was interrupted; the text says why."""


class Guard:
    """Fence of one run, and the one way to interrupt it.

    Attributes:
        is_interrupted: the user wants no more.
        fence: so far from `home` the robot may be [rad or m]; None while nobody looks.
        breaches: how often it was farther.
    """

    def __init__(self, stop: Callable[[], None]) -> None:
        self._stop = stop
        self._home: tuple[float, ...] = ()
        self._work: asyncio.Task[Any] | None = None
        self._reason = ""
        self.fence: float | None = None
        self.is_interrupted = False
        self.breaches = 0

    def put_up(self, home: tuple[float, ...], reach: float) -> None:
        """Put the fence around a position.

        Args:
            home: all ten slots [rad or m].
            reach: how far any joint may be from there [rad or m].
        """
        self._home, self.fence = home, reach

    def look(self, position: Sequence[float]) -> None:
        """Look at a reported position; break off where it is beyond the fence."""
        if self.fence is None or self._work is None or self._reason:
            return
        away = distance(position, self._home)
        if away > self.fence:
            self.breaches += 1
            self.break_off(
                f"the robot was {away:.4g} rad or m from where it stood at first, allowed are"
                f" {self.fence:.4g}; it was sent STOP"
            )

    def interrupt(self) -> None:
        """Interrupt the run: the present check ends, and no other is started."""
        self.is_interrupted = True
        self.break_off(INTERRUPTED)

    def break_off(self, reason: str) -> None:
        """Send STOP and cancel the present check, if there is one."""
        if self._work is None or self._reason:
            return
        self._reason = reason
        self._stop()
        self._work.cancel()

    async def over(self, work: Coroutine[Any, Any, _Result]) -> _Result:
        """Run a check; raise MotionInterrupted where it was interrupted."""
        self._reason = ""
        task: asyncio.Task[_Result] = asyncio.create_task(work)
        self._work = task
        try:
            return await task
        except asyncio.CancelledError:
            if self._reason:
                raise MotionInterrupted(self._reason) from None
            raise
        finally:
            self._work = None
