"""Keys of the compiled firmware: debounce, time to the line, pairs, ghosts, STOP, the button."""

import random
from collections.abc import Callable, Sequence
from itertools import combinations, permutations
from pathlib import Path

import pytest
from rigs.firmware.simulated_board import STOP, Board, Firmware, Received, events_of, frames_of

from openpendant.simplemsg.serial_frames import (
    AskHello,
    KeyDown,
    KeyFlag,
    KeypadBeat,
    KeypadHello,
    KeyUp,
)

from .conftest import StartBoard

pytestmark = pytest.mark.firmware

TRIPLES = list(combinations(range(16), 3))
MANY, HELD = KeyFlag.TOO_MANY_KEYS, KeyFlag.ENABLING_HELD


def read(event: object) -> tuple[str, int, int]:
    """Return what happened, to which key, and the keys that were down then."""
    assert isinstance(event, KeyDown | KeyUp)
    return type(event).__name__, event.key, event.mask


def bits(*keys: int) -> int:
    return sum(1 << key for key in keys)


def flagged(received: Sequence[Received], flag: KeyFlag) -> list[Received]:
    """Return the key frames that have a flag."""
    kinds = (KeyDown, KeyUp, KeypadBeat)
    return [each for each in received if isinstance(each.frame, kinds) and each.frame.flags & flag]


def let_go(board: Board, *keys: int) -> list[Received]:
    for key in keys:
        board.up(key)
    return board.run(20)


def test_500_presses_with_bounce_reach_the_line_within_20_ms_and_each_once(
    ready: Board, record_property: Callable[[str, object], None]
) -> None:
    chosen = random.Random(500)
    took = []
    for _ in range(500):
        key = chosen.choice([each for each in range(16) if each != STOP])
        ready.run(chosen.uniform(0, 20))
        began = ready.now
        ready.down(key, bounce=chosen.uniform(0, 8))
        came = ready.run(35)
        ready.up(key, bounce=chosen.uniform(0, 8))
        came += ready.run(30)
        assert [read(event) for event in events_of(came)] == [
            ("KeyDown", key, bits(key)),
            ("KeyUp", key, 0),
        ]
        took += [each.at - began for each in came if isinstance(each.frame, KeyDown)]
    took.sort()
    record_property("key to last byte, p50 [ms]", round(took[250], 2))
    record_property("key to last byte, p99 [ms]", round(took[495], 2))
    assert len(took) == 500
    assert took[495] <= 20


def test_a_key_without_bounce_is_on_the_line_within_9_ms(ready: Board) -> None:
    took = []
    for phase in range(40):
        ready.run(20 + 1.3 * phase)
        began = ready.now
        ready.down(5)
        took += [each.at - began for each in ready.run(30) if isinstance(each.frame, KeyDown)]
        let_go(ready, 5)
    assert len(took) == 40
    assert max(took) <= 5 + 1 + 2 * 1.6


def test_a_contact_that_chatters_without_rest_is_no_press(ready: Board) -> None:
    for _ in range(60):
        ready.down(2)
        ready.run(3)
        ready.up(2)
        ready.run(2)
    assert events_of(ready.log) == []


def test_a_press_of_four_milliseconds_is_none(ready: Board) -> None:
    ready.down(2)
    ready.run(4)
    assert events_of(let_go(ready, 2)) == []


def test_a_gap_of_nine_milliseconds_is_no_release(ready: Board) -> None:
    ready.down(2)
    ready.run(20)
    ready.up(2)
    ready.run(9)
    ready.down(2)
    ready.run(30)
    assert [read(event)[0] for event in events_of(ready.log)] == ["KeyDown"]


def test_the_welcome_chooses_how_long_a_key_must_be_down(ready: Board) -> None:
    ready.welcome(debounce=20)
    ready.down(2)
    early = ready.run(18)
    late = ready.run(5)
    assert events_of(early) == []
    assert [read(event)[0] for event in events_of(late)] == ["KeyDown"]


def test_each_key_has_its_number(ready: Board) -> None:
    for key in range(16):
        ready.down(key)
        assert [read(event)[1] for event in events_of(ready.run(15))] == [key]
        assert [read(event)[1] for event in events_of(let_go(ready, key))] == [key]


def test_pairs_are_exact_in_both_orders(ready: Board) -> None:
    for first, second in permutations(range(16), 2):
        ready.down(first)
        ready.run(10)
        ready.down(second)
        ready.run(10)
        came = let_go(ready, first)
        came += let_go(ready, second)
        assert [read(event) for event in events_of(ready.log)[-4:]] == [
            ("KeyDown", first, bits(first)),
            ("KeyDown", second, bits(first, second)),
            ("KeyUp", first, bits(second)),
            ("KeyUp", second, 0),
        ]
        assert not any(event.flags & MANY for event in events_of(came) if isinstance(event, KeyUp))
    assert ready.order("faults")["shorts"] == 0


def test_two_keys_of_one_scan_come_one_after_the_other(ready: Board) -> None:
    ready.down(0)
    ready.down(9)
    assert [read(event) for event in events_of(ready.run(15))] == [
        ("KeyDown", 0, bits(0)),
        ("KeyDown", 9, bits(0, 9)),
    ]


def test_no_key_of_three_at_once_counts(ready: Board) -> None:
    for triple in TRIPLES:
        for key in triple:
            ready.down(key)
        came = ready.run(12)
        downs = frames_of(came, KeyDown)
        assert {down.key for down in downs} >= set(triple)
        assert all(down.flags & MANY for down in downs if down.key != STOP)
        assert all(
            up.mask or not up.flags & MANY for up in frames_of(let_go(ready, *triple), KeyUp)
        )
    assert ready.order("faults") == {"shorts": 0, "floating": 0, "lcd_too_fast": 0}


def test_the_third_key_is_told_before_it_is_debounced(ready: Board) -> None:
    for key in (0, 1):
        ready.down(key)
        ready.run(20)
    pressed = ready.now
    ready.down(6)
    told = flagged(ready.run(15), MANY)
    assert isinstance(told[0].frame, KeypadBeat)
    assert told[0].frame.mask == bits(0, 1)
    assert told[0].at - pressed <= 2 + 1 + 2 * 1.6


def test_a_rectangle_of_three_shows_its_ghost(ready: Board) -> None:
    for key in (0, 1, 4):
        ready.down(key)
    assert {down.key for down in frames_of(ready.run(12), KeyDown)} == {0, 1, 4, 5}


def test_too_many_keys_holds_until_all_are_let_go(ready: Board) -> None:
    for key in (0, 5, 10):
        ready.down(key)
    ready.run(20)
    let_go(ready, 10)
    two = frames_of(ready.run(120), KeypadBeat)
    ready.down(3)
    third = frames_of(ready.run(12), KeyDown)
    none = frames_of(let_go(ready, 0, 5, 3), KeyUp)
    ready.down(3)
    after = frames_of(ready.run(12), KeyDown)
    assert all(beat.flags & MANY for beat in two)
    assert third[0].flags & MANY
    assert not none[-1].flags & MANY
    assert not after[0].flags & MANY


def test_stop_needs_two_scans(ready: Board) -> None:
    took = []
    for phase in range(20):
        ready.run(20 + 1.3 * phase)
        pressed = ready.now
        ready.down(STOP)
        took += [each.at - pressed for each in ready.run(20) if isinstance(each.frame, KeyDown)]
        let_go(ready, STOP)
    assert len(took) == 20
    assert max(took) <= 2 + 1 + 2 * 1.6


def test_stop_goes_ahead_of_keys_of_the_same_scan(ready: Board) -> None:
    ready.welcome(debounce=5)
    for key in (0, 1):
        ready.down(key)
    ready.run(3)
    ready.down(STOP)
    assert frames_of(ready.run(12), KeyDown)[0].key == STOP


def test_stop_is_told_whatever_else_is_down(ready: Board) -> None:
    for triple in TRIPLES[::5]:
        others = [key for key in triple if key != STOP]
        for key in others:
            ready.down(key)
        came = ready.run(15)
        ready.down(STOP)
        came += ready.run(8)
        assert STOP in {down.key for down in frames_of(came, KeyDown)}  # at once where a ghost is
        let_go(ready, *others, STOP)


def test_stop_is_told_though_a_palm_lies_on_all_keys(ready: Board) -> None:
    for key in range(15):
        ready.down(key)
    ready.run(3)
    ready.down(STOP)
    assert STOP in {down.key for down in frames_of(ready.run(60), KeyDown)}


def test_at_most_one_other_frame_is_ahead_of_a_key(ready: Board) -> None:
    took = []
    for turn in range(60):
        pressed = ready.now
        ready.down(7)
        ready.run(0.1 * turn)
        for _ in range(5):
            ready.send(AskHello())  # each is sooner here than its answer is away
        ready.run(30)
        took += [each.at - pressed for each in ready.log if isinstance(each.frame, KeyDown)]
        let_go(ready, 7)
        ready.log.clear()
    assert len(took) == 60
    assert max(took) <= 5 + 1 + 2.2 + 1.6  # debounce, scan, a hello, the frame itself


@pytest.mark.parametrize("bounce", [0.0, 3.0])
def test_the_hello_of_a_restart_shows_the_key_that_is_held(ready: Board, bounce: float) -> None:
    ready.down(4, bounce)
    ready.run(20)
    ready.order("reset")
    assert frames_of(ready.run(30), KeypadHello)[0].mask == bits(4)


def test_the_button_is_told_at_once_and_in_every_frame(ready: Board) -> None:
    ready.run(7)
    pressed = ready.now
    ready.order("button", 1)
    told = flagged(ready.run(20), HELD)
    ready.down(1)
    down = frames_of(ready.run(12), KeyDown)[0]
    released = ready.now
    ready.order("button", 0)
    came = ready.run(20)
    last = flagged(came, HELD)
    gone = [each for each in came if isinstance(each.frame, KeypadBeat) and each not in last]
    assert told[0].at - pressed <= 5 + 1 + 2 * 1.6
    assert down.flags & HELD
    assert gone[0].at - released <= 2 + 1 + 2 * 1.6
    assert all(each.at < gone[0].at for each in last)


def test_the_hello_tells_a_fitted_button(
    start_board: StartBoard, tmp_path: Path, firmware: Firmware
) -> None:
    fitted = Firmware.compiled(tmp_path, ENABLING_BUTTON=1)
    assert frames_of(start_board(fitted).run(30), KeypadHello)[0].features == 1
    assert frames_of(start_board(firmware).run(30), KeypadHello)[0].features == 0
