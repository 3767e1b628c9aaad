"""Connection of the blocking client, its motions and jogs, and what is known of the cell."""

from __future__ import annotations

import asyncio
import contextlib
import ssl
from collections.abc import Callable, Coroutine, Iterator, Mapping
from types import TracebackType
from typing import Any, Self

from openpendant.simplemsg.pendant import Capability, HelloReply, State

from .client import DEFAULT_PORT, ConnectionLost, PendantClient, Pose
from .jog import Jog
from .loop_thread import LoopThread
from .management.calls import SyncCalls
from .management.groups import CellCalls
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
        """True once it has ended, for any reason."""
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
        """Account of how the robot came to rest; None during the jog."""
        return self._jog.account

    @property
    def is_over(self) -> bool:
        """True once the robot is at rest again, for any reason."""
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


class SyncSession(CellCalls, SyncCalls):
    """A connection on a thread of its own.

    Attributes:
        background: the client on the private thread.
    """

    def __init__(self, thread: LoopThread, background: PendantClient) -> None:
        """Use `connect` instead."""
        super().__init__(thread, background.manage)
        self.background = background

    @classmethod
    def connect(
        cls,
        host: str = "127.0.0.1",
        port: int = DEFAULT_PORT,
        *,
        client: str = "pendant",
        cell: str = "",
        state_rate: float = 25.0,
        tls: ssl.SSLContext | None = None,
        user: str = "",
        password: str | None = None,
        pairing: str | None = None,
    ) -> Self:
        """Connect, say hello and, where a secret is given, log in: as `PendantClient.connect`."""
        thread = LoopThread(f"pendant {client}")
        try:
            background = thread.call(
                PendantClient.connect(
                    host,
                    port,
                    client=client,
                    cell=cell,
                    state_rate=state_rate,
                    tls=tls,
                    user=user,
                    password=password,
                    pairing=pairing,
                )
            )
        except BaseException:
            thread.end()
            raise
        return cls(thread, background)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def close(self) -> None:
        """End the connection and its thread; what it was moving is stopped by the server.

        What other threads wait for fails with `ConnectionLost`, and so does every later call.
        """
        with contextlib.suppress(ConnectionLost):  # closed already, by this thread or another
            self._thread.call(self.background.close())
        self._thread.end()

    def login(self, user: str, *, password: str | None = None, pairing: str | None = None) -> None:
        """Log in with an account or as a guest; a stop never needs it."""
        self._thread.call(self.background.login(user, password=password, pairing=pairing))

    # What is known, without asking.

    @property
    def hello(self) -> HelloReply:
        """The server's hello reply."""
        return self.background.hello

    @property
    def state(self) -> State | None:
        """The newest state message, None before the first."""
        return self.background.state

    @property
    def in_control(self) -> bool:
        """True while this connection holds the motion authority, by the messages received."""
        return self.background.in_control

    def offers(self, capability: Capability) -> bool:
        """Return True if the server offers a capability to this connection."""
        return self.background.offers(capability)

    def joints(self) -> tuple[float, ...]:
        """Return the newest joint positions of the robot's own joints [rad, m]."""
        return self.background.joints()

    def tool_pose(self) -> Pose:
        """Return the newest tool pose in the base frame."""
        return self.background.tool_pose()

    # State and data.

    def subscribe(self, state_rate: float) -> None:
        """Choose the rate of state messages, Hz; 0 for none."""
        self._thread.call(self.background.subscribe(state_rate))

    def next_state(self) -> State:
        """Wait for the next state message."""
        return self._thread.call(self.background.next_state())

    def states(self) -> Iterator[State]:
        """Yield state messages as they come, the newest only: whoever is slow misses some."""
        seen: State | None = None
        while True:
            newest = self.background.state
            seen = self.next_state() if newest is None or newest is seen else newest
            yield seen

    def wait_until(self, condition: Callable[[State], bool], *, within: float = 10.0) -> State:
        """Wait for a state that meets a condition; it is judged on the private thread."""
        return self._thread.call(self.background.wait_until(condition, within=within))

    def manage(self, request: dict[str, Any]) -> dict[str, Any]:
        """Send a management request, a JSON object with its `op`, and return the answer."""
        return self._thread.call(self.background.manage(request))

    def _motion(self, begin: Coroutine[Any, Any, MotionHandle]) -> SyncMotion:
        return SyncMotion(self._thread, self._thread.call(begin))
