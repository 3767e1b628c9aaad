"""A window of a terminal with a program in it: keys in, the rows that it shows out.

Understands as much of the sequences of a terminal as textual draws with: where the cursor goes,
what is erased, and text. Colours and all else are ignored, and what is too wide is cut.
"""

import fcntl
import os
import pty
import re
import struct
import subprocess
import termios
import threading
import time
from collections.abc import Callable, Mapping
from pathlib import Path

from rigs.clock.busy_machine import PATIENCE

_SEQUENCE = re.compile(
    r"\x1b\[(?P<given>[0-9;?<>=]*)[ -/]*(?P<final>[@-~])"
    r"|\x1b[()][A-Z0-9]|\x1b\][^\x07]*\x07|\x1b[^\[()\]]"
)


class ShownRows:
    """The rows of a screen after all that was written to it."""

    def __init__(self, columns: int, rows: int) -> None:
        self._columns, self._rows = columns, rows
        self._cells = [[" "] * columns for _ in range(rows)]
        self._row = self._column = 0
        self._rest = ""

    def __str__(self) -> str:
        return "\n".join("".join(row).rstrip() for row in self._cells)

    def write(self, text: str) -> None:
        """Take what a program writes; the beginning of a sequence waits for its end."""
        text = self._rest + text
        at = 0
        while at < len(text):
            if text[at] != "\x1b":
                self._put(text[at])
                at += 1
            elif found := _SEQUENCE.match(text, at):
                if found["final"]:
                    self._act(found["final"], found["given"])
                at = found.end()
            else:
                break
        self._rest = text[at:]

    def _put(self, sign: str) -> None:
        if sign == "\r":
            self._column = 0
        elif sign == "\n":
            self._row = min(self._row + 1, self._rows - 1)
        elif sign.isprintable() and self._column < self._columns:
            self._cells[self._row][self._column] = sign
            self._column += 1

    def _act(self, final: str, given: str) -> None:
        if not re.fullmatch(r"[0-9;]*", given):
            return
        numbers = [int(each or 0) for each in given.split(";")]
        if final in "Hf":
            row, column = (*numbers, 1, 1)[:2] if len(numbers) > 1 else (numbers[0], 1)
            self._row = min(max(row, 1), self._rows) - 1
            self._column = min(max(column, 1), self._columns) - 1
        elif final == "J" and numbers[0] == 2:
            self._cells = [[" "] * self._columns for _ in range(self._rows)]
        elif final == "K":
            self._cells[self._row][self._column :] = " " * (self._columns - self._column)


class TerminalWindow:
    """A program that has a terminal of its own for keyboard and screen.

    Attributes:
        raw: all that it wrote.
    """

    def __init__(
        self,
        command: list[str],
        *,
        environment: Mapping[str, str] = {},
        folder: Path | None = None,
        columns: int = 80,
        rows: int = 24,
    ) -> None:
        self._window, inside = pty.openpty()
        fcntl.ioctl(inside, termios.TIOCSWINSZ, struct.pack("HHHH", rows, columns, 0, 0))
        self.before = termios.tcgetattr(inside)
        self._inside = inside
        self._shown = ShownRows(columns, rows)
        self.raw = ""
        self.process = subprocess.Popen(
            command,
            stdin=inside,
            stdout=inside,
            stderr=inside,
            cwd=folder,
            env={**os.environ, "TERM": "xterm-256color", **environment},
            start_new_session=True,
            preexec_fn=lambda: fcntl.ioctl(0, termios.TIOCSCTTY, 0),
        )
        threading.Thread(target=self._read, daemon=True).start()

    def _read(self) -> None:
        while True:
            try:
                text = os.read(self._window, 65536).decode(errors="replace")
            except OSError:
                return
            self._shown.write(text)
            self.raw += text

    @property
    def screen(self) -> str:
        """The rows as they are shown."""
        return str(self._shown)

    def strike(self, keys: str) -> None:
        """Strike keys."""
        os.write(self._window, keys.encode())

    def until(self, holds: Callable[[str], object]) -> str:
        """Wait until something holds of the screen, and return it; else fail with what is shown."""
        deadline = time.monotonic() + PATIENCE
        while not holds(shown := self.screen):
            assert time.monotonic() < deadline, f"not shown in time:\n{shown}"
            time.sleep(0.02)
        return shown

    def ended(self) -> int:
        """Wait for the end of the program and return its exit code."""
        return self.process.wait(PATIENCE)

    @property
    def is_as_before(self) -> bool:
        """Whether the terminal behaves as it did before the program."""
        return termios.tcgetattr(self._inside) == self.before

    def close(self) -> None:
        """Close the window, which ends what still runs in it."""
        if self.process.poll() is None:
            self.process.terminate()
            self.process.wait(PATIENCE)
        os.close(self._window)
        os.close(self._inside)
