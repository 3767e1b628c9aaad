"""`openpendant packets encode`: JSON objects, one a line, to packets in hexadecimal digits."""

from __future__ import annotations

import argparse
import json
from typing import Any, NoReturn

from openpendant.simplemsg import Codec, ProtocolError
from openpendant.simplemsg.packet_text import packet_from_json

from ..console import ExitCode, complain
from .console import LineError, lines_of, open_input, parser, run, text_of
from .reading.reader import add_reading_form, codec_of

_ABOUT = "Read packets as JSON objects, one a line, as decode prints them; print hexadecimal."


def main(argv: list[str] | None = None) -> int:
    """Run the command and return its exit code."""
    command = parser("encode", _ABOUT)
    command.add_argument(
        "file",
        nargs="?",
        default="-",
        metavar="FILE",
        help="one packet a line; - or nothing reads standard input",
    )
    add_reading_form(command, dialect="standard", order="little")
    return run(command, _encode, argv)


def _encode(arguments: argparse.Namespace) -> int:
    codec = codec_of(arguments)
    status = ExitCode.OK
    with open_input(arguments.file) as stream:
        for number, raw in enumerate(lines_of(stream), start=1):
            try:
                line = text_of(raw)
                if line:
                    print(encode_line(line, codec), flush=True)
            except (LineError, ProtocolError) as error:
                complain(f"line {number}: {error}")
                status = ExitCode.FAILED
    return status


def encode_line(line: str, codec: Codec) -> str:
    """Return the packet that JSON describes, in hexadecimal; LineError, ProtocolError for none."""
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
