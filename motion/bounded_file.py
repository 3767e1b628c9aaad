"""Files that nobody vouches for: read whole, but no more of them than a bound.

Owns that nothing but a regular file is opened, without waiting, and the words for a file that
cannot be read, is too large, or is no text. Which error carries these is the caller's.
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
"""From the file, a field of it (none here) and what is wrong to the error to raise."""


def open_regular(path: Path) -> BinaryIO:
    """Open a regular file for reading.

    Raises:
        OSError: there is none, it may not be read, or it is a folder, a device or a pipe.
        ValueError: no file can be called so.
    """
    # Without waiting: of a pipe that nobody writes to, opening alone would never end.
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
    """Return the first bytes of a regular file, at most so many; raises as `open_regular`."""
    with open_regular(path) as stream:
        return stream.read(most)


def read_bounded(path: Path, most: int, refusal: Refusal) -> bytes:
    """Return a file's content.

    Args:
        path: the file.
        most: bytes that are accepted; no more than one beyond is read.
        refusal: makes the error.

    Raises:
        MotionError: the one that `refusal` makes: the file cannot be read or is larger.
    """
    try:
        content = beginning_of(path, most + 1)
    except OSError as error:
        raise refusal(str(path), "", error.strerror or "cannot be read") from error
    except ValueError as error:
        # The name may hold what a terminal must not be sent.
        raise refusal(repr(str(path)), "", "is not a legal file name") from error
    if len(content) > most:
        raise refusal(str(path), "", f"is larger than {most} bytes, the most that is accepted")
    return content


def read_text(path: Path, most: int, refusal: Refusal, encoding: str = "utf-8") -> str:
    """Return a file's text.

    Args:
        path: the file.
        most: bytes that are accepted.
        refusal: makes the error.
        encoding: `utf-8`, or `utf-8-sig` where a byte-order mark is dropped.

    Raises:
        MotionError: the one that `refusal` makes, as of `read_bounded`, or for what is no UTF-8.
    """
    content = read_bounded(path, most, refusal)
    try:
        return content.decode(encoding)
    except UnicodeDecodeError as error:
        problem = f"is not UTF-8 text (byte {error.start})"
        raise refusal(str(path), "", problem) from error
