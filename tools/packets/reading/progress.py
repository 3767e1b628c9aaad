"""Progress of an input that is read: a line on a terminal, and the end where nobody listens.

Owns how often either is looked at. A tool that prints little of a large file would otherwise say
nothing for minutes, and would read on after the reader of its output has gone.
"""

from __future__ import annotations

import io
import os
import select
import stat
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, BinaryIO

PERIOD = 0.5
"""Time between two looks [s]."""

_BUFFER_BYTES = 1 << 17
_UNITS = ("bytes", "kB", "MB", "GB", "TB")


class WatchedInput(io.RawIOBase):
    """A stream that tells how much of it was read; closing it leaves the stream below open.

    A read raises `BrokenPipeError` once the reader of standard output is gone.
    """

    def __init__(
        self, below: BinaryIO, total: int | None, clock: Callable[[], float] = time.monotonic
    ) -> None:
        """Watch a stream.

        Args:
            total: its size [bytes]; None where that is not known.
            clock: monotonic time [s].
        """
        self.name = getattr(below, "name", "<stdin>")
        # A pipe gives what is there; `read` would wait for as much as was asked for.
        self._read = below.read1 if isinstance(below, io.BufferedIOBase) else below.read
        self._total = total
        self._clock = clock
        self._began = self._looked = clock()
        self._done = 0
        self._is_shown = False
        self._tells = sys.stderr is not None and sys.stderr.isatty()

    def readable(self) -> bool:
        """Return True: this stream can be read."""
        return True

    def readinto(self, buffer: Any) -> int:
        """Read as `io.RawIOBase` demands."""
        chunk = self._read(len(buffer))
        buffer[: len(chunk)] = chunk
        self._done += len(chunk)
        now = self._clock()
        if now - self._looked >= PERIOD:
            self._looked = now
            self._look(now - self._began)
        return len(chunk)

    def clear(self) -> None:
        """Take the line off the terminal, before anything else is written there."""
        if self._is_shown:
            self._is_shown = False
            sys.stderr.write("\r\x1b[K")
            sys.stderr.flush()

    def _look(self, seconds: float) -> None:
        if _reader_is_gone():
            raise BrokenPipeError
        if self._tells:
            self._is_shown = True
            sys.stderr.write(f"\r{in_words(self._done, self._total, seconds)}\x1b[K")
            sys.stderr.flush()


def in_words(done: int, total: int | None, seconds: float) -> str:
    """Return how much was read, and how long the rest takes at the same pace."""
    if not total or done > total:  # it may grow while it is read
        return f"read {_size(done)}"
    rest = seconds * (total - done) / done if done else 0.0
    return f"read {_size(done)} of {_size(total)}, {done / total:.0%}, {rest:.0f} s left"


def _size(count: float) -> str:
    for unit in _UNITS[:-1]:
        if count < 1000:
            return f"{count:.3g} {unit}"
        count /= 1000
    return f"{count:.3g} {_UNITS[-1]}"


def _reader_is_gone() -> bool:
    """Return True if standard output is a pipe or terminal whose other end is closed."""
    if sys.platform == "win32" or sys.stdout is None:
        return False
    try:
        descriptor = sys.stdout.fileno()
    except OSError:  # a stream in memory
        return False
    poll = select.poll()
    poll.register(descriptor, 0)  # errors and hang-ups are reported without a mask
    return bool(poll.poll(0))


@contextmanager
def watched(below: BinaryIO) -> Iterator[tuple[BinaryIO, WatchedInput]]:
    """Give a stream to read instead, and its progress, which leaves no line behind at the end."""
    watch = WatchedInput(below, _total(below))
    try:
        yield io.BufferedReader(watch, _BUFFER_BYTES), watch
    finally:
        watch.clear()


def _total(stream: BinaryIO) -> int | None:
    try:
        about = os.fstat(stream.fileno())
    except OSError:
        return None
    return about.st_size if stat.S_ISREG(about.st_mode) else None
