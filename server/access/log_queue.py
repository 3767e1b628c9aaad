"""The stream behind the process log: takes text at once, and a thread writes it soon.

Owns the thread and the bounded queue. A terminal that is held or a pipe that nobody reads holds up
the thread and never the event loop: entries wait, the ones that find no more room are counted, and
a line says how many are missing once the stream takes lines again.
"""

from __future__ import annotations

import os
import sys
import threading
from collections import deque

MOST_WAITING = 1_000
"""Entries that may wait for the stream."""

_FAREWELL = 1.0


class LogQueue:
    """What `logging.StreamHandler` writes to, in place of standard error itself."""

    def __init__(
        self, descriptor: int, *, most_waiting: int = MOST_WAITING, farewell: float = _FAREWELL
    ) -> None:
        """Start the thread.

        Args:
            descriptor: of the stream; it is written past Python's own buffer, whose lock the thread
                would hold for as long as nobody reads.
            most_waiting: entries that may wait.
            farewell: for how long the end waits for what is left [s].
        """
        self._descriptor = descriptor
        self._most_waiting = most_waiting
        self._farewell = farewell
        self._turn = threading.Condition()
        self._waiting: deque[str] = deque()
        self._lost = 0
        self._is_ending = False
        self._thread = threading.Thread(target=self._run, name="log", daemon=True)
        self._thread.start()

    def write(self, text: str) -> int:
        """Take an entry; returns at once, whatever the stream does."""
        with self._turn:
            if len(self._waiting) >= self._most_waiting:
                self._lost += 1
            else:
                self._waiting.append(text)
                self._turn.notify()
        return len(text)

    def flush(self) -> None:
        """Do nothing: entries are written as they come."""

    def close(self) -> None:
        """Write what is left, for a limited time, and end."""
        with self._turn:
            self._is_ending = True
            self._turn.notify()
        self._thread.join(self._farewell)

    def _run(self) -> None:
        while True:
            with self._turn:
                while not self._waiting and not self._is_ending:
                    self._turn.wait()
                if not self._waiting:
                    return
                text = self._waiting.popleft()
            self._write(text)
            # Behind the entries that were there before: at that place the others are missing.
            with self._turn:
                lost = 0 if self._waiting else self._lost
                self._lost -= lost
            if lost:
                self._write(f"{lost} log entries were left out: nobody read them\n")

    def _write(self, text: str) -> None:
        data = text.encode("utf-8", "backslashreplace")
        try:
            while data:
                data = data[os.write(self._descriptor, data) :]
        except OSError:  # the stream is gone, so there is nobody to tell
            return


def standard_error() -> int:
    """Return the descriptor of standard error; where it was closed, of nothing.

    Its number alone may meanwhile be that of a connection.
    """
    stream = sys.__stderr__
    return os.open(os.devnull, os.O_WRONLY) if stream is None else stream.fileno()
