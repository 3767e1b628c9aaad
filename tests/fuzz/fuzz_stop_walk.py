"""The walk ahead finds the STOPs that lie in what has arrived, each at once, and no others.

The other way to find them is slow and needs all bytes: cut the stream at its lengths, look at each
frame alone.
"""

import struct
from collections.abc import Iterator

from rigs.data.message_samples import SAMPLES

from openpendant.simplemsg import (
    PENDANT,
    PENDANT_STOPS,
    ROS_STOPS,
    STANDARD,
    ByteOrder,
    Connection,
    JointTraj,
    MessageFault,
    MsgType,
    Opaque,
    Role,
    Unasked,
    WaitingStop,
    codec_for,
)
from openpendant.simplemsg.pendant import SoftwareStop

from .choices import Choices, portions
from .sample_frames import sample_frames

_PORTS = ((STANDARD, ROS_STOPS, 1_023), (PENDANT, PENDANT_STOPS, 65_532))
_ORDERS = (ByteOrder.LITTLE, ByteOrder.BIG)
_SEQUENCE_AT = {int(MsgType.JOINT_TRAJ_PT): 16, int(MsgType.JOINT_TRAJ_PT_FULL): 20}


def TestOneInput(data: bytes) -> None:
    choices = Choices(data)
    port, order = choices.number(2), choices.pick(_ORDERS)
    dialect, rule, most = _PORTS[port]
    is_known, limit, sizes = choices.number(2), choices.number(20) + 1, choices.take(3)
    # A first frame that is no STOP: one that is, and comes alone, would not need the walk.
    stream = codec_for(STANDARD, order).encode(Opaque(999, b"", comm_type=1)) + choices.rest()
    known = order if is_known else None
    wire = Connection(Role.SERVER, dialect, known, 4, most, frames_per_call=limit, stop_rule=rule)
    expected = _stops(stream, order, port, most)
    arrived = 0
    for piece in portions(stream, sizes):
        arrived += len(piece)
        wire.read_ahead(piece)
        if wire.byte_order is not None:
            ended = [place for place, end in expected if end <= arrived]
            assert [stop.place for stop in wire.stops] == ended
    _hand_over(wire, {place for place, _ in expected})


def _hand_over(wire: Connection, expected: set[int]) -> None:
    """Decode what waits: each STOP stands in its place, and answers are owed as without them."""
    place, owed, is_begun = 0, 0, True
    while wire.more or is_begun:
        is_begun = False
        received = wire.receive(b"")
        owed += sum(not isinstance(each, Unasked) and each.comm_type == 2 for each in received)
        for each in wire.marked(received) if wire.overtaking else received:
            assert isinstance(each, WaitingStop) == (place in expected)
            place += 1
    assert wire.unanswered == owed
    assert wire.fault is not None or not expected or place > max(expected)


def _stops(stream: bytes, order: ByteOrder, port: int, most: int) -> list[tuple[int, int]]:
    at, place, found = 0, 0, []
    while at + 16 <= len(stream):
        length, msg_type, comm = struct.unpack_from(f"{order.value}3i", stream, at)
        end = at + 4 + length
        if not 12 <= length <= most - 4 or end > len(stream):
            break
        if comm in (1, 2) and _is_stop(stream[at:end], msg_type, order, port):
            found.append((place, end))
        at, place = end, place + 1
    return found


def _is_stop(frame: bytes, msg_type: int, order: ByteOrder, port: int) -> bool:
    if port == 1:
        return msg_type == SoftwareStop.PLACE.msg_type
    if msg_type == MsgType.JOINT_TRAJ:
        try:
            message = codec_for(STANDARD, order).decode(frame)
        except MessageFault:
            return False
        return isinstance(message, JointTraj) and -4 in [each.sequence for each in message.points]
    at = _SEQUENCE_AT.get(msg_type, len(frame))
    return frame[at : at + 4] == struct.pack(f"{order.value}i", -4)


def seeds() -> Iterator[bytes]:
    stops = [sample for sample in sample_frames() if sample.real == 0]
    for sample in stops:
        head = bytes((sample.dialect == 2, sample.order, sample.order, 3, 200, 7, 1))
        yield head + sample.data + sample.data
    for place, order in enumerate(_ORDERS):
        for msg_type, at in _SEQUENCE_AT.items():
            body = struct.pack(f"{order.value}i", -4).rjust(at - 12, b"\0")
            header = struct.pack(f"{order.value}4i", 12 + len(body), msg_type, 2, 0)
            yield bytes((0, place, 0, 1, 9, 50, 3)) + (header + body) * 3 + header[:9]
        frame = codec_for(PENDANT, order).encode(SAMPLES[SoftwareStop])
        yield bytes((1, place, 1, 2, 200, 50, 3)) + frame * 2 + bytes(4) + frame
