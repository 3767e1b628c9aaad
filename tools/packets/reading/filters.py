"""Filters that select packets and events of a trace.

Owns the conditions of `show` and how they are written on the command line.
"""

from __future__ import annotations

import argparse
import math
import operator
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from openpendant.simplemsg import CommType

from ..trace import Entry, Event, TraceDirection
from .field_table import FieldValue, field_values
from .reader import ALL, Reading

_NANOSECONDS = 1_000_000_000
_WAYS = {"to-server": TraceDirection.TO_SERVER, "to-client": TraceDirection.TO_CLIENT}
_KINDS = {comm.name.lower(): comm for comm in (CommType.TOPIC, CommType.REQUEST, CommType.REPLY)}

_COMPARISONS: Mapping[str, Callable[[float, float], bool]] = {
    ">=": operator.ge,
    "<=": operator.le,
    "!=": operator.ne,
    "=": operator.eq,
    ">": operator.gt,
    "<": operator.lt,
}
_CONDITION = re.compile(r"(?s)\s*([\w.\[\]]+)\s*(>=|<=|!=|=|>|<)\s*(.*?)\s*")
_INDEXED = re.compile(r"(.*)\[(\d+)\]")


@dataclass(frozen=True, slots=True)
class FieldCondition:
    """A comparison of one field, such as `sequence>=2`, `mode=AUTO` or `joints[1]<0`.

    An array without index, and a field of repeated records (`groups.time`), fits when any of its
    values fits. A packet without the field does not.

    Attributes:
        wanted: what to compare with, as written.
    """

    path: str
    sign: str
    wanted: str

    @staticmethod
    def parse(text: str) -> FieldCondition:
        """Return the condition that a text says; ArgumentTypeError where it says none."""
        match = _CONDITION.fullmatch(text)
        if match is None:
            raise argparse.ArgumentTypeError(
                f"{text!r} is not NAME=VALUE, with =, !=, <, >, <=, >="
            )
        condition = FieldCondition(*match.groups())
        if condition.sign not in ("=", "!=") and condition._number() is None:
            raise argparse.ArgumentTypeError(f"{text!r} compares with what is no number")
        return condition

    def fits(self, reading: Reading) -> bool:
        """Return True if a packet fits."""
        if reading.message is None:
            return False
        fields = field_values(reading.message, reading.codec)
        return any(self._fits_field(field) for field in fields)

    def _fits_field(self, field: FieldValue) -> bool:
        if self.path in (field.path, re.sub(r"\[\d+\]", "", field.path)):
            values = field.value if isinstance(field.value, tuple) else (field.value,)
            return any(self._fits_value(value, field.label) for value in values)
        indexed = _INDEXED.fullmatch(self.path)
        if indexed is None or indexed[1] != field.path or not isinstance(field.value, tuple):
            return False
        index = int(indexed[2])
        return index < len(field.value) and self._fits_value(field.value[index], "")

    def _fits_value(self, value: float | str | bytes, label: str) -> bool:
        if isinstance(value, int | float):
            number = self._number()
            if number is not None:
                return _COMPARISONS[self.sign](value, number)
            same = self.wanted.upper() in (label.upper(), *label.upper().split("|"))
        else:
            text = value.hex() if isinstance(value, bytes) else value
            same = self.wanted == text
        return same == (self.sign == "=") if self.sign in ("=", "!=") else False

    def _number(self) -> float | None:
        try:
            return float(self.wanted)
        except ValueError:
            return None


@dataclass(frozen=True, slots=True)
class Filters:
    """Conditions of which all must hold; None and empty ones always do."""

    types: tuple[str, ...] = ()
    comm: CommType | None = None
    port: int | None = None
    connection: int | None = None
    direction: TraceDirection | None = None
    scenario: str | None = None
    since: float | None = None
    until: float | None = None
    malformed: bool = False
    fields: tuple[FieldCondition, ...] = ()

    def fits(self, item: Reading | Event) -> bool:
        """Return True if a packet or event is wanted; conditions on packets leave no event."""
        if isinstance(item, Event):
            return not self._only_packets and self._fits_place(item)
        header = item.header
        return (
            self._fits_place(item.packet)
            and self.direction in (None, item.packet.direction)
            and (not self.malformed or item.message is None)
            and (self.comm is None or (header is not None and header.comm_type == self.comm))
            and (not self.types or self._fits_type(item))
            and all(condition.fits(item) for condition in self.fields)
        )

    @property
    def _only_packets(self) -> bool:
        return bool(self.types or self.comm or self.direction or self.malformed or self.fields)

    def _fits_place(self, entry: Entry) -> bool:
        seconds = entry.time / _NANOSECONDS
        return (
            self.port in (None, entry.port)
            and self.connection in (None, entry.connection)
            and self.scenario in (None, entry.scenario)
            and (self.since is None or seconds >= self.since)
            and (self.until is None or seconds <= self.until)
        )

    def _fits_type(self, reading: Reading) -> bool:
        if reading.header is None:
            return False
        return not {reading.name, str(reading.header.msg_type)}.isdisjoint(self.types)


def add_filters(command: argparse.ArgumentParser) -> None:
    """Add the conditions to a command; `filters_of` reads them."""
    add = command.add_argument_group("which packets (all conditions must hold)").add_argument
    add(
        "--type",
        action="append",
        type=_message_type,
        default=[],
        metavar="NAME|NUMBER",
        help="message type; may be given several times",
    )
    add("--comm", choices=_KINDS, help="communication type")
    add("--port", type=int, metavar="PORT", help="TCP port of the server's end")
    add("--conn", type=int, metavar="N", help="number of the connection on its port")
    add("--direction", choices=_WAYS)
    add("--scenario", metavar="NAME", help="part of the trace")
    add("--since", type=_seconds, metavar="SECONDS", help="not before this time of the trace")
    add("--until", type=_seconds, metavar="SECONDS", help="not after this time of the trace")
    add("--malformed", action="store_true", help="only packets that could not be decoded")
    add(
        "--field",
        action="append",
        type=FieldCondition.parse,
        default=[],
        metavar="NAME=VALUE",
        help="field with a value, also !=, <, >, <=, >=; may be given several times",
    )


def filters_of(arguments: argparse.Namespace) -> Filters:
    """Return what `add_filters` read."""
    return Filters(
        types=tuple(arguments.type),
        comm=_KINDS[arguments.comm] if arguments.comm else None,
        port=arguments.port,
        connection=arguments.conn,
        direction=_WAYS[arguments.direction] if arguments.direction else None,
        scenario=arguments.scenario,
        since=arguments.since,
        until=arguments.until,
        malformed=arguments.malformed,
        fields=tuple(arguments.field),
    )


def _message_type(text: str) -> str:
    known = {message.PLACE.name for message in ALL.messages} | {"read_input", "write_output"}
    if text not in known and re.fullmatch(r"-?\d{1,10}", text, re.ASCII) is None:
        raise argparse.ArgumentTypeError(f"no message is called {text!r}")
    return text


def _seconds(text: str) -> float:
    seconds = float(text)
    if not math.isfinite(seconds):
        raise ValueError(text)
    return seconds
