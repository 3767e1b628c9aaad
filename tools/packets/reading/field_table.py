"""The fields of a message one by one: path, offset in the frame, value, unit, name of the value.

Everything follows from the declaration of the message. Knows nothing of how fields are shown.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from openpendant.simplemsg import Codec, HeaderOnly, Message, Opaque
from openpendant.simplemsg.declaration import (
    MASK,
    Array,
    CountPlace,
    Field,
    Int,
    Record,
    Tail,
    value_name,
)
from openpendant.simplemsg.framing import HEADER_SIZE
from openpendant.simplemsg.layout import WireForm
from openpendant.simplemsg.masking import masked_body

COUNT = Int("number of records")
BODY = Tail("body that is not taken apart")

Value = int | float | str | bytes | tuple[float, ...]


@dataclass(frozen=True, slots=True)
class FieldValue:
    """One field of a message.

    Attributes:
        path: its name, such as `sequence` or `groups[1].positions`.
        offset: of its first byte from the beginning of the frame.
        field: its declaration.
        value: as decoded; an array of reals is one value.
        label: name of the value, empty where it has none.
    """

    path: str
    offset: int
    field: Field
    value: Value
    label: str


def field_values(message: Message, codec: Codec) -> list[FieldValue]:
    """Return the fields of a message in wire order; opaque bodies are one field `body`."""
    if isinstance(message, HeaderOnly):
        return []
    if isinstance(message, Opaque):
        shown = masked_body(message.msg_type, message.body)
        body = FieldValue("body", HEADER_SIZE, BODY, shown, "")
        return [body] if message.body else []
    form = WireForm(codec.byte_order.value, "f" if codec.real_size == 4 else "d")
    return list(_Walk(form).record(message, message.FIELDS, ""))


class _Walk:
    """Goes through a body from its first byte to its last."""

    def __init__(self, form: WireForm) -> None:
        self._form = form
        self._offset = HEADER_SIZE

    def record(
        self, record: Record, fields: Mapping[str, Field], prefix: str
    ) -> Iterator[FieldValue]:
        for name, field in fields.items():
            value = getattr(record, name)
            if value and record.is_secret(name):
                value = MASK
            if isinstance(field, Array):
                yield from self._array(prefix + name, field, value)
            else:
                yield self._one(prefix + name, field, value)

    def _array(self, path: str, field: Array, records: tuple[Record, ...]) -> Iterator[FieldValue]:
        if field.count_place is CountPlace.BEFORE:
            yield self._one(field.count_name, COUNT, len(records))
        for index, record in enumerate(records):
            yield from self.record(record, record.FIELDS, f"{path}[{index}].")
        if field.count_place is CountPlace.AFTER:
            yield self._one(field.count_name, COUNT, len(records))

    def _one(self, path: str, field: Field, value: Value) -> FieldValue:
        offset = self._offset
        if isinstance(field, Tail):
            value = bytes(value) if isinstance(value, bytes) else b""
            self._offset += len(value)
        else:
            self._offset += self._form.structure({path: field}).size
        return FieldValue(path, offset, field, value, value_name(field, value) or "")
