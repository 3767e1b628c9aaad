"""What holds for any bytes, cut in any way (promises 7 and 9), and what takes a short cut."""

import struct
import tracemalloc
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rigs.data.message_samples import SAMPLES

from openpendant.simplemsg import (
    DIALECTS,
    MOTOMAN,
    PENDANT,
    ByteOrder,
    Codec,
    CommType,
    Connection,
    Dialect,
    JointTrajPt,
    Malformed,
    Opaque,
    Received,
    Role,
    Unasked,
    codec_for,
)
from openpendant.simplemsg.errors import LengthOutOfBounds, MessageFault
from openpendant.simplemsg.framing import HEADER_SIZE, MAX_DETECTABLE_LENGTH

FRAMES = [
    codec_for(dialect, byte_order).encode(SAMPLES[cls])
    for dialect in (MOTOMAN, PENDANT)
    for byte_order in ByteOrder
    for cls in dialect.messages
]


@st.composite
def damaged_frames(draw: st.DrawFn) -> bytes:
    frame = bytearray(draw(st.sampled_from(FRAMES)))
    for _ in range(draw(st.integers(0, 3))):
        frame[draw(st.integers(0, min(len(frame), 24) - 1))] = draw(st.integers(0, 255))
    return bytes(frame[: draw(st.integers(0, len(frame)))]) if draw(st.booleans()) else bytes(frame)


pieces = st.one_of(st.sampled_from(FRAMES), damaged_frames(), st.binary(max_size=40))
streams = st.lists(pieces, max_size=8).map(b"".join)

dialects = st.sampled_from([MOTOMAN, PENDANT])


def _drain(connection: Connection, data: bytes) -> list[Received]:
    received = connection.receive(data)
    while connection.more:
        received += connection.receive(b"")
    return received


def _chunks(stream: bytes, cuts: list[int]) -> list[bytes]:
    edges = [0, *sorted(cut % (len(stream) + 1) for cut in cuts), len(stream)]
    return [stream[a:b] for a, b in pairwise(edges)]


@given(streams, dialects, st.lists(st.integers(0, 2_000), max_size=12))
def test_events_do_not_depend_on_how_bytes_were_cut(
    stream: bytes, dialect: Dialect, cuts: list[int]
) -> None:
    runs = []
    bytewise = [stream[at : at + 1] for at in range(len(stream))]
    for chunks in ([stream], _chunks(stream, cuts), bytewise):
        connection = Connection(Role.SERVER, dialect)
        events = [event for chunk in chunks for event in _drain(connection, chunk)]
        # Texts, because two not-a-numbers are not equal.
        runs.append((repr(events), repr(connection.fault), connection.partial))
    assert runs[0] == runs[1] == runs[2]


@given(st.integers(12, 200), st.binary(min_size=200, max_size=200), dialects)
def test_any_frame_of_sound_length_keeps_a_link(length: int, data: bytes, dialect: Dialect) -> None:
    connection = Connection(Role.SERVER, dialect, ByteOrder.LITTLE)
    assert len(connection.receive(length.to_bytes(4, "little") + data[:length])) == 1
    assert connection.fault is None
    assert not connection.partial


@given(streams)
def test_what_was_received_can_be_sent_again(stream: bytes) -> None:
    connection = Connection(Role.SERVER, MOTOMAN, ByteOrder.LITTLE)
    codec = codec_for(MOTOMAN)
    connection.awaited = 1_000
    for event in _drain(connection, stream):
        if isinstance(event, Malformed | Unasked):
            continue
        frame = codec.encode(event)
        assert repr(codec.decode(frame)) == repr(event)


def test_memory_is_bounded_by_one_frame_however_much_comes() -> None:
    connection = Connection(Role.SERVER, max_frame=65_539)
    frame = codec_for().encode(Opaque(999, bytes(65_000), comm_type=CommType.TOPIC))
    point = codec_for().encode(SAMPLES[JointTrajPt])
    tracemalloc.start()
    for _ in range(200):
        for at in range(0, len(frame), 999):
            connection.receive(frame[at : at + 999])
        connection.receive(point)
    connection.receive(bytes(4))
    for _ in range(100):
        connection.receive(frame)
    kept, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert kept < 100_000
    assert peak < 10 * len(frame)


# Frames with a usual header take a short cut; it leads to the same place.

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
def test_a_frame_of_any_size_is_received_as_codecs_decode_it(codec: Codec, filling: int) -> None:
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
    start = (65_000).to_bytes(4, "little"), CommType.REPLY
    header = next(each for each in codec.usual if (each[4:8], each[8]) == start)
    size, _ = codec.usual[header]
    (received,) = client.receive(header + b"\x80" * (size - HEADER_SIZE))
    assert isinstance(received, Opaque)
    assert client.awaited == 0
