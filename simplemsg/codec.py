"""Whole frames to messages and back, for one dialect, byte order and real width.

Owns the header of a frame and the choice of a layout. How a body is packed is the business of
`packing`; where a frame begins in a stream is `connection`'s.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, partial
from typing import Any

from .codes import ByteOrder, CommType, MsgType, ReplyCode
from .declaration import Message
from .errors import BodyFault, HeaderFault, LocalProtocolError, NotEncodable
from .framing import HEADER_SIZE, PREFIX_SIZE, Bytes, broken_header_rule
from .layout import Decode, Encode, Misfit, WireForm, header_fault
from .motoman import MOTOMAN_MESSAGES
from .packing import UNPACKABLE, FixedLayout, VariableLayout
from .pendant import PENDANT_MESSAGES
from .standard import STANDARD_MESSAGES, HeaderOnly, Opaque

_REAL_CODES = {4: "f", 8: "d"}


@dataclass(frozen=True)
class Dialect:
    """A named set of messages."""

    name: str
    messages: tuple[type[Message], ...]


STANDARD = Dialect("standard", STANDARD_MESSAGES)
MOTOMAN = Dialect("motoman", STANDARD_MESSAGES + MOTOMAN_MESSAGES)
PENDANT = Dialect("pendant", STANDARD_MESSAGES + PENDANT_MESSAGES)
DIALECTS = {dialect.name: dialect for dialect in (STANDARD, MOTOMAN, PENDANT)}

_REPLY_HEADERS = [
    (CommType.REPLY, ReplyCode.SUCCESS),
    (CommType.REPLY, ReplyCode.FAILURE),
]
_OTHER_HEADERS = [
    (CommType.TOPIC, ReplyCode.UNUSED),
    (CommType.REQUEST, ReplyCode.UNUSED),
]

# Types that have a name but no layout anywhere, so they stay opaque.
_NAMED_OPAQUE = {
    int(msg_type): msg_type.name.lower() for msg_type in (MsgType.READ_INPUT, MsgType.WRITE_OUTPUT)
}


class _Encoders(dict[type[Message], Callable[[Any], bytes]]):
    """What encodes the messages of a dialect, by their classes."""

    def __init__(self, dialect: str) -> None:
        super().__init__()
        self._dialect = dialect

    def __missing__(self, cls: type[Message]) -> Callable[[Any], bytes]:
        raise LocalProtocolError(f"{cls.__name__} is no message of the {self._dialect} dialect")


class Codec:
    """Encodes and decodes the messages of one dialect in one wire form.

    Get one from `codec_for`, which keeps them: building one writes and compiles its functions.

    Attributes:
        encode: `encode(message: Message) -> bytes` gives the whole frame, prefix included. Raises
            `LocalProtocolError` where the dialect does not know the message or its header breaks
            a rule, and `NotEncodable` where a value does not fit its field.
        decode: `decode(frame) -> Message` takes one whole frame, prefix included, in any bytes-like
            object. Raises `HeaderFault` or `BodyFault`.
        usual: the sixteen header bytes of every frame of fixed size with a usual header, with the
            size of the frame and a decoder for it; that decoder raises `struct.error` for another
            size and `UnicodeDecodeError` for a text that is none.
        of_any_size: the header bytes behind the length of every frame of variable size with a usual
            header, with a decoder for it that raises what `decode` raises.
        encoders: for each class of messages what `encode` does with it, and raises.
        real_size: bytes of a real, 4 or 8.
    """

    encode: Encode
    decode: Decode
    usual: dict[bytes, tuple[int, Decode]]
    of_any_size: dict[bytes, Decode]

    def __init__(self, dialect: Dialect, byte_order: ByteOrder, real_size: int) -> None:
        if real_size not in _REAL_CODES:
            raise ValueError(f"a real has 4 or 8 bytes, not {real_size}")
        self.dialect = dialect
        self.byte_order = byte_order
        self.real_size = real_size
        form = WireForm(byte_order.value, _REAL_CODES[real_size])
        self._header = struct.Struct(f"{form.order}4i")
        self._layouts: dict[tuple[int, bool], FixedLayout | VariableLayout] = {}
        self.encoders = _Encoders(dialect.name)
        self.encoders[HeaderOnly] = self._encode_header_only
        self.encoders[Opaque] = self._encode_opaque
        for cls in dialect.messages:
            layout = _layout_of(cls, form)
            self._layouts[cls.PLACE.msg_type, cls.PLACE.is_reply] = layout
            self.encoders[cls] = layout.encode
        self.encode = self._fast_encode()
        headers = self._usual_headers()
        self.decode = self._fast_decode(headers)
        self.usual = {
            header: (PREFIX_SIZE + self._header.unpack(header)[0], decode)
            for header, decode in headers.items()
        }
        self.of_any_size = {
            self._header.pack(0, msg_type, comm, code)[PREFIX_SIZE:]: layout.decoder(
                comm, code, on_misfit=self._decode_unusual
            )
            for (msg_type, is_reply), layout in self._layouts.items()
            if isinstance(layout, VariableLayout) and not layout.cls.PLACE.any_body
            for comm, code in self._headers_of(msg_type, is_reply)
        }

    def _headers_of(self, msg_type: int, is_reply: bool) -> list[tuple[CommType, ReplyCode]]:
        """Return the usual headers of a layout."""
        if is_reply:
            return _REPLY_HEADERS
        has_reply = (msg_type, True) in self._layouts
        return _OTHER_HEADERS if has_reply else _OTHER_HEADERS + _REPLY_HEADERS

    def _usual_headers(self) -> dict[bytes, Decode]:
        """Return a decoder for every header that is usual in this dialect."""
        usual: dict[bytes, Decode] = {}
        for (msg_type, is_reply), layout in self._layouts.items():
            if not isinstance(layout, FixedLayout):
                continue
            for comm, code in self._headers_of(msg_type, is_reply):
                header = self._header.pack(layout.size - PREFIX_SIZE, msg_type, comm, code)
                usual[header] = layout.decoder(comm, code)
        for msg_type, _ in self._layouts:
            for comm, code in _REPLY_HEADERS:
                header = self._header.pack(HEADER_SIZE - PREFIX_SIZE, msg_type, comm, code)
                usual.setdefault(header, _header_only_decoder(msg_type, code))
        return usual

    def _fast_decode(self, usual: dict[bytes, Decode]) -> Decode:
        """Return `decode`: one look-up of the sixteen header bytes checks the whole header.

        Length, type, communication type and reply code of every usual frame are known beforehand;
        only unusual ones are taken apart.
        """
        unusual = self._decode_unusual
        header = slice(0, HEADER_SIZE)
        size_error = struct.error

        # Names bound as defaults are locals of the function: looked up by index, without a cell.
        def decode(
            frame: Any, usual: dict[bytes, Decode] = usual, header: slice = header
        ) -> Message:
            try:
                return usual[frame[header]](frame)
            except (KeyError, size_error, ValueError, TypeError):
                return unusual(frame)

        return decode

    def _fast_encode(self) -> Encode:
        """Return `encode`: a closure, since attributes of `self` would cost a tenth more."""
        encoders = self.encoders
        known = dict(encoders)  # the interpreter looks up faster in a dict than in our kind of one

        def encode(message: Message) -> bytes:
            try:
                return known[type(message)](message)
            except KeyError:
                return encoders[type(message)](message)

        return encode

    def name_of(self, msg_type: int, comm_type: int) -> str:
        """Return the name of a message type, `unknown` where the dialect has none."""
        cls = self.message_class(msg_type, comm_type)
        return _NAMED_OPAQUE.get(msg_type, "unknown") if cls is None else cls.PLACE.name

    def message_class(self, msg_type: int, comm_type: int) -> type[Message] | None:
        """Return the class that a header calls for, None where the dialect has none."""
        layout = self._find(msg_type, comm_type)
        return None if layout is None else layout.cls

    def request_id(self, frame: bytes, msg_type: int, comm_type: int) -> int:
        """Return the id of a request whose body is wrong further on; 0 where it has none."""
        cls = self.message_class(msg_type, comm_type)
        if cls is None or comm_type != CommType.REQUEST:
            return 0
        if next(iter(cls.FIELDS), "") != "request_id" or len(frame) < HEADER_SIZE + 4:
            return 0
        number: int = struct.unpack_from(f"{self.byte_order.value}i", frame, HEADER_SIZE)[0]
        return number

    def _find(self, msg_type: int, comm_type: int) -> FixedLayout | VariableLayout | None:
        is_reply = comm_type == CommType.REPLY
        return self._layouts.get((msg_type, is_reply)) or self._layouts.get((msg_type, False))

    def _encode_header_only(self, message: HeaderOnly) -> bytes:
        """Pack first, judge then: a stream of points has an answer of this kind to each of them."""
        msg_type, comm, code = message.msg_type, message.comm_type, message.reply_code
        try:
            frame = self._header.pack(HEADER_SIZE - PREFIX_SIZE, msg_type, comm, code)
        except UNPACKABLE:
            frame = b""
        if not frame or broken_header_rule(msg_type, comm, code) is not None:
            return self._frame("header_only", message, msg_type, b"")  # which says what is wrong
        return frame

    def _encode_opaque(self, message: Opaque) -> bytes:
        return self._frame("opaque", message, message.msg_type, message.body)

    def _frame(self, name: str, message: Message, msg_type: int, body: Bytes) -> bytes:
        comm, code = message.comm_type, message.reply_code
        reason = header_fault(msg_type, comm, code)
        if reason is not None:
            raise LocalProtocolError(f"{name}: {reason}")
        try:
            raw = bytes(memoryview(body))
        except TypeError:
            raise NotEncodable(name, "body", body, "bytes") from None
        return self._header.pack(len(raw) + HEADER_SIZE - PREFIX_SIZE, msg_type, comm, code) + raw

    def _decode_unusual(self, frame: Bytes) -> Message:
        if not isinstance(frame, bytes):
            return self.decode(bytes(memoryview(frame)))
        if len(frame) < HEADER_SIZE:
            raise HeaderFault(f"{len(frame)} bytes are less than a header", 0, 0, 0)
        length, msg_type, comm, code = self._header.unpack_from(frame)
        if length != len(frame) - PREFIX_SIZE:
            reason: str | None = (
                f"declared length {length} is not the {len(frame) - PREFIX_SIZE} bytes that follow"
            )
        else:
            reason = broken_header_rule(msg_type, comm, code)
        if reason is not None:
            raise HeaderFault(reason, msg_type, comm, code)
        return self._decode_body(
            frame, msg_type, _COMM_TYPES.get(comm, comm), _REPLY_CODES.get(code, code)
        )

    def _decode_body(self, frame: bytes, msg_type: int, comm: int, code: int) -> Message:
        layout = self._find(msg_type, comm)
        if layout is None:
            return _undeclared(frame, msg_type, comm, code)
        if layout.cls.PLACE.any_body:
            return layout.cls(comm_type=comm, reply_code=code)
        try:
            return layout.decode(frame, comm, code)
        except Misfit as misfit:
            # Vendors answer one type with several layouts, so no reply is refused for its body.
            if comm == CommType.REPLY:
                return _undeclared(frame, msg_type, comm, code)
            raise BodyFault(f"{layout.cls.PLACE.name}: {misfit}", msg_type, comm, code) from None


def _layout_of(cls: type[Message], form: WireForm) -> FixedLayout | VariableLayout:
    return VariableLayout(cls, form) if VariableLayout.suits(cls) else FixedLayout(cls, form)


def _undeclared(frame: bytes, msg_type: int, comm: int, code: int) -> Message:
    if comm == CommType.REPLY and len(frame) == HEADER_SIZE:
        return HeaderOnly(msg_type, comm_type=comm, reply_code=code)
    return Opaque(msg_type, frame[HEADER_SIZE:], comm_type=comm, reply_code=code)


def _header_only_decoder(msg_type: int, code: ReplyCode) -> Decode:
    new, comm = partial(object.__new__, HeaderOnly), CommType.REPLY

    def decode(frame: Bytes) -> Message:
        if len(frame) != HEADER_SIZE:
            raise Misfit("a bare reply has no body")
        # As in `packing`: to call the class takes three times as long, and every point is answered.
        reply = new()
        reply.msg_type, reply.comm_type, reply.reply_code = msg_type, comm, code
        return reply

    return decode


_COMM_TYPES = {int(member): member for member in CommType}
_REPLY_CODES = {int(member): member for member in ReplyCode}


@cache
def codec_for(
    dialect: Dialect = STANDARD,
    byte_order: ByteOrder = ByteOrder.LITTLE,
    real_size: int = 4,
) -> Codec:
    """Return the codec of a dialect in a wire form; the same object every time.

    Raises:
        ValueError: `real_size` is neither 4 nor 8.
    """
    return Codec(dialect, byte_order, real_size)
