"""Processes that a command starts and ends: ready lines, signals, orders to end.

No process outlives the command, however that ends: each is asked to end, then killed; where the
command is killed by force, the kernel asks (Linux).
"""

from __future__ import annotations

import ctypes
import json
import os
import queue
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from types import FrameType
from typing import IO, Any

READY_TIMEOUT = 30.0
STOP_TIMEOUT = 10.0

_STOP_SIGNALS = [signal.SIGINT, signal.SIGTERM]
if sys.platform != "win32":
    _STOP_SIGNALS.append(signal.SIGHUP)

_PR_SET_PDEATHSIG = 1  # from linux/prctl.h


class DemoFailed(Exception):
    """Failure of a part of the demonstration; the text names the part and its failure."""


class DemoInterrupted(BaseException):
    """Interruption of the demonstration by a signal; `number` is the signal's."""

    def __init__(self, number: int) -> None:
        super().__init__(number)
        self.number = number


class Interruptions:
    """Turns signals into `DemoInterrupted`, but only where the demonstration waits or computes.

    Anywhere else a signal is kept until the next such place: raised between the start of a process
    and the note that it has to be stopped, or while one is being stopped, it would leave an orphan.
    """

    def __init__(self) -> None:
        self._pending: int | None = None
        self._is_welcome = False

    @contextmanager
    def installed(self) -> Iterator[None]:
        """Handle the signals for the length of the context; ignored ones (nohup) stay ignored."""
        numbers = [n for n in _STOP_SIGNALS if signal.getsignal(n) is not signal.SIG_IGN]
        before = [(number, signal.signal(number, self._on_signal)) for number in numbers]
        try:
            yield
        finally:
            for number, handler in before:
                signal.signal(number, handler)

    @contextmanager
    def welcome(self) -> Iterator[None]:
        """Let a signal, also an earlier one, interrupt the context by DemoInterrupted."""
        self._is_welcome = True
        try:
            if self._pending is not None:
                raise DemoInterrupted(self._pending)
            yield
        finally:
            self._is_welcome = False

    def _on_signal(self, number: int, _: FrameType | None) -> None:
        if self._pending is None:
            self._pending = number
        if self._is_welcome:
            # A second Ctrl-C must not interrupt the unwinding that this one begins.
            self._is_welcome = False
            raise DemoInterrupted(self._pending)


@dataclass(frozen=True, slots=True)
class _Part:
    """A running process and the first line of its output, if that is read here."""

    name: str
    process: subprocess.Popen[str]
    lines: queue.Queue[str]


def _command(module: str, *arguments: str) -> list[str]:
    return [sys.executable, "-m", module, *arguments]


def _dying_with_parent() -> Callable[[], None] | None:
    """Return what a child runs before it starts, so that it ends with a demo killed by force."""
    if sys.platform != "linux":
        return None
    # Loaded before the fork: a forked child of a threaded process should do as little as possible.
    prctl, parent = ctypes.CDLL(None).prctl, os.getpid()

    def set_death_signal() -> None:
        prctl(_PR_SET_PDEATHSIG, int(signal.SIGTERM), 0, 0, 0)
        if os.getppid() != parent:  # it died before the request was made
            os._exit(1)

    return set_death_signal


@contextmanager
def _process(name: str, command: list[str], *, has_terminal: bool = False) -> Iterator[_Part]:
    """Run a process for the length of the context; it is asked to end, then killed."""
    process = subprocess.Popen(
        command,
        stdin=subprocess.DEVNULL,
        stdout=None if has_terminal else subprocess.PIPE,
        text=True,
        # Ctrl-C is ours to handle: the parts are stopped in order, by process id.
        start_new_session=True,
        preexec_fn=_dying_with_parent(),
        env={**os.environ, "MPLBACKEND": "Agg"},
    )
    part = _Part(name, process, queue.Queue())
    reader = threading.Thread(target=_forward, args=(process.stdout, part.lines), daemon=True)
    reader.start()
    try:
        yield part
    finally:
        _stop(part)
        reader.join(STOP_TIMEOUT)
        # A grandchild may hold the pipe open; closing it under the reader would make that fail.
        if process.stdout is not None and not reader.is_alive():
            process.stdout.close()


def _stop(part: _Part) -> None:
    if part.process.poll() is None:
        part.process.send_signal(signal.SIGTERM)
    try:
        part.process.wait(STOP_TIMEOUT)
    except subprocess.TimeoutExpired:
        print(f"demo: {part.name} does not end; killing it", file=sys.stderr)
        part.process.kill()
        part.process.wait()


def _forward(stream: IO[str] | None, lines: queue.Queue[str]) -> None:
    """Pass the first line on and drain the rest, so that the process never blocks on a pipe."""
    if stream is None:
        return
    lines.put(stream.readline())
    for _ in stream:
        continue


def _ready(part: _Part, interruptions: Interruptions) -> dict[str, Any]:
    """Return the ready line that a part prints as JSON; DemoFailed where none comes in time."""
    try:
        with interruptions.welcome():
            line = part.lines.get(timeout=READY_TIMEOUT)
    except queue.Empty:
        raise DemoFailed(f"{part.name} was not ready within {READY_TIMEOUT:g} s") from None
    if not line:
        raise DemoFailed(f"{part.name} ended with exit code {part.process.wait(STOP_TIMEOUT)}")
    ready: dict[str, Any] = json.loads(line)
    return ready
