"""Beats and watchdog of the compiled firmware: it tells that it lives, and starts anew if not."""

from collections.abc import Callable
from itertools import pairwise

import pytest
from rigs.firmware.simulated_board import QUIET, Board, Received, events_of, frames_of

from openpendant.simplemsg.serial_frames import (
    KeyDown,
    KeypadBeat,
    KeypadHello,
    KeyUp,
    LcdPage,
)

pytestmark = pytest.mark.firmware

BY_WATCHDOG = 8
INTERRUPTS_OF_TIMER_0 = 0x6E
LOOP = "bridge_pass"
TWO_BYTES = 2 * 10 / 115_200 * 1e6
"""What the chip's receiver keeps besides the byte that it is reading [us]."""


def beat_gaps(received: list[Received]) -> list[float]:
    times = [each.at for each in received if isinstance(each.frame, KeypadBeat)]
    return [later - sooner for sooner, later in pairwise(times)]


def work_hard(board: Board, turns: int) -> list[Received]:
    """Press keys, and change every character of the display, all the time."""
    came: list[Received] = []
    for turn in range(turns):
        board.send(LcdPage(bytes([97 + turn % 26]) * 80))
        board.down(turn % 15, bounce=3)
        came += board.run(43)
        board.up(turn % 15, bounce=3)
        came += board.run(31)
    return came


def test_beats_come_every_50_ms_without_keys(ready: Board) -> None:
    gaps = beat_gaps(ready.talk(10_000))
    assert len(gaps) >= 195
    assert all(45 <= gap <= 55 for gap in gaps)


def test_beats_come_every_50_ms_with_keys_and_pages(ready: Board) -> None:
    gaps = beat_gaps(work_hard(ready, 100))
    assert len(gaps) >= 140
    assert all(45 <= gap <= 55 for gap in gaps)


def test_beats_come_before_any_bridge(board: Board) -> None:
    gaps = beat_gaps(board.run(2_000))
    assert len(gaps) >= 37
    assert all(45 <= gap <= 55 for gap in gaps)


def test_the_welcome_chooses_the_period_of_beats(ready: Board) -> None:
    ready.welcome(beat=100)
    gaps = beat_gaps(ready.talk(3_000))
    assert all(95 <= gap <= 105 for gap in gaps)


def test_beats_show_the_keys_that_are_down(ready: Board) -> None:
    ready.down(0)
    ready.down(9)
    ready.run(20)
    beats = frames_of(ready.run(1_000), KeypadBeat)
    assert {beat.mask for beat in beats} == {0x0201}
    assert {beat.key for beat in beats} == {0xFF}


def test_the_clock_counts_milliseconds_and_goes_round(ready: Board) -> None:
    ready.poke("now", (65_500).to_bytes(2, "little"))
    ready.listen()
    began = ready.now
    came = [each for each in ready.run(400) if isinstance(each.frame, KeypadBeat)]
    for each in came:
        assert isinstance(each.frame, KeypadBeat)
        expected = (65_500 + each.at - began) % 65_536
        assert abs(each.frame.time - expected) <= 3
    assert {type(each.frame) for each in came} == {KeypadBeat}


def test_a_loop_that_hangs_is_started_anew_within_300_ms(ready: Board) -> None:
    hung = ready.now
    ready.order("hang", ready.firmware.symbols[LOOP])
    came = ready.run(400)
    hello = [each for each in came if isinstance(each.frame, KeypadHello)]
    assert isinstance(hello[0].frame, KeypadHello)
    assert hello[0].frame.reset_cause == BY_WATCHDOG
    assert 200 <= hello[0].at - hung <= 300


def test_a_timer_that_stands_still_is_no_life(ready: Board) -> None:
    hung = ready.now
    ready.order("poke", INTERRUPTS_OF_TIMER_0, "00")
    ready.send_bytes(b"\0" * 5_000)  # what wakes the loop, and is no frame
    hello = [each for each in ready.run(400) if isinstance(each.frame, KeypadHello)]
    assert hello
    assert isinstance(hello[0].frame, KeypadHello)
    assert hello[0].frame.reset_cause == BY_WATCHDOG
    assert hello[0].at - hung <= 300


def test_hard_work_wakes_no_watchdog(ready: Board) -> None:
    work_hard(ready, 200)
    assert ready.order("resets")["resets"] == 0


def test_no_interrupt_is_so_long_that_the_receiver_loses_a_byte(
    ready: Board, record_property: Callable[[str, object], None]
) -> None:
    work_hard(ready, 20)
    for key in range(16):
        ready.down(key)
    ready.run(30)
    longest = ready.order("longest")["interrupt_us"]
    record_property("longest interrupt, sixteen keys at once [us]", longest)
    assert longest <= TWO_BYTES


def test_a_key_held_through_a_reset_by_the_watchdog_is_not_called_let_go(ready: Board) -> None:
    ready.down(0)
    ready.run(20)
    ready.order("hang", ready.firmware.symbols[LOOP])
    came = ready.run(800)
    ready.up(0)
    after = ready.run(60)
    assert frames_of(came, KeyUp) == []
    assert [(up.key, up.mask) for up in frames_of(after, KeyUp)] == [(0, 0), (0xFF, 0)]


def test_a_board_without_power_says_nothing_and_begins_with_a_hello(ready: Board) -> None:
    ready.down(0)
    ready.run(20)
    ready.order("off")
    dark = ready.run(500)
    ready.order("on")
    lit = ready.run(QUIET)
    assert dark == []
    assert isinstance(
        next(each.frame for each in lit if not isinstance(each.frame, KeyDown)), KeypadHello
    )
    assert [type(event) for event in events_of(lit)] == [KeyDown]
