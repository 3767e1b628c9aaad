"""The compiled firmware before the bridge's core: what it makes move, and what never."""

import random
from collections.abc import Iterator
from itertools import combinations, pairwise
from pathlib import Path

import pytest
from rigs.cells.keypad_rig import KeypadRig, key
from rigs.firmware.firmware_rig import FirmwareRig
from rigs.firmware.simulated_board import Firmware

from openpendant.tools.pendants.keypad.keys import LABELS
from openpendant.tools.pendants.keypad.line import LineState
from openpendant.tools.pendants.keypad.pages import page
from openpendant.tools.pendants.panel import commands as do

pytestmark = pytest.mark.firmware

JOG = "1234567890*#"
LOOP = "bridge_pass"


@pytest.fixture
def rig(board_program: Path, firmware: Firmware) -> Iterator[FirmwareRig]:
    made = FirmwareRig(board_program, firmware)
    with made.board:
        yield made


def test_the_firmware_becomes_ready(rig: FirmwareRig) -> None:
    assert rig.keypad.line.state is LineState.READY
    assert rig.keypad.line.bad == rig.keypad.line.missing == 0


def test_a_jog_key_moves_its_axis_while_it_is_held(rig: FirmwareRig) -> None:
    assert rig.press("6") == [do.PressJog(do.JOINTS, ((2, -1),))]
    assert rig.wait(500) == []
    assert rig.let_go() == [do.ReleaseJog()]


def test_a_held_key_is_fed_with_a_beat_at_least_every_55_ms(rig: FirmwareRig) -> None:
    rig.press("1")
    rig.asked.clear()
    rig.wait(2_000)
    beats = rig.times(do.FeedBeat)
    assert len(beats) >= 38
    assert max(later - sooner for sooner, later in pairwise(beats)) <= 55


def test_the_display_shows_the_page_that_the_bridge_makes(rig: FirmwareRig) -> None:
    for _ in range(3):
        rig.strike("C")
        shown = rig.rows
        assert shown == list(page(rig.keypad, rig.now))
        assert shown[0].startswith("T1 ")


def test_no_three_keys_at_once_move_anything(rig: FirmwareRig) -> None:
    states = set()
    for triple in combinations([label for label in LABELS if label != "D"], 3):
        states.add(rig.keypad.line.state)
        for label in triple:
            rig.emulated.press(key(label))
        rig.wait(10)
        rig.let_go(wait=25)
    assert states == {LineState.READY}
    assert rig.moves == []
    assert rig.press("1", 40) == [do.PressJog(do.JOINTS, ((0, 1),))]


def test_stop_among_three_keys_stops_and_moves_nothing(rig: FirmwareRig) -> None:
    for label in JOG:
        rig.emulated.press(key(label))
        rig.emulated.press(key("B"))
        asked = rig.press("D")
        rig.let_go()
        assert any(isinstance(each, do.StopRobot) for each in asked)
    assert rig.moves == []


def test_a_reset_by_the_watchdog_ends_the_motion_and_the_held_key_begins_none(
    rig: FirmwareRig,
) -> None:
    rig.press("1")
    rig.board.order("hang", rig.board.firmware.symbols[LOOP])
    ended = rig.wait(140)
    rig.asked.clear()
    rig.wait(3_000)
    still = rig.moves
    rig.let_go(wait=100)
    again = rig.press("1", 40)
    assert ended == [do.ReleaseJog()]
    assert rig.board.order("resets")["resets"] >= 1
    assert still == []
    assert again == [do.PressJog(do.JOINTS, ((0, 1),))]


def test_a_pulled_cable_ends_the_motion_and_the_key_held_through_the_plug_begins_none(
    rig: FirmwareRig,
) -> None:
    rig.press("1")
    rig.is_cut = True
    ended = rig.wait(145)
    rig.wait(1_500)
    rig.is_cut = False
    rig.asked.clear()
    rig.plug_in()
    rig.wait(1_000)
    still = rig.moves
    rig.let_go(wait=100)
    assert ended == [do.ReleaseJog()]
    assert still == []
    assert rig.press("1", 40) == [do.PressJog(do.JOINTS, ((0, 1),))]


def play(rig: KeypadRig, seed: int) -> tuple[list[do.Command], list[str]]:
    """Press and let go of one, two or three keys as chance has it; return what that asked for."""
    chance = random.Random(seed)
    for _ in range(12):
        for label in chance.sample(JOG + "AC", chance.choice([1, 1, 2, 2, 3])):
            rig.press(label, chance.randrange(8, 90))
        rig.let_go(wait=chance.randrange(30, 200))
    rig.wait(300)
    return [each for _, each in rig.asked if each != do.FeedBeat()], rig.rows


@pytest.mark.parametrize("seed", range(8))
def test_firmware_and_emulated_keypad_ask_for_the_same(rig: FirmwareRig, seed: int) -> None:
    asked, rows = play(rig, seed)
    expected, expected_rows = play(KeypadRig(), seed)
    assert asked == expected
    assert rows == expected_rows
    assert any(isinstance(each, do.PressJog) for each in asked)
