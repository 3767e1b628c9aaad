"""The client library for programs without asyncio: notebooks, scripts, other languages' bridges.

    with SyncPendantClient.connect("127.0.0.1", 11010, client="notebook") as pendant:
        with pendant.control():
            pendant.move_joints([0.0, -1.2, 1.2, -1.5, -1.5, 0.0], speed=0.2).done()

Every call has the name, the arguments and the errors of `PendantClient`, and blocks. The connection
lives on a thread of its own, so its beats go on while your program computes, and would go on while
it hangs: therefore a jog lets go by itself (`longest`), unless the program calls it again.
"""

from __future__ import annotations

import asyncio
import contextlib
import ssl
from collections.abc import Callable, Coroutine, Iterator
from functools import wraps
from inspect import signature
from types import TracebackType
from typing import Any, Concatenate, Generic, ParamSpec, Self, TypeVar

from openpendant.simplemsg.pendant import AuthorityWanted, Capability, HelloReply, State
from openpendant.simplemsg.pendant.management.cell import ServedCells

from .client import DEFAULT_PORT, ConnectionLost, EnablingDevice, PendantClient, Pose
from .jog import Jog
from .loop_thread import LoopThread
from .management.calls import SyncCalls, then
from .management.groups import GroupedCalls, ProgramCalls, RecordingCalls
from .managing import PlaybackHandle
from .motions import JogAccount, MotionHandle, MotionResult
from .session import LONGEST_SILENCE

LONGEST_JOG = 2.0
"""A jog lets go by itself so long after the program's last call [s]."""

_Arguments = ParamSpec("_Arguments")
_Result = TypeVar("_Result")
_Asked = TypeVar("_Asked")
_AskedByOne = TypeVar("_AskedByOne", covariant=True)


class OnThread(Generic[_AskedByOne]):
    """An object that asks another, which lives on a thread with an event loop."""

    _thread: LoopThread
    _asked: _AskedByOne


def _waits(
    call: Callable[Concatenate[_Asked, _Arguments], Coroutine[Any, Any, _Result]],
) -> Callable[Concatenate[OnThread[_Asked], _Arguments], _Result]:
    """Return an asynchronous call as one that blocks."""

    @wraps(call)
    def waiting(
        this: OnThread[_Asked], /, *arguments: _Arguments.args, **named: _Arguments.kwargs
    ) -> _Result:
        return this._thread.call(call(this._asked, *arguments, **named))

    return waiting


def _begins(
    call: Callable[Concatenate[_Asked, _Arguments], Coroutine[Any, Any, MotionHandle]],
) -> Callable[Concatenate[OnThread[_Asked], _Arguments], SyncMotion]:
    """Return a call that begins a motion as one that blocks until then."""

    @wraps(call)
    def begin(
        this: OnThread[_Asked], /, *arguments: _Arguments.args, **named: _Arguments.kwargs
    ) -> SyncMotion:
        return SyncMotion(this._thread, this._thread.call(call(this._asked, *arguments, **named)))

    begin.__annotations__ = {**call.__annotations__, "return": SyncMotion}
    return begin


def _holds(
    call: Callable[Concatenate[_Asked, _Arguments], Jog],
) -> Callable[
    Concatenate[OnThread[_Asked], _Arguments], contextlib.AbstractContextManager[SyncJog]
]:
    """Return a call that makes a jog as one that presses for the length of a context."""

    @wraps(call)
    def hold(
        this: OnThread[_Asked], /, *arguments: _Arguments.args, **named: _Arguments.kwargs
    ) -> contextlib.AbstractContextManager[SyncJog]:
        named.setdefault("longest", LONGEST_JOG)
        return SyncJog.held(this._thread, call(this._asked, *arguments, **named))

    told = signature(call)
    longest = told.parameters["longest"].replace(default=LONGEST_JOG)
    parameters = {**told.parameters, "longest": longest}
    vars(hold)["__signature__"] = told.replace(parameters=list(parameters.values()))
    returned = contextlib.AbstractContextManager[SyncJog]
    hold.__annotations__ = {**call.__annotations__, "return": returned}
    return hold


class SyncMotion:
    """A motion that the server accepted and began."""

    def __init__(self, thread: LoopThread, motion: MotionHandle) -> None:
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
        return self._thread.call(asyncio.wait_for(self._motion.done(), within))


class SyncPlayback(SyncMotion):
    """A recording that is played back, which has begun."""

    def __init__(self, thread: LoopThread, motion: PlaybackHandle) -> None:
        super().__init__(thread, motion)
        self.account = motion.account


class SyncJog(OnThread[Jog]):
    """A jog that is held; made by `jog` and `jog_tool`, which are context managers."""

    def __init__(self, thread: LoopThread, jog: Jog) -> None:
        self._thread = thread
        self._asked = jog

    @classmethod
    @contextlib.contextmanager
    def held(cls, thread: LoopThread, jog: Jog) -> Iterator[SyncJog]:
        """Press, and release on the way out; only its account tells how the robot came to rest."""
        with thread.entered(jog, misses=lambda: jog.account is None):
            yield cls(thread, jog)

    @property
    def account(self) -> JogAccount | None:
        """Account of how the robot came to rest; None during the jog."""
        return self._asked.account

    @property
    def is_over(self) -> bool:
        """True once the robot is at rest again, for any reason."""
        return self._asked.is_over

    aim = _waits(Jog.aim)
    aim_tool = _waits(Jog.aim_tool)
    hold = _waits(Jog.hold)
    release = _waits(Jog.release)


class SyncPrograms(ProgramCalls[SyncCalls]):
    """Stored programs.

    Attributes:
        run: runs one, or a step of it; the client's `run_program`.
    """

    def __init__(self, way: SyncCalls, client: SyncPendantClient) -> None:
        super().__init__(way)
        self.run = client.run_program


class SyncRecordings(RecordingCalls[SyncCalls]):
    """Recordings.

    Attributes:
        play: plays one back; returns once the motion has begun, and its `done` tells the end.
    """

    def __init__(self, thread: LoopThread, background: PendantClient) -> None:
        super().__init__(SyncCalls(thread, background.manage))

        def begun(playback: Coroutine[Any, Any, PlaybackHandle]) -> SyncPlayback:
            return SyncPlayback(thread, thread.call(playback))

        self.play = then(background.recordings.play, begun)


class SyncPendantClient(GroupedCalls[SyncCalls], OnThread[PendantClient]):
    """One connection to a pendant server, with blocking calls.

    Safe to share between threads: each call waits for its own answer. Where one thread closes it,
    the calls of the others fail with `ConnectionLost`. Callbacks are those of `background`, and
    run on its thread: they must not block, nor call this client.

    Attributes:
        background: the client on the private thread.
    """

    def __init__(self, thread: LoopThread, background: PendantClient) -> None:
        way = SyncCalls(thread, background.manage)
        super().__init__(way)
        self._thread = thread
        self.background = self._asked = background
        self.programs = SyncPrograms(way, self)
        self.recordings = SyncRecordings(thread, background)

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
        strict: bool = False,
        user: str = "",
        password: str | None = None,
        pairing: str | None = None,
        enabling_deadline: float = LONGEST_SILENCE,
        notices: bool = False,
        language: str = "",
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
                    strict=strict,
                    user=user,
                    password=password,
                    pairing=pairing,
                    enabling_deadline=enabling_deadline,
                    notices=notices,
                    language=language,
                )
            )
        except BaseException:
            thread.end()
            raise
        return cls(thread, background)

    @staticmethod
    def lobby(
        host: str = "127.0.0.1", port: int = DEFAULT_PORT, *, tls: ssl.SSLContext | None = None
    ) -> ServedCells:
        """Return which cells a server has, without a hello: as `PendantClient.lobby`."""
        thread = LoopThread("lobby")
        try:
            return thread.call(PendantClient.lobby(host, port, tls=tls))
        finally:
            thread.end()

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

    login = _waits(PendantClient.login)
    declare = _waits(PendantClient.declare)

    @property
    def hello(self) -> HelloReply:
        """The server's hello reply."""
        return self.background.hello

    @property
    def state(self) -> State | None:
        """The newest state message, None before the first."""
        return self.background.state

    @property
    def ramp_time(self) -> float | None:
        """How long the robot may take to come to rest after a press ended [s]; None before told."""
        return self.background.ramp_time

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

    subscribe = _waits(PendantClient.subscribe)
    next_state = _waits(PendantClient.next_state)
    wait_until = _waits(PendantClient.wait_until)
    manage = _waits(PendantClient.manage)

    def states(self) -> Iterator[State]:
        """Yield state messages as they come, the newest only: whoever is slow misses some."""
        seen: State | None = None
        while True:
            newest = self.background.state
            seen = self.next_state() if newest is None or newest is seen else newest
            yield seen

    issue_pairing_code = _waits(PendantClient.issue_pairing_code)
    end_pairing = _waits(PendantClient.end_pairing)
    add_account = _waits(PendantClient.add_account)
    set_password = _waits(PendantClient.set_password)

    take_control = _waits(PendantClient.take_control)
    release_control = _waits(PendantClient.release_control)
    set_mode = _waits(PendantClient.set_mode)
    set_speed = _waits(PendantClient.set_speed)
    pause = _waits(PendantClient.pause)
    resume = _waits(PendantClient.resume)
    program_stop = _waits(PendantClient.program_stop)
    stop = _waits(PendantClient.stop)
    reset_stop = _waits(PendantClient.reset_stop)

    def control(
        self, *, force: bool = False, wanted: Callable[[AuthorityWanted], None] | None = None
    ) -> contextlib.AbstractContextManager[None]:
        """Hold the motion authority for the length of the context."""
        return self._thread.entered(self.background.control(force=force, wanted=wanted))

    def enabling(self) -> contextlib.AbstractContextManager[EnablingDevice]:
        """Hold the enabling device (training) half pressed for the length of the context."""
        return self._thread.entered(self.background.enabling())

    move_joints = _begins(PendantClient.move_joints)
    move_to_pose = _begins(PendantClient.move_to_pose)
    follow_joints = _begins(PendantClient.follow_joints)
    follow_poses = _begins(PendantClient.follow_poses)
    home = _begins(PendantClient.home)
    execute = _begins(PendantClient.execute)
    prepare = _begins(PendantClient.prepare)
    run_program = _begins(PendantClient.run_program)
    jog = _holds(PendantClient.jog)
    jog_tool = _holds(PendantClient.jog_tool)
    jog_out = _holds(PendantClient.jog_out)
    step = _begins(PendantClient.step)
    step_tool = _begins(PendantClient.step_tool)
    undo_jog = _begins(PendantClient.undo_jog)
