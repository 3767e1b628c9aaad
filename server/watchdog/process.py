"""The watchdog process: stops the robots when the server's event loop stands still (promise 26).

A process and no thread, because a loop that hangs may hold the interpreter. The server writes a
beat into its standard input each tick, and hears from it that it is alive. Owns the server's end:
the process, its life and the pipes. Must not know how a robot is stopped; that is what the process
itself does, `child`.
"""

from __future__ import annotations

import logging
import os
import subprocess
import sys
import time
from collections.abc import Sequence

from .pipe import ANSWER, BEAT, IS_BEAT, IS_FAREWELL, IS_NEWS, Deadlines, StopTarget, orders
from .watchdog import AnswerWatch

log = logging.getLogger("openpendant.server")

_RESTART_NS = 1_000_000_000


class Watchdog:
    """The server's end: starts the process, beats, and starts it again if it dies.

    Attributes:
        process: the process, None while there is none.
    """

    def __init__(self, targets: Sequence[StopTarget], deadlines: Deadlines, period: float) -> None:
        """Prepare a watchdog.

        Args:
            targets: one for each cell, in their order.
            deadlines: it stops a robot when no beat came for so long.
            period: between two ticks of the server [s].
        """
        self.process: subprocess.Popen[bytes] | None = None
        self._orders = orders(deadlines, targets)
        self._answers = AnswerWatch(round(period * 1e9))
        self._started = 0
        self._told = (0, 0)
        self._ended: list[subprocess.Popen[bytes]] = []

    def __enter__(self) -> Watchdog:
        """Start the process."""
        self._start(time.monotonic_ns())
        return self

    def __exit__(self, *_: object) -> None:
        """Let it go: the server ends in good order, with every robot at rest."""
        process = self.process
        self.process = None
        if process is not None:
            self._write(process, BEAT.pack(0, 0, IS_FAREWELL))
            _close(process)
            self._ended.append(process)
        for process in self._ended:
            try:
                process.wait(2.0)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()
        self._ended.clear()

    def beat(self, moving: Sequence[bool], emulated: Sequence[bool]) -> int:
        """Say that the loop is alive; to be called first in each tick.

        Args:
            moving: for each cell whether its robot may move before the next tick.
            emulated: for each cell whether its controller says that it is emulated.

        Returns:
            The cells whose robots the process has stopped since the last beat, one bit for each.
        """
        now = time.monotonic_ns()
        process, heard = self.process, b""
        if process is None:
            if now - self._started >= _RESTART_NS:
                self._start(now)
        else:
            self._told = _bits(moving), _bits(emulated)
            heard = _heard(process)
            if not self._write(process, BEAT.pack(*self._told, IS_BEAT)):
                self._part(process, "is gone or does not read")
            elif self._answers.tick(now, was_heard=bool(heard)):
                self._part(process, "does not answer")
        self._ended = [each for each in self._ended if each.poll() is None]
        stopped = 0
        for (cells,) in ANSWER.iter_unpack(heard[: len(heard) - len(heard) % ANSWER.size]):
            stopped |= cells
        return stopped

    def news(self, moving: Sequence[bool], emulated: Sequence[bool]) -> None:
        """Say what may move now, which is no beat.

        To be called last in each tick, and before the first set-point of a motion leaves: else
        nobody would stop one that the loop begins and then hangs.

        Args:
            moving: for each cell whether its robot may move before the next tick.
            emulated: for each cell whether its controller says that it is emulated.
        """
        cells = _bits(moving), _bits(emulated)
        if self.process is None or cells == self._told:
            return
        self._told = cells
        if not self._write(self.process, BEAT.pack(*cells, IS_NEWS)):
            self._part(self.process, "is gone or does not read")

    def _part(self, process: subprocess.Popen[bytes], why: str) -> None:
        """Let a process go that is of no use, without waiting for its end."""
        log.error("the watchdog process %s; starting another", why)
        self.process = None
        _close(process)
        process.kill()
        self._ended.append(process)

    def _start(self, now: int) -> None:
        self._started = now
        try:
            process = subprocess.Popen(
                [sys.executable, "-m", f"{__package__}.child"],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                # A signal for the server's terminal is none for its watchdog.
                start_new_session=True,
            )
        except OSError as error:
            log.error("no watchdog process: %s", error.strerror or error)
            return
        assert process.stdin is not None
        assert process.stdout is not None
        os.set_blocking(process.stdin.fileno(), False)
        os.set_blocking(process.stdout.fileno(), False)
        self._write(process, self._orders)
        self._answers.begin(now)
        self._told = (0, 0)
        self.process = process

    @staticmethod
    def _write(process: subprocess.Popen[bytes], data: bytes) -> bool:
        """Write to the process, all or nothing; tell whether that worked. Never waits."""
        assert process.stdin is not None
        try:
            return os.write(process.stdin.fileno(), data) == len(data)
        except OSError:  # it ended, or its pipe is full
            return False


def _bits(moving: Sequence[bool]) -> int:
    return sum(1 << number for number, moves in enumerate(moving) if moves)


def _heard(process: subprocess.Popen[bytes]) -> bytes:
    """Return what the process has said. Never waits."""
    assert process.stdout is not None
    try:
        return os.read(process.stdout.fileno(), 65_536)
    except BlockingIOError:
        return b""


def _close(process: subprocess.Popen[bytes]) -> None:
    assert process.stdin is not None
    assert process.stdout is not None
    process.stdin.close()
    process.stdout.close()
