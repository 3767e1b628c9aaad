"""Files that a run leaves behind: the log of the executed motion and the referee's report.

Owns their formats. The log is streamed, so its length costs no memory; the report is replaced in
one step where it is a regular file, so a reader never sees half of it. Times are handed in.
"""

from __future__ import annotations

import json
import os
import stat
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TextIO

from ..interpolation.segment import State

_BUFFER_BYTES = 1 << 16


class MotionLog:
    """A CSV file with one row per joint report.

    Columns: `time` [s since the emulator was ready], then for each joint `<name>.position` [rad or
    m], `<name>.velocity` and `<name>.acceleration`. Numbers are written so that they read back
    exactly. Each call raises `OSError` where the file cannot be written.
    """

    def __init__(self, file: Path, joints: Sequence[str]) -> None:
        """Create the file and write its header."""
        self._stream: TextIO = file.open("w", encoding="ascii", buffering=_BUFFER_BYTES)
        columns = [f"{name}.{what}" for name in joints for what in _COLUMNS]
        self._stream.write(",".join(["time", *columns]) + "\n")

    def write(self, time: float, state: State) -> None:
        """Add a row."""
        values = [repr(value) for joint in zip(*state, strict=True) for value in joint]
        self._stream.write(f"{time:.6f},{','.join(values)}\n")

    def close(self) -> None:
        """Write what is left and close the file."""
        self._stream.close()


_COLUMNS = ("position", "velocity", "acceleration")


def write_report(file: Path, report: Mapping[str, object]) -> None:
    """Write a report as JSON, replacing an older one in one step.

    A device, a pipe or a symbolic link such as /dev/stdout is written in place.

    Raises:
        OSError: the file cannot be written.
    """
    text = json.dumps(report, indent=2, allow_nan=False) + "\n"
    if _is_replaceable(file):
        _replace(file, text)
    else:
        file.write_text(text, encoding="utf-8")


def _is_replaceable(file: Path) -> bool:
    # Renaming onto /dev/null would take the device away from everyone on the machine.
    try:
        return stat.S_ISREG(file.lstat().st_mode)
    except FileNotFoundError:
        return True


def _replace(file: Path, text: str) -> None:
    temporary = file.with_name(f".{file.name}.{os.getpid()}.tmp")
    try:
        with temporary.open("w", encoding="utf-8") as stream:
            stream.write(text)
            stream.flush()
            os.fsync(stream.fileno())
        temporary.replace(file)
    except OSError:
        temporary.unlink(missing_ok=True)
        raise
