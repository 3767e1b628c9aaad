"""Background writers: a bounded queue of entries and the thread that writes them.

Owns that `put` returns at once, whatever a disk, a terminal or a pipe does: entries wait for the
thread, those that find no more room are counted, and the end waits for a limited time only. What an
entry is and how it is written is the user's, who hands in the function that the thread runs.
`LogStream` is the one for text on a stream: the process log and the watchdog's messages.
"""

from __future__ import annotations

import os
import sys
import threading
from collections import deque
from collections.abc import Callable
from typing import Generic, TypeVar

Entry = TypeVar("Entry")


class BackgroundWriter(Generic[Entry]):
    """A bounded queue and the thread that empties it."""

    def __init__(
        self,
        name: str,
        run: Callable[[BackgroundWriter[Entry]], None],
        *,
        most_waiting: int,
        farewell: float,
    ) -> None:
        """Start the thread.

        Args:
            run: what the thread does: call `take` until it returns the last entries.
            farewell: for how long the end waits for what is left [s].
        """
        self._most_waiting = most_waiting
        self._farewell = farewell
        self._turn = threading.Condition()
        self._ending = threading.Event()
        self._waiting: deque[Entry] = deque()
        self._lost = 0
        self._thread = threading.Thread(target=run, args=(self,), name=name, daemon=True)
        self._thread.start()

    def put(self, entry: Entry) -> None:
        """Queue an entry, or count it where there is no room; return at once."""
        with self._turn:
            if len(self._waiting) >= self._most_waiting:
                self._lost += 1
                return
            self._waiting.append(entry)
            self._turn.notify()

    def close(self) -> bool:
        """Return True if the thread wrote what was left within the farewell."""
        self._ending.set()
        with self._turn:
            self._turn.notify()
        self._thread.join(self._farewell)
        return not self._thread.is_alive()

    # What follows is for the thread.

    def take(
        self, *, most: int | None = None, patience: float | None = None
    ) -> tuple[list[Entry], bool]:
        """Wait for entries; return them, and whether they are the last ones.

        Args:
            most: entries to take at once; None for all.
            patience: for how long to wait [s]; None for as long as it takes.
        """
        with self._turn:
            if not self._waiting and not self._ending.is_set():
                self._turn.wait(patience)
            count = len(self._waiting) if most is None else min(most, len(self._waiting))
            taken = [self._waiting.popleft() for _ in range(count)]
            return taken, self._ending.is_set() and not self._waiting

    def lost(self, *, behind_all: bool = False) -> int:
        """Return how many entries found no room and were not told of yet.

        Args:
            behind_all: return 0 while entries wait; they came before those that are missing.
        """
        with self._turn:
            return 0 if behind_all and self._waiting else self._lost

    def told(self, lost: int) -> None:
        """Count so many lost entries no longer: a reader of the log was told of them."""
        with self._turn:
            self._lost -= lost

    @property
    def is_ending(self) -> bool:
        """Whether `close` was called."""
        return self._ending.is_set()

    def pause(self, seconds: float) -> None:
        """Wait before another try, but not beyond `close`."""
        self._ending.wait(seconds)


class LogStream:
    """A text stream for `logging.StreamHandler`, in place of standard error itself."""

    def __init__(
        self,
        descriptor: int,
        *,
        most_waiting: int = 1_000,
        farewell: float = 1.0,
        gap: str = "{} log entries were left out: nobody read them\n",
    ) -> None:
        """Start the thread.

        Args:
            descriptor: of the stream; it is written past Python's own buffer, whose lock the thread
                would hold for as long as nobody reads.
            most_waiting: entries that may wait.
            farewell: for how long the end waits for what is left [s].
            gap: the line that says how many entries are missing, where they are.
        """
        self._descriptor = descriptor
        self._gap = gap
        self._writer = BackgroundWriter(
            "log", self._run, most_waiting=most_waiting, farewell=farewell
        )

    def write(self, text: str) -> int:
        """Queue an entry; return at once, whatever the stream does."""
        self._writer.put(text)
        return len(text)

    def flush(self) -> None:
        """Do nothing: entries are written as they come."""

    def close(self) -> None:
        """Write what is left, for a limited time, and end."""
        self._writer.close()

    def _run(self, writer: BackgroundWriter[str]) -> None:
        is_last = False
        while not is_last:
            # One at a time: what the thread holds while nobody reads has left the bounded queue.
            entries, is_last = writer.take(most=1)
            for text in entries:
                self._write(text)
            lost = writer.lost(behind_all=True)
            if lost:
                self._write(self._gap.format(lost))
                writer.told(lost)

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
