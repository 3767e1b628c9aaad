"""Frames with a usual header take a short cut through `Connection`; it leads to the same place."""

from __future__ import annotations

import struct

import pytest

from openpendant.simplemsg import (
    DIALECTS,
    ByteOrder,
    Codec,
    CommType,
    Connection,
    Malformed,
    Opaque,
    Role,
    Unasked,
    codec_for,
)
from openpendant.simplemsg.errors import LengthOutOfBounds, MessageFault
from openpendant.simplemsg.framing import HEADER_SIZE, MAX_DETECTABLE_LENGTH

CODECS = [
    codec_for(dialect, order, real_size)
    for dialect in DIALECTS.values()
    for order in ByteOrder
    for real_size in (4, 8)
]

each_codec = pytest.mark.parametrize(
    "codec", CODECS, ids=lambda c: f"{c.dialect.name}-{c.byte_order.name}-{c.real_size}"
)


def _connection(codec: Codec, max_frame: int = MAX_DETECTABLE_LENGTH) -> Connection:
    return Connection(
        Role.SERVER, codec.dialect, codec.byte_order, codec.real_size, max_frame=max_frame
    )


def _plainly(codec: Codec, frame: bytes) -> str:
    """What the codec alone makes of a frame."""
    try:
        message = codec.decode(frame)
    except MessageFault as error:
        request_id = codec.request_id(frame, error.msg_type, error.comm_type)
        return repr(Malformed(error.msg_type, error.comm_type, error, request_id))
    return repr(Unasked(message) if message.comm_type == CommType.REPLY else message)


@each_codec
@pytest.mark.parametrize("filling", [0x00, 0x41, 0x80, 0xFF])
def test_every_usual_frame_is_received_as_the_codec_decodes_it(codec: Codec, filling: int) -> None:
    for header, (size, _) in codec.usual.items():
        frame = header + bytes([filling]) * (size - HEADER_SIZE)
        (received,) = _connection(codec).receive(frame)
        assert repr(received) == _plainly(codec, frame)


@each_codec
@pytest.mark.parametrize("filling", [0x00, 0x41, 0x80, 0xFF])
def test_a_frame_of_any_size_is_received_as_the_codec_decodes_it(
    codec: Codec, filling: int
) -> None:
    for header in codec.of_any_size:
        for size in (0, 3, 4, 8, 52, 104, 400):
            frame = _prefix(codec, header, size) + header + bytes([filling]) * size
            (received,) = _connection(codec).receive(frame)
            assert repr(received) == _plainly(codec, frame)
            in_two = _connection(codec)
            assert list(map(repr, in_two.receive(frame + frame[:-1]))) == [repr(received)]
            assert in_two.partial


@each_codec
def test_a_frame_of_any_size_beyond_the_bound_of_the_conversation_is_a_fault(codec: Codec) -> None:
    for header in codec.of_any_size:
        wire = _connection(codec, max_frame=HEADER_SIZE + 99)
        assert wire.receive(_prefix(codec, header, 100) + header + bytes(100)) == []
        assert isinstance(wire.fault, LengthOutOfBounds)


def _prefix(codec: Codec, header: bytes, size: int) -> bytes:
    return struct.pack(f"{codec.byte_order.value}i", len(header) + size)


@each_codec
def test_a_usual_frame_beyond_the_bound_of_the_conversation_is_a_fault(codec: Codec) -> None:
    for header, (size, _) in codec.usual.items():
        frame = header + bytes(size - HEADER_SIZE)
        if size > HEADER_SIZE:
            wire = _connection(codec, max_frame=size - 1)
            assert wire.receive(frame) == []
            assert isinstance(wire.fault, LengthOutOfBounds)
        assert len(_connection(codec, max_frame=size).receive(frame)) == 1


def test_a_reply_whose_text_is_no_utf_8_settles_its_request_and_is_kept_whole() -> None:
    codec = codec_for(DIALECTS["pendant"])
    client = Connection(Role.CLIENT, codec.dialect, ByteOrder.LITTLE, max_frame=4_096)
    client.awaited = 1
    header = next(
        header
        for header in codec.usual
        if header[4:8] == (65_000).to_bytes(4, "little") and header[8] == CommType.REPLY
    )
    size, _ = codec.usual[header]
    (received,) = client.receive(header + b"\x80" * (size - HEADER_SIZE))
    assert isinstance(received, Opaque)
    assert client.awaited == 0
