"""`openpendant packets decode`: what the packets in hexadecimal lines and trace files say.

Owns the command and the reading of hexadecimal lines. What a file holds is seen from its content.
"""

from __future__ import annotations

import argparse
import json
import string
from typing import BinaryIO

from openpendant.simplemsg import Codec, ProtocolError
from openpendant.simplemsg.errors import shown
from openpendant.simplemsg.packet_text import packet_to_json

from ..console import ExitCode, complain
from .console import LineError, lines_of, open_input, parser, run, text_of
from .reading.presentation import Format, Output, add_presentation, frame_as_tree, message_as_line
from .reading.progress import watched
from .reading.reader import add_reading_form, codec_of, reader_of
from .reading.trace_files import FileKind, detect, read_trace

_ABOUT = """\
Read packets and print what they say. FILE holds hexadecimal digits (one packet a line), a trace
(JSON lines), a capture list (JSON array), or is a pcap or pcapng file; its content tells which."""

_EPILOG = """\
exit codes: 0 every packet decoded; 1 one did not, or the reader went away; 2 wrong usage, or a
file that is none of these or breaks off (what came before is printed)."""


def main(argv: list[str] | None = None) -> int:
    """Run the command and return its exit code."""
    command = parser("decode", _ABOUT, _EPILOG)
    command.add_argument(
        "file", nargs="?", default="-", metavar="FILE", help="- or nothing reads standard input"
    )
    command.add_argument(
        "--input",
        choices=[kind.value for kind in FileKind],
        help="what FILE holds (default: seen from its content); pcap is pcapng too",
    )
    add_reading_form(command)
    add_presentation(command, usual=None)
    return run(command, _decode, argv)


def _decode(arguments: argparse.Namespace) -> int:
    output = Output(arguments)
    with open_input(arguments.file) as opened, watched(opened) as (stream, progress):
        output.before_text = progress.clear
        if arguments.input:
            kind = FileKind(arguments.input)
        else:
            kind, stream = detect(stream)
        if kind is FileKind.HEX:
            return _decode_lines(stream, codec_of(arguments), output)
        return output.print_all(map(reader_of(arguments).read, read_trace(stream, kind)))


def _decode_lines(stream: BinaryIO, codec: Codec, output: Output) -> int:
    status = ExitCode.OK
    for number, raw in enumerate(lines_of(stream), start=1):
        try:
            line = text_of(raw)
            if not line:
                continue
            output.print_text(_line_as(output, line, codec))
        except (LineError, ProtocolError) as error:
            complain(f"line {number}: {error}")
            status = ExitCode.FAILED
            continue
        output.count_packet()
        if output.full:
            break
    return status


def _line_as(output: Output, line: str, codec: Codec) -> str:
    if output.form is Format.JSON:
        return decode_line(line, codec)
    frame = _frame_in(line)
    message = codec.decode(frame)
    title = message_as_line(message, codec, output.paint)
    if output.form is Format.LINE:
        return title
    return "\n".join([title, *frame_as_tree(frame, message, codec, output.paint)])


def decode_line(line: str, codec: Codec) -> str:
    """Return a packet in hexadecimal digits as JSON; LineError or ProtocolError for no packet.

    Digits may be in upper or lower case, apart or together, with or without `0x`.
    """
    packet = packet_to_json(codec.decode(_frame_in(line)), codec)
    return json.dumps(packet, allow_nan=False)


def _frame_in(line: str) -> bytes:
    digits = "".join(part.removeprefix("0x").removeprefix("0X") for part in line.split())
    for digit in digits:
        if digit not in string.hexdigits:
            raise LineError(f"{shown(digit)} is no hexadecimal digit")
    if len(digits) % 2:
        raise LineError(f"an odd number of hexadecimal digits: {len(digits)}")
    return bytes.fromhex(digits)
