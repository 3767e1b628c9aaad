"""Stream: coalesced frames through a connection, against a bare `unpack_from` over the same bytes.

Every message is built and every reply accounted for on our side; the baseline takes the numbers out
of bodies whose places it knows. A ratio of 4 is a quarter of its packets per second.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from openpendant.simplemsg import ByteOrder, Connection, Role, codec_for

from ..packets.reading.reader import ALL
from .codec import FULL_POINT, FULL_POINT_BODY
from .table import Benchmark, Bound, Sides

_FRAMES = 6_400
_CHUNK = 64
"""Frames of one read: 9.7 kB, what a loopback socket gives at once under load."""

_PASSES = 3


def benchmarks() -> list[Benchmark]:
    """Return the one benchmark."""
    name = "stream of coalesced 152-byte frames"
    return [Benchmark(name, "ns/frame", _sides, Bound(4.0, aim=2.5), 21)]


@contextmanager
def _sides() -> Iterator[Sides]:
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
