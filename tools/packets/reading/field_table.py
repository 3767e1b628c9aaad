"""The fields of a message one by one, and a remark on what they mean together.

A field has path, offset in the frame, value, unit and name of the value, all from the declaration.
Verdicts and addresses of Motoman's have a remark, whose text is the catalogue's and loaded only
when one is needed. Knows nothing of how fields are shown.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from openpendant.simplemsg import Codec, HeaderOnly, Message, Opaque
from openpendant.simplemsg import motoman as m
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


_IO_REPLIES = (
    m.MotomanReadSingleIoReply,
    m.MotomanWriteSingleIoReply,
    m.MotomanReadGroupIoReply,
    m.MotomanWriteGroupIoReply,
    m.MotomanReadMregisterReply,
    m.MotomanWriteMregisterReply,
)


def remark_on(message: Message) -> str:
    """Return meaning and remedy of a verdict that is no success, or what an I/O address names."""
    match message:
        case m.MotomanMotionReply() if message.result:
            return _motion_verdict(message)
        case _ if isinstance(message, _IO_REPLIES) and message.result_code:
            return _io_verdict(message.result_code)
        case m.MotomanReadSingleIo() | m.MotomanWriteSingleIo():
            return _areas(message.address)
        case m.MotomanReadGroupIo() | m.MotomanWriteGroupIo():
            return _areas(10 * message.address)
    return ""


def is_failed_verdict(message: Message) -> bool:
    """Return True if the body says that a request failed, whatever the header says."""
    if isinstance(message, m.MotomanMotionReply):
        return message.result != 0
    return isinstance(message, _IO_REPLIES) and message.result_code != 0


def _motion_verdict(reply: m.MotomanMotionReply) -> str:
    from openpendant.simplemsg.motoman_catalogue import explain  # most packets need no such text

    told = explain(reply.command, reply.result, reply.subcode)
    return f"{told.name}: {told.meaning} {told.remedy}"


def _io_verdict(number: int) -> str:
    from openpendant.simplemsg.motoman_catalogue import IO_RESULTS  # as above

    for result, entry in IO_RESULTS.items():
        if result == number:
            return f"{result.name}: {entry.cause} {entry.remedy}"
    return f"result {number}: This result is unknown."


def _areas(bit: int) -> str:
    """Return the purpose of a bit address in words; the models of the controller differ."""
    from openpendant.simplemsg.motoman_addresses import ControllerModel, area_of  # as above

    models: dict[str, list[str]] = {}
    for controller in ControllerModel:
        area = area_of(controller, bit)
        what = "nothing" if area is None else area.name
        if area is not None and area.writable:
            what += " (can be written)"
        models.setdefault(what, []).append(controller.value)
    if len(models) == 1:
        (what,) = models
        return f"bit {bit}: {what}"
    return f"bit {bit}: " + "; ".join(f"{what} on {', '.join(on)}" for what, on in models.items())
