"""`openpendant packets show`: packets and events of a trace, listed, counted, or one followed.

Owns what belongs to a followed request (its reply, and the robot's motion that it caused), and what
is counted of each kind of packet.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterator
from dataclasses import dataclass, field
from enum import Enum
from typing import Any

from openpendant.simplemsg import CommType, MsgType, ReplyCode, Status, TriState
from openpendant.simplemsg.errors import shown
from openpendant.simplemsg.pendant import JointMove, JointPath, Outcome, PoseMove, PosePath

from ..console import ExitCode, complain
from .console import PacketToolError, open_input, parser, run
from .reading.filters import Filters, add_filters, filters_of
from .reading.presentation import Format, Output, add_presentation, comm_name
from .reading.progress import watched
from .reading.reader import Reading, add_reading_form, reader_of
from .reading.trace_files import FileKind, read_trace
from .trace import Event, TraceDirection

PATIENCE = 2_000_000_000
"""Longest time from the reply to the start of the robot's motion [ns]."""

_TRAJECTORIES = {11, 12, 14, 2016}
_JOINT_STATES = {MsgType.JOINT_POSITION, MsgType.STATUS, MsgType.JOINT_FEEDBACK, 2017}
_PENDANT_MOTIONS = (JointMove, PoseMove, JointPath, PosePath)


class FollowStage(Enum):
    """Progress of the request."""

    SOUGHT = "the request was not found"
    ASKED = "no reply"
    ANSWERED = "answered"
    MOVED = "in motion"
    ENDED = "ended"


class Follower:
    """Selection of the packets of a trace that belong to one request."""

    def __init__(self, number: int) -> None:
        self.stage = FollowStage.SOUGHT
        self.replied = False
        self._number = number
        self._seen = 0
        self._request: Reading | None = None
        self._replied_at = 0

    def belongs(self, item: Reading | Event) -> bool:
        """Return True for a packet of the request; PacketToolError where that is no request."""
        if isinstance(item, Event):
            return False
        self._seen = item.number
        if self._request is None:
            return item.number == self._number and self._found(item)
        if item.packet.scenario != self._request.packet.scenario:
            self.stage = FollowStage.ENDED
        if self.stage is FollowStage.ENDED:
            return False
        if item.answers == self._number:
            self._take_reply(item)
            return True
        if self._is_trajectory:
            return self._is_robot_state(item)
        return self._is_outcome(item)

    def finish(self) -> None:
        """End the trace; raise PacketToolError where it has no packet of that number."""
        if self._request is None:
            raise PacketToolError(f"no packet {self._number}: the trace has {self._seen}")

    @property
    def _is_trajectory(self) -> bool:
        header = self._request.header if self._request else None
        return header is not None and header.msg_type in _TRAJECTORIES

    def _found(self, item: Reading) -> bool:
        kind = item.header.comm_type if item.header else None
        if kind != CommType.REQUEST:
            hint = f"; it answers request {item.answers}" if item.answers else ""
            raise PacketToolError(f"packet {self._number} is no request{hint}")
        self._request = item
        self.stage = FollowStage.ASKED
        return True

    def _take_reply(self, reply: Reading) -> None:
        self.replied = True
        self._replied_at = reply.packet.time
        refused = reply.header is None or reply.header.reply_code != ReplyCode.SUCCESS
        moves = self._is_trajectory or isinstance(self._message, _PENDANT_MOTIONS)
        if refused or not moves:
            self.stage = FollowStage.ENDED
        elif self.stage is FollowStage.ASKED:
            self.stage = FollowStage.ANSWERED

    @property
    def _message(self) -> object:
        return self._request.message if self._request else None

    def _is_robot_state(self, item: Reading) -> bool:
        header, packet = item.header, item.packet
        if header is None or packet.direction is not TraceDirection.TO_CLIENT:
            return False
        if header.comm_type != CommType.TOPIC or header.msg_type not in _JOINT_STATES:
            return False
        if self.stage is FollowStage.ANSWERED and packet.time - self._replied_at > PATIENCE:
            self.stage = FollowStage.ENDED
            return False
        if isinstance(item.message, Status):
            self._judge(item.message)
        return True

    def _judge(self, status: Status) -> None:
        if status.in_motion == TriState.TRUE:
            self.stage = FollowStage.MOVED
        elif (
            status.in_motion == TriState.FALSE and self.stage is FollowStage.MOVED and self.replied
        ):
            self.stage = FollowStage.ENDED

    def _is_outcome(self, item: Reading) -> bool:
        asked, request = self._message, self._request
        if request is None or not isinstance(asked, _PENDANT_MOTIONS):
            return False
        if not isinstance(item.message, Outcome) or item.message.request_id != asked.request_id:
            return False
        here, there = item.packet, request.packet
        if (here.port, here.connection) != (there.port, there.connection):
            return False
        self.stage = FollowStage.ENDED
        return True


MAX_KINDS = 10_000
"""Most kinds counted apart; packets of further kinds are counted together."""

_NANOSECONDS = 1_000_000_000
_HEADINGS = (
    "direction", "type", "name", "comm", "count", "malformed", "rate/s", "first", "last",
    "bytes", "latency/ms",
)  # fmt: skip


@dataclass(slots=True)
class _Tally:
    """Counts of one kind of packet."""

    count: int = 0
    malformed: int = 0
    size: int = 0
    answered: int = 0
    latency: int = 0
    first: int | None = None
    last: int = 0
    spans: dict[str, tuple[int, int, int]] = field(default_factory=dict)

    def add(self, reading: Reading) -> None:
        time, scenario = reading.packet.time, reading.packet.scenario
        self.count += 1
        self.malformed += reading.message is None
        self.size += len(reading.packet.data)
        self.first = time if self.first is None else min(self.first, time)
        self.last = max(self.last, time)
        if reading.latency is not None:
            self.answered += 1
            self.latency += reading.latency
        begin, _, count = self.spans.get(scenario, (time, time, 0))
        if scenario in self.spans or len(self.spans) < MAX_KINDS:
            self.spans[scenario] = (begin, time, count + 1)

    def rate(self) -> float | None:
        """Packets a second; time runs anew in each scenario."""
        passed = sum(end - begin for begin, end, _ in self.spans.values())
        intervals = sum(count - 1 for _, _, count in self.spans.values())
        return intervals * _NANOSECONDS / passed if passed > 0 else None


_Kind = tuple[str, int | None, str, str]


class Summary:
    """Counts packets by direction, type and communication type."""

    def __init__(self) -> None:
        self._tallies: dict[_Kind, _Tally] = {}

    def add(self, reading: Reading) -> None:
        """Count a packet."""
        way = "to-server" if reading.packet.direction is TraceDirection.TO_SERVER else "to-client"
        kind: _Kind = (way, None, "no frame", "")
        if reading.header is not None:
            header = reading.header
            kind = (way, header.msg_type, reading.name, comm_name(header.comm_type))
        if kind not in self._tallies and len(self._tallies) >= MAX_KINDS:
            kind = (way, None, "others", "")
        self._tallies.setdefault(kind, _Tally()).add(reading)

    def rows(self) -> list[dict[str, Any]]:
        """Return a JSON object for each kind: times in seconds, mean latency in seconds."""
        rows: list[dict[str, Any]] = []
        for (way, msg_type, name, comm), tally in sorted(
            self._tallies.items(), key=lambda item: (item[0][0], item[0][1] or 0, item[0][3])
        ):
            answered = tally.answered
            rows.append(
                {
                    "direction": way,
                    "msg_type": msg_type,
                    "name": name,
                    "comm": comm,
                    "count": tally.count,
                    "malformed": tally.malformed,
                    "rate": tally.rate(),
                    "first": (tally.first or 0) / _NANOSECONDS,
                    "last": tally.last / _NANOSECONDS,
                    "bytes": tally.size,
                    "latency": tally.latency / answered / _NANOSECONDS if answered else None,
                }
            )
        return rows

    def table(self) -> str:
        """Return the rows as a table."""
        cells = [list(_HEADINGS), *(_cells(row) for row in self.rows())]
        widths = [max(len(line[column]) for line in cells) for column in range(len(_HEADINGS))]
        left = {0, 2, 3}
        return "\n".join(
            "  ".join(
                text.ljust(width) if column in left else text.rjust(width)
                for column, (text, width) in enumerate(zip(line, widths, strict=True))
            ).rstrip()
            for line in cells
        )


def _cells(row: dict[str, Any]) -> list[str]:
    rate, latency = row["rate"], row["latency"]
    return [
        row["direction"],
        "" if row["msg_type"] is None else str(row["msg_type"]),
        row["name"],
        row["comm"],
        str(row["count"]),
        str(row["malformed"]),
        "" if rate is None else f"{rate:.1f}",
        f"{row['first']:.3f}",
        f"{row['last']:.3f}",
        str(row["bytes"]),
        "" if latency is None else f"{latency * 1000:.3f}",
    ]


_ABOUT = """\
List the packets and events of a trace (JSON lines), a capture list, a pcap or pcapng file. Replies
are shown with the number of the request that they answer, and the time since it."""

_EPILOG = """\
exit codes: 0 done; 1 a packet that is shown could not be decoded, or the followed request has no
reply; 2 wrong usage, or a file that is none of these or breaks off (what came before is shown)."""

_Items = Iterator[Reading | Event]


def main(argv: list[str] | None = None) -> int:
    """Run the command and return its exit code."""
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
    with open_input(arguments.file) as opened, watched(opened) as (stream, progress):
        output.before_text = progress.clear
        items = (reader.read(entry) for entry in read_trace(stream, kind))
        if arguments.follow is not None:
            return _follow(items, filters, arguments.follow, output)
        wanted = (item for item in items if filters.fits(item))
        return _count(wanted, output) if arguments.count else output.print_all(wanted)


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
