"""One rule applied to one frame: what each fault does.

Pure functions from bytes to bytes change a frame; chance comes in as a `Random`, and none may fail
on any frame that a `Splitter` gives. How frames wait is `fault_lane`'s business, and which rule
fits is `fault_engine`'s.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from itertools import pairwise
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

from ..live.relay import Action, CloseBoth, Freeze, ProxyLinkId, ResetBoth
from ..trace import TraceDirection
from . import fault_script as faults
from .fault_lane import Awaited, Lane, Prepared, Traffic, nanoseconds

_MEANT_FIELDS = 0xF
_LARGEST_LENGTH = 2**31 - 1
_JOINTS = (0.0,) * 10
_RESULT_BUSY, _RESULT_FAILURE = 1, 2
_ANSWERED_BY_MOTION_REPLY = {14, 2001, 2016, 2018}


class FrameForm(NamedTuple):
    """Assumed form of the traffic; the byte order is read from each frame."""

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


@dataclass(frozen=True, slots=True)
class FaultCase:
    """One rule applied to one frame."""

    form: FrameForm
    prepared: Prepared
    traffic: Traffic
    direction: TraceDirection
    link: ProxyLinkId
    frame: bytes
    now: int

    @property
    def _lane(self) -> Lane:
        return self.traffic.lanes[self.direction]

    def apply(self) -> tuple[str, bool]:
        """Do the fault; return what was done, and whether the receiver will owe a reply.

        What was done is empty where the fault is done to the reply, once that comes.
        """
        expects = is_request(self.frame)
        match self.prepared.rule:
            case faults.Drop():
                return "dropped", False
            case faults.LostReply():
                return self._lose_reply(), False
            case faults.Refuse():
                return self._refuse(), False
            case faults.Busy():
                return self._be_busy(), False
            case faults.ResetLink() | faults.CloseLink() | faults.HalfOpen() as rule:
                return self._end(rule), False
            case faults.Duplicate() as rule:
                for _ in range(1 + rule.copies):
                    self._lane.put(self.frame, self.now)
                for _ in range(rule.copies if expects else 0):
                    self.traffic.awaited[self.direction].append(Awaited())
                return f"sent {1 + rule.copies} times", expects
            case faults.Corrupt() | faults.WrongByteOrder() as rule:
                return self._change(rule), expects
            case rule:
                return self._put_off(rule), expects

    def _put_off(
        self, rule: faults.Delay | faults.Split | faults.Coalesce | faults.Throttle | faults.Reorder
    ) -> str:
        lane, frame, now = self._lane, self.frame, self.now
        match rule:
            case faults.Delay():
                ms = rule.ms + self.prepared.chance.random() * rule.jitter_ms
                lane.put(frame, now, delay=nanoseconds(ms))
                return f"held {ms:.3f} ms"
            case faults.Split():
                return self._split(rule)
            case faults.Coalesce():
                lane.gather(frame, now, rule.frames, nanoseconds(rule.within_ms))
                return f"held for {rule.frames} frames or {rule.within_ms:g} ms"
            case faults.Throttle():
                lane.put_at_rate(frame, now, rule.bytes_per_s)
                return f"slowed to {rule.bytes_per_s:g} bytes/s"
            case faults.Reorder():
                lane.set_aside(frame, now, rule.overtaken_by, nanoseconds(rule.within_ms))
                return f"set aside for {rule.overtaken_by} frames or {rule.within_ms:g} ms"

    def _split(self, rule: faults.Split) -> str:
        gap = nanoseconds(rule.gap_ms)
        if rule.size is not None:
            self._lane.put(self.frame, self.now, piece=rule.size, gap=gap)
            return f"sent in pieces of {rule.size} bytes"
        cuts = sorted({0, *(cut for cut in rule.at if cut < len(self.frame)), len(self.frame)})
        pieces = [self.frame[start:end] for start, end in pairwise(cuts)]
        self._lane.put_pieces(pieces, self.now, gap)
        return f"cut into {len(pieces)} pieces"

    def _change(self, rule: faults.Corrupt | faults.WrongByteOrder) -> str:
        changed, detail = self._changed(rule)
        self._lane.put(changed, self.now)
        return detail

    def _changed(self, rule: faults.Corrupt | faults.WrongByteOrder) -> tuple[bytes, str]:
        frame, chance = self.frame, self.prepared.chance
        if isinstance(rule, faults.WrongByteOrder):
            return in_other_order(frame, self.form), "sent in the other byte order"
        match rule.how:
            case faults.Corruption.BITS:
                changed = with_flipped_bits(frame, rule.bits, rule.offset, chance)
                wrong = [at for at, byte in enumerate(frame) if byte != changed[at]]
                return changed, f"bits flipped in bytes {', '.join(map(str, wrong))}"
            case faults.Corruption.LENGTH:
                return with_wrong_length(frame, rule.by), f"length field {rule.by:+d}"
            case faults.Corruption.TRUNCATE:
                cut = truncated(frame, rule.by)
                return cut, f"{len(frame) - len(cut)} bytes of the body cut off"
            case faults.Corruption.VALID_FIELDS:
                garbled = with_garbage_valid_fields(frame, self.form, chance)
                if garbled is None:
                    return frame, "forwarded as it was: it has no valid_fields"
                return garbled, "garbage in the upper bits of valid_fields"

    def _end(self, rule: faults.ResetLink | faults.CloseLink | faults.HalfOpen) -> str:
        if rule.forward:
            self._lane.put(self.frame, self.now)
        match rule:
            case faults.ResetLink():
                action: Action = ResetBoth(self.link)
                detail = "connection reset"
            case faults.CloseLink():
                action, detail = CloseBoth(self.link), "connection closed"
            case faults.HalfOpen():
                action, detail = Freeze(self.link), "connection half-open from here on"
        self._lane.put_action(action, self.now)
        return detail

    def _lose_reply(self) -> str:
        if is_reply(self.frame):
            return "the reply is lost"
        self._lane.put(self.frame, self.now)
        if not is_request(self.frame):
            return "forwarded as it was: nobody replies to it"
        self._owe(Awaited(lost_by=self.prepared))
        return ""

    def _refuse(self) -> str:
        if not is_request(self.frame):
            self._lane.put(self.frame, self.now)
            return "forwarded as it was: no request"
        self._owe(Awaited(answer=failure_reply(self.frame, self.form)))
        return "answered with failure, not forwarded"

    def _be_busy(self) -> str:
        if not is_request(self.frame):
            self._lane.put(self.frame, self.now)
            return "forwarded as it was: no request"
        if has_busy_answer(self.frame, self.form):
            self._owe(Awaited(answer=busy_reply(self.frame, self.form)))
            return "answered busy, not forwarded"
        self._lane.put(self.frame, self.now)
        self._owe(Awaited(withheld_by=self.prepared))
        return ""

    def _owe(self, awaited: Awaited) -> None:
        self.traffic.awaited[self.direction].append(awaited)
