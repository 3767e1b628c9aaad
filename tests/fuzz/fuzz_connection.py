"""Both ends of a conversation, sending and receiving in any order, keep their accounts."""

import struct
from collections.abc import Iterator

from rigs.data.golden_vectors import GOLDEN
from rigs.data.message_samples import SAMPLES

from openpendant.simplemsg import (
    DIALECTS,
    ByteOrder,
    CommType,
    Connection,
    LocalProtocolError,
    Malformed,
    Message,
    Role,
    Unasked,
    accepted,
    refused,
)

from .choices import Choices
from .sample_frames import sample_frames

_DIALECTS = tuple(DIALECTS.values())
_ORDERS = (ByteOrder.LITTLE, ByteOrder.BIG)
_SAMPLES = tuple(SAMPLES.values())


def TestOneInput(data: bytes) -> None:
    choices = Choices(data)
    role, dialect = choices.pick(tuple(Role)), choices.pick(_DIALECTS)
    order = None if role is Role.SERVER and choices.number(2) else choices.pick(_ORDERS)
    connection = Connection(role, dialect, order, choices.pick((4, 8)), choices.pick((1_023, 300)))
    last: Message | None = None
    while choices.more:
        match choices.number(4):
            case 0:
                _send(connection, choices.pick(_SAMPLES))
            case 1:
                if last is not None:
                    _send(connection, choices.pick((accepted, refused))(last))
            case _:
                last = _receive(connection, choices.take(choices.number(200) + 1)) or last


def _send(connection: Connection, message: Message) -> None:
    before = connection.unanswered, connection.awaited
    try:
        frame = connection.send(message)
    except LocalProtocolError:
        assert (connection.unanswered, connection.awaited) == before
        return
    assert connection.byte_order is not None
    assert struct.unpack_from(f"{connection.byte_order.value}i", frame) == (len(frame) - 4,)
    paid = message.comm_type == CommType.REPLY
    asked = message.comm_type == CommType.REQUEST
    assert (connection.unanswered, connection.awaited) == (before[0] - paid, before[1] + asked)
    assert connection.unanswered >= 0


def _receive(connection: Connection, piece: bytes) -> Message | None:
    """Hand over a piece and check the accounts; return the last message that is one."""
    was_lost = connection.fault is not None
    unanswered, awaited = connection.unanswered, connection.awaited
    received = connection.receive(piece)
    while connection.more:
        received += connection.receive(b"")
    assert not (was_lost and received)
    last: Message | None = None
    for item in received:
        if isinstance(item, Unasked):
            assert awaited == 0
            continue
        unanswered += item.comm_type == CommType.REQUEST
        if item.comm_type == CommType.REPLY:
            awaited = max(awaited - 1, 0)
        if not isinstance(item, Malformed):
            last = item
    assert (connection.unanswered, connection.awaited) == (unanswered, awaited)
    return last


def seeds() -> Iterator[bytes]:
    for golden in GOLDEN[::9]:
        order = 0 if golden.byte_order is ByteOrder.LITTLE else 1
        frame = golden.frame[:200]
        head = bytes((0, _DIALECTS.index(golden.dialect), order, golden.real_size // 8, 0))
        yield head + bytes((2, len(frame) - 1)) + frame + bytes((1, 0, 0, 4, 1, 1))
    for sample in sample_frames():
        # A server is asked, a client is answered and told; the byte behind a server settles that
        # its order is picked, too.
        asks = sample.comm_type is CommType.REQUEST
        role = bytes((1, sample.dialect, 0) if asks else (0, sample.dialect))
        head = role + bytes((sample.order, sample.real, 0))
        yield head + b"".join(_pieces(sample.data)) + bytes((1, 0, 0, 4, 1, 1))


def _pieces(frame: bytes) -> Iterator[bytes]:
    for at in range(0, len(frame), 200):
        piece = frame[at : at + 200]
        yield bytes((2, len(piece) - 1)) + piece
