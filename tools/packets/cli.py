"""`openpendant packets`: packets as hexadecimal digits to JSON, and back, line by line.

Owns the arguments, the reading of lines and the messages to the user. The standard library's
argument parser is used because scripts call this command often, and it starts in milliseconds.
"""

from __future__ import annotations

import argparse
import errno
import json
import os
import string
import sys
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, nullcontext
from typing import Any, BinaryIO, NoReturn

from openpendant.simplemsg import DIALECTS, ByteOrder, Codec, ProtocolError, codec_for
from openpendant.simplemsg.errors import shown
from openpendant.simplemsg.text import packet_from_json, packet_to_json

MAX_LINE = 1_048_576
"""Longest accepted line, bytes; the largest frame needs half of it as JSON."""

_USAGE_ERROR = 2
_INTERRUPTED = 130

_ORDERS = {"little": ByteOrder.LITTLE, "big": ByteOrder.BIG}

Convert = Callable[[str, Codec], str]


class LineError(Exception):
    """A line of the input that cannot be converted; the text says why."""


def main(argv: list[str] | None = None) -> int:
    """Run the command.

    Args:
        argv: arguments behind `openpendant packets`; None takes those of the process.

    Returns:
        0 when every line was converted, 1 when one was not or the reader went away, 2 for wrong
        arguments or an unreadable file.
    """
    try:
        arguments = _parser().parse_args(argv)
    except SystemExit as stop:
        return stop.code if isinstance(stop.code, int) else 0
    codec = codec_for(DIALECTS[arguments.dialect], _ORDERS[arguments.order], arguments.real)
    try:
        with _open(arguments.file) as stream:
            return _convert_lines(stream, arguments.convert, codec)
    except BrokenPipeError:
        # Nobody reads any more; Python would complain again when it flushes at its end.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1
    except OSError as error:
        _complain(f"{arguments.file}: {error.strerror}")
        return _USAGE_ERROR
    except KeyboardInterrupt:
        return _INTERRUPTED


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="openpendant packets",
        description="Simple-message packets, one a line, between hexadecimal digits and JSON.",
        allow_abbrev=False,
    )
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
    for name, convert, about in (
        ("decode", decode_line, "read packets as hexadecimal digits, print JSON objects"),
        ("encode", encode_line, "read JSON objects as decode prints them, print hexadecimal"),
    ):
        command = commands.add_parser(name, help=about, description=about, allow_abbrev=False)
        command.add_argument(
            "file",
            nargs="?",
            default="-",
            metavar="FILE",
            help="one packet a line; - or nothing reads standard input",
        )
        command.add_argument(
            "--order", choices=_ORDERS, default="little", help="byte order (default: little)"
        )
        command.add_argument(
            "--real", type=int, choices=(4, 8), default=4, help="bytes of a real (default: 4)"
        )
        command.add_argument(
            "--dialect",
            choices=DIALECTS,
            default="standard",
            help="messages to know (default: standard)",
        )
        command.set_defaults(convert=convert)
    return parser


def _open(file: str) -> AbstractContextManager[BinaryIO]:
    if file != "-":
        return open(file, "rb")
    if sys.stdin is None:
        raise OSError(errno.EBADF, "standard input is closed")
    return nullcontext(sys.stdin.buffer)


def _convert_lines(stream: BinaryIO, convert: Convert, codec: Codec) -> int:
    status = 0
    for number, raw in enumerate(_lines(stream), start=1):
        try:
            line = _text(raw)
            if line:
                print(convert(line, codec), flush=True)
        except (LineError, ProtocolError) as error:
            _complain(f"line {number}: {error}")
            status = 1
    return status


def _complain(sentence: str) -> None:
    print(sentence, file=sys.stderr, flush=True)


def _lines(stream: BinaryIO) -> Iterator[bytes]:
    """Give lines as they come; of a line that is too long only the beginning, to bound memory."""
    while line := stream.readline(MAX_LINE + 1):
        yield line
        while len(line) > MAX_LINE and not line.endswith(b"\n"):
            line = stream.readline(MAX_LINE + 1)


def _text(raw: bytes) -> str:
    if len(raw) > MAX_LINE and not raw.endswith(b"\n"):
        raise LineError(f"longer than {MAX_LINE} bytes")
    try:
        return raw.decode("utf-8-sig").strip()
    except UnicodeDecodeError as error:
        raise LineError(f"not UTF-8: byte {raw[error.start]:#04x} at {error.start}") from None


def decode_line(line: str, codec: Codec) -> str:
    """Return the packet in hexadecimal digits as a JSON object.

    Digits may be in upper or lower case, apart or together, with or without `0x`.

    Raises:
        LineError: these are no hexadecimal digits.
        ProtocolError: these are no packet.
    """
    digits = "".join(part.removeprefix("0x").removeprefix("0X") for part in line.split())
    for digit in digits:
        if digit not in string.hexdigits:
            raise LineError(f"{shown(digit)} is no hexadecimal digit")
    if len(digits) % 2:
        raise LineError(f"an odd number of hexadecimal digits: {len(digits)}")
    packet = packet_to_json(codec.decode(bytes.fromhex(digits)), codec)
    return json.dumps(packet, allow_nan=False)


def encode_line(line: str, codec: Codec) -> str:
    """Return the packet that a JSON object describes, in hexadecimal digits.

    Raises:
        LineError: this is no JSON.
        ProtocolError: this is no packet, or one that cannot be encoded.
    """
    return codec.encode(packet_from_json(_parse(line), codec)).hex()


def _parse(line: str) -> Any:
    try:
        return json.loads(line, parse_constant=_refuse_constant)
    except json.JSONDecodeError as error:
        raise LineError(f"no JSON: {error.msg} at column {error.colno}") from None
    except RecursionError:
        raise LineError("no packet: nested too deeply") from None
    except ValueError:  # Python refuses to read integers of thousands of digits
        raise LineError("no packet: an integer of thousands of digits") from None


def _refuse_constant(name: str) -> NoReturn:
    raise LineError(f'no JSON: {name}; write "nan", "inf" or "-inf"')


if __name__ == "__main__":
    sys.exit(main())
