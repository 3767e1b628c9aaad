"""Frames whole and in portions are the same messages, and what was decoded encodes again."""

import contextlib
from collections.abc import Iterable, Iterator

from rigs.data.golden_vectors import GOLDEN

from openpendant.simplemsg import (
    DIALECTS,
    ByteOrder,
    Connection,
    Malformed,
    ProtocolError,
    Received,
    Role,
    Unasked,
    codec_for,
)

from .choices import Choices, portions
from .sample_frames import sample_frames

_DIALECTS = tuple(DIALECTS.values())
_ORDERS = (None, ByteOrder.LITTLE, ByteOrder.BIG)
_SIZES = (4, 8)
_BOUNDS = (1_023, 16, 200, 65_536)


def TestOneInput(data: bytes) -> None:
    choices = Choices(data)
    dialect, order = choices.pick(_DIALECTS), choices.pick(_ORDERS)
    real_size, bound = choices.pick(_SIZES), choices.pick(_BOUNDS)
    sizes = choices.take(3)
    stream = choices.rest()
    whole, split = (Connection(Role.SERVER, dialect, order, real_size, bound) for _ in range(2))
    messages = _received(whole, [stream])
    assert list(map(_text, messages)) == list(map(_text, _received(split, portions(stream, sizes))))
    assert (whole.byte_order, repr(whole.fault)) == (split.byte_order, repr(split.fault))
    assert (whole.unanswered, whole.partial) == (split.unanswered, split.partial)

    codec = codec_for(dialect, whole.byte_order or ByteOrder.LITTLE, real_size)
    for received in messages:
        if isinstance(received, Malformed):
            continue
        message = received.message if isinstance(received, Unasked) else received
        frame = codec.encode(message)
        again = codec.decode(frame)
        assert repr(again) == repr(message)
        assert codec.encode(again) == frame
    with contextlib.suppress(ProtocolError):
        codec.decode(stream)


def _received(connection: Connection, pieces: Iterable[bytes]) -> list[Received]:
    received: list[Received] = []
    for piece in pieces:
        received += connection.receive(piece)
        while connection.more:
            received += connection.receive(b"")
    return received


def _text(received: Received) -> str:
    """Tell messages apart, also those that hold a NaN."""
    return f"{received!r} {received.error}" if isinstance(received, Malformed) else repr(received)


def seeds() -> Iterator[bytes]:
    for golden in GOLDEN[::9]:
        order = 1 if golden.byte_order is ByteOrder.LITTLE else 2
        dialect = _DIALECTS.index(golden.dialect)
        head = bytes((dialect, order, golden.real_size // 8, 3, 1, 7, 0))
        yield head + golden.frame + golden.frame
    for sample in sample_frames():
        head = bytes((sample.dialect, 1 + sample.order, sample.real, 3, 1, 7, 0))
        yield head + sample.data + sample.data
