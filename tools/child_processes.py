"""Processes that a command starts and ends: streams, ready lines, signals, orders to end.

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
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from types import FrameType
from typing import IO, Any

READY_TIMEOUT = 30.0
STOP_TIMEOUT = 10.0

_STOP_SIGNALS = [signal.SIGINT, signal.SIGTERM]
if sys.platform != "win32":
    _STOP_SIGNALS.append(signal.SIGHUP)

_PR_SET_PDEATHSIG = 1  # from linux/prctl.h


class PartFailed(Exception):
    """Failure of a process; the text names the process and its failure."""


class Interrupted(BaseException):
    """Interruption of the command by a signal; `number` is the signal's."""

    def __init__(self, number: int) -> None:
        super().__init__(number)
        self.number = number


class Interruptions:
    """Turns signals into `Interrupted`, but only where the command waits or computes.

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
        """Let a signal, also an earlier one, interrupt the context by Interrupted."""
        self._is_welcome = True
        try:
            if self._pending is not None:
                raise Interrupted(self._pending)
            yield
        finally:
            self._is_welcome = False

    def _on_signal(self, number: int, _: FrameType | None) -> None:
        if self._pending is None:
            self._pending = number
        if self._is_welcome:
            # A second Ctrl-C must not interrupt the unwinding that this one begins.
            self._is_welcome = False
            raise Interrupted(self._pending)


class Streams(Enum):
    """Standard streams of a process that is started."""

    READ = "no input; its output is read here"
    SHOWN = "no input; its output goes where ours goes"
    TERMINAL = "all of them are ours, and so is the terminal"


@dataclass(frozen=True, slots=True)
class Part:
    """A running process.

    Attributes:
        lines: the first line of its output, if that is read here.
        log: what else it writes; None where it goes where ours goes.
    """

    name: str
    process: subprocess.Popen[str]
    lines: queue.Queue[str]
    log: Path | None = None

    def ended(self) -> PartFailed:
        """Return the failure of a process that has ended: its exit code and its last words."""
        code = self.process.wait(STOP_TIMEOUT)
        how = f"exit code {code}" if code >= 0 else signal.Signals(-code).name
        told = "" if self.log is None else _last_line(self.log)
        return PartFailed(f"{self.name} ended with {how}{f': {told}' if told else ''}")


_LAST_BYTES = 4096


def _last_line(log: Path) -> str:
    with log.open("rb") as file:
        file.seek(max(0, log.stat().st_size - _LAST_BYTES))
        lines = file.read().decode(errors="replace").split("\n")
    return next((line.strip() for line in reversed(lines) if line.strip()), "")


def python_command(module: str, *arguments: str) -> list[str]:
    """Return the command that runs a module with this interpreter."""
    return [sys.executable, "-m", module, *arguments]


def _dying_with_parent() -> Callable[[], None] | None:
    """Return what a child runs before it starts, so that it ends with a parent killed by force."""
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
def process(
    name: str, command: list[str], *, streams: Streams = Streams.READ, log: Path | None = None
) -> Iterator[Part]:
    """Run a process for the length of the context; it is asked to end, then killed.

    Args:
        log: file of its errors and of its output after the first line; our own errors without.
    """
    with ExitStack() as stack:
        kept = None if log is None else stack.enter_context(log.open("a", encoding="utf-8"))
        has_terminal = streams is Streams.TERMINAL
        child = subprocess.Popen(
            command,
            stdin=None if has_terminal else subprocess.DEVNULL,
            stdout=subprocess.PIPE if streams is Streams.READ else None,
            stderr=kept,
            text=True,
            # Ctrl-C is ours to handle: the parts are stopped in order, by process id. Who has the
            # terminal stays with it, or it would hear of no change of its size.
            start_new_session=not has_terminal,
            preexec_fn=_dying_with_parent(),
            env={**os.environ, "MPLBACKEND": "Agg"},
        )
        part = Part(name, child, queue.Queue(), log)
        reader = threading.Thread(
            target=_forward, args=(child.stdout, part.lines, kept), daemon=True
        )
        reader.start()
        try:
            yield part
        finally:
            _stop(part)
            reader.join(STOP_TIMEOUT)
            # A grandchild may hold the pipe open; closing it under the reader would make that fail.
            if child.stdout is not None and not reader.is_alive():
                child.stdout.close()


def _stop(part: Part) -> None:
    if part.process.poll() is None:
        part.process.send_signal(signal.SIGTERM)
    try:
        part.process.wait(STOP_TIMEOUT)
    except subprocess.TimeoutExpired:
        print(f"{part.name} does not end; killing it", file=sys.stderr)
        part.process.kill()
        part.process.wait()


def _forward(stream: IO[str] | None, lines: queue.Queue[str], kept: IO[str] | None) -> None:
    """Pass the first line on and drain the rest, so that the process never blocks on a pipe."""
    if stream is None:
        return
    lines.put(stream.readline())
    for line in stream:
        if kept is not None:
            kept.write(line)
            kept.flush()


def ready(part: Part, interruptions: Interruptions) -> dict[str, Any]:
    """Return the ready line that a part prints as JSON; PartFailed where none comes in time."""
    try:
        with interruptions.welcome():
            line = part.lines.get(timeout=READY_TIMEOUT)
    except queue.Empty:
        raise PartFailed(f"{part.name} was not ready within {READY_TIMEOUT:g} s") from None
    if not line:
        raise part.ended()
    told: dict[str, Any] = json.loads(line)
    return told
