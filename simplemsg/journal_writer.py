"""A journal's file, written by a thread of its own: a slow disk must not hold up a robot.

The one module of this folder that owns a file and a thread. Nothing is overwritten: a journal that
is there already, perhaps of a process that crashed, is kept under a number.
"""

from __future__ import annotations

import errno
import stat
import threading
from pathlib import Path

MOST_WAITING = 64 * 1024 * 1024
"""Characters that may wait for a disk that does not keep up; then the journal ends."""

_FAREWELL = 2.0
_MOST_KEPT = 10_000


class JournalWriter:
    """A file that takes text at once and writes it soon."""

    def __init__(self, path: Path) -> None:
        """Open the file; an older one is renamed first, to `path.1`, `path.2` and so on.

        Raises:
            OSError: it cannot be opened, or is a pipe, which nobody may be reading.
        """
        _make_way(path)
        self._file = path.open("w", encoding="ascii")
        self._turn = threading.Condition()
        self._waiting: list[str] = []
        self._size = 0
        self._closing = False
        self._error: OSError | None = None
        self._thread = threading.Thread(target=self._run, name="journal", daemon=True)
        self._thread.start()

    def write(self, text: str) -> None:
        """Take text to be written.

        Raises:
            OSError: what was taken before could not be written, or waits for too long.
        """
        with self._turn:
            if self._error is not None:
                raise self._error
            self._size += len(text)
            if self._size > MOST_WAITING:
                raise OSError(errno.ENOBUFS, "the disk is too slow for the journal")
            self._waiting.append(text)
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
                while (text := self._next()) is not None:
                    file.write(text)
                    file.flush()
        except OSError as error:
            with self._turn:
                self._error = error

    def _next(self) -> str | None:
        with self._turn:
            while not self._waiting and not self._closing:
                self._turn.wait()
            if not self._waiting:
                return None
            text = "".join(self._waiting)
            self._waiting.clear()
            self._size = 0
            return text


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
