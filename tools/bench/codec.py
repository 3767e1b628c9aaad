"""Codec: decode and encode of the four messages that travel most, and a stream of one of them.

The baseline is bare `struct`. The codec knows the messages of all dialects: more of them must not
make any one slower.
"""

from __future__ import annotations

import struct
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from timeit import Timer
from typing import Any

from openpendant.simplemsg import (
    ByteOrder,
    Connection,
    JointFeedback,
    JointPosition,
    JointTrajPt,
    JointTrajPtFull,
    Message,
    Role,
    codec_for,
)

from ..packets.reading.reader import ALL
from .table import Benchmark, Bound, Sides

_CALLS = 5_000
_DECODE = Bound(2.5, aim=1.8)
_ENCODE = Bound(1.4, aim=1.1)

_JOINTS = tuple(0.1 * joint for joint in range(10))

POSITION = JointPosition(sequence=1, joints=_JOINTS)
POINT = JointTrajPt(sequence=1, joints=_JOINTS, velocity=0.5, duration=1.0)
FULL_POINT = JointTrajPtFull(
    robot_id=0,
    sequence=1,
    valid_fields=15,
    time=0.5,
    positions=_JOINTS,
    velocities=_JOINTS,
    accelerations=_JOINTS,
)
FEEDBACK = JointFeedback(
    robot_id=0,
    valid_fields=15,
    time=0.5,
    positions=_JOINTS,
    velocities=_JOINTS,
    accelerations=_JOINTS,
)

POSITION_BODY = struct.Struct("<i10f")
POINT_BODY = struct.Struct("<i12f")
FULL_POINT_BODY = struct.Struct("<3i31f")
FEEDBACK_BODY = struct.Struct("<2i31f")

POSITION_FRAME = struct.Struct("<5i10f")
POINT_FRAME = struct.Struct("<5i12f")
FULL_POINT_FRAME = struct.Struct("<7i31f")
FEEDBACK_FRAME = struct.Struct("<6i31f")


# The baselines are written out, one for each message, because that is what someone would write who
# has no codec: nothing shared, nothing checked.


def _unpack_position(frame: bytes) -> tuple[Any, ...]:
    return POSITION_BODY.unpack_from(frame, 16)


def _unpack_point(frame: bytes) -> tuple[Any, ...]:
    return POINT_BODY.unpack_from(frame, 16)


def _unpack_full_point(frame: bytes) -> tuple[Any, ...]:
    return FULL_POINT_BODY.unpack_from(frame, 16)


def _unpack_feedback(frame: bytes) -> tuple[Any, ...]:
    return FEEDBACK_BODY.unpack_from(frame, 16)


def _pack_position(m: JointPosition) -> bytes:
    return POSITION_FRAME.pack(56, 10, m.comm_type, m.reply_code, m.sequence, *m.joints)


def _pack_point(m: JointTrajPt) -> bytes:
    return POINT_FRAME.pack(
        64, 11, m.comm_type, m.reply_code, m.sequence, *m.joints, m.velocity, m.duration
    )


def _pack_full_point(m: JointTrajPtFull) -> bytes:
    return FULL_POINT_FRAME.pack(
        148,
        14,
        m.comm_type,
        m.reply_code,
        m.robot_id,
        m.sequence,
        m.valid_fields,
        m.time,
        *m.positions,
        *m.velocities,
        *m.accelerations,
    )


def _pack_feedback(m: JointFeedback) -> bytes:
    return FEEDBACK_FRAME.pack(
        144,
        15,
        m.comm_type,
        m.reply_code,
        m.robot_id,
        m.valid_fields,
        m.time,
        *m.positions,
        *m.velocities,
        *m.accelerations,
    )


_CASES: tuple[tuple[Message, Callable[[bytes], Any], Callable[[Any], bytes]], ...] = (
    (POSITION, _unpack_position, _pack_position),
    (POINT, _unpack_point, _pack_point),
    (FEEDBACK, _unpack_feedback, _pack_feedback),
    (FULL_POINT, _unpack_full_point, _pack_full_point),
)


def benchmarks() -> list[Benchmark]:
    """Return one benchmark for each message and direction."""
    codec = codec_for(ALL)
    found = []
    for message, unpack, pack in _CASES:
        frame = codec.encode(message)
        if pack(message) != frame:
            raise ValueError(f"the baseline of {message.PLACE.name} packs other bytes")
        label = f"{message.PLACE.name} ({len(frame)} bytes)"
        decode = partial(_sides, codec.decode, unpack, frame)
        encode = partial(_sides, codec.encode, pack, message)
        found.append(Benchmark(f"codec decode {label}", "ns", decode, _DECODE))
        found.append(Benchmark(f"codec encode {label}", "ns", encode, _ENCODE))
    name = "stream of coalesced 152-byte frames"
    return [*found, Benchmark(name, "ns/frame", _stream, Bound(4.0, aim=2.5), 21)]


@contextmanager
def _sides(
    subject: Callable[[Any], Any], baseline: Callable[[Any], Any], argument: Any
) -> Iterator[Sides]:
    yield Sides(
        partial(_sample, _timer(subject, argument)), partial(_sample, _timer(baseline, argument))
    )


def _timer(function: Callable[[Any], Any], argument: Any) -> Timer:
    return Timer("f(x)", globals={"f": function, "x": argument})


def _sample(timer: Timer) -> float:
    """Return nanoseconds per call."""
    return timer.timeit(_CALLS) / _CALLS * 1e9


_FRAMES = 6_400
_CHUNK = 64
"""Frames of one read: 9.7 kB, what a loopback socket gives at once under load."""

_PASSES = 3


@contextmanager
def _stream() -> Iterator[Sides]:
    """Take coalesced frames through a connection; the baseline takes numbers out of known places.

    Every message is built and every reply accounted for on our side. A ratio of 4 is a quarter of
    the baseline's packets per second.
    """
    frame = codec_for().encode(FULL_POINT)
    chunks = [frame * _CHUNK] * (_FRAMES // _CHUNK)

    def through_a_connection() -> int:
        wire = Connection(Role.SERVER, ALL, ByteOrder.LITTLE)
        return sum(len(wire.receive(chunk)) for chunk in chunks)

    def bare() -> int:
        count, unpack = 0, FULL_POINT_BODY.unpack_from
        for chunk in chunks:
            for at in range(16, len(chunk), len(frame)):
                unpack(chunk, at)
                count += 1
        return count

    def sample(run: Callable[[], int]) -> float:
        best = float("inf")
        for _ in range(_PASSES):
            began = time.perf_counter_ns()
            count = run()
            best = min(best, (time.perf_counter_ns() - began) / count)
            if count != _FRAMES:
                raise ValueError(f"{count} messages of {_FRAMES} frames")
        return best

    yield Sides(lambda: sample(through_a_connection), lambda: sample(bare))
