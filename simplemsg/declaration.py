"""Declarations of messages: fields with type, unit and meaning, and their place in the protocol.

A message is declared once, as a class whose annotations carry one `Field` each. The codec, the
readable text form and the reference pages are all derived from that declaration; no other module
knows a byte offset. Owns, too, how joint values fill the ten slots of a message, and what the
values of integer fields are called. Knows nothing of bytes.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum, IntEnum, IntFlag
from inspect import get_annotations
from operator import attrgetter
from typing import Any, ClassVar, Protocol, TypeVar, cast, dataclass_transform

from .codes import JOINT_SLOTS, CommType, ReplyCode

MASK = "********"
"""Stands for a secret wherever a message is shown."""


class Direction(Enum):
    """Direction in which a message travels."""

    TO_CONTROLLER = "client to controller"
    FROM_CONTROLLER = "controller to client"
    TO_SERVER = "pendant to server"
    FROM_SERVER = "server to pendant"
    BOTH = "either way"


@dataclass(frozen=True, slots=True)
class Field:
    """One declared field.

    Attributes:
        unit: SI unit, empty for a pure number.
    """

    meaning: str
    unit: str = ""


@dataclass(frozen=True, slots=True)
class Int(Field):
    """A signed 32-bit integer.

    Attributes:
        values: names of the values that have one; bits where it is an `IntFlag`. Other values are
            no error.
        mask: bits that a receiver keeps; whoever sends may leave rubbish in the others.
    """

    values: type[IntEnum] | type[IntFlag] | None = None
    mask: int | None = None


@dataclass(frozen=True, slots=True)
class Real(Field):
    """One real of the connection's width (4 or 8 bytes)."""


@dataclass(frozen=True, slots=True)
class Reals(Field):
    """A fixed number of reals.

    Attributes:
        shape: how the readable form nests them, slowest index first; empty for a plain list.
    """

    count: int = JOINT_SLOTS
    shape: tuple[int, ...] = ()


@dataclass(frozen=True, slots=True)
class Text(Field):
    """UTF-8 text in a fixed number of bytes, padded with zero bytes.

    Attributes:
        size: bytes on the wire.
        secret: a password or code, shown to nobody; only as the last field.
    """

    size: int = 32
    secret: bool = False


@dataclass(frozen=True, slots=True)
class Tail(Field):
    """Bytes up to the end of the body; only as the last field."""


class CountPlace(Enum):
    """Place of the number of records of an `Array`."""

    NOWHERE = "the body's length tells"
    BEFORE = "just before the records"
    AFTER = "just after the records"


@dataclass(frozen=True, slots=True)
class Array(Field):
    """Records of one kind, one after the other; at most one per message.

    Attributes:
        count_name: name of the integer that counts the records, empty where there is none.
        meant_by: name of the field before them that says how many records are meant, empty where
            there is none. That many travel, or `most`, of which the last are padding.
    """

    of: type[Record] | None = None
    count_name: str = ""
    count_place: CountPlace = CountPlace.NOWHERE
    least: int = 1
    most: int = JOINT_SLOTS
    meant_by: str = ""

    def takes(self, number: int, meant: int) -> bool:
        """Return True if so many records may travel where so many are meant."""
        if not self.least <= number <= self.most:
            return False
        return not self.meant_by or (self.least <= meant <= number and number in (meant, self.most))


@dataclass(frozen=True, slots=True)
class Place:
    """A message's place in the protocol.

    Attributes:
        name: snake-case name, as in the reference vectors.
        reply: what is expected in answer, in words; "none" for topics and replies.
        is_reply: true where the body of the reply differs from the request of the same type.
        any_body: true where a receiver accepts a body of any size and ignores it.
        since: the first version of the pendant protocol that has it; 2 also where it is no message
            of that protocol.
    """

    msg_type: int
    name: str
    direction: Direction
    reply: str
    source: str
    about: str
    is_reply: bool = False
    any_body: bool = False
    since: int = 2


class Record:
    """A group of fields that repeats inside an `Array`; no header of its own.

    Comparison and text are written here once: `dataclass` would write and compile both anew for
    every message, which was most of what importing this package cost.
    """

    __slots__ = ()
    FIELDS: ClassVar[dict[str, Field]]
    _CONTENT: ClassVar[attrgetter[Any]]

    @classmethod
    def is_secret(cls, name: str) -> bool:
        """Return True if a field is secret: it is shown to nobody."""
        field = cls.FIELDS.get(name)
        return isinstance(field, Text) and field.secret

    @classmethod
    def _compared(cls) -> tuple[str, ...]:
        return tuple(cls.FIELDS)

    def _values(self) -> dict[str, object]:
        return {name: getattr(self, name) for name in self._compared()}

    def __eq__(self, other: object) -> bool:
        if type(other) is not type(self):
            return NotImplemented
        content = type(self)._CONTENT
        same: bool = content(self) == content(other)
        return same

    def __repr__(self) -> str:
        values = ", ".join(
            f"{name}={MASK if self.is_secret(name) else repr(value)}"
            for name, value in self._values().items()
        )
        return f"{type(self).__name__}({values})"


@dataclass(slots=True, eq=False, repr=False)
class Message(Record):
    """Base of every message; the two header fields that are not the type itself.

    Attributes:
        comm_type: a `CommType`; another integer where the peer sent one.
        reply_code: a `ReplyCode`; another integer where the peer sent one.
    """

    PLACE: ClassVar[Place]
    comm_type: int = dataclasses.field(default=CommType.REQUEST, kw_only=True)
    reply_code: int = dataclasses.field(default=ReplyCode.UNUSED, kw_only=True)

    @classmethod
    def _compared(cls) -> tuple[str, ...]:
        return ("comm_type", "reply_code", *cls.FIELDS)


@dataclass(slots=True, eq=False, repr=False)
class Topic(Message):
    """Base of messages that are usually topics: sent unasked, never answered."""

    comm_type: int = dataclasses.field(default=CommType.TOPIC, kw_only=True)


@dataclass(slots=True, eq=False, repr=False)
class Reply(Message):
    """Base of messages that are always the answer to a request."""

    comm_type: int = dataclasses.field(default=CommType.REPLY, kw_only=True)
    reply_code: int = dataclasses.field(default=ReplyCode.SUCCESS, kw_only=True)


_RecordT = TypeVar("_RecordT", bound=Record)
_MessageT = TypeVar("_MessageT", bound=Message)


def _fields_of(cls: type[Record]) -> dict[str, Field]:
    fields: dict[str, Field] = {}
    for name, hint in get_annotations(cls, eval_str=True).items():
        for extra in getattr(hint, "__metadata__", ()):
            if isinstance(extra, Field):
                fields[name] = extra
    return fields


@dataclass_transform()
def record(cls: type[_RecordT]) -> type[_RecordT]:
    """Declare a record class: a slotted dataclass whose annotated fields are its layout."""
    made: Any = dataclass(slots=True, eq=False, repr=False)(cls)
    made.FIELDS = _fields_of(made)
    made._CONTENT = attrgetter(*made._compared())
    return cast("type[_RecordT]", made)


class MessageDecorator(Protocol):
    """Makes a class with annotated fields a message class."""

    def __call__(self, cls: type[_MessageT], /) -> type[_MessageT]:
        """Return the slotted dataclass of the class, with `PLACE` and `FIELDS`."""


@dataclass_transform()
def message(place: Place) -> MessageDecorator:
    """Return the decorator that declares a message class."""

    def declare(cls: type[_MessageT], /) -> type[_MessageT]:
        made: Any = record(cls)
        made.PLACE = place
        return cast("type[_MessageT]", made)

    return declare


_PADDING = tuple((0.0,) * (JOINT_SLOTS - count) for count in range(JOINT_SLOTS + 1))
"""The unused slots of a message, by the number of those that are used."""


def joint_array(values: Sequence[float]) -> tuple[float, ...]:
    """Return joint values padded with zeros to the ten slots of a message.

    Raises:
        ValueError: there are more than ten values.
    """
    if len(values) > JOINT_SLOTS:
        raise ValueError(f"{len(values)} joints do not fit the {JOINT_SLOTS} slots of a message")
    return tuple(values) + _PADDING[len(values)]


def value_name(field: Field, value: object) -> str | None:
    """Return the name of a field's value, such as `BUSY` or `TIME|POSITION`.

    Returns:
        None where the field's values have no names, or this one has none. Bits without a name are
        added to the others in hexadecimal, as in `TIME|0x30`.
    """
    if not isinstance(field, Int) or field.values is None or not isinstance(value, int):
        return None
    if issubclass(field.values, IntFlag):
        return _bits(field.values, value)
    return _member(field.values, value)


def _member(values: type[IntEnum], value: int) -> str | None:
    try:
        return values(value).name
    except ValueError:
        return None


def _bits(flags: type[IntFlag], value: int) -> str | None:
    # A negative number has no end of bits; on the wire there are 32.
    rest = value & 0xFFFF_FFFF
    names: list[str] = []
    for bit in flags:
        if rest & bit:
            names.append(str(bit.name))
            rest &= ~int(bit)
    if not names:
        return None
    return "|".join([*names, f"0x{rest:x}"] if rest else names)
