"""Jogs of the client: presses that are held, increments, and the way back.

The beats of a press come from the event loop that also runs the program. A program whose loop hangs
stops beating by nature, and the server brings the robot to rest within the declared deadline. That
is meant so: never move the beats to a thread of their own without a bound like `longest`.

A jog that is over stays over. A press that comes after its end would begin another motion, so none
is sent where this side knows of the end, or must assume it by its own clock.
"""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Mapping, Sequence
from types import TracebackType
from typing import Self

from openpendant.simplemsg.pendant import JogEnd, JogEnded, JogSpace, JogStep, JogUndo
from openpendant.simplemsg.pendant.management.cell import WayOut
from openpendant.simplemsg.verdicts import VerdictCode

from .connection_errors import Aborted, ConnectionLost, PendantError, Refused, WrongArgument
from .motions import JOG_ENDS, JogAccount, MotionHandle, PressHandle
from .observing import Observing
from .operating import BEAT_PERIOD
from .press import HeldPresses, JogValues, PressLine, slots
from .session import end_task


class Jog:
    """A jog by hold-to-run, as an async context manager.

    Entering presses, leaving releases and waits until the robot stands; `account` then tells how
    it came to rest. Where something else ended the jog (a stop, the enabling device, the link),
    leaving raises what it was. Once it is over, or this client must assume so (no beat left within
    the deadline), it moves nothing any more: make another.
    """

    def __init__(
        self,
        line: PressLine,
        aim: JogValues,
        deadline: float,
        longest: float | None,
    ) -> None:
        self._line = line
        self._first_aim = aim
        self._deadline = deadline
        self._longest = longest
        self._motion: PressHandle | None = None
        self._held = HeldPresses(line, deadline)
        self._taken_over: PressHandle | None = None
        self._aiming = asyncio.Lock()
        self._is_released = False
        self._until = 0.0
        self._beating: asyncio.Task[None] | None = None

    async def __aenter__(self) -> Self:
        self._touch()
        self._beating = self._begin_beats()
        try:
            await self._press(self._first_aim)
        except BaseException:
            self._held.let_go()
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
        """Account of how the robot came to rest; None during the jog."""
        return None if self._motion is None else self._motion.account

    @property
    def is_over(self) -> bool:
        """True once the robot is at rest again, for any reason."""
        return self._motion is not None and self._motion.is_over

    async def aim(self, joints: Mapping[int, float]) -> None:
        """Go on with other joints or speeds, smoothly; the key stays pressed.

        Args:
            joints: part of the jog speed by joint index, -1 to 1.

        Raises:
            Refused: a value is out of bounds; PRESS_DEAD, the jog is over; PRESS_STALE, no new
                state came within 0.25 s.
            Unanswered: no verdict came within 5 s; the jog was let go.
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
            Refused: a value is out of bounds, nobody knows the frame; PRESS_DEAD, the jog is over;
                PRESS_STALE, no new state came within 0.25 s.
            Unanswered: no verdict came within 5 s; the jog was let go.
            ConnectionLost: the connection ended.
        """
        await self._press(JogValues.of_tool((x, y, z, a, b, c), frame))

    async def hold(self, seconds: float) -> None:
        """Keep the key pressed for so long; returns early where it is released meanwhile.

        Raises:
            Aborted: something else ended the jog: a stop, or PRESS_DEAD, no beat in time.
            ConnectionLost: the connection ended.
        """
        self._begun()
        self._check_beaten()
        self._touch(seconds)
        end = asyncio.get_running_loop().time() + seconds
        try:
            await self._hold_until(end)
        finally:
            self._until = asyncio.get_running_loop().time()

    async def _hold_until(self, end: float) -> None:
        loop = asyncio.get_running_loop()
        while True:
            motion = self._begun()
            if not await motion.over_within(max(0.0, end - loop.time())):
                self._check_beaten()
                return
            if motion is not self._motion:
                continue  # another task aimed anew
            account = await motion.rested()
            if account.reason == JogEnd.RELEASED and self._is_released:
                return
            raise _aborted(self._held.why_given_up or JOG_ENDS[account.reason])

    async def release(self) -> JogAccount:
        """Let the key go and wait until the robot stands; a second call returns the same.

        Raises:
            Aborted: something else ended the jog.
            Unanswered: the server did not say within 35 s that the robot stands.
            ConnectionLost: the connection ended.
        """
        motion = self._begun()
        self._is_released = True
        if self._beating is not None:
            self._beating.cancel()
        # With a take-over under way either press may be the one that drives.
        rested = {motion.press} if motion.is_over else set()
        for press in self._held.unbeaten():
            if press in rested:
                continue
            try:
                await self._line.release(press)
            except Refused as refused:
                # It ended by itself, by silence or a stop; `rested` tells which.
                if refused.code != VerdictCode.NOTHING_TO_CONTROL:
                    raise
        async with self._aiming:
            self._motion = await self._held.newest(self._begun())
            return await self._motion.rested()

    def _begun(self) -> PressHandle:
        if self._motion is None:
            raise WrongArgument("the jog has not begun: use it as a context manager")
        return self._motion

    def _touch(self, seconds: float = 0.0) -> None:
        """Let the beats go on for `longest` after so many seconds from now."""
        self._until = max(self._until, asyncio.get_running_loop().time() + seconds)

    def _why_unbeaten(self) -> str:
        """Return why this side has let go of the press by itself; empty where it has not."""
        now = asyncio.get_running_loop().time()
        if self._held.why_given_up:
            return self._held.why_given_up
        if self._has_run_out(now):
            return f"nothing called it for {self._longest:g} s, and it let go"
        before = self._taken_over
        if before is not None and before.account is not None:
            if before.account.reason != JogEnd.REPLACED:
                return f"press {before.press} had ended before: {JOG_ENDS[before.account.reason]}"
        return self._held.why_late(now)

    def _has_run_out(self, now: float) -> bool:
        return self._longest is not None and now - self._until > self._longest

    def _check_beaten(self) -> None:
        """Raise where this side let go, though the end may not have been heard yet."""
        if not self._is_released and not self.is_over and (why := self._why_unbeaten()):
            raise _aborted(why)

    def _check_held(self) -> None:
        """Raise where a press would not take over from one that is held, but begin a motion."""
        motion = self._motion
        if motion is None:
            if self._is_released:
                raise _dead(JOG_ENDS[JogEnd.RELEASED])
            return
        self._line.check_link()
        if self._is_released:
            why = JOG_ENDS[JogEnd.RELEASED]
        elif motion.is_over and not self._held.why_given_up:
            why = JOG_ENDS[JogEnd.STOPPED if motion.account is None else motion.account.reason]
        else:
            why = self._why_unbeaten()
        if why:
            raise _dead(why)

    async def _press(self, aim: JogValues) -> None:
        """Send a press of this aim; it takes over from the one before."""
        if not self._has_run_out(asyncio.get_running_loop().time()):
            self._touch()  # the wait for a state and for the verdict is a call too
        async with self._aiming:
            state = await self._line.quotable_state()
            # Nothing is awaited between this look and the sending.
            self._check_held()
            self._touch()
            before = self._motion
            motion = await self._held.press(aim, state)
            self._motion, self._taken_over = motion, before
            why = self._why_unbeaten()
            if why and before is not None and not self._is_released:
                # The server had ended the jog, but we had not heard of it: this is a new motion.
                await self._withdraw(motion)
                raise _dead(why)

    async def _withdraw(self, motion: PressHandle) -> None:
        """Let go of a press that began a motion of its own, and wait until the robot stands."""
        self._held.unbeaten()
        with contextlib.suppress(PendantError):
            await self._line.release(motion.press)
        with contextlib.suppress(PendantError):
            await motion.rested()

    def _begin_beats(self) -> asyncio.Task[None] | None:
        return asyncio.get_running_loop().create_task(self._beat())

    async def _beat(self) -> None:
        loop = asyncio.get_running_loop()
        due = loop.time()
        with contextlib.suppress(ConnectionLost):
            while True:
                due = max(due + BEAT_PERIOD, loop.time())
                await asyncio.sleep(due - loop.time())
                if self._why_unbeaten():
                    return  # the server ends the press at its deadline
                self._held.beat(loop.time())


class FedJog(Jog):
    """A jog whose beats come from a device that beats by itself; no timer beats here.

    Whoever hears the device hands on each sign of it: `beat` while its key is down, `let_go` when
    it is not. A device that is unplugged, or a program that hears it no more, falls silent, and the
    server ends the press at its deadline.
    """

    def beat(self) -> None:
        """Send a beat of each held press, with the sign of the enabling device in front of it.

        Nothing leaves once the jog is over, or must be by now: no beat revives it.

        Raises:
            ConnectionLost: the connection ended.
        """
        if not self._is_released and not self._why_unbeaten():
            self._held.beat(asyncio.get_running_loop().time())

    def let_go(self) -> None:
        """Release at once, whether the server has answered the press or not.

        `release`, or the end of the context, waits until the robot stands.
        """
        self._is_released = True
        self._held.let_go()

    async def aim_at(self, values: Sequence[float], frame: str = "") -> None:
        """Go on along other axes, smoothly; the key stays pressed.

        Args:
            values: part of the jog speed, -1 to 1: (n,) by joint, or (6,) along x, y, z and about
                x, y, z of the frame.
            frame: base, tool or a named frame; empty for joints.

        Raises:
            Refused: as by `aim_tool`.
            Unanswered: no verdict came within 5 s; the jog was let go.
            ConnectionLost: the connection ended.
        """
        await self._press(_aim_of(values, frame))

    def _begin_beats(self) -> None:
        return None


def _aim_of(values: Sequence[float], frame: str) -> JogValues:
    space = JogSpace.TOOL if frame else JogSpace.JOINTS
    return JogValues(space, frame, tuple(values))


def _dead(why: str) -> Refused:
    return Refused(VerdictCode.PRESS_DEAD, f"the jog is over: {why}", -1, 0.0, 0.0)


def _aborted(why: str) -> Aborted:
    return Aborted(VerdictCode.PRESS_DEAD, f"the jog is over: {why}", -1, 0.0, 0.0)


DEFAULT_DEADLINE = 0.15
"""The server ends a press so long after its last beat, where nothing else is declared [s]."""


class Jogging(Observing):
    """Jogs. Speeds are parts of the cell's jog speed; angles are rad, lengths m."""

    _line: PressLine

    def _begin_work(self) -> None:
        self._line = PressLine(
            *(self._conversation, self._quotable_state, self.hello.dof),
            self._enabling_sign,
        )
        super()._begin_work()

    def _jog_ended(self, account: JogEnded) -> None:
        self._line.ended(account)

    def jog(
        self,
        joints: Mapping[int, float],
        *,
        deadline: float = DEFAULT_DEADLINE,
        longest: float | None = None,
    ) -> Jog:
        """Return a jog of one or several joints: `async with pendant.jog(joints={0: 0.5}):`.

        Args:
            joints: part of the jog speed by joint index from 0, -1 to 1.
            deadline: the robot ramps to rest so long after a beat was missed, 0.05 to 0.25 s, and
                in the manual modes no longer than the `enabling_deadline` that was declared.
            longest: let go by itself so long after the last call of `aim` or `hold` [s].

        Raises:
            WrongArgument: the robot has no such joint.
        """
        return self._jog(JogValues.of_joints(joints, self.hello.dof), deadline, longest)

    def jog_tool(
        self,
        *,
        x: float = 0.0,
        y: float = 0.0,
        z: float = 0.0,
        a: float = 0.0,
        b: float = 0.0,
        c: float = 0.0,
        frame: str = "base",
        deadline: float = DEFAULT_DEADLINE,
        longest: float | None = None,
    ) -> Jog:
        """Return a jog of the tool: `async with pendant.jog_tool(x=0.5, frame="tool"):`.

        Args:
            x: part of the jog speed along the frame's x axis, -1 to 1.
            y: likewise along y.
            z: likewise along z.
            a: part of the rotation speed about the frame's x axis, -1 to 1.
            b: likewise about y.
            c: likewise about z.
            frame: base, tool or a named frame.
            deadline: the robot ramps to rest so long after a beat was missed, 0.05 to 0.25 s.
            longest: let go by itself so long after the last call of `aim` or `hold` [s].
        """
        return self._jog(JogValues.of_tool((x, y, z, a, b, c), frame), deadline, longest)

    def jog_out(
        self, way: WayOut, *, deadline: float = DEFAULT_DEADLINE, longest: float | None = None
    ) -> Jog:
        """Return the jog of a key that `retreat` named.

        Args:
            way: one of its ways.
            deadline: the robot ramps to rest so long after a beat was missed, 0.05 to 0.25 s.
            longest: let go by itself so long after the last call of `aim` or `hold` [s].
        """
        values = way["values"]
        if way["space"] == JogSpace.TOOL:
            aim = JogValues.of_tool(tuple(values), way["frame"])
        else:
            aim = JogValues.of_joints(dict(enumerate(values)), self.hello.dof)
        return self._jog(aim, deadline, longest)

    def fed_jog(
        self, values: Sequence[float], *, frame: str = "", deadline: float = DEFAULT_DEADLINE
    ) -> FedJog:
        """Return a jog of a device that beats by itself: each sign of it is handed on by `beat`.

        Args:
            values: part of the jog speed, -1 to 1: (n,) by joint, or (6,) along x, y, z and about
                x, y, z of the frame.
            frame: base, tool or a named frame; empty for joints.
            deadline: the robot ramps to rest so long after the last beat, 0.05 to 0.25 s, and in
                the manual modes no longer than the `enabling_deadline` that was declared.
        """
        return FedJog(self._line, _aim_of(values, frame), deadline, None)

    def _jog(self, aim: JogValues, deadline: float, longest: float | None) -> Jog:
        return Jog(self._line, aim, deadline, longest)

    async def step(self, joints: Mapping[int, float], *, speed: float = 1.0) -> MotionHandle:
        """Move one or several joints by increments.

        Args:
            joints: increments by joint index from 0 [rad, m for a linear axis].
            speed: fraction of the jog speed, above 0, up to 1.

        Raises:
            Refused: out of range, not in control, the mode or the enabling device forbids it, …
            WrongArgument: the robot has no such joint.
            ConnectionLost: the connection ended.
        """
        return await self._step(JogValues.of_joints(joints, self.hello.dof), speed)

    async def step_tool(
        self,
        *,
        x: float = 0.0,
        y: float = 0.0,
        z: float = 0.0,
        a: float = 0.0,
        b: float = 0.0,
        c: float = 0.0,
        frame: str = "base",
        speed: float = 1.0,
    ) -> MotionHandle:
        """Move the tool by an increment, in a straight line.

        Args:
            x: increment along the frame's x axis [m].
            y: likewise along y.
            z: likewise along z.
            a: rotation about the frame's x axis [rad].
            b: likewise about y.
            c: likewise about z.
            frame: base, tool or a named frame.
            speed: fraction of the jog speed, above 0, up to 1.

        Raises:
            Refused: unreachable, nobody knows the frame, not in control, …
            ConnectionLost: the connection ended.
        """
        return await self._step(JogValues.of_tool((x, y, z, a, b, c), frame), speed)

    async def _step(self, by: JogValues, speed: float) -> MotionHandle:
        return await self._begin(
            lambda request_id: JogStep(
                request_id=request_id,
                speed=speed,
                space=by.space,
                frame=by.frame,
                value_count=len(by.values),
                values=slots(by.values),
            )
        )

    async def undo_jog(self, *, speed: float = 1.0) -> MotionHandle:
        """Move back along the way of the last jog or step.

        Raises:
            Refused: there is no jog to take back, not in control, …
            ConnectionLost: the connection ended.
        """
        return await self._begin(lambda request_id: JogUndo(request_id=request_id, speed=speed))
