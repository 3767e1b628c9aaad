"""A trace: the packets and events of some connections in time order.

Every packet tool reads and writes this one form. On disk it is JSON lines (a header line, then one
object an entry), with the keys of the captures in `tests/vectors`: `t` in seconds from the start,
`dir`, `port`, `conn`, `hex`, or `event` in words. Knows nothing of messages, sockets or clocks.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from enum import Enum
from typing import Any

FORMAT = "openpendant-trace/1"
"""Name and version of the file format, in the header line."""

MAX_ENTRY = 262_144
"""Longest accepted line of a trace file, bytes; the largest frame needs half of it."""

_NANOSECONDS = 1_000_000_000
_GREATEST = 2**31 - 1
LONGEST_TRACE = 1_000_000_000
"""No entry is further from the start than this [s]; a wild number is none."""


class TraceDirection(Enum):
    """Direction in which a packet travelled; the server is the end that listens."""

    TO_SERVER = "client->server"
    TO_CLIENT = "server->client"


@dataclass(frozen=True, slots=True)
class Packet:
    """Bytes that travelled in one piece of the protocol.

    Attributes:
        time: since the start of the trace [ns].
        data: one whole frame, prefix included.
        port: TCP port of the server's end, 0 where unknown.
        connection: number of the connection on that port, from 1.
        scenario: name of the part of the trace, empty where there are no parts.
        is_frame: False for bytes in which no frame can be found (a stream out of step, or one
            that ended inside a frame).
    """

    time: int
    direction: TraceDirection
    data: bytes
    port: int = 0
    connection: int = 1
    scenario: str = ""
    is_frame: bool = True


@dataclass(frozen=True, slots=True)
class Event:
    """Something that happened to a connection.

    Attributes:
        time: since the start of the trace [ns].
        text: what happened, e.g. `client-connected`.
        port: TCP port of the server's end, 0 where it concerns none.
        connection: number of the connection on that port, 0 where it concerns none.
        scenario: name of the part of the trace, empty where there are no parts.
    """

    time: int
    text: str
    port: int = 0
    connection: int = 0
    scenario: str = ""


Entry = Packet | Event


class EntryError(ValueError):
    """A JSON object is no entry of a trace; the text says why."""


def entry_to_json(entry: Entry) -> dict[str, Any]:
    """Return an entry as a JSON object."""
    shared: dict[str, Any] = {"scenario": entry.scenario} if entry.scenario else {}
    shared["t"] = entry.time / _NANOSECONDS
    if isinstance(entry, Event):
        where = {"port": entry.port, "conn": entry.connection}
        return {**shared, "dir": "event", **where, "event": entry.text}
    packet = {
        **shared,
        "dir": entry.direction.value,
        "port": entry.port,
        "conn": entry.connection,
        "hex": entry.data.hex(),
    }
    return packet if entry.is_frame else {**packet, "frame": False}


def entry_from_json(value: Any) -> Entry:
    """Return the entry that a JSON object describes; EntryError names a missing or wrong key."""
    if not isinstance(value, dict):
        raise EntryError("an entry is a JSON object")
    seconds = value.get("t")
    if isinstance(seconds, bool) or not isinstance(seconds, int | float):
        raise EntryError("t must be a number of seconds")
    if not -LONGEST_TRACE <= seconds <= LONGEST_TRACE:
        raise EntryError("t is no time of a trace")
    time = round(seconds * _NANOSECONDS)
    port, connection = _integer(value, "port", 0), _integer(value, "conn", 0)
    scenario = _text(value, "scenario", "")
    kind = value.get("dir")
    if kind == "event":
        return Event(time, _text(value, "event", None), port, connection, scenario)
    try:
        direction = TraceDirection(kind)
    except ValueError:
        known = ", ".join(member.value for member in TraceDirection)
        raise EntryError(f"dir must be event, {known}") from None
    try:
        data = bytes.fromhex(_text(value, "hex", None))
    except ValueError:
        raise EntryError("hex must be pairs of hexadecimal digits") from None
    is_frame = value.get("frame", True) is not False
    return Packet(time, direction, data, port, connection, scenario, is_frame)


def header_line(started: str, **more: str | int | float) -> str:
    """Return the first line of a trace file, with the wall-clock time of t = 0, ISO 8601."""
    return json.dumps({"format": FORMAT, "started": started, **more})


def entry_line(entry: Entry) -> str:
    """Return an entry as a line of a trace file, without the line feed."""
    return json.dumps(entry_to_json(entry))


def _integer(value: dict[str, Any], key: str, default: int) -> int:
    number = value.get(key, default)
    if isinstance(number, bool) or not isinstance(number, int):
        raise EntryError(f"{key} must be an integer")
    if not 0 <= number <= _GREATEST:
        raise EntryError(f"{key} must be 0 to {_GREATEST}")
    return number


def _text(value: dict[str, Any], key: str, default: str | None) -> str:
    text = value.get(key, default)
    if not isinstance(text, str):
        raise EntryError(f"{key} must be a string")
    return text
