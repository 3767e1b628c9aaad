"""Bounded reading of files of unknown origin.

Owns that only a regular file is opened, without waiting, that no more than a bound is read, and the
words for a file that cannot be read, is too large, or is no text. The caller chooses the error.
"""

from __future__ import annotations

import errno
import os
import stat
from collections.abc import Callable
from pathlib import Path
from typing import BinaryIO, TypeAlias

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
