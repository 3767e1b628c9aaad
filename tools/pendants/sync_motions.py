"""Motions and jogs of the blocking client."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Iterator, Mapping

from .jog import Jog
from .loop_thread import LoopThread
from .motions import JogAccount, MotionHandle, MotionResult


class SyncMotion:
    """A motion that the server accepted and began."""

    def __init__(self, thread: LoopThread, motion: MotionHandle) -> None:
        """Made by the client's move methods."""
        self._thread = thread
        self._motion = motion

    @property
    def request_id(self) -> int:
        """Its number."""
        return self._motion.request_id

    @property
    def is_over(self) -> bool:
        """Whether it has ended, one way or another."""
        return self._motion.is_over

    def done(self, *, within: float | None = None) -> MotionResult:
        """Wait until the motion ended; giving up the wait does not stop the robot.

        Args:
            within: wait at most so long [s]; None for as long as it takes.

        Raises:
            Aborted: the motion did not arrive.
            ConnectionLost: the connection ended first.
            TimeoutError: it goes on after `within`.
        """
        return self._thread.call(self._done(within))

    async def _done(self, within: float | None) -> MotionResult:
        return await asyncio.wait_for(self._motion.done(), within)


class SyncJog:
    """A jog that is held; made by `jog` and `jog_tool`, which are context managers."""

    def __init__(self, thread: LoopThread, jog: Jog) -> None:
        """Use `held` instead."""
        self._thread = thread
        self._jog = jog

    @classmethod
    @contextlib.contextmanager
    def held(cls, thread: LoopThread, jog: Jog) -> Iterator[SyncJog]:
        """Press, and release on the way out; only its account tells how the robot came to rest."""
        with thread.entered(jog, misses=lambda: jog.account is None):
            yield cls(thread, jog)

    @property
    def account(self) -> JogAccount | None:
        """How the robot came to rest; None while the jog goes on."""
        return self._jog.account

    @property
    def is_over(self) -> bool:
        """Whether the robot stands again, for whatever reason."""
        return self._jog.is_over

    def aim(self, joints: Mapping[int, float]) -> None:
        """Go on with other joints or speeds, smoothly: as `Jog.aim`."""
        self._thread.call(self._jog.aim(joints))

    def aim_tool(
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
        """Go on along and about other axes, smoothly: as `Jog.aim_tool`."""
        self._thread.call(self._jog.aim_tool(x=x, y=y, z=z, a=a, b=b, c=c, frame=frame))

    def hold(self, seconds: float) -> None:
        """Keep the key pressed for so long: as `Jog.hold`."""
        self._thread.call(self._jog.hold(seconds))

    def release(self) -> JogAccount:
        """Let the key go and wait until the robot stands."""
        return self._thread.call(self._jog.release())
