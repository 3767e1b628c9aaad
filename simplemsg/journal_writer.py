"""A journal's file, written by a thread of its own: a slow disk must not hold up a robot.

The one module of this folder that owns a file and a thread. What people type is in a journal, so
it belongs to its owner alone from its first byte. It spells out what is long, and lets
the other threads run after each piece. Nothing is overwritten: a journal that is there already,
perhaps of a process that crashed, is kept under a number.
"""

from __future__ import annotations

import errno
import os
import stat
import sys
import threading
from pathlib import Path
from typing import TextIO

from .journal import Part

MOST_WAITING = 64 * 1024 * 1024
"""Characters and bytes that may wait for a disk that does not keep up; then the journal ends."""

_FAREWELL = 2.0
_BREATH = 1e-4  # s after a piece: an event that waits for this thread gets its turn
_MOST_KEPT = 10_000
_OWNER_ONLY = 0o600


class JournalWriter:
    """A file that takes text without blocking and writes it in a thread."""

    def __init__(self, path: Path) -> None:
        """Open the file; an older one is renamed first, to `path.1`, `path.2` and so on.

        Raises:
            OSError: it cannot be opened, or is a pipe, which nobody may be reading.
        """
        _make_way(path)
        self._file = os.fdopen(open_for_owner(path), "w", encoding="ascii")
        self._turn = threading.Condition()
        self._waiting: list[Part] = []
        self._size = 0
        self._closing = False
        self._error: OSError | None = None
        self._thread = threading.Thread(target=self._run, name="journal", daemon=True)
        self._thread.start()

    def write(self, *parts: Part) -> None:
        """Return the next text to write.

        Raises:
            OSError: what was taken before could not be written, or waits for too long.
        """
        with self._turn:
            if self._error is not None:
                raise self._error
            self._size += sum(map(len, parts))
            if self._size > MOST_WAITING:
                raise OSError(errno.ENOBUFS, "the disk is too slow for the journal")
            self._waiting.extend(parts)
            self._turn.notify()

    def close(self) -> None:
        """Write what is left, for at most two seconds, and close the file.

        Raises:
            OSError: the rest could not be written.
        """
        with self._turn:
            self._closing = True
            self._turn.notify()
        self._thread.join(_FAREWELL)
        if self._thread.is_alive():
            raise OSError(errno.ETIMEDOUT, "the disk did not take the rest of the journal in time")
        if self._error is not None:
            raise self._error

    def _run(self) -> None:
        try:
            with self._file as file:
                while parts := self._next():
                    for part in parts:
                        self._put(file, part)
                    file.flush()
        except OSError as error:
            with self._turn:
                self._error = error

    def _put(self, file: TextIO, part: Part) -> None:
        if isinstance(part, str):
            file.write(part)
            return
        for piece in part.pieces():
            file.write(piece)
            with self._turn:
                if not self._closing:
                    self._turn.wait(_BREATH)

    def _next(self) -> list[Part]:
        """Wait for something to write; return nothing once all is written and no more comes."""
        with self._turn:
            while not self._waiting and not self._closing:
                self._turn.wait()
            parts, self._waiting = self._waiting, []
            self._size = 0
            return parts


def open_for_owner(path: Path) -> int:
    """Open a file for writing, emptied, that its owner alone can read; return its descriptor.

    A device is opened as it is. A file that is there already loses the rights of others before a
    byte is written.

    Raises:
        OSError: it cannot be opened, or it is another user's and open to more than its owner.
    """
    flags = os.O_WRONLY | getattr(os, "O_CLOEXEC", 0) | getattr(os, "O_BINARY", 0)
    try:
        return os.open(path, flags | os.O_CREAT | os.O_EXCL, _OWNER_ONLY)
    except FileExistsError:
        opened = os.open(path, flags | os.O_CREAT | os.O_TRUNC, _OWNER_ONLY)
    try:
        mode = os.fstat(opened).st_mode
        # Windows has no such rights; there a file is private by the folder that it is in.
        if sys.platform != "win32" and stat.S_ISREG(mode) and stat.S_IMODE(mode) != _OWNER_ONLY:
            os.fchmod(opened, _OWNER_ONLY)
    except OSError as error:
        os.close(opened)
        raise OSError(error.errno, error.strerror, str(path)) from None
    return opened


def _make_way(path: Path) -> None:
    try:
        mode = path.stat().st_mode
    except FileNotFoundError:
        return
    if stat.S_ISFIFO(mode) or stat.S_ISSOCK(mode):
        raise OSError(errno.EINVAL, "a pipe cannot hold a journal", str(path))
    if not stat.S_ISREG(mode) or not path.stat().st_size:
        return
    for number in range(1, _MOST_KEPT):
        kept = path.with_name(f"{path.name}.{number}")
        if not kept.exists():
            path.rename(kept)
            return
    raise OSError(errno.EEXIST, f"{_MOST_KEPT} older journals are kept already", str(path))
