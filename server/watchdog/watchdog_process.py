"""The watchdog process: stops the robots when the server's event loop stands still (promise 26).

A process and not a thread, because a loop that hangs may hold the interpreter's lock. The server
writes a beat into its standard input each tick and reads its reports that it is alive. Owns the
server's end: the start and end of the process, its pipes, and the bytes of each cell's STOP that it
is given. Must not know how a robot is stopped: `watchdog_main` owns that.
"""

from __future__ import annotations

import logging
import os
import subprocess
import sys
import time
from collections.abc import Sequence
from typing import Literal

from openpendant.simplemsg import STANDARD, ByteOrder, codec_for

from ..settings.cell_settings import CellSettings
from ..uplinks import dialect_of
from .watchdog_protocol import (
    ANSWER,
    BEAT,
    IS_BEAT,
    IS_FAREWELL,
    IS_UPDATE,
    AnswerWatch,
    Deadlines,
    StopTarget,
    orders,
)

log = logging.getLogger("openpendant.server")

_RESTART_NS = 1_000_000_000


class Watchdog:
    """The server's end: starts the process, beats, and starts it again if it dies."""

    def __init__(self, targets: Sequence[StopTarget], deadlines: Deadlines, period: float) -> None:
        """Prepare a watchdog.

        Args:
            targets: one for each cell, in their order.
            deadlines: longest times without a beat before it stops a robot [s].
            period: between two ticks of the server [s].
        """
        self.process: subprocess.Popen[bytes] | None = None
        self._orders = orders(deadlines, targets)
        self._answers = AnswerWatch(round(period * 1e9))
        self._started = 0
        self._sent = (0, 0)
        self._ended: list[subprocess.Popen[bytes]] = []

    def __enter__(self) -> Watchdog:
        """Start the process."""
        self._start(time.monotonic_ns())
        return self

    def __exit__(self, *_: object) -> None:
        """End the process without a STOP: the server ends in order, with every robot at rest."""
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
        """Send the beat that shows that the loop is alive; call it first in each tick.

        Args:
            moving: for each cell whether its robot may move before the next tick.
            emulated: for each cell whether its controller says that it is emulated.

        Returns:
            The cells whose robots the process has stopped since the last beat, one bit for each.
        """
        now = time.monotonic_ns()
        process, reports = self.process, b""
        if process is None:
            if now - self._started >= _RESTART_NS:
                self._start(now)
        else:
            self._sent = _bits(moving), _bits(emulated)
            reports = _read(process)
            if not self._write(process, BEAT.pack(*self._sent, IS_BEAT)):
                self._part(process, "is gone or does not read")
            elif self._answers.tick(now, has_reported=bool(reports)):
                self._part(process, "does not answer")
        self._ended = [each for each in self._ended if each.poll() is None]
        stopped = 0
        for (cells,) in ANSWER.iter_unpack(reports[: len(reports) - len(reports) % ANSWER.size]):
            stopped |= cells
        return stopped

    def update(self, moving: Sequence[bool], emulated: Sequence[bool]) -> None:
        """Send which robots may move now; this is no beat.

        Call it last in each tick, before the first set-point of a motion is sent: otherwise no
        process would stop a motion that the loop starts before it hangs.
        """
        cells = _bits(moving), _bits(emulated)
        if self.process is None or cells == self._sent:
            return
        self._sent = cells
        if not self._write(self.process, BEAT.pack(*cells, IS_UPDATE)):
            self._part(self.process, "is gone or does not read")

    def _part(self, process: subprocess.Popen[bytes], why: str) -> None:
        """Kill a process that no longer works, without waiting for its end."""
        log.error("the watchdog process %s; starting another", why)
        self.process = None
        _close(process)
        process.kill()
        self._ended.append(process)

    def _start(self, now: int) -> None:
        self._started = now
        try:
            process = subprocess.Popen(
                [sys.executable, "-m", f"{__package__}.watchdog_main"],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                # Ctrl-C in the server's terminal must not end its watchdog.
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
        self._sent = (0, 0)
        self.process = process

    @staticmethod
    def _write(process: subprocess.Popen[bytes], data: bytes) -> bool:
        """Write to the process; return True if all of it was written. Never waits."""
        assert process.stdin is not None
        try:
            return os.write(process.stdin.fileno(), data) == len(data)
        except OSError:  # it ended, or its pipe is full
            return False


def _bits(moving: Sequence[bool]) -> int:
    return sum(1 << number for number, moves in enumerate(moving) if moves)


def _read(process: subprocess.Popen[bytes]) -> bytes:
    """Return the bytes that the process has written. Never waits."""
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


_HEADER = slice(4, 16)
"""Type, communication type and reply code of a frame: they tell the answer to a STOP."""


def stop_target(settings: CellSettings) -> StopTarget:
    """Return the stop target of a cell."""
    link = settings.controller
    dialect, codec = dialect_of(link), codec_for(STANDARD, link.order, link.real_size)
    order: Literal["little", "big"] = "big" if link.order is ByteOrder.BIG else "little"
    return StopTarget(
        cell=settings.name,
        host=link.host,
        port=link.motion_port,
        stop=codec.encode(dialect.stop).hex(),
        is_kept=link.stop_connection,
        answer=codec.encode(dialect.stopped)[_HEADER].hex(),
        order=order,
    )


def watchdog_of(cells: Sequence[CellSettings]) -> Watchdog:
    """Return the watchdog of a server, not started yet; all cells have the same deadlines."""
    targets = [stop_target(cell) for cell in cells]
    rule = cells[0].watchdog
    deadlines = Deadlines(rule.real_deadline, rule.emulated_deadline)
    return Watchdog(targets, deadlines, 1.0 / cells[0].tick_rate)
