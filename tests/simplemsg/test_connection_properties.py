"""What holds for any bytes, cut in any way (promises 7 and 9)."""

from __future__ import annotations

import tracemalloc
from itertools import pairwise

from hypothesis import given
from hypothesis import strategies as st
from rigs.data.message_samples import SAMPLES

from openpendant.simplemsg import (
    MOTOMAN,
    PENDANT,
    ByteOrder,
    CommType,
    Connection,
    Dialect,
    FramingFault,
    JointTrajPt,
    Malformed,
    Opaque,
    Received,
    Role,
    Unasked,
    codec_for,
)

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


streams = st.lists(
    st.one_of(st.sampled_from(FRAMES), damaged_frames(), st.binary(max_size=40)), max_size=8
).map(b"".join)

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


@given(st.lists(st.binary(max_size=200), max_size=10))
def test_any_bytes_give_events_or_a_framing_fault(chunks: list[bytes]) -> None:
    connection = Connection(Role.SERVER)
    for chunk in chunks:
        _drain(connection, chunk)
    assert connection.fault is None or isinstance(connection.fault, FramingFault)


@given(st.integers(12, 200), st.binary(min_size=200, max_size=200), dialects)
def test_any_frame_of_a_sound_length_keeps_the_link(
    length: int, content: bytes, dialect: Dialect
) -> None:
    connection = Connection(Role.SERVER, dialect, ByteOrder.LITTLE)
    assert len(connection.receive(length.to_bytes(4, "little") + content[:length])) == 1
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
