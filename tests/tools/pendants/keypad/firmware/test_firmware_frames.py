"""Frames of the firmware, to the byte: the golden ones, its hello, and what it makes of rubbish."""

import binascii
import random
from collections.abc import Sequence

import pytest
from rigs.data.keypad_vectors import G1, G2, G3, G4
from rigs.firmware.simulated_board import QUIET, Board, Received, events_of, frames_of

from openpendant.simplemsg.serial_frames import (
    Ack,
    AckResult,
    AskHello,
    HostBeat,
    KeyFlag,
    KeypadBeat,
    KeypadHello,
    KeypadWelcome,
    KeyUp,
    LcdPage,
    LcdRow,
    bytes_of,
    stuffed,
)

pytestmark = pytest.mark.firmware

POWER_ON, RESET_BUTTON = 1, 2
RUBBISH = KeyFlag.RUBBISH_RECEIVED
PAGE = b"".join(bytes([65 + row]) * 20 for row in range(4))


def told_rubbish(received: Sequence[Received]) -> int:
    """Return how many beats tell of rubbish."""
    return sum(bool(beat.flags & RUBBISH) for beat in frames_of(received, KeypadBeat))


def set_clock(board: Board, time: int, sequence: int) -> None:
    board.poke("now", time.to_bytes(2, "little"))
    board.poke("own_sequence", bytes([sequence]))


def test_a_pressed_key_leaves_as_the_golden_frame(ready: Board) -> None:
    ready.send(LcdPage(PAGE))
    ready.run(20)
    ready.raw.clear()
    ready.poke("beat_at", (1220).to_bytes(2, "little"))
    set_clock(ready, 1234 - 5, 7)
    ready.down(0)
    ready.run(10)
    assert bytes(ready.raw) == G1.line


def test_a_beat_leaves_as_the_golden_frame(ready: Board) -> None:
    ready.send(LcdPage(PAGE))
    ready.down(0)
    ready.down(9)
    ready.run(20)
    ready.raw.clear()
    ready.poke("beat_at", (1284 - 50).to_bytes(2, "little"))
    set_clock(ready, 1284 - 1, 8)
    ready.run(10)
    assert bytes(ready.raw) == G2.line


def test_the_golden_row_stands_on_the_display(ready: Board) -> None:
    ready.send_bytes(G3.line)
    came = ready.run(30)
    assert ready.lcd()[0] == "T1 JOINT      * EN  "
    assert Ack(33, AckResult.DONE) in frames_of(came, Ack)


def test_a_frame_with_a_flipped_bit_is_rubbish(ready: Board) -> None:
    ready.send_bytes(G4.line)
    assert told_rubbish(ready.run(110)) == 1


def test_a_row_with_a_flipped_bit_changes_nothing(ready: Board) -> None:
    before = ready.lcd()
    for at in range(3, len(G3.line) - 1):
        for bit in (0, 3):
            flipped = bytearray(G3.line)
            flipped[at] ^= 1 << bit
            ready.send_bytes(bytes(flipped))
            assert frames_of(ready.run(5), Ack) == []
    ready.run(50)
    assert ready.lcd() == before


def test_each_frame_is_what_our_writer_makes_of_its_fields(ready: Board) -> None:
    ready.send(AskHello())
    ready.down(3)
    ready.run(300)
    ready.up(3)
    ready.run(300)
    assert ready.reader.counts.bad == 0
    assert bytes(ready.raw) == b"".join(bytes_of(each.frame, each.sequence) for each in ready.log)


def test_frames_are_numbered_without_a_gap(ready: Board) -> None:
    ready.talk(20_000)
    assert len(ready.log) > 256
    assert ready.reader.counts.missing == ready.reader.counts.repeated == 0


def test_the_hello_after_power_says_who_is_here_and_why(board: Board) -> None:
    hello = frames_of(board.run(30), KeypadHello)
    assert hello == [KeypadHello(1, 1, 0, POWER_ON, 20, 4, 0, 0, hello[0].time)]


def test_the_hello_is_the_first_frame_after_the_start(board: Board) -> None:
    assert isinstance(board.run(QUIET)[0].frame, KeypadHello)


def test_the_hello_after_the_reset_button_says_so(ready: Board) -> None:
    ready.order("reset")
    assert frames_of(ready.run(30), KeypadHello)[0].reset_cause == RESET_BUTTON


def test_a_hello_is_said_when_asked_for(ready: Board) -> None:
    ready.send(AskHello())
    assert len(frames_of(ready.run(20), KeypadHello)) == 1


def test_the_frame_of_empty_keys_comes_after_the_start_and_after_each_welcome(
    board: Board,
) -> None:
    after_start = events_of(board.run(QUIET))
    board.welcome()
    board.welcome()
    assert [(up.key, up.mask) for up in after_start if isinstance(up, KeyUp)] == [(0xFF, 0)]
    assert len(events_of(board.log)) == 3


def test_the_frame_of_empty_keys_waits_until_a_key_held_at_the_start_is_let_go(
    board: Board,
) -> None:
    board.down(6)
    before = events_of(board.run(400))
    board.up(6)
    let_go = board.now
    board.run(100)
    empty = [each for each in board.log if isinstance(each.frame, KeyUp) and each.frame.key == 0xFF]
    assert [type(event).__name__ for event in before] == ["KeyDown"]
    assert len(empty) == 1
    assert empty[0].at >= let_go + 20


def test_a_welcome_of_another_protocol_is_refused(ready: Board) -> None:
    sequence = ready.send(KeypadWelcome(2, 50, 5, 0))
    came = ready.run(100)
    assert frames_of(came, Ack) == [Ack(sequence, AckResult.WRONG_VERSION)]
    assert events_of(came) == []


@pytest.mark.parametrize(("beat", "debounce"), [(19, 5), (251, 5), (50, 4), (50, 21)])
def test_a_welcome_out_of_bounds_is_refused(ready: Board, beat: int, debounce: int) -> None:
    sequence = ready.send(KeypadWelcome(1, beat, debounce, 0))
    assert frames_of(ready.run(50), Ack) == [Ack(sequence, AckResult.WRONG_PLACE)]


def test_a_row_below_the_display_is_refused(ready: Board) -> None:
    before = ready.lcd()
    sequence = ready.send(LcdRow(4, b"x" * 20))
    assert frames_of(ready.run(30), Ack) == [Ack(sequence, AckResult.WRONG_PLACE)]
    assert ready.lcd() == before


def ended(data: bytes) -> bytes:
    """Return head and payload as a frame whose check sum is right."""
    return b"\0" + stuffed(data + binascii.crc_hqx(data, 0xFFFF).to_bytes(2, "little")) + b"\0"


def framed(kind: int, sequence: int, payload: bytes) -> bytes:
    """Return a frame of any kind and size."""
    return ended(bytes([kind, sequence]) + len(payload).to_bytes(2, "little") + payload)


@pytest.mark.parametrize(
    ("kind", "size", "result"),
    [
        (0x86, 0, AckResult.WRONG_KIND),
        (0x82, 21, AckResult.WRONG_LENGTH),
        (0x83, 81, AckResult.WRONG_LENGTH),
        (0x84, 0, AckResult.WRONG_LENGTH),
    ],
)
def test_a_frame_that_means_nothing_here_is_refused_and_told_as_rubbish(
    ready: Board, kind: int, size: int, result: AckResult
) -> None:
    ready.send_bytes(framed(kind, 200, bytes(size)))
    came = ready.run(110)
    assert frames_of(came, Ack) == [Ack(200, result)]
    assert told_rubbish(came) == 1


def test_an_echo_of_its_own_frames_gets_no_answer(ready: Board) -> None:
    ready.run(200)
    ready.send_bytes(bytes(ready.raw))
    assert frames_of(ready.run(500), Ack) == []


def test_a_frame_that_comes_twice_counts_once(ready: Board) -> None:
    line = bytes_of(LcdRow(0, b"once".ljust(20)), 77)
    ready.send_bytes(line + line)
    assert frames_of(ready.run(30), Ack) == [Ack(77, AckResult.DONE)]


@pytest.mark.parametrize("cut", [1, 2, 5, 12, 28])
def test_a_frame_that_is_cut_costs_no_other(ready: Board, cut: int) -> None:
    whole = bytes_of(LcdRow(1, b"whole".ljust(20)), 78)
    ready.send_bytes(G3.line[:cut] + whole)
    came = ready.run(30)
    assert ready.lcd()[1] == "whole".ljust(20)
    assert frames_of(came, Ack) == [Ack(78, AckResult.DONE)]


def test_a_piece_that_is_too_long_costs_no_other(ready: Board) -> None:
    ready.send_bytes(b"\x01" * 97 + bytes_of(LcdRow(1, b"whole".ljust(20)), 78))
    ready.run(40)
    assert ready.lcd()[1] == "whole".ljust(20)


def test_a_frame_whose_length_is_a_lie_is_rubbish(ready: Board) -> None:
    text = b"lie".ljust(20)
    data = bytes([0x82, 90, 23, 0, 1, 0]) + text
    ready.send_bytes(ended(data))
    came = ready.run(110)
    assert ready.lcd()[1] != text.decode()
    assert frames_of(came, Ack) == []
    assert told_rubbish(came) == 1


def test_a_frame_with_more_behind_it_than_a_piece_holds_is_rubbish(ready: Board) -> None:
    fills_a_piece = ended(bytes([0x83, 91, 89, 0]) + b"z" * 89)
    assert len(fills_a_piece) == 1 + 96 + 1
    ready.send_bytes(fills_a_piece[:-1] + b"\x01\0")
    came = ready.run(110)
    assert frames_of(came, Ack) == []
    assert told_rubbish(came) == 1


def test_the_longest_frame_without_a_zero_is_read(ready: Board) -> None:
    ready.send(LcdPage(PAGE))
    ready.run(40)
    assert ready.lcd() == [chr(65 + row) * 20 for row in range(4)]


def test_random_bytes_change_nothing_and_the_next_frame_is_read(ready: Board) -> None:
    before = ready.lcd()
    ready.send_bytes(random.Random(20).randbytes(9_000))
    came = ready.run(900)
    assert ready.order("sent")["to_come"] == 0
    assert ready.lcd() == before
    assert frames_of(came, Ack) == []
    assert told_rubbish(came) > 10
    ready.send(LcdRow(0, b"clean".ljust(20)))
    ready.run(30)
    assert ready.lcd()[0] == "clean".ljust(20)


@pytest.mark.soak
@pytest.mark.timeout(600)
def test_a_megabyte_of_random_bytes_changes_nothing(ready: Board) -> None:
    before, source = ready.lcd(), random.Random(1)
    for _ in range(1_000):
        ready.send_bytes(source.randbytes(1_000))
        came = ready.run(100)
        assert frames_of(came, Ack) == []
        assert frames_of(came, KeypadBeat)
    assert ready.lcd() == before
    ready.run(100)
    ready.send(LcdRow(0, b"clean".ljust(20)))
    ready.run(30)
    assert ready.lcd()[0] == "clean".ljust(20)
    assert ready.order("resets")["resets"] == 0


def test_rubbish_is_told_by_one_beat(ready: Board) -> None:
    ready.send_bytes(b"rubbish\0")
    assert told_rubbish(ready.run(310)) == 1


def test_rubbish_is_no_bridge(board: Board) -> None:
    board.send_bytes(b"rubbish\0" * 200)
    hellos = frames_of(board.run(3_100), KeypadHello)
    assert len(hellos) == 4


def test_a_beat_of_the_bridge_gets_no_answer(ready: Board) -> None:
    ready.send(HostBeat(1))
    assert frames_of(ready.run(40), Ack) == []
