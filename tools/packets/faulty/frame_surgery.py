"""Single changes to a frame, as the fault proxy makes them.

Pure functions from bytes to bytes; chance comes in as a `Random`. None of them may fail on any
frame that a `Splitter` gives.
"""

from __future__ import annotations

import struct
from random import Random
from typing import NamedTuple

from openpendant.simplemsg import (
    MOTOMAN,
    ByteOrder,
    Codec,
    CommType,
    Dialect,
    HeaderOnly,
    Message,
    MsgType,
    Opaque,
    ProtocolError,
    ReplyCode,
    codec_for,
)
from openpendant.simplemsg.framing import HEADER_SIZE, PREFIX_SIZE, Frame
from openpendant.simplemsg.motoman import MotomanMotionReply

_MEANT_FIELDS = 0xF
_LARGEST_LENGTH = 2**31 - 1
_JOINTS = (0.0,) * 10
_RESULT_BUSY, _RESULT_FAILURE = 1, 2
_ANSWERED_BY_MOTION_REPLY = {14, 2001, 2016, 2018}


class FrameForm(NamedTuple):
    """Assumed form of the traffic; the byte order is read from each frame.

    Attributes:
        dialect: messages to know.
        real_size: bytes of a real, 4 or 8.
    """

    dialect: Dialect
    real_size: int

    def codec(self, order: ByteOrder) -> Codec:
        """Return the codec for a byte order."""
        return codec_for(self.dialect, order, self.real_size)


def decoded(frame: bytes, form: FrameForm) -> Message | None:
    """Return the message in a frame, None where it is malformed."""
    try:
        return form.codec(Frame(frame).byte_order).decode(frame)
    except ProtocolError:
        return None


def sequence_of(frame: bytes, form: FrameForm) -> int | None:
    """Return the field `sequence`, None where there is none."""
    sequence = getattr(decoded(frame, form), "sequence", None)
    return sequence if isinstance(sequence, int) else None


def with_flipped_bits(frame: bytes, count: int, offset: int | None, chance: Random) -> bytes:
    """Flip bits, in one byte or anywhere; an offset behind the end is the last byte."""
    changed = bytearray(frame)
    bits = range(8 * len(frame))
    if offset is not None:
        first = 8 * min(offset, len(frame) - 1)
        bits = range(first, first + 8)
    for bit in chance.sample(bits, min(count, len(bits))):
        changed[bit // 8] ^= 1 << bit % 8
    return bytes(changed)


def with_wrong_length(frame: bytes, by: int) -> bytes:
    """Add to the length field; the bytes behind it stay."""
    order = Frame(frame).byte_order
    length = len(frame) - PREFIX_SIZE + by
    return struct.pack(f"{order.value}i", min(length, _LARGEST_LENGTH)) + frame[PREFIX_SIZE:]


def truncated(frame: bytes, by: int) -> bytes:
    """Cut bytes off the end of the body; the length field agrees, so the stream stays in step."""
    kept = frame[: max(HEADER_SIZE, len(frame) - abs(by))]
    return with_wrong_length(kept, 0)


def with_garbage_valid_fields(frame: bytes, form: FrameForm, chance: Random) -> bytes | None:
    """Fill the meaningless 28 bits of every `valid_fields`; None where there is none."""
    message = decoded(frame, form)
    records = [message, *getattr(message, "groups", ())]
    found = [record for record in records if hasattr(record, "valid_fields")]
    if message is None or not found:
        return None
    for record in found:
        garbage = chance.getrandbits(28) << 4 | record.valid_fields & _MEANT_FIELDS
        record.valid_fields = garbage - (1 << 32) if garbage >= 1 << 31 else garbage
    return _encoded(message, form, Frame(frame).byte_order)


def in_other_order(frame: bytes, form: FrameForm) -> bytes:
    """Encode a frame in the other byte order; what is not known is taken for 32-bit words."""
    order = ByteOrder.BIG if Frame(frame).byte_order is ByteOrder.LITTLE else ByteOrder.LITTLE
    message = decoded(frame, form)
    if message is not None and not isinstance(message, Opaque):
        encoded = _encoded(message, form, order)
        if encoded is not None and len(encoded) == len(frame):
            return encoded
    whole = len(frame) // 4 * 4
    words = [frame[at : at + 4][::-1] for at in range(0, whole, 4)]
    return b"".join(words) + frame[whole:]


def failure_reply(request: bytes, form: FrameForm) -> bytes:
    """Return a reply that refuses a request as the dialect does."""
    header = Frame(request)
    codec = form.codec(header.byte_order)
    if has_busy_answer(request, form):
        return codec.encode(_motion_reply(request, form, _RESULT_FAILURE))
    # Type 0 is reserved, and a reply to it cannot have it either.
    return codec.encode(HeaderOnly(header.msg_type or MsgType.PING, reply_code=ReplyCode.FAILURE))


def has_busy_answer(request: bytes, form: FrameForm) -> bool:
    """Return True if the dialect can answer a request with "busy"."""
    return form.dialect is MOTOMAN and Frame(request).msg_type in _ANSWERED_BY_MOTION_REPLY


def busy_reply(request: bytes, form: FrameForm) -> bytes:
    """Return the Motoman reply that says: not now, send it again."""
    order = Frame(request).byte_order
    return form.codec(order).encode(_motion_reply(request, form, _RESULT_BUSY))


def _motion_reply(request: bytes, form: FrameForm, result: int) -> MotomanMotionReply:
    message = decoded(request, form)
    msg_type = Frame(request).msg_type
    return MotomanMotionReply(
        robot_id=getattr(message, "robot_id", getattr(message, "group", 0)),
        sequence=getattr(message, "sequence", -1),
        command=getattr(message, "command", msg_type),
        result=result,
        subcode=0,
        data=_JOINTS,
    )


def is_request(frame: bytes) -> bool:
    """Return True if a frame asks for a reply."""
    return Frame(frame).comm_type == CommType.REQUEST


def is_reply(frame: bytes) -> bool:
    """Return True if a frame is a reply."""
    return Frame(frame).comm_type == CommType.REPLY


def _encoded(message: Message, form: FrameForm, order: ByteOrder) -> bytes | None:
    try:
        return form.codec(order).encode(message)
    except ProtocolError:
        return None
