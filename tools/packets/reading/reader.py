"""Packets of a trace, read: their messages, and which request each reply answers.

Owns, for each connection, the byte order and the requests that wait for a reply: replies answer
them in order, topics never; and the options that state the wire form. Reads packets one after the
other and keeps a bounded amount.
"""

from __future__ import annotations

import argparse
from collections import deque
from dataclasses import dataclass, field

from openpendant.simplemsg import (
    DIALECTS,
    MOTOMAN,
    PENDANT,
    STANDARD,
    ByteOrder,
    Codec,
    CommType,
    Dialect,
    Message,
    MessageFault,
    codec_for,
)
from openpendant.simplemsg.framing import HEADER_SIZE, Frame, detect_byte_order

from ..console import ORDERS
from ..trace import Entry, Event, Packet, TraceDirection

MAX_CONVERSATIONS = 4_096
"""Most connections kept in mind at once."""

MAX_UNANSWERED = 10_000
"""Most requests of one end kept in mind for their replies."""

_BEGINNINGS = ("client-connected", "found-connected")


@dataclass(frozen=True, slots=True)
class Reading:
    """Decoded content of a packet.

    Attributes:
        number: place among the packets of the trace, from 1.
        header: the frame, None where it is shorter than a header.
        message: None where it is malformed.
        fault: why it is malformed, empty where it is not.
        answers: number of the request that it answers, None where it answers none.
        latency: time since that request [ns].
    """

    number: int
    packet: Packet
    codec: Codec
    header: Frame | None
    message: Message | None
    fault: str = ""
    answers: int | None = None
    latency: int | None = None

    @property
    def name(self) -> str:
        """Name of the message type, `unknown` where there is none."""
        if self.header is None:
            return "unknown"
        return self.codec.name_of(self.header.msg_type, self.header.comm_type)


@dataclass(slots=True)
class _Conversation:
    """State kept of one connection."""

    byte_order: ByteOrder | None
    unanswered: dict[TraceDirection, deque[tuple[int, int]]] = field(
        default_factory=lambda: {way: deque(maxlen=MAX_UNANSWERED) for way in TraceDirection}
    )


class Reader:
    """Reads the packets of a trace one after the other."""

    def __init__(self, dialect: Dialect, order: ByteOrder | None, real_size: int) -> None:
        """Make a reader; an order of None is detected for each connection."""
        self._dialect = dialect
        self._order = order
        self._real_size = real_size
        self._count = 0
        self._conversations: dict[tuple[str, int, int], _Conversation] = {}

    def read(self, entry: Entry) -> Reading | Event:
        """Return what an entry says; events are what they are."""
        if isinstance(entry, Event):
            if entry.text.startswith(_BEGINNINGS):
                self._conversations.pop((entry.scenario, entry.port, entry.connection), None)
            return entry
        self._count += 1
        conversation = self._conversation(entry)
        found = detect_byte_order(entry.data) if len(entry.data) >= HEADER_SIZE else None
        if conversation.byte_order is None and entry.is_frame:
            conversation.byte_order = found
        order = conversation.byte_order or ByteOrder.LITTLE
        codec = codec_for(self._dialect, order, self._real_size)
        frame = Frame(entry.data, order)
        header = frame if entry.is_frame and frame.has_header else None
        message, fault = None, ""
        if not entry.is_frame:
            fault = f"{len(entry.data)} bytes that are no frame"
        elif found is not None and found is not order:
            fault = f"in {found.name.lower()}-endian, the connection is {order.name.lower()}-endian"
        else:
            try:
                message = codec.decode(entry.data)
            except MessageFault as error:
                fault = str(error)
        reading = Reading(self._count, entry, codec, header, message, fault)
        return self._paired(reading, conversation)

    def _conversation(self, packet: Packet) -> _Conversation:
        key = (packet.scenario, packet.port, packet.connection)
        conversation = self._conversations.pop(key, None) or _Conversation(self._order)
        self._conversations[key] = conversation  # the last one is the one last received from
        if len(self._conversations) > MAX_CONVERSATIONS:
            self._conversations.pop(next(iter(self._conversations)))
        return conversation

    def _paired(self, reading: Reading, conversation: _Conversation) -> Reading:
        header, packet = reading.header, reading.packet
        if header is None:
            return reading
        if header.comm_type == CommType.REQUEST:
            conversation.unanswered[packet.direction].append((reading.number, packet.time))
        elif header.comm_type == CommType.REPLY:
            waiting = conversation.unanswered[_other(packet.direction)]
            if waiting:
                number, time = waiting.popleft()
                return Reading(
                    reading.number,
                    packet,
                    reading.codec,
                    header,
                    reading.message,
                    reading.fault,
                    number,
                    packet.time - time,
                )
        return reading


def _other(direction: TraceDirection) -> TraceDirection:
    return (
        TraceDirection.TO_CLIENT
        if direction is TraceDirection.TO_SERVER
        else TraceDirection.TO_SERVER
    )


def _every_message() -> tuple[type[Message], ...]:
    known = STANDARD.messages + MOTOMAN.messages + PENDANT.messages
    return tuple(dict.fromkeys(known))


ALL = Dialect("all", _every_message())
"""Every message that any dialect knows."""

READABLE = {**DIALECTS, ALL.name: ALL}


def add_reading_form(
    command: argparse.ArgumentParser, *, dialect: str | None = None, order: str | None = None
) -> None:
    """Add `--order`, `--real` and `--dialect`; a default of None leaves it to the input."""
    command.add_argument(
        "--order",
        choices=ORDERS,
        default=order,
        help=f"byte order (default: {order or 'detected; little for hexadecimal lines'})",
    )
    command.add_argument(
        "--real", type=int, choices=(4, 8), default=4, help="bytes of a real (default: 4)"
    )
    command.add_argument(
        "--dialect",
        choices=READABLE,
        default=dialect,
        help=f"messages to know (default: {dialect or 'all; standard for hexadecimal lines'})",
    )


def codec_of(arguments: argparse.Namespace) -> Codec:
    """Return the codec for hexadecimal lines; little-endian and standard unless told otherwise."""
    order = ORDERS[arguments.order] if arguments.order else ByteOrder.LITTLE
    dialect = READABLE[arguments.dialect] if arguments.dialect else STANDARD
    return codec_for(dialect, order, arguments.real)


def reader_of(arguments: argparse.Namespace) -> Reader:
    """Return the reader for a trace; it detects byte orders and knows all unless told otherwise."""
    order = ORDERS[arguments.order] if arguments.order else None
    dialect = READABLE[arguments.dialect] if arguments.dialect else ALL
    return Reader(dialect, order, arguments.real)
