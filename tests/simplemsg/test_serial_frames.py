"""Frames of the keypad's line: golden bytes, and what rubbish costs."""

import random
import tracemalloc
from dataclasses import asdict
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rigs.data.keypad_vectors import G1, G2, G3, G4, GOLDEN_FRAMES, GoldenFrame

from openpendant.simplemsg.serial_frames import (
    FRAMES,
    LONGEST_PIECE,
    LONGEST_UPLINK_PIECE,
    AskHello,
    CarriedMessage,
    FrameReader,
    FrameWriter,
    HostBeat,
    KeyDown,
    KeyUp,
    LcdPage,
    LcdRow,
    LineWay,
    SerialFrame,
    bytes_of,
    checksum,
    stuffed,
    unstuffed,
)

GOOD = [golden for golden in GOLDEN_FRAMES if golden.fields is not None]
good = pytest.mark.parametrize("golden", GOOD, ids=lambda golden: golden.name)


def read(data: bytes, way: LineWay = LineWay.TO_HOST) -> list[tuple[int, SerialFrame]]:
    return FrameReader(way).receive(data)


def made(golden: GoldenFrame) -> SerialFrame:
    assert golden.fields is not None
    return FRAMES[golden.kind][0](**golden.fields)


@good
def test_a_golden_frame_is_written_to_the_byte(golden: GoldenFrame) -> None:
    assert bytes_of(made(golden), golden.sequence) == golden.line


@good
def test_a_golden_frame_is_read(golden: GoldenFrame) -> None:
    ((sequence, frame),) = read(golden.line, golden.way)
    assert (sequence, frame.KIND, asdict(frame)) == (golden.sequence, golden.kind, golden.fields)


def test_a_key_that_came_up_is_never_read_as_one_that_went_down_for_one_flipped_bit() -> None:
    reader = FrameReader(G4.way)
    assert reader.receive(G4.line) == []
    assert reader.counts.bad == 1
    # One flipped bit, back again: the same bytes with the kind that they were sent with.
    sent = G4.line.replace(b"\x02\x09", b"\x03\x09")
    ((_, frame),) = read(sent)
    assert isinstance(frame, KeyUp)


def test_the_checksum_is_the_one_that_is_not_reflected() -> None:
    assert checksum(b"123456789") == 0x29B1
    for golden in GOOD:
        data = unstuffed(golden.line[1:-1])
        assert data is not None
        assert checksum(data[:-2]) == golden.crc


def test_a_frame_that_was_cut_costs_only_itself() -> None:
    reader = FrameReader(LineWay.TO_DEVICE)
    assert reader.receive(G3.line[:12] + G3.line) == [(G3.sequence, made(G3))]
    assert reader.counts.bad == 1
    host = FrameReader(LineWay.TO_HOST)
    assert host.receive(G3.line[:12] + G1.line) == [(G1.sequence, made(G1))]
    assert host.counts.bad == 1


@pytest.mark.parametrize("golden", GOLDEN_FRAMES, ids=lambda golden: golden.name)
def test_no_part_of_a_golden_frame_is_a_frame_and_the_next_one_is_read(
    golden: GoldenFrame,
) -> None:
    after = G3 if golden.way is LineWay.TO_DEVICE else G2
    whole = golden.line.rstrip(b"\0")
    for end in range(len(whole)):
        reader = FrameReader(golden.way)
        assert reader.receive(golden.line[:end]) == []
        assert reader.receive(after.line) == [(after.sequence, made(after))]


@good
def test_a_frame_is_read_however_its_bytes_are_portioned(golden: GoldenFrame) -> None:
    for first in range(len(golden.line) + 1):
        for second in range(first, len(golden.line) + 1):
            reader = FrameReader(golden.way)
            parts = pairwise((0, first, second, len(golden.line)))
            found = [one for at, end in parts for one in reader.receive(golden.line[at:end])]
            assert found == [(golden.sequence, made(golden))]


@good
def test_each_flipped_bit_of_a_frame_is_noticed(golden: GoldenFrame) -> None:
    for place in range(1, len(golden.line) - 1):
        for bit in range(8):
            line = bytearray(golden.line)
            line[place] ^= 1 << bit
            assert read(bytes(line), golden.way) == []


@good
def test_a_frame_in_the_wrong_direction_is_rubbish(golden: GoldenFrame) -> None:
    other = LineWay.TO_HOST if golden.way is LineWay.TO_DEVICE else LineWay.TO_DEVICE
    reader = FrameReader(other)
    assert reader.receive(golden.line) == []
    assert reader.counts.bad == 1


def test_the_bytes_between_two_frames_cost_none_of_them() -> None:
    reader = FrameReader(LineWay.TO_HOST)
    found = reader.receive(b"\x41\x42" + G1.line + b"boot" + G2.line + b"\0\0\0")
    assert [sequence for sequence, _ in found] == [G1.sequence, G2.sequence]
    assert (reader.counts.frames, reader.counts.bad) == (2, 2)


def framed(data: bytes) -> bytes:
    return b"\0" + stuffed(data + checksum(data).to_bytes(2, "little")) + b"\0"


@pytest.mark.parametrize(
    "data",
    [
        b"\x03\x01\x06\x00\xff\x00\x00\x00\x01",  # a byte of the payload is missing
        b"\x03\x01\x05\x00\xff\x00\x00\x00\x01",  # as long as it says, not as its kind is
        b"\x03\x01\x06\x01\xff\x00\x00\x00\x01\x00",  # 262 bytes, it says
        b"\x7f\x01\x00\x00",  # no such kind
        b"\x03",
        b"",
    ],
)
def test_a_right_checksum_alone_makes_no_frame(data: bytes) -> None:
    assert read(framed(data)) == []


def test_a_frame_that_comes_twice_counts_once() -> None:
    reader = FrameReader(LineWay.TO_HOST)
    assert len(reader.receive(G1.line + G1.line + G2.line)) == 2
    assert (reader.counts.repeated, reader.counts.missing) == (1, 0)


def test_frames_that_never_came_are_counted_also_where_the_sequence_begins_anew() -> None:
    reader = FrameReader(LineWay.TO_HOST)
    for sequence in (254, 255, 0, 3):
        assert len(reader.receive(bytes_of(KeyDown(0, 0, 1, 0), sequence))) == 1
    assert reader.counts.missing == 2


def test_a_writer_numbers_its_frames_modulo_256() -> None:
    writer = FrameWriter()
    numbers = [writer.write(AskHello())[0] for _ in range(258)]
    assert numbers == [*range(256), 0, 1]


def test_a_piece_that_is_too_long_is_dropped_whole_and_held_nowhere() -> None:
    reader = FrameReader(LineWay.TO_HOST)
    tracemalloc.start()
    try:
        for _ in range(20_000):
            assert reader.receive(b"\x01" * 90) == []
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert peak < 20_000
    assert reader.receive(G1.line.lstrip(b"\0")) == []  # the rest of it
    assert reader.receive(G2.line) == [(G2.sequence, made(G2))]
    assert reader.counts.bad == 1


def test_the_longest_frame_of_a_keypad_fits_the_longest_piece() -> None:
    page = bytes_of(LcdPage(b"\x7e" * 80), 1)
    assert len(page) == 89
    assert len(page) - 2 <= LONGEST_PIECE
    assert read(page, LineWay.TO_DEVICE) == [(1, LcdPage(b"\x7e" * 80))]


@pytest.mark.parametrize("size", [16, 254, 255, 1_027])
def test_a_line_of_messages_carries_the_longest_one(size: int) -> None:
    message = CarriedMessage(b"\x55" * size)
    line = bytes_of(message, 9)
    assert FrameReader(LineWay.TO_HOST, LONGEST_UPLINK_PIECE).receive(line) == [(9, message)]


@pytest.mark.parametrize("size", [15, 1_028])
def test_a_message_of_another_size_is_not_written(size: int) -> None:
    with pytest.raises(ValueError, match=r"16 to 1,027"):
        bytes_of(CarriedMessage(bytes(size)), 0)


@pytest.mark.parametrize("frame", [LcdRow(0, b"short"), LcdPage(b" " * 79)])
def test_a_text_that_fills_no_row_is_not_written(frame: SerialFrame) -> None:
    with pytest.raises(ValueError, match="characters"):
        bytes_of(frame, 0)


@pytest.mark.parametrize(
    ("data", "by_hand"),
    [
        # Worked out by hand from the rule of consistent overhead byte stuffing.
        (b"", "01"),
        (b"\0", "0101"),
        (b"\x11\x22\x00\x33", "0311220233"),
        (b"\x11\x00\x00\x00", "0211010101"),
        (b"\x01" * 254, "ff" + "01" * 254),
        (b"\x01" * 255, "ff" + "01" * 254 + "0201"),
        (b"\0" + b"\x01" * 254, "01ff" + "01" * 254),
        (b"\x01" * 254 + b"\0", "ff" + "01" * 254 + "0101"),
    ],
)
def test_stuffing_leaves_no_zero_and_comes_back(data: bytes, by_hand: str) -> None:
    assert stuffed(data) == bytes.fromhex(by_hand)
    assert unstuffed(bytes.fromhex(by_hand)) == data


@given(st.binary(max_size=800))
def test_whatever_is_stuffed_comes_back(data: bytes) -> None:
    line = stuffed(data)
    assert 0 not in line
    assert len(line) <= len(data) + 1 + len(data) // 254
    assert unstuffed(line) == data


@pytest.mark.parametrize("piece", ["05112233", "00", "0311"])
def test_a_count_beyond_the_end_is_no_stuffing(piece: str) -> None:
    assert unstuffed(bytes.fromhex(piece)) is None


def test_a_million_random_bytes_hold_no_frame() -> None:
    for way in LineWay:
        reader = FrameReader(way)
        noise = random.Random(20).randbytes(1_000_000)
        assert [reader.receive(noise[at : at + 4096]) for at in range(0, len(noise), 4096)] == (
            [[]] * -(-len(noise) // 4096)
        )
        assert reader.counts.bad > 3_000
        reader.receive(b"\0")
        golden = G3 if way is LineWay.TO_DEVICE else G1
        assert reader.receive(golden.line) == [(golden.sequence, made(golden))]


def test_frames_between_random_bytes_are_all_read() -> None:
    """Each stands between its own zero bytes, so that noise before it costs no frame."""
    chance = random.Random(4)
    reader = FrameReader(LineWay.TO_HOST)
    for turn in range(2_000):
        noise = chance.randbytes(chance.randrange(60))
        line = noise + bytes_of(KeyDown(3, 0, 8, turn), turn)
        assert [frame for _, frame in reader.receive(line)] == [KeyDown(3, 0, 8, turn)]


def test_one_to_four_flipped_bits_make_no_frame_of_another() -> None:
    chance = random.Random(7)
    for turn in range(3_000):
        golden = chance.choice((G1, G2))
        line = bytearray(golden.line[1:-1])
        for place in chance.sample(range(len(line) * 8), chance.randint(1, 4)):
            line[place // 8] ^= 1 << place % 8
        assert read(b"\0" + bytes(line) + b"\0") == [], turn


@given(st.binary(max_size=400), st.lists(st.integers(0, 40), min_size=1, max_size=8))
def test_the_same_bytes_mean_the_same_however_they_are_portioned(
    data: bytes, sizes: list[int]
) -> None:
    data = G1.line + data + G2.line
    whole, parts = FrameReader(LineWay.TO_HOST), FrameReader(LineWay.TO_HOST)
    expected, found, at = whole.receive(data), [], 0
    for size in [*sizes, len(data)]:
        found += parts.receive(data[at : at + size])
        at += size
    assert found == expected
    assert parts.counts == whole.counts


def test_every_kind_has_one_declaration_and_a_way() -> None:
    assert {kind: frame.KIND for kind, (frame, _) in FRAMES.items()} == {
        kind: kind for kind in FRAMES
    }
    assert all(ways for _, ways in FRAMES.values())
    assert read(bytes_of(HostBeat(6), 1), LineWay.TO_DEVICE) == [(1, HostBeat(6))]
