"""Packets and events for people: one line each, or a tree of every field with its offset.

Owns layout, colour and the options that choose them. Texts out of packets are made harmless: a peer
must not steer the terminal.
"""

from __future__ import annotations

import argparse
import io
import json
import math
import os
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from enum import Enum
from typing import Any

from openpendant.simplemsg import ByteOrder, Codec, CommType, Message, ReplyCode, message_type
from openpendant.simplemsg.declaration import Reals
from openpendant.simplemsg.framing import Frame
from openpendant.simplemsg.masking import masked_frame
from openpendant.simplemsg.packet_text import packet_to_json

from ...console import ExitCode, clean_json, one_line
from ..trace import Event, TraceDirection, entry_to_json
from .field_table import FieldValue, Value, field_values, remark_on
from .reader import Reading

_NANOSECONDS = 1_000_000_000
_MOST_FIELDS = 8
_LONGEST_TEXT = 60
_REALS_IN_A_ROW = 10

LINE_FIELDS: Mapping[str, tuple[str, ...]] = {
    "joint_feedback": ("robot_id", "valid_fields", "time", "positions"),
    "joint_traj_pt_full": ("robot_id", "sequence", "valid_fields", "time", "positions"),
    "motoman_motion_ctrl": ("robot_id", "sequence", "command"),
    "motoman_motion_reply": ("robot_id", "sequence", "command", "result", "subcode"),
    "verdict": ("request_id", "code", "joint", "value", "limit", "text"),
    "outcome": ("request_id", "outcome", "code", "motion_time", "text"),
    "state": ("sequence", "activity", "request_id", "holder", "stop", "link", "positions"),
}
"""Fields that matter in one line, where not all do; of other messages the first eight are shown."""


class Style(Enum):
    """A colour; the value is the parameter of the escape sequence."""

    DIM = "2"
    RED = "31"
    GREEN = "32"
    YELLOW = "33"
    CYAN = "36"
    BOLD = "1"


Paint = Callable[[str, Style], str]


def painter(choice: str) -> Paint:
    """Return what colours a text; `auto`: on a terminal without NO_COLOR (no-color.org)."""
    wanted = on_terminal() and not os.environ.get("NO_COLOR")
    if choice == "always" or (choice == "auto" and wanted):
        return lambda text, style: f"\x1b[{style.value}m{text}\x1b[0m"
    return lambda text, style: text


def on_terminal() -> bool:
    """Return True if standard output is a terminal; a process may also have none at all."""
    return sys.stdout is not None and sys.stdout.isatty()


def item_as_json(item: Reading | Event) -> dict[str, Any]:
    """Return a packet or an event as a JSON object: its place in the trace, then what it says."""
    if isinstance(item, Event):
        return entry_to_json(item)
    place = entry_to_json(item.packet)
    place.pop("hex")
    place.pop("frame", None)
    answer: dict[str, Any] = {}
    if item.answers is not None and item.latency is not None:
        answer = {"answers": item.answers, "latency": item.latency / _NANOSECONDS}
    if item.message is None:
        digits = masked_frame(item.packet.data).hex()
        said: dict[str, Any] = {"fault": item.fault, "hex": digits}
    else:
        said = packet_to_json(item.message, item.codec)
    return {"number": item.number, **place, **answer, **said}


def item_as_line(item: Reading | Event, paint: Paint) -> str:
    """Return a packet or an event as one line."""
    if isinstance(item, Event):
        where = f"{item.port}/{item.connection}" if item.port else ""
        text = paint(one_line(item.text), Style.YELLOW)
        return f"{'':>6} {item.time / _NANOSECONDS:11.6f}  * {where:<9} {text}"
    packet = item.packet
    arrow = "->" if packet.direction is TraceDirection.TO_SERVER else "<-"
    where = f"{packet.port}/{packet.connection}"
    lead = f"{item.number:>6} {packet.time / _NANOSECONDS:11.6f} {arrow} {where:<9} "
    if item.message is None:
        return lead + _malformed(item.header, item.name, item.fault, packet.data, paint)
    said = message_as_line(item.message, item.codec, paint)
    if item.latency is None:
        return lead + said
    late = f"(answers {item.answers} after {item.latency / 1e6:.3f} ms)"
    return f"{lead}{said} {paint(late, Style.DIM)}"


def _malformed(header: Frame | None, name: str, fault: str, data: bytes, paint: Paint) -> str:
    what = f"{name} " if header is not None else ""
    digits = masked_frame(data)[:24].hex() + ("..." if len(data) > 24 else "")
    return paint(f"MALFORMED {what}{one_line(fault)}", Style.RED) + f" [{digits}]"


def message_as_line(message: Message, codec: Codec, paint: Paint) -> str:
    """Return name, communication type and the fields that matter."""
    name = codec.name_of(message_type(message), message.comm_type)
    if name == "unknown":
        name = f"type {message_type(message)}"
    fields = "".join(f" {_short(field)}" for field in _that_matter(name, message, codec))
    return f"{paint(name, Style.BOLD)} {_kind(message, paint)}{fields}"


def _kind(message: Message, paint: Paint) -> str:
    kind = comm_name(message.comm_type)
    match message.comm_type:
        case CommType.REPLY:
            style = Style.GREEN if message.reply_code == ReplyCode.SUCCESS else Style.RED
            return paint(f"{kind} {_code(message.reply_code)}", style)
        case CommType.REQUEST:
            return paint(kind, Style.CYAN)
    return paint(kind, Style.DIM)


def _that_matter(name: str, message: Message, codec: Codec) -> list[FieldValue]:
    fields = field_values(message, codec)
    chosen = LINE_FIELDS.get(name)
    if chosen is not None:
        known = [field for field in fields if field.path in chosen]
        if known:
            return known
    return fields[:_MOST_FIELDS]


def _short(field: FieldValue) -> str:
    label = f":{field.label}" if field.label else ""
    return f"{field.path}={_value(field.value, short=True)}{label}"


def _value(value: Value, *, short: bool) -> str:
    match value:
        case str():
            text = one_line(value)
            if short and len(text) > _LONGEST_TEXT:
                text = text[:_LONGEST_TEXT] + "..."
            return f'"{text}"'
        case bytes():
            most = _LONGEST_TEXT // 2 if short else len(value)
            digits = value[:most].hex()
            return f"{digits}..." if len(value) > most else digits
        case float():
            return f"{value:.6g}" if short else _real(value)
        case tuple() if short:
            meant = list(value)
            while meant and meant[-1] == 0:
                meant.pop()
            return f"[{' '.join(f'{real:.5g}' for real in meant)}]"
        case tuple():
            return " ".join(map(_real, value))
    return str(value)


def _real(value: float) -> str:
    # Nine digits distinguish every real of four bytes; fewer would not.
    return f"{value:.9g}" if math.isfinite(value) else str(value)


def item_as_tree(item: Reading | Event, paint: Paint) -> str:
    """Return a packet as header and fields, one a line with offset; an event is one line."""
    if isinstance(item, Event):
        return item_as_line(item, paint)
    packet = item.packet
    ways = {
        TraceDirection.TO_SERVER: "client -> server",
        TraceDirection.TO_CLIENT: "server -> client",
    }
    title = f"{item.number}  {packet.time / _NANOSECONDS:.6f} s  {ways[packet.direction]}"
    where = f"port {packet.port}, connection {packet.connection}"
    scenario = f", {one_line(packet.scenario)}" if packet.scenario else ""
    lines = [f"{paint(title, Style.BOLD)}  {where}{scenario}, {len(packet.data)} bytes"]
    if item.latency is not None:
        lines.append(f"      answers {item.answers} after {item.latency / 1e6:.3f} ms")
    lines += frame_as_tree(packet.data, item.message, item.codec, paint)
    if item.message is None:
        lines.append(paint(f"      MALFORMED {one_line(item.fault)}", Style.RED))
        lines += _hex_rows(packet.data)
    return "\n".join(lines)


def frame_as_tree(
    data: bytes, message: Message | None, codec: Codec, paint: Paint
) -> Iterator[str]:
    """Yield header and fields of a frame, one a line with its offset, unit and value's name.

    What the message means beyond its fields follows as a last line.
    """
    header = Frame(data, codec.byte_order)
    if header.has_header:
        length = int.from_bytes(
            data[:4], "little" if codec.byte_order is ByteOrder.LITTLE else "big", signed=True
        )
        name = codec.name_of(header.msg_type, header.comm_type)
        yield _row(0, "length", str(length), "byte", "", paint)
        yield _row(4, "msg_type", str(header.msg_type), "", name, paint)
        yield _row(8, "comm_type", str(header.comm_type), "", comm_name(header.comm_type), paint)
        yield _row(12, "reply_code", str(header.reply_code), "", _code(header.reply_code), paint)
    if message is not None:
        for field in field_values(message, codec):
            yield from _rows(field, codec, paint)
        remark = remark_on(message)
        if remark:
            yield paint(f"{'':>8}{remark}", Style.YELLOW)


def _rows(field: FieldValue, codec: Codec, paint: Paint) -> Iterator[str]:
    value, unit = field.value, field.field.unit
    if isinstance(field.field, Reals) and isinstance(value, tuple):
        shape = field.field.shape
        step = shape[-1] if shape else _REALS_IN_A_ROW
        for at in range(0, len(value), step):
            path = field.path if len(value) <= step else f"{field.path}[{at}:{at + step}]"
            shown = _value(value[at : at + step], short=False)
            yield _row(field.offset + at * codec.real_size, path, shown, unit, "", paint)
        return
    yield _row(field.offset, field.path, _value(value, short=False), unit, field.label, paint)


def _row(offset: int, path: str, value: str, unit: str, label: str, paint: Paint) -> str:
    more = "  ".join(text for text in (unit and f"[{unit}]", label) if text)
    row = f"{paint(f'{offset:>6}', Style.DIM)}  {path:<16} {value}"
    return f"{row}  {paint(more, Style.CYAN)}" if more else row


def _hex_rows(data: bytes) -> Iterator[str]:
    shown = masked_frame(data)[:256]
    for at in range(0, len(shown), 16):
        yield f"{at:>6}  {shown[at : at + 16].hex(' ')}"
    if len(data) > len(shown):
        yield f"{'':>6}  ... {len(data) - len(shown)} bytes more"


def comm_name(number: int) -> str:
    """Return the name of a communication type, such as `request`."""
    return {comm.value: comm.name.lower() for comm in CommType}.get(number, f"comm {number}")


def _code(number: int) -> str:
    return {code.value: code.name.lower() for code in ReplyCode}.get(number, f"code {number}")


class Format(Enum):
    """Format of printed packets; the value is its name on the command line."""

    JSON = "json"
    LINE = "line"
    TREE = "tree"


def add_presentation(command: argparse.ArgumentParser, usual: Format | None) -> None:
    """Add `--format`, `--json`, `--color` and `--max-packets`."""
    told = usual.value if usual else "line on a terminal, else json"
    command.add_argument(
        "--format",
        choices=[form.value for form in Format],
        default=usual.value if usual else None,
        help=f"one JSON object or one line a packet, or every field (default: {told})",
    )
    command.add_argument(
        "--json", dest="format", action="store_const", const="json", help="short for --format json"
    )
    command.add_argument(
        "--color",
        choices=["auto", "always", "never"],
        default="auto",
        help="auto: on a terminal, unless NO_COLOR is set (default)",
    )
    command.add_argument(
        "--max-packets", type=_positive, metavar="N", help="stop after N packets were printed"
    )


def _positive(text: str) -> int:
    number = int(text)
    if number < 1:
        raise ValueError(text)
    return number


class Output:
    """Prints packets and events."""

    def __init__(self, arguments: argparse.Namespace) -> None:
        if isinstance(sys.stdout, io.TextIOWrapper):
            # Texts of any script survive a terminal that cannot show them.
            sys.stdout.reconfigure(errors="backslashreplace")
        usual = Format.LINE if on_terminal() else Format.JSON
        self.form = Format(arguments.format) if arguments.format else usual
        self.paint: Paint = painter(arguments.color)
        self.before_text: Callable[[], None] = lambda: None
        """Called before each text: takes a progress line off the terminal."""
        self._left: int | None = arguments.max_packets
        self._scenario = ""

    @property
    def full(self) -> bool:
        """True when as many packets were printed as were asked for."""
        return self._left == 0

    def print_all(self, items: Iterable[Reading | Event]) -> ExitCode:
        """Print items, as many packets as were asked for; FAILED where one was not decoded."""
        status = ExitCode.OK
        for item in items:
            self.print_item(item)
            if isinstance(item, Reading) and item.message is None:
                status = ExitCode.FAILED
            if self.full:
                break
        return status

    def print_item(self, item: Reading | Event) -> None:
        """Print a packet or an event in the chosen format."""
        scenario = item.scenario if isinstance(item, Event) else item.packet.scenario
        if scenario != self._scenario and self.form is not Format.JSON:
            self.print_text(self.paint(f"== {one_line(scenario)}", Style.BOLD))
        self._scenario = scenario
        match self.form:
            case Format.JSON:
                self.print_text(clean_json(json.dumps(item_as_json(item), allow_nan=False)))
            case Format.LINE:
                self.print_text(item_as_line(item, self.paint))
            case Format.TREE:
                self.print_text(item_as_tree(item, self.paint))
        if isinstance(item, Reading):
            self.count_packet()

    def count_packet(self) -> None:
        """Note that a packet was printed."""
        if self._left is not None:
            self._left -= 1

    def print_text(self, text: str) -> None:
        """Print lines at once, so that a reader sees each packet before the next one comes."""
        self.before_text()
        print(text, flush=True)
