"""Any bytes on a serial line, in any portions, leave frames that are such, and counts."""

from collections.abc import Iterator

from rigs.data.keypad_vectors import G1, G2, G3, GOLDEN_FRAMES

from openpendant.simplemsg.serial_frames import (
    LONGEST_PIECE,
    LONGEST_UPLINK_PIECE,
    FrameReader,
    LcdPage,
    LineWay,
    bytes_of,
    frame_of,
)

from .choices import Choices, portions

_WAYS = tuple(LineWay)


def TestOneInput(data: bytes) -> None:
    choices = Choices(data)
    way = choices.pick(_WAYS)
    longest = choices.pick((LONGEST_PIECE, LONGEST_UPLINK_PIECE))
    sizes = choices.take(4)
    line = choices.rest()
    parts, whole = FrameReader(way, longest), FrameReader(way, longest)
    found = [frame for part in portions(line, sizes) for frame in parts.receive(part)]
    assert found == whole.receive(line)
    assert parts.counts == whole.counts
    assert parts.counts.frames == len(found)
    assert parts.counts.received == len(line)
    for sequence, frame in found:
        # What was read is written to bytes that are read alike.
        assert frame_of(bytes_of(frame, sequence)[1:-1], way) == (sequence, frame)
    # The reader is back in step at the next zero byte.
    after = G3 if way is LineWay.TO_DEVICE else G1
    last = found[-1][0] if found else None
    read = parts.receive(b"\0" + after.line)
    closing = frame_of(after.line[1:-1], way)
    assert read[-1:] == [closing] or last == after.sequence or read == []


def seeds() -> Iterator[bytes]:
    for golden in GOLDEN_FRAMES:
        yield bytes((_WAYS.index(golden.way), 0, 1, 7, 0, 3)) + golden.line
    yield (
        bytes((_WAYS.index(LineWay.TO_HOST), 0, 5, 1, 9, 2))
        + G1.line
        + b"noise"
        + G2.line
        + G2.line
    )
    page = bytes_of(LcdPage(b"T1 JOINT" * 10), 200)
    yield (
        bytes((_WAYS.index(LineWay.TO_DEVICE), 1, 40, 40, 1, 1)) + page[:50] + page + b"\x01" * 120
    )
