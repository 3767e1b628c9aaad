"""Packing and unpacking of messages, of fixed size or ending in records or in a tail of bytes.

For each message of fixed size it writes, once for each byte order and real width, the source of two
small functions with every index in place (the way `dataclasses` writes `__init__`): a generic loop
over the fields costs three times as much.
"""

from __future__ import annotations

import dataclasses
import struct
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from types import FunctionType
from typing import Any

from .codes import CommType, ReplyCode
from .declaration import Array, CountPlace, Field, Int, Message, Reals, Record, Tail, Text
from .framing import HEADER_SIZE, PREFIX_SIZE, Bytes, broken_header_rule
from .layout import Decode, Encode, Misfit, WireForm, encoding_fault
from .real_records import RealRecords

UNPACKABLE = (struct.error, OverflowError, ValueError, TypeError, AttributeError)
"""Errors that packing raises for a value of the wrong kind or size."""

_ZERO = b"\0"
"""Ends a text, and fills its field up."""


def _compile(name: str, source: list[str], scope: dict[str, Any]) -> FunctionType:
    exec(compile("\n".join(source), f"<simplemsg {name}>", "exec"), scope)
    made = scope[name]
    assert isinstance(made, FunctionType)
    return made


def _assignments(fields: Mapping[str, Field], scope: dict[str, Any]) -> list[str]:
    """Write statements that set the fields of `m` from the unpacked tuple `v`."""
    lines: list[str] = []
    index = 0
    for name, field in fields.items():
        if isinstance(field, Reals):
            scope[f"at_{name}"] = slice(index, index + field.count)
            lines.append(f" m.{name} = v[at_{name}]")
            index += field.count
            continue
        lines.append(f" m.{name} = {_received(field, f'v[{index}]')}")
        index += 1
    return lines


def _received(field: Field, raw: str) -> str:
    """Write what makes a field's value of the unpacked `raw`; a text ends at its first zero."""
    match field:
        case Text():
            return f"{raw}.split(zero, 1)[0].decode()"
        case Int(mask=int(mask)):
            return f"{raw} & {mask}"
    return raw


def _arguments(fields: Mapping[str, Field]) -> str:
    """Write the arguments of `pack`: the fields of `m`, arrays spread out."""
    parts = []
    for name, field in fields.items():
        match field:
            case Reals():
                parts.append(f"*m.{name}")
            case Text():
                parts.append(f"raw_{name}")
            case _:
                parts.append(f"m.{name}")
    return ", ".join(parts)


def _checks(fields: Mapping[str, Field], indent: str) -> list[str]:
    """Write the checks of what `struct` would pack wrongly, and the texts as bytes (`raw_…`).

    `struct` cuts a text to its field, and counts the values of all arrays together, so 9 + 11 would
    pass for 10 + 10; with every array but the first measured, its count settles that.
    """
    arrays = [(name, field.count) for name, field in fields.items() if isinstance(field, Reals)]
    texts = [(name, field.size) for name, field in fields.items() if isinstance(field, Text)]
    lines = [f"raw_{name} = m.{name}.encode()" for name, _ in texts]
    wrong = [f"len(m.{name}) != {count}" for name, count in arrays[1:]]
    wrong += [f"len(raw_{name}) > {size} or zero in raw_{name}" for name, size in texts]
    if wrong:
        lines += [f"if {' or '.join(wrong)}:", " raise ValueError"]
    return [indent + line for line in lines]


class FieldGroup:
    """Fields of fixed size that lie together: the head of a message, or one repeated record.

    Attributes:
        fill: `fill(record, values)` sets the fields from the unpacked tuple; raises
            `UnicodeDecodeError` for a text that is none.
        pack: `pack(record) -> bytes`; raises one of `UNPACKABLE`.
    """

    def __init__(self, fields: Mapping[str, Field], form: WireForm) -> None:
        self.structure = form.structure(fields)
        scope: dict[str, Any] = {"zero": _ZERO}
        body = _assignments(fields, scope) or [" pass"]
        self.fill: Callable[[Record, tuple[Any, ...]], None] = _compile(
            "fill", ["def fill(m, v):", *body], scope
        )
        self.pack: Callable[[Record], bytes] = _compile(
            "pack_group",
            [
                "def pack_group(m):",
                *_checks(fields, " "),
                f" return pack({_arguments(fields)})",
            ],
            {"pack": self.structure.pack, "zero": _ZERO},
        )


class FixedLayout:
    """A message of fixed size in one wire form.

    Attributes:
        size: bytes of the frame, prefix included.
        encode: `encode(message) -> bytes`, the whole frame; raises `LocalProtocolError`, and
            `NotEncodable` for a value that does not fit.
    """

    def __init__(self, cls: type[Message], form: WireForm) -> None:
        self.cls = cls
        self.size = HEADER_SIZE + form.structure(cls.FIELDS).size
        self.encode: Encode = self._compile_encode(form)
        self._decode = self._compile_decode(form)

    def _compile_decode(self, form: WireForm) -> FunctionType:
        """Write the decoder: one `unpack` for all single values, one for each array.

        Cutting the arrays out of one long tuple would take an eighth longer.
        """
        fields = self.cls.FIELDS
        arrays = [name for name, field in fields.items() if isinstance(field, Reals)]
        singles = [name for name in fields if name not in arrays]
        scope: dict[str, Any] = {
            "new": partial(object.__new__, self.cls),
            "zero": _ZERO,
            "comm": CommType.INVALID,
            "code": ReplyCode.UNUSED,
            "unpack": self._only(form, singles),
        }
        source = [
            "def decode(frame):",
            " m = new()",
            " m.comm_type = comm",
            " m.reply_code = code",
        ]
        if singles or not arrays:
            targets = ", ".join(f"m.{name}" for name in singles)
            source.append(f" [{targets}] = unpack(frame)")
        for name in singles:
            value = _received(fields[name], f"m.{name}")
            if value != f"m.{name}":
                source.append(f" m.{name} = {value}")
        for name in arrays:
            scope[f"unpack_{name}"] = self._only(form, [name])
            source.append(f" m.{name} = unpack_{name}(frame)")
        return _compile("decode", [*source, " return m"], scope)

    def _only(self, form: WireForm, names: list[str]) -> Callable[[Bytes], tuple[Any, ...]]:
        """Return a function that unpacks these fields of a frame and skips all others."""
        codes = (
            form.format_of(field) if name in names else f"{form.structure({name: field}).size}x"
            for name, field in self.cls.FIELDS.items()
        )
        return struct.Struct(f"{form.order}{HEADER_SIZE}x{''.join(codes)}").unpack

    def decoder(self, comm_type: int, reply_code: int) -> Decode:
        """Return a decoder for frames whose header is known to be the given one.

        Returns:
            `decode(frame)`; it raises `struct.error` for a frame of another size, and
            `UnicodeDecodeError` for a text that is none.
        """
        scope = {**self._decode.__globals__, "comm": comm_type, "code": reply_code}
        return FunctionType(self._decode.__code__, scope)

    def decode(self, frame: bytes, comm_type: int, reply_code: int) -> Message:
        """Return the message in a whole frame.

        Raises:
            Misfit: the body is longer or shorter than declared, or a text is not UTF-8.
        """
        if len(frame) != self.size:
            raise Misfit(
                f"the body has {len(frame) - HEADER_SIZE} bytes, not {self.size - HEADER_SIZE}"
            )
        try:
            return self.decoder(comm_type, reply_code)(frame)
        except UnicodeDecodeError as error:
            # Python's words name a byte, which may be one of a secret.
            has_secret = any(map(self.cls.is_secret, self.cls.FIELDS))
            raise Misfit(f"a text is not UTF-8{'' if has_secret else f': {error}'}") from None

    def _compile_encode(self, form: WireForm) -> FunctionType:
        place, fields = self.cls.PLACE, self.cls.FIELDS
        usual = {field.name: field.default for field in dataclasses.fields(self.cls)}
        scope: dict[str, Any] = {
            "pack": form.structure(fields, prefix="4i").pack,
            "zero": _ZERO,
            "usual_comm": usual["comm_type"],
            "usual_code": usual["reply_code"],
            "breaks_rule": partial(breaks_rule, self.cls),
            "fault": partial(encoding_fault, form=form),
            "unpackable": UNPACKABLE,
        }
        head = f"{self.size - PREFIX_SIZE}, {int(place.msg_type)}, c, r, "
        source = [
            "def encode(m):",
            " c = m.comm_type",
            " r = m.reply_code",
            # Members of an enumeration are one object each, so the usual header costs two pointers.
            " if (c is not usual_comm or r is not usual_code) and breaks_rule(c, r):",
            "  raise fault(m)",
            " try:",
            *_checks(fields, "  "),
            f"  return pack({head}{_arguments(fields)})",
            " except unpackable:",
            "  raise fault(m) from None",
        ]
        return _compile("encode", source, scope)


def breaks_rule(cls: type[Message], comm_type: int, reply_code: int) -> bool:
    """Return True if a message of this class may not have this header."""
    if cls.PLACE.is_reply and comm_type != CommType.REPLY:
        return True
    return broken_header_rule(cls.PLACE.msg_type, comm_type, reply_code) is not None


_COUNT_SIZE = 4

_USUAL_HEADERS = (
    (CommType.REQUEST, ReplyCode.UNUSED),
    (CommType.REPLY, ReplyCode.SUCCESS),
    (CommType.REPLY, ReplyCode.FAILURE),
    (CommType.TOPIC, ReplyCode.UNUSED),
)


class VariableLayout:
    """A message of variable size in one wire form."""

    def __init__(self, cls: type[Message], form: WireForm) -> None:
        self.cls = cls
        self._form = form
        *head, (self._name, last) = cls.FIELDS.items()
        self._head = FieldGroup(dict(head), form)
        self._last = _Tail() if isinstance(last, Tail) else _Records(last, form)
        self._header = struct.Struct(f"{form.order}4i")
        self._sound_headers = tuple(
            header for header in _USUAL_HEADERS if not breaks_rule(cls, *header)
        )

    @staticmethod
    def suits(cls: type[Message]) -> bool:
        """Return True if a message class is of variable size."""
        return any(isinstance(field, Array | Tail) for field in cls.FIELDS.values())

    def encode(self, message: Message) -> bytes:
        """Return the whole frame.

        Raises:
            LocalProtocolError: a header rule is broken.
            NotEncodable: a value does not fit, or there are too many or too few records.
        """
        comm, code = message.comm_type, message.reply_code
        if (comm, code) not in self._sound_headers and breaks_rule(self.cls, comm, code):
            raise encoding_fault(message, self._form)
        try:
            body = self._head.pack(message) + self._last.pack(getattr(message, self._name), message)
            length = len(body) + HEADER_SIZE - PREFIX_SIZE
            return self._header.pack(length, self.cls.PLACE.msg_type, comm, code) + body
        except UNPACKABLE:
            raise encoding_fault(message, self._form) from None

    def decode(self, frame: bytes, comm_type: int, reply_code: int) -> Message:
        """Return the message in a whole frame.

        Raises:
            Misfit: its size or its count does not fit the declaration, or a text is not UTF-8.
        """
        size = self._head.structure.size
        if len(frame) < HEADER_SIZE + size:
            raise Misfit(
                f"the body has {len(frame) - HEADER_SIZE} bytes, fewer than the {size} of its head"
            )
        message = object.__new__(self.cls)
        message.comm_type = comm_type
        message.reply_code = reply_code
        try:
            self._head.fill(message, self._head.structure.unpack_from(frame, HEADER_SIZE))
            last = self._last.unpack(frame[HEADER_SIZE + size :], message)
        except UnicodeDecodeError as error:
            raise Misfit(f"a text is not UTF-8: {error}") from None
        setattr(message, self._name, last)
        return message

    def decoder(self, comm_type: int, reply_code: int, on_misfit: Decode) -> Decode:
        """Return a decoder for frames whose header is known to be the given one.

        Args:
            on_misfit: decodes a frame whose body does not have this layout, or says what is wrong.
        """
        unpack = self.decode

        def decode(frame: Any) -> Message:
            try:
                return unpack(frame, comm_type, reply_code)
            except Misfit:
                return on_misfit(frame)

        return decode


class _Tail:
    """Bytes up to the end of the body."""

    def pack(self, value: Any, _head: Message) -> bytes:
        if not isinstance(value, bytes | bytearray | memoryview):
            raise TypeError
        return bytes(value)

    def unpack(self, rest: bytes, _head: Message) -> bytes:
        return rest


class _Records:
    """Records of one kind up to the end of the body, with or without their count."""

    def __init__(self, field: Any, form: WireForm) -> None:
        assert isinstance(field, Array)
        assert field.of is not None
        self._field = field
        self._of = field.of
        self._group = FieldGroup(field.of.FIELDS, form)
        self._count = struct.Struct(f"{form.order}i")
        self._real = form.order + form.real
        self._is_of_reals = all(isinstance(each, Reals) for each in field.of.FIELDS.values())

    def pack(self, records: Any, head: Message) -> bytes:
        if not isinstance(records, tuple | list | RealRecords):
            raise TypeError
        if not self._field.takes(len(records), self._meant(head)):
            raise ValueError
        body = b"".join([self._group.pack(record) for record in records])
        match self._field.count_place:
            case CountPlace.BEFORE:
                return self._count.pack(len(records)) + body
            case CountPlace.AFTER:
                return body + self._count.pack(len(records))
        return body

    def unpack(self, rest: bytes, head: Message) -> Sequence[Record]:
        field, size = self._field, self._group.structure.size
        counted = field.count_place is not CountPlace.NOWHERE
        number, left = divmod(len(rest) - counted * _COUNT_SIZE, size)
        if left or not field.least <= number <= field.most:
            raise Misfit(
                f"{len(rest)} bytes are no {field.least} to {field.most} records of {size} bytes"
            )
        start = _COUNT_SIZE if field.count_place is CountPlace.BEFORE else 0
        if counted:
            (count,) = self._count.unpack_from(rest, 0 if start else number * size)
            if count != number:
                raise Misfit(f"{field.count_name} is {count}, the body holds {number} records")
        if not field.takes(number, self._meant(head)):
            meant = self._meant(head)
            raise Misfit(
                f"{field.meant_by} is {meant}, the body holds {number} records:"
                f" neither that many nor {field.most}"
            )
        data = rest[start : start + number * size]
        if self._is_of_reals:
            return RealRecords(data, number, self._real, self._records)
        return tuple(self._records(data))

    def _meant(self, head: Message) -> int:
        """Return how many records the head of a message says are meant."""
        return getattr(head, self._field.meant_by) if self._field.meant_by else 0

    def _records(self, data: bytes) -> Iterator[Record]:
        for values in self._group.structure.iter_unpack(data):
            record = object.__new__(self._of)
            self._group.fill(record, values)
            yield record
