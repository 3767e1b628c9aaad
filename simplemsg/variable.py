"""Packing and unpacking of messages that end in records of one kind or in a tail of bytes."""

from __future__ import annotations

import struct
from typing import Any

from .declaration import Array, CountPlace, Message, Record, Tail
from .fixed import UNPACKABLE, FieldGroup, breaks_rule
from .framing import HEADER_SIZE, PREFIX_SIZE
from .layout import Misfit, WireForm
from .unfit import encoding_fault

_COUNT_SIZE = 4


class VariableLayout:
    """A message of variable size in one wire form.

    Attributes:
        cls: the message class.
    """

    def __init__(self, cls: type[Message], form: WireForm) -> None:
        self.cls = cls
        self._form = form
        *head, (self._name, last) = cls.FIELDS.items()
        self._head = FieldGroup(dict(head), form)
        self._last = _Tail() if isinstance(last, Tail) else _Records(last, form)
        self._header = struct.Struct(f"{form.order}4i")

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
        if breaks_rule(self.cls, comm, code):
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

    def pack(self, records: Any, head: Message) -> bytes:
        if not isinstance(records, tuple | list):
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

    def unpack(self, rest: bytes, head: Message) -> tuple[Record, ...]:
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
        return tuple(
            self._record(values)
            for values in self._group.structure.iter_unpack(rest[start : start + number * size])
        )

    def _meant(self, head: Message) -> int:
        """Return how many records the head of a message says are meant."""
        return getattr(head, self._field.meant_by) if self._field.meant_by else 0

    def _record(self, values: tuple[Any, ...]) -> Record:
        record = object.__new__(self._of)
        self._group.fill(record, values)
        return record
