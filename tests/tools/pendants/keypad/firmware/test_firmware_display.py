"""Display of the compiled firmware: pages, rows, how soon they stand there, and its own pages."""

from collections.abc import Callable
from itertools import pairwise
from pathlib import Path

import pytest
from rigs.firmware.simulated_board import QUIET, Board, Firmware, frames_of

from openpendant.simplemsg.serial_frames import (
    Ack,
    AckResult,
    KeyFlag,
    KeypadBeat,
    KeypadHello,
    LcdPage,
    LcdRow,
)

from .conftest import StartBoard

pytestmark = pytest.mark.firmware

NO_BRIDGE = [
    "NO BRIDGE           ",
    "USE THE ROBOT'S OWN ",
    "STOP BUTTON         ",
    "keypad 1.0   115200 ",
]
JOINTS = [
    "T1 JOINT      * EN  ",
    "1:   1.00 2: -90.00 ",
    "3:  90.00 4: -90.00 ",
    "5: -90.00 6:   0.00 ",
]
PRINTABLE = bytes(range(0x20, 0x7F))


def page(rows: list[str]) -> LcdPage:
    return LcdPage("".join(rows).encode())


def test_without_a_bridge_the_display_says_so(board: Board) -> None:
    board.run(QUIET)
    assert board.lcd() == NO_BRIDGE


def test_a_page_stands_character_by_character(ready: Board) -> None:
    sequence = ready.send(page(JOINTS))
    came = ready.run(30)
    assert ready.lcd() == JOINTS
    assert frames_of(came, Ack) == [Ack(sequence, AckResult.DONE)]


def test_a_page_is_on_the_glass_within_50_ms(
    ready: Board, record_property: Callable[[str, object], None]
) -> None:
    began = ready.now
    ready.send(page([chr(97 + row) * 20 for row in range(4)]))
    ready.run(100)
    took = ready.order("lcd")["written_us"] / 1000 - began
    record_property("page to glass [ms]", round(took, 1))
    assert took <= 50


@pytest.mark.parametrize("row", range(4))
def test_a_row_changes_no_other(ready: Board, row: int) -> None:
    ready.send(page(JOINTS))
    ready.run(30)
    ready.send(LcdRow(row, b"0123456789abcdefghij"))
    ready.run(30)
    assert ready.lcd() == [*JOINTS[:row], "0123456789abcdefghij", *JOINTS[row + 1 :]]


def test_only_what_differs_is_written(ready: Board) -> None:
    ready.send(page(JOINTS))
    ready.run(30)
    before = ready.order("lcd")["bytes"]
    ready.send(page([JOINTS[0], JOINTS[1].replace("1.00", "1.01"), *JOINTS[2:]]))
    ready.run(30)
    assert ready.order("lcd")["bytes"] - before == 2  # an address and a character


def test_every_printable_character_is_shown(ready: Board) -> None:
    for part in (PRINTABLE[:80], PRINTABLE[-80:]):
        ready.send(LcdPage(part))
        ready.run(30)
        assert "".join(ready.lcd()) == part.decode()


def test_what_is_not_printable_is_a_question_mark(ready: Board) -> None:
    ready.send(LcdRow(0, b"\x00\x07\x1f\x7f\x80\xff" + b"." * 14))
    ready.run(30)
    assert ready.lcd()[0] == "??????" + "." * 14


def test_the_latest_page_wins(ready: Board) -> None:
    for letter in "abcdef":
        ready.send(page([letter * 20] * 4))
        ready.run(9)
    ready.run(30)
    assert ready.lcd() == ["f" * 20] * 4


def test_the_display_gets_the_time_that_a_slow_one_needs(ready: Board) -> None:
    for letter in "abcd":
        ready.send(page([letter * 20] * 4))
        ready.talk(200)
    ready.order("reset")
    ready.run(QUIET)
    assert ready.order("faults")["lcd_too_fast"] == 0


def test_a_bridge_silent_for_a_second_is_gone_from_display_and_line(ready: Board) -> None:
    ready.send(page(JOINTS))
    ready.run(30)
    ready.talk(2_000)
    last_heard = ready.now - 250
    before = ready.lcd()
    came = ready.run(3_500)
    hellos = [each.at for each in came if isinstance(each.frame, KeypadHello)]
    assert before == JOINTS
    assert ready.lcd() == NO_BRIDGE
    assert last_heard + 1_000 <= hellos[0] <= last_heard + 1_020
    assert all(990 <= later - sooner <= 1_010 for sooner, later in pairwise(hellos))
    assert len(hellos) >= 3


def test_beats_of_the_bridge_keep_its_page(ready: Board) -> None:
    ready.send(page(JOINTS))
    came = ready.talk(5_000)
    assert ready.lcd() == JOINTS
    assert frames_of(came, KeypadHello) == []


def test_a_page_is_incomplete_until_each_row_has_come(ready: Board) -> None:
    def is_incomplete() -> bool:
        return bool(frames_of(ready.run(60), KeypadBeat)[-1].flags & KeyFlag.PAGE_INCOMPLETE)

    told = [is_incomplete()]
    for row in range(4):
        ready.send(LcdRow(row, JOINTS[row].encode()))
        told.append(is_incomplete())
    ready.run(1_200)
    told.append(is_incomplete())
    ready.send(page(JOINTS))
    told.append(is_incomplete())
    assert told == [True, True, True, True, False, True, False]


def test_a_display_that_lost_its_power_shows_the_page_after_the_next_welcome(ready: Board) -> None:
    ready.send(page(JOINTS))
    ready.run(30)
    ready.order("dim")
    lost = ready.lcd()
    ready.welcome()
    assert lost != JOINTS
    assert ready.lcd() == JOINTS


@pytest.mark.parametrize("moment", range(12))
def test_a_reset_in_the_middle_of_a_character_leaves_no_display_out_of_step(
    ready: Board, moment: int
) -> None:
    ready.send(page([chr(97 + row) * 20 for row in range(4)]))
    ready.run(9 + 0.0117 * moment)
    ready.order("reset")
    ready.run(QUIET)
    assert ready.lcd() == NO_BRIDGE


def test_the_page_without_a_bridge_names_the_baud(start_board: StartBoard, tmp_path: Path) -> None:
    slow = start_board(Firmware.compiled(tmp_path, LINE_BAUD=9600), 9_600)
    slow.run(QUIET)
    assert slow.lcd()[3] == "keypad 1.0     9600 "
