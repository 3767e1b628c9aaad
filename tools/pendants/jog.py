"""A press that is held: beats by itself, can be aimed anew, is released on the way out.

The beats come from the event loop that also runs the program. A program whose loop hangs stops
beating by nature, and the server brings the robot to rest within the declared deadline. That is
meant so: never move the beats to a thread of their own without a bound like `longest`.
"""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Mapping
from types import TracebackType
from typing import Self

from openpendant.simplemsg.verdicts import VerdictCode

from .failures import ConnectionLost, PendantError, Refused, WrongArgument
from .joint_values import JogValues
from .motions import JogAccount, PressHandle
from .operating import BEAT_PERIOD
from .press_line import PressLine
from .session import end_task


class Jog:
    """A jog by hold-to-run, as an async context manager.

    Entering presses, leaving releases and waits until the robot stands; `account` then tells how
    it came to rest. Where something else ended the jog (a stop, the enabling device, the link),
    leaving raises what it was.
    """

    def __init__(
        self,
        line: PressLine,
        aim: JogValues,
        deadline: float,
        longest: float | None,
    ) -> None:
        """Made by `PendantClient.jog` and `jog_tool`."""
        self._line = line
        self._first_aim = aim
        self._deadline = deadline
        self._longest = longest
        self._motion: PressHandle | None = None
        # While one press takes over from another, both are beaten: the server may refuse the new.
        self._beats: dict[int, int] = {}
        self._until = 0.0
        self._beating: asyncio.Task[None] | None = None

    async def __aenter__(self) -> Self:
        self._touch()
        self._beating = asyncio.get_running_loop().create_task(self._beat())
        try:
            await self._press(self._first_aim)
        except BaseException:
            await end_task(self._beating)
            raise
        return self

    async def __aexit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if kind is None:
            await self.release()
            return
        with contextlib.suppress(PendantError):
            await self.release()

    @property
    def account(self) -> JogAccount | None:
        """How the robot came to rest; None while the jog goes on."""
        return None if self._motion is None else self._motion.account

    @property
    def is_over(self) -> bool:
        """Whether the robot stands again, for whatever reason."""
        return self._motion is not None and self._motion.is_over

    async def aim(self, joints: Mapping[int, float]) -> None:
        """Go on with other joints or speeds, smoothly; the key stays pressed.

        Args:
            joints: part of the jog speed by joint index, -1 to 1.

        Raises:
            Refused: a value is out of bounds, or the jog is over.
            ConnectionLost: the connection ended.
        """
        await self._press(JogValues.of_joints(joints, self._line.dof))

    async def aim_tool(
        self,
        *,
        x: float = 0.0,
        y: float = 0.0,
        z: float = 0.0,
        a: float = 0.0,
        b: float = 0.0,
        c: float = 0.0,
        frame: str = "base",
    ) -> None:
        """Go on along and about other axes, smoothly; the key stays pressed.

        Args:
            x: part of the jog speed along the frame's x axis, -1 to 1.
            y: likewise along y.
            z: likewise along z.
            a: part of the rotation speed about the frame's x axis, -1 to 1.
            b: likewise about y.
            c: likewise about z.
            frame: base, tool or a named frame.

        Raises:
            Refused: a value is out of bounds, nobody knows the frame, or the jog is over.
            ConnectionLost: the connection ended.
        """
        await self._press(JogValues.of_tool((x, y, z, a, b, c), frame))

    async def hold(self, seconds: float) -> None:
        """Keep the key pressed for so long.

        Raises:
            Aborted: something else ended the jog meanwhile.
            ConnectionLost: the connection ended.
        """
        if self._motion is None:
            raise WrongArgument("the jog has not begun: use it as a context manager")
        self._touch(seconds)
        if await self._motion.over_within(seconds):
            await self._motion.done()

    async def release(self) -> JogAccount:
        """Let the key go and wait until the robot stands; a second call returns the same.

        Raises:
            Aborted: something else ended the jog.
            ConnectionLost: the connection ended.
        """
        motion = self._motion
        if motion is None:
            raise WrongArgument("the jog has not begun: use it as a context manager")
        if self._beating is not None:
            self._beating.cancel()
        if not motion.is_over:
            try:
                await self._line.release(motion.press)
            except Refused as refused:
                # It ended by itself, by silence or a stop; `rested` tells which.
                if refused.code != VerdictCode.NOTHING_TO_CONTROL:
                    raise
        return await motion.rested()

    def _touch(self, seconds: float = 0.0) -> None:
        """Let the beats go on for `longest` after so many seconds from now."""
        self._until = asyncio.get_running_loop().time() + seconds

    async def _press(self, aim: JogValues) -> None:
        """Send a press of this aim; it takes over from the one before."""
        press = self._line.next_press()
        earlier = list(self._beats)
        self._beats[press] = 0
        try:
            self._motion = await self._line.press(press, aim, self._deadline)
        except BaseException:
            self._beats.pop(press)
            raise
        for dead in earlier:
            self._beats.pop(dead, None)
        self._touch()

    async def _beat(self) -> None:
        loop = asyncio.get_running_loop()
        due = loop.time()
        with contextlib.suppress(ConnectionLost):
            while True:
                due = max(due + BEAT_PERIOD, loop.time())
                await asyncio.sleep(due - loop.time())
                if self._longest is not None and loop.time() - self._until > self._longest:
                    return  # the server ends the press at its deadline
                for press in self._beats:
                    self._beats[press] += 1
                    self._line.beat(press, self._beats[press])
