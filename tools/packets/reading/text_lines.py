"""Reader of text lines with a bounded length, and of the file that they come from.

Owns the longest accepted line and the opening of FILE or standard input. Knows nothing of what a
line says.
"""

from __future__ import annotations

import errno
import sys
from collections.abc import Iterator
from contextlib import AbstractContextManager, nullcontext
from typing import BinaryIO

MAX_LINE = 1_048_576
"""Longest accepted line, bytes; the largest frame needs half of it as JSON."""


class LineError(Exception):
    """A line of the input that cannot be converted; the text says why."""


def open_input(file: str) -> AbstractContextManager[BinaryIO]:
    """Open a file for reading; `-` is standard input, which stays open afterwards.

    Raises:
        OSError: it cannot be opened.
    """
    if file != "-":
        return open(file, "rb")
    if sys.stdin is None:
        raise OSError(errno.EBADF, "standard input is closed")
    return nullcontext(sys.stdin.buffer)


def lines_of(stream: BinaryIO, longest: int = MAX_LINE) -> Iterator[bytes]:
    """Yield lines as they come; of a line that is too long only the beginning, to bound memory.

    Args:
        stream: where to read.
        longest: longest line to give whole, bytes, its end included.
    """
    while line := stream.readline(longest + 1):
        yield line
        while len(line) > longest and not line.endswith(b"\n"):
            line = stream.readline(longest + 1)


def text_of(line: bytes, longest: int = MAX_LINE) -> str:
    """Return a line that `lines_of` gave as text, without the white space around it.

    Raises:
        LineError: it was too long, or is not UTF-8.
    """
    if len(line) > longest and not line.endswith(b"\n"):
        raise LineError(f"longer than {longest} bytes")
    try:
        return line.decode("utf-8-sig").strip()
    except UnicodeDecodeError as error:
        raise LineError(f"not UTF-8: byte {line[error.start]:#04x} at {error.start}") from None
