"""What the watchdog process says into the server's log stream: lines that never hold it up.

Owns the thread that speaks and the queue before it. Whoever reads the stream may have stopped: a
terminal that is held, a pipe that is full. Then the thread waits and the watchdog does not. The
stream is shared with the server, so it is not made non-blocking.
"""

from __future__ import annotations

import os
import queue
import threading

_MOST_WAITING = 100
_FAREWELL = 0.3


class Voice:
    """Says lines on a stream, as soon as the stream takes them."""

    def __init__(self, descriptor: int = 2) -> None:
        """Start the thread.

        Args:
            descriptor: of the stream.
        """
        self._descriptor = descriptor
        self._lines: queue.Queue[str | None] = queue.Queue(_MOST_WAITING)
        self._lost = 0
        self._thread = threading.Thread(target=self._run, name="voice", daemon=True)
        self._thread.start()

    def say(self, text: str) -> None:
        """Have a line said; returns at once. One that finds no more room is counted."""
        try:
            self._lines.put_nowait(text)
        except queue.Full:
            self._lost += 1

    def close(self) -> None:
        """Say what is left, if that can be done soon."""
        try:
            self._lines.put_nowait(None)
        except queue.Full:
            return
        self._thread.join(_FAREWELL)

    def _run(self) -> None:
        while (text := self._lines.get()) is not None:
            self._write(text)
            lost, self._lost = self._lost, 0
            if lost:
                self._write(f"{lost} lines were left out: nobody read them")

    def _write(self, text: str) -> None:
        try:
            os.write(self._descriptor, f"openpendant watchdog: {text}\n".encode())
        except OSError:  # the stream is gone, so there is nobody to tell
            return
