"""An event loop whose clock is a number: when nothing is ready, time jumps to the next timer.

Owns the test double for time. `asyncio.sleep`, `asyncio.timeout`, `call_later` and sockets work
unchanged on it, an hour passes in milliseconds, and a run repeats to the byte. Prefer socket pairs;
loopback TCP works as long as both ends are on this loop. Never talk to another process or thread
under virtual time: the clock does not wait for them, so every deadline passes before they answer.
Mark such a test `realtime` instead.
"""

import asyncio
import ctypes
import selectors
import socket
import sys
import time
from collections.abc import Callable
from concurrent.futures import Executor
from functools import cache, partial, wraps
from typing import Protocol, TypeVar, TypeVarTuple

# Not zero, as no real monotonic clock starts there: code that takes 0 for "never" is found out.
START_NS = 1_000_000_000_000

# The kernel delivers over loopback TCP within the sender's call, but under load it may put that off
# to another thread. One short real pause before a jump gives it the chance, where `UNDER_WAY` says
# that something may still come: a pause before each jump was a quarter of the processor time.
SETTLE_S = 50e-6

_PR_SET_TIMERSLACK = 29  # from linux/prctl.h

# With neither a timer nor anything ready, only bytes under way inside the kernel can still come.
STALL_S = 0.5

_Result = TypeVar("_Result")
_Arguments = TypeVarTuple("_Arguments")


class HasFileno(Protocol):
    """What a selector can watch, besides a bare descriptor."""

    def fileno(self) -> int: ...


class StalledError(RuntimeError):
    """Nothing is ready, no timer is set and nothing arrives: the test would wait for ever."""


class UnderWay:
    """What the sockets of this process have sent and nobody has received yet.

    Attributes:
        size: bytes sent and not received, of all sockets together; below zero where bytes are
            received that had been given up.
        is_changing: the other end has yet to notice that a connection is asked for or ends.
    """

    def __init__(self) -> None:
        """Begin with what sockets may have done that nobody followed."""
        self.size = 0
        self.is_changing = True

    def __bool__(self) -> bool:
        """Return True if something may still arrive."""
        return self.size != 0 or self.is_changing

    def give_up(self) -> None:
        """Expect nothing more: whoever is to receive it does not read now, or is gone."""
        self.size = 0
        self.is_changing = False


UNDER_WAY = UnderWay()


class VirtualSelector(selectors.DefaultSelector):
    """A selector that moves its own clock instead of waiting for a timer."""

    def __init__(self, stalled: Callable[[], str]) -> None:
        super().__init__()
        _wake_punctually()
        _follow_all_sockets()
        self.now_ns = START_NS
        self._stalled = stalled
        self._network: set[int] = set()

    def register(
        self, fileobj: int | HasFileno, events: int, data: object = None
    ) -> selectors.SelectorKey:
        """Watch a file, and remember whether bytes may reach it with a delay."""
        key = super().register(fileobj, events, data)
        if _is_network_socket(key.fd):
            self._network.add(key.fd)
        return key

    def unregister(self, fileobj: int | HasFileno) -> selectors.SelectorKey:
        key = super().unregister(fileobj)
        self._network.discard(key.fd)
        return key

    def select(self, timeout: float | None = None) -> list[tuple[selectors.SelectorKey, int]]:
        """Return what is ready; if nothing is, jump `timeout` seconds ahead.

        Raises:
            StalledError: There is no timer to jump to, and nothing arrives.
        """
        ready = super().select(0)
        if ready or timeout == 0:
            return ready
        if timeout is None:
            ready = super().select(STALL_S)
            if not ready:
                raise StalledError(self._stalled())
            return ready
        if self._network and UNDER_WAY:
            time.sleep(SETTLE_S)
            ready = super().select(0)
            if ready:
                return ready
            UNDER_WAY.give_up()
        self.now_ns += max(1, round(timeout * 1e9))
        return []


@cache
def _wake_punctually() -> None:
    """Have this thread woken when its pause is over: by default the kernel adds 50 us (Linux)."""
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_PR_SET_TIMERSLACK, 1, 0, 0, 0)


@cache
def _follow_all_sockets() -> None:
    """Have what every socket of this process sends and receives counted from now on."""
    for name in ("send", "sendto", "sendmsg", "recv", "recv_into"):
        _count(name, -1 if name.startswith("recv") else 1)
    for name in ("sendall", "connect", "connect_ex", "shutdown", "close"):
        _note(name)


def _count(name: str, sign: int) -> None:
    """Have a method of sockets add what it returns, bytes or how many, to what is under way."""
    method: Callable[..., bytes | int] = getattr(socket.socket, name)

    @wraps(method)
    def counted(self: socket.socket, *arguments: object, **named: object) -> bytes | int:
        outcome = method(self, *arguments, **named)
        UNDER_WAY.size += sign * (outcome if isinstance(outcome, int) else len(outcome))
        return outcome

    setattr(socket.socket, name, counted)


def _note(name: str) -> None:
    """Have a method of sockets say that a connection changes, whatever becomes of the call."""
    method: Callable[..., object] = getattr(socket.socket, name)

    @wraps(method)
    def noted(self: socket.socket, *arguments: object, **named: object) -> object:
        UNDER_WAY.is_changing = True
        return method(self, *arguments, **named)

    setattr(socket.socket, name, noted)


class VirtualLoop(asyncio.SelectorEventLoop):
    """An asyncio loop on virtual time; executors run inline, and take no time."""

    def __init__(self) -> None:
        self._virtual = VirtualSelector(self._describe_stall)
        super().__init__(self._virtual)

    @property
    def now_ns(self) -> int:
        """Virtual time in nanoseconds; it starts at `START_NS`."""
        return self._virtual.now_ns

    def time(self) -> float:
        return self._virtual.now_ns / 1e9

    def run_in_executor(
        self, executor: Executor | None, func: Callable[[*_Arguments], _Result], *args: *_Arguments
    ) -> asyncio.Future[_Result]:
        """Call `func` here and now; its outcome arrives in the next turn of the loop.

        A thread or process at work is invisible to the selector, which would jump past every
        deadline in the meantime.
        """
        future: asyncio.Future[_Result] = self.create_future()
        try:
            result = func(*args)
        except Exception as error:
            self.call_soon(_unless_done, future, partial(future.set_exception, error))
        else:
            self.call_soon(_unless_done, future, partial(future.set_result, result))
        return future

    def _describe_stall(self) -> str:
        waiting = sorted(repr(task.get_coro()) for task in asyncio.all_tasks(self))
        return (
            f"nothing is ready, no timer is set and nothing came within {STALL_S} s; "
            f"still waiting: {', '.join(waiting) or 'no task'}"
        )


def _unless_done(future: asyncio.Future[_Result], deliver: Callable[[], None]) -> None:
    if not future.done():  # whoever asked may have been cancelled in the meantime
        deliver()


def _is_network_socket(fd: int) -> bool:
    try:
        probe = socket.socket(fileno=fd)
    except OSError:
        return False
    try:
        return probe.family in (socket.AF_INET, socket.AF_INET6)
    finally:
        probe.detach()
