from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from openpendant.simplemsg import ByteOrder
from openpendant.simplemsg.framing import MAX_FRAME, Cut, Frame, Mode, Splitter

PING = bytes.fromhex("0c000000010000000200000000000000")
PING_BIG = bytes.fromhex("0000000c000000010000000200000000")
STRAY = b"GET / HTTP/1.1\r\n"


def frame_of(size: int) -> bytes:
    return (size - 4).to_bytes(4, "little") + bytes(size - 4)


def split(chunks: list[bytes], splitter: Splitter | None = None) -> list[Cut]:
    splitter = splitter or Splitter(Mode.ONLOOKER)
    return [piece for chunk in chunks for piece in splitter.feed(chunk)] + splitter.finish()


@pytest.mark.parametrize("frame", [PING, PING_BIG, frame_of(1023), frame_of(MAX_FRAME)])
def test_a_frame_is_found_whole_in_pieces_and_merged(frame: bytes) -> None:
    whole = [Cut(frame, is_frame=True)]
    assert split([frame]) == whole
    assert split([frame[:3], frame[3:]]) == whole
    assert split([frame * 3]) == whole * 3
    step = max(1, len(frame) // 50)
    assert split([frame[at : at + step] for at in range(0, len(frame), step)]) == whole


@pytest.mark.parametrize(("frame", "order"), [(PING, ByteOrder.LITTLE), (PING_BIG, ByteOrder.BIG)])
def test_the_byte_order_is_told_by_the_first_prefix(frame: bytes, order: ByteOrder) -> None:
    splitter = Splitter(Mode.ONLOOKER)
    splitter.feed(frame)
    assert splitter.byte_order is order


def test_a_given_byte_order_is_kept() -> None:
    (piece,) = split([PING], Splitter(Mode.ONLOOKER, ByteOrder.BIG))
    assert not piece.is_frame


@pytest.mark.parametrize(
    "lie", [bytes(4), b"\xff" * 4, (11).to_bytes(4, "little"), (65_536).to_bytes(4, "little")]
)
def test_a_length_that_no_frame_has_puts_the_stream_out_of_step_for_good(lie: bytes) -> None:
    splitter = Splitter(Mode.ONLOOKER)
    pieces = splitter.feed(PING + lie + PING)
    assert pieces == [Cut(PING, is_frame=True), Cut(lie + PING, is_frame=False)]
    assert not splitter.in_step
    assert splitter.feed(PING) == [Cut(PING, is_frame=False)]


def test_a_frame_that_does_not_end_is_given_as_it_is() -> None:
    assert split([PING + PING[:9]])[1:] == [Cut(PING[:9], is_frame=False)]


def test_memory_is_bounded_by_one_frame() -> None:
    splitter = Splitter(Mode.ONLOOKER)
    data = frame_of(MAX_FRAME)[:-1]
    for at in range(0, len(data), 1000):
        splitter.feed(data[at : at + 1000])
    assert len(splitter.pending) == MAX_FRAME - 1
    splitter.feed(bytes(10))
    assert len(splitter.pending) < 16
    strays = Splitter(Mode.ONLOOKER).feed(STRAY * 100_000)
    assert max(len(piece.data) for piece in strays) == MAX_FRAME


@given(st.lists(st.one_of(st.binary(max_size=40), st.just(PING), st.just(PING[:7]))))
def test_nothing_is_lost_or_changed_whatever_comes(chunks: list[bytes]) -> None:
    assert b"".join(piece.data for piece in split(chunks)) == b"".join(chunks)


@given(st.binary(max_size=200), st.lists(st.integers(0, 300), max_size=8))
def test_the_cuts_of_the_stream_do_not_matter(tail: bytes, cuts: list[int]) -> None:
    stream = PING * 3 + tail
    edges = sorted({0, *(cut for cut in cuts if cut < len(stream)), len(stream)})
    chunks = [stream[a:b] for a, b in pairwise(edges)]
    frames = [piece for piece in split(chunks) if piece.is_frame]
    assert frames == [piece for piece in split([stream]) if piece.is_frame]


def test_a_strict_splitter_gives_what_it_holds_once_and_drops_the_rest() -> None:
    splitter = Splitter(Mode.STRICT, ByteOrder.LITTLE)
    lie = (11).to_bytes(4, "little")
    cuts = splitter.feed(PING + lie + PING)
    assert cuts == [Cut(PING, is_frame=True), Cut(lie + PING, is_frame=False)]
    assert splitter.feed(PING) == splitter.finish() == []


def test_a_shorter_length_is_one_where_it_is_asked_for() -> None:
    splitter = Splitter(Mode.STRICT, ByteOrder.LITTLE, least_length=0)
    short = (3).to_bytes(4, "little") + b"abc"
    assert splitter.feed(bytes(4) + short) == [Cut(bytes(4), True), Cut(short, True)]


def test_a_searching_splitter_goes_on_at_the_next_header() -> None:
    cuts = Splitter(Mode.SEARCHING).feed(PING + STRAY + PING)
    assert cuts == [Cut(PING, True), Cut(STRAY, False), Cut(PING, True)]


@pytest.mark.parametrize("data", [PING, PING_BIG])
def test_a_frame_shows_its_raw_header_in_either_order(data: bytes) -> None:
    frame = Frame(data)
    assert (frame.length, frame.msg_type, frame.comm_type, frame.reply_code) == (12, 1, 2, 0)
    assert (frame.has_header, frame.body) == (True, b"")


def test_a_header_that_is_cut_short_reads_as_zeros() -> None:
    frame = Frame(PING[:7])
    assert (frame.length, frame.msg_type, frame.comm_type) == (12, 0, 0)
    assert not frame.has_header
    assert frame.integer_at(4) is None
