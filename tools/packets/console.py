"""Arguments of the packet tools, their errors and exit codes, and the lines that they read.

No input may end in a traceback; a line has a bounded length. The standard library's argument parser
is used because scripts call these tools often, and it starts in milliseconds.
"""

from __future__ import annotations

import argparse
import errno
import sys
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, nullcontext
from typing import BinaryIO

from openpendant.simplemsg import DIALECTS, ByteOrder, Codec, ProtocolError, codec_for
from openpendant.simplemsg.errors import shown

from ..console import ExitCode, Faults, run_parsed

ORDERS = {"little": ByteOrder.LITTLE, "big": ByteOrder.BIG}


class PacketToolError(Exception):
    """The tool cannot continue; the text is the one line that the user reads."""


class PeerError(PacketToolError):
    """The peer could not be reached, hung up or never answered."""


_FAULTS: Faults = {
    PeerError: ExitCode.REFUSED,
    PacketToolError: ExitCode.USAGE,
    ProtocolError: ExitCode.FAILED,
    OSError: ExitCode.USAGE,
}


def parser(command: str, about: str, epilog: str = "") -> argparse.ArgumentParser:
    """Return an argument parser for `openpendant packets COMMAND`."""
    return argparse.ArgumentParser(
        prog=f"openpendant packets {command}",
        description=about,
        epilog=epilog,
        allow_abbrev=False,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )


def add_wire_form(
    command: argparse.ArgumentParser, *, dialect: str = "standard", order: str | None = "little"
) -> None:
    """Add `--order`, `--real` and `--dialect`; an order of None leaves it to be detected."""
    told = f"default: {order}" if order else "default: detected"
    command.add_argument("--order", choices=ORDERS, default=order, help=f"byte order ({told})")
    command.add_argument(
        "--real", type=int, choices=(4, 8), default=4, help="bytes of a real (default: 4)"
    )
    command.add_argument(
        "--dialect",
        choices=DIALECTS,
        default=dialect,
        help=f"messages to know (default: {dialect})",
    )


def codec_of(arguments: argparse.Namespace, order: ByteOrder | None = None) -> Codec:
    """Return the codec that `add_wire_form`'s arguments name."""
    known = ORDERS[arguments.order] if arguments.order else order or ByteOrder.LITTLE
    return codec_for(DIALECTS[arguments.dialect], known, arguments.real)


def seconds(text: str) -> float:
    """Return the time that an argument names [s]: up to a day, to wait for something."""
    try:
        named = float(text)
    except ValueError:
        named = -1.0
    if not 0 < named <= 86_400:
        raise argparse.ArgumentTypeError(f"{shown(text)} is no time from 0 to 86400 s")
    return named


def run(
    command: argparse.ArgumentParser,
    body: Callable[[argparse.Namespace], int],
    argv: list[str] | None,
) -> int:
    """Parse the arguments and run a command; whatever goes wrong becomes a line and a code."""
    return run_parsed(command, body, argv, _FAULTS)


MAX_LINE = 1_048_576
"""Longest accepted line, bytes; the largest frame needs half of it as JSON."""


class LineError(Exception):
    """A line of the input that cannot be converted; the text says why."""


def open_input(file: str) -> AbstractContextManager[BinaryIO]:
    """Open a file for reading; `-` is standard input, which stays open. OSError if it cannot."""
    if file != "-":
        return open(file, "rb")
    if sys.stdin is None:
        raise OSError(errno.EBADF, "standard input is closed")
    return nullcontext(sys.stdin.buffer)


def lines_of(stream: BinaryIO, longest: int = MAX_LINE) -> Iterator[bytes]:
    """Yield lines as they come; of a line that is too long only the beginning, to bound memory."""
    while line := stream.readline(longest + 1):
        yield line
        while len(line) > longest and not line.endswith(b"\n"):
            line = stream.readline(longest + 1)


def text_of(line: bytes, longest: int = MAX_LINE) -> str:
    """Return a line of `lines_of` as stripped text; LineError where too long, or not UTF-8."""
    if len(line) > longest and not line.endswith(b"\n"):
        raise LineError(f"longer than {longest} bytes")
    try:
        return line.decode("utf-8-sig").strip()
    except UnicodeDecodeError as error:
        raise LineError(f"not UTF-8: byte {line[error.start]:#04x} at {error.start}") from None
