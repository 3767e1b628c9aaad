"""What the state port says, kept with its times, so that checks can judge it afterwards.

Owns the reading of joint positions and STATUS out of the stream, and the meaning of "stands". Knows
no motion and no verdicts.
"""

from __future__ import annotations

import asyncio
import itertools
import math
from collections import deque
from collections.abc import Callable, Sequence
from typing import NamedTuple

from openpendant.simplemsg import (
    JointFeedback,
    JointPosition,
    MessageFault,
    Status,
    TriState,
    ValidField,
)

from .news import News
from .wire import Frame, RuleBroken, Wire

STEADY = 2e-4
"""A joint that changes by less between reports stands [rad or m]; real encoders flicker."""

STEADY_FOR = 0.1
"""So long must it change by less before the robot counts as standing [s]."""

_HISTORY = 8192


class Heard(NamedTuple):
    """What is kept of a frame; a peer that sends large ones must not fill the memory.

    Attributes:
        time: when its last byte came [s].
        msg_type: message type.
        comm_type: communication type.
        reply_code: reply code.
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


class Joints(NamedTuple):
    """One report of joint values.

    Attributes:
        time: when it came [s].
        values: all ten slots [rad or m].
        sequence: what stands in front of them; 0 where nothing does.
    """

    time: float
    values: tuple[float, ...]
    sequence: int = 0


class Told(NamedTuple):
    """One STATUS.

    Attributes:
        time: when it came [s].
        status: what it said.
    """

    time: float
    status: Status


class Watch:
    """A state connection and what came on it.

    Attributes:
        wire: the connection.
        frames: the header of every frame, in order.
        positions: joint values of type 10.
        feedback: joint values with velocity, of type 15; the times are those of arrival.
        statuses: STATUS, type 13.
    """

    def __init__(self, wire: Wire, look: Callable[[Sequence[float]], None] | None = None) -> None:
        """Watch a connection from now on.

        Args:
            wire: the connection.
            look: told every reported position [rad or m].
        """
        self.wire = wire
        self._look = look
        self.began = asyncio.get_running_loop().time()
        self.frames: deque[Heard] = deque(maxlen=_HISTORY)
        self.positions: deque[Joints] = deque(maxlen=_HISTORY)
        self.feedback: deque[tuple[float, JointFeedback]] = deque(maxlen=_HISTORY)
        self.statuses: deque[Told] = deque(maxlen=_HISTORY)
        self._news = News()
        wire.listener = self._take

    def _take(self, frame: Frame) -> None:
        header = (frame.msg_type, frame.comm_type, frame.reply_code)
        self.frames.append(Heard(frame.time, *header, len(frame.data)))
        try:
            message = frame.codec.decode(frame.data)
        except MessageFault:
            self._news.came()
            return  # checks on framing look at `frames`
        match message:
            case JointPosition():
                self.positions.append(Joints(frame.time, message.joints, message.sequence))
                self._show(message.joints)
            case JointFeedback():
                self.feedback.append((frame.time, message))
                if message.valid_fields & ValidField.POSITION:
                    self._show(message.positions)
            case Status() if message.comm_type == 1:
                self.statuses.append(Told(frame.time, message))
        self._news.came()

    def _show(self, position: Sequence[float]) -> None:
        if self._look is not None:
            self._look(position)

    @property
    def joints(self) -> Sequence[Joints]:
        """Joint values from whatever message carries them, oldest first."""
        if self.positions:
            return self.positions
        return [
            Joints(time, message.positions)
            for time, message in self.feedback
            if message.valid_fields & ValidField.POSITION
        ]

    @property
    def position(self) -> tuple[float, ...]:
        """Where the joints are now, all slots.

        Raises:
            RuleBroken: nothing was reported yet.
        """
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
        """Wait until a condition on what came holds; tell whether it does."""
        return await self._news.until(condition, within)

    async def begin(self, within: float = 2.5) -> bool:
        """Wait for the first joint values and STATUS; tell whether both came."""
        return await self.until(lambda: bool(self.joints and self.statuses), within)

    def is_steady(self, since: float) -> bool:
        """Tell whether the joints have not changed, and reports came, for long enough.

        Args:
            since: reports before this time do not count [s].
        """
        joints = self.joints
        if not joints:
            return False
        newest = joints[-1]
        for report in reversed(joints):
            if report.time < since:
                return False
            if _distance(report.values, newest.values) > STEADY:
                return False
            if newest.time - report.time >= STEADY_FOR:
                return True
        return False

    def says_motion(self) -> bool:
        """Tell whether the last STATUS says that the robot moves."""
        return self.status is not None and self.status.in_motion == TriState.TRUE

    async def standstill(self, within: float) -> bool:
        """Wait until the robot stands by its joints and by its STATUS; tell whether it does."""
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
    """Return how often something came [Hz]; 0 for less than two times."""
    if len(times) < 2 or times[-1] <= times[0]:
        return 0.0
    return (len(times) - 1) / (times[-1] - times[0])


def longest_gap(times: Sequence[float]) -> float:
    """Return the longest pause between two times [s]; inf for less than two."""
    return max((b - a for a, b in itertools.pairwise(times)), default=math.inf)
