"""Bounded reading of files of unknown origin.

Owns that only a regular file is opened, without waiting, that no more than a bound is read, and the
words for a file that cannot be read, is too large, or is no text. The caller chooses the error.
Owns also which TOML is read: not what would take the standard parser hours.
"""

from __future__ import annotations

import errno
import os
import re
import stat
from collections.abc import Callable
from pathlib import Path
from typing import Any, BinaryIO, TypeAlias

from .errors import MotionError

Refusal: TypeAlias = Callable[[str, str, str], MotionError]
"""Returns the error to raise for the file, a field of it (none here) and the problem."""


def open_regular(path: Path) -> BinaryIO:
    """Open a regular file for reading.

    Raises:
        OSError: there is none, it may not be read, or it is a folder, a device or a pipe.
        ValueError: no file can be called so.
    """
    # Without waiting: opening a pipe that nobody writes to would block for ever.
    file = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
    try:
        mode = os.fstat(file).st_mode
        if stat.S_ISDIR(mode):
            raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(path))
        if not stat.S_ISREG(mode):
            problem = "is not a regular file; accepted: a file on a disk, no pipe and no device"
            raise OSError(errno.EINVAL, problem, str(path))
        return os.fdopen(file, "rb")
    except BaseException:
        os.close(file)
        raise


def beginning_of(path: Path, most: int) -> bytes:
    """Return the first bytes of a regular file, at most `most`; raises as `open_regular`."""
    with open_regular(path) as stream:
        return stream.read(most)


def read_bounded(path: Path, most: int, refusal: Refusal) -> bytes:
    """Return a file's content.

    Args:
        most: greatest accepted number of bytes; no more than one beyond is read.

    Raises:
        MotionError: the one that `refusal` makes: the file cannot be read or is larger.
    """
    try:
        content = beginning_of(path, most + 1)
    except OSError as error:
        raise refusal(str(path), "", error.strerror or "cannot be read") from error
    except ValueError as error:
        # The name may hold characters that must not be sent to a terminal.
        raise refusal(repr(str(path)), "", "is not a legal file name") from error
    if len(content) > most:
        raise refusal(str(path), "", f"is larger than {most} bytes, the most that is accepted")
    return content


def read_text(path: Path, most: int, refusal: Refusal, encoding: str = "utf-8") -> str:
    """Return a file's text.

    Args:
        most: greatest accepted number of bytes.
        encoding: `utf-8`, or `utf-8-sig`, which drops a byte-order mark.

    Raises:
        MotionError: the one that `refusal` makes, as of `read_bounded`, or for text that is not
            UTF-8.
    """
    content = read_bounded(path, most, refusal)
    try:
        return content.decode(encoding)
    except UnicodeDecodeError as error:
        problem = f"is not UTF-8 text (byte {error.start})"
        raise refusal(str(path), "", problem) from error


MOST_KEY_PARTS = 8
"""Most parts of a dotted key in TOML, such as the three of `a.b.c`."""

# Possessive, and a bare part begins only where one can: no text is looked through twice.
_PART = r"""(?:(?<![\w-])[\w-]++|"(?:[^"\\\n]|\\.)*+"|'[^'\n]*+')"""
_LONG_KEY = re.compile(rf"{_PART}(?:[ \t]*+\.[ \t]*+{_PART}){{{MOST_KEY_PARTS}}}", re.ASCII)


def toml_of(content: bytes) -> dict[str, Any]:
    """Return the data of a TOML file.

    Raises:
        ValueError: it is not UTF-8, no TOML, or has a key of too many parts.
        RecursionError: it nests without end.
    """
    import tomllib  # imported here because most runs read no file, and the emulator must start fast

    text = content.decode()
    # The standard parser needs the square of the number of parts, in time and in memory.
    found = _LONG_KEY.search(text)
    if found is not None:
        line = text.count("\n", 0, found.start()) + 1
        raise ValueError(f"more than {MOST_KEY_PARTS} parts of a dotted key (at line {line})")
    return tomllib.loads(text)
