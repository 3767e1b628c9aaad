"""`openpendant packets show`: packets and events of a trace, listed, counted, or one followed."""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterator

from openpendant.simplemsg.errors import shown

from ..console import ExitCode, complain
from .console import parser, run
from .reading.filters import Filters, add_filters, filters_of
from .reading.following import Follower, FollowStage
from .reading.output import Format, Output, add_presentation
from .reading.reader import Reading
from .reading.summary import Summary
from .reading.text_lines import open_input
from .reading.trace_files import FileKind, read_trace
from .reading.wire_form import add_reading_form, reader_of
from .trace import Event

_ABOUT = """\
List the packets and events of a trace (JSON lines), a capture list, a pcap or pcapng file. Replies
are shown with the number of the request that they answer, and the time since it."""

_EPILOG = """\
exit codes: 0 done; 1 a packet that is shown could not be decoded, or the followed request has no
reply; 2 wrong usage, or a file that is none of these or breaks off (what came before is shown)."""

_Items = Iterator[Reading | Event]


def main(argv: list[str] | None = None) -> int:
    """Run the command.

    Args:
        argv: arguments behind `openpendant packets show`; None takes those of the process.

    Returns:
        0 when done, 1 when a packet that is shown could not be decoded or the followed request has
        no reply, 2 for wrong arguments or a file that cannot be read to its end.
    """
    command = parser("show", _ABOUT, _EPILOG)
    command.add_argument("file", metavar="FILE", help="- reads standard input")
    command.add_argument(
        "--input",
        choices=[kind.value for kind in FileKind if kind is not FileKind.HEX],
        help="what FILE holds (default: seen from its content); pcap is pcapng too",
    )
    what = command.add_mutually_exclusive_group()
    what.add_argument("--count", action="store_true", help="print a table: how many of each type")
    what.add_argument(
        "--follow",
        type=int,
        metavar="N",
        help="only request number N, its reply, and what the robot reports until it rests",
    )
    add_filters(command)
    add_reading_form(command)
    add_presentation(command, usual=Format.LINE)
    return run(command, _show, argv)


def _show(arguments: argparse.Namespace) -> int:
    output, filters = Output(arguments), filters_of(arguments)
    reader = reader_of(arguments)
    kind = FileKind(arguments.input) if arguments.input else None
    with open_input(arguments.file) as stream:
        items = (reader.read(entry) for entry in read_trace(stream, kind))
        if arguments.follow is not None:
            return _follow(items, filters, arguments.follow, output)
        wanted = (item for item in items if filters.fits(item))
        return _count(wanted, output) if arguments.count else _list(wanted, output)


def _list(items: _Items, output: Output) -> int:
    status = ExitCode.OK
    for item in items:
        output.print_item(item)
        if isinstance(item, Reading) and item.message is None:
            status = ExitCode.FAILED
        if output.full:
            break
    return status


def _count(items: _Items, output: Output) -> int:
    summary = Summary()
    status = ExitCode.OK
    try:
        for item in items:
            if isinstance(item, Reading):
                summary.add(item)
                status = ExitCode.FAILED if item.message is None else status
    finally:  # also of a file that breaks off
        if output.form is Format.JSON:
            for row in summary.rows():
                output.print_text(json.dumps(row))
        else:
            output.print_text(summary.table())
    return status


def _follow(items: _Items, filters: Filters, number: int, output: Output) -> int:
    follower = Follower(number)
    for item in items:
        if follower.belongs(item) and filters.fits(item):
            output.print_item(item)
        if output.full or follower.stage is FollowStage.ENDED:
            break
    else:
        follower.finish()
    if not follower.replied:
        complain(f"request {shown(number)} has no reply in this trace")
        return ExitCode.FAILED
    return ExitCode.OK
