"""Plain characters of the compiled firmware: the legacy mode that jumper D48 chooses."""

import pytest
from rigs.firmware.simulated_board import QUIET, STOP, Board

pytestmark = pytest.mark.firmware

LABELS = "123A456B789C*0#D"


@pytest.fixture
def plain(board: Board) -> Board:
    """A board with the jumper set, its keys let go."""
    board.order("plain", 1)
    board.order("reset")
    board.run(QUIET)
    board.raw.clear()
    board.times.clear()
    return board


def test_it_says_nothing_but_keys(plain: Board) -> None:
    plain.run(3_000)
    assert bytes(plain.raw) == b""


def test_each_key_sends_its_label_once_when_it_goes_down(plain: Board) -> None:
    for key in range(16):
        plain.down(key, bounce=3)
        plain.run(400)
        plain.up(key, bounce=3)
        plain.run(40)
    assert bytes(plain.raw).decode() == LABELS


def test_two_characters_never_leave_within_20_ms(plain: Board) -> None:
    plain.down(0)
    plain.down(5)
    plain.run(60)
    first, second = plain.times
    assert bytes(plain.raw) == b"15"
    assert 20 <= second - first <= 22


def test_stop_takes_the_place_of_what_waits(plain: Board) -> None:
    plain.down(0)
    plain.run(7)
    plain.up(0)
    plain.down(1)
    plain.run(7)
    plain.down(STOP)
    plain.run(100)
    assert bytes(plain.raw) == b"1D"


def test_three_keys_send_no_character_but_stop(plain: Board) -> None:
    for key in (0, 5, 10):
        plain.down(key)
    plain.run(50)
    plain.down(STOP)
    plain.run(50)
    assert bytes(plain.raw) == b"D"


def test_a_key_held_at_the_start_sends_nothing_and_stop_does(board: Board) -> None:
    board.order("plain", 1)
    board.down(0)
    board.order("reset")
    board.run(QUIET)
    held = bytes(board.raw)
    board.down(STOP)
    board.run(50)
    assert held == b""
    assert bytes(board.raw) == b"D"


def test_the_display_tells_the_mode(plain: Board) -> None:
    assert plain.lcd() == [
        "PLAIN CHARACTERS    ",
        "keypad 1.0   115200 ",
        " " * 20,
        " " * 20,
    ]


def test_the_last_line_of_the_answers_stands_on_rows_3_and_4(plain: Board) -> None:
    plain.send_bytes(b"X  +12.0 Y   +0.0 Z   +0.0 ok\r\n")
    plain.run(30)
    first = plain.lcd()[2:]
    plain.send_bytes(b"refused leg_3 387.3 of 320.0 mm, and more than forty\n")
    plain.run(30)
    assert first == ["X  +12.0 Y   +0.0 Z ", "  +0.0 ok           "]
    assert plain.lcd()[2:] == ["refused leg_3 387.3 ", "of 320.0 mm, and mor"]


def test_without_the_jumper_frames_are_sent(board: Board) -> None:
    board.run(QUIET)
    assert board.log
