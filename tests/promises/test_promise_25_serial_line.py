"""Promise 25: a serial line that is unplugged, noisy or at another speed moves nothing."""

import random
from collections.abc import Callable
from copy import deepcopy

import pytest
from promises.promise_table import figure
from rigs.cells.keypad_rig import KeypadRig

from openpendant.tools.pendants.keypad.bridge import BACK_OFF
from openpendant.tools.pendants.panel import commands as do

LOST = figure(25, "lost")
NOISE = figure(25, "noise")

TICK_MS = 20
"""The core looks at the clock so often."""


def test_promise_25_a_silent_line_is_lost_in_time_at_any_phase_of_its_beats() -> None:
    unpressed = KeypadRig()
    for phase in range(50):
        unpressed.wait(1)
        rig = deepcopy(unpressed)
        rig.press("1" if phase % 2 else "15")
        rig.is_cut, pulled = True, rig.time
        rig.wait(int(LOST.ms) - TICK_MS)
        assert not rig.keypad.line.is_open
        assert [at for at in rig.times(do.FeedBeat) if at > pulled] == []
        assert len([at for at in rig.times(do.ReleaseJog) if at > pulled]) == 1


def unplugged(rig: KeypadRig) -> None:
    rig.is_cut = True
    rig.wait(1_000)
    rig.is_cut = False
    rig.plug_in()


def started_anew(rig: KeypadRig) -> None:
    rig.emulated.start(rig.now, reset_cause=8)


def server_lost(rig: KeypadRig) -> None:
    rig.keypad.lost("gone")
    rig.keypad.cell.is_connected = True
    rig.keypad.controller_described(is_emulated=True)


@pytest.mark.parametrize("happens", [unplugged, started_anew, server_lost])
@pytest.mark.parametrize("labels", ["1", "15"])
def test_promise_25_no_key_moves_anything_before_all_were_seen_to_be_let_go(
    happens: Callable[[KeypadRig], None], labels: str
) -> None:
    rig = KeypadRig()
    rig.press(labels)
    happens(rig)
    rig.asked.clear()
    rig.wait(2_000)
    rig.press("2")
    rig.let_go("2")
    # An aim without one of two keys begins nothing: it is what a start anew takes away first.
    assert [each for each in rig.moves if not isinstance(each, do.AimJog)] == []
    assert not rig.keypad.is_jogging
    rig.let_go()
    assert rig.press("1") == [do.PressJog(do.JOINTS, ((0, 1),))]


def test_promise_25_random_bytes_move_nothing_and_clean_ones_count_soon_after() -> None:
    rig = KeypadRig()
    chance = random.Random(6)
    for _ in range(0, NOISE.count, 2_000):
        rig.feed(chance.randbytes(2_000))
        rig.wait(1)
    assert rig.moves == []
    assert rig.keypad.line.bad > NOISE.count / 400
    rig.wait(100)
    assert rig.press("1") == [do.PressJog(do.JOINTS, ((0, 1),))]


def test_promise_25_a_line_at_another_speed_moves_nothing() -> None:
    """What a reader at half the speed makes of frames: bits twice, and ends out of place."""
    rig = KeypadRig()
    rig.up = at_half_the_speed
    rig.asked.clear()
    rig.press("1", 300)
    rig.let_go()
    assert rig.moves == []


def at_half_the_speed(data: bytes) -> bytes:
    bits = "".join(f"0{byte:08b}1" for byte in data)[::2]
    return bytes(int(bits[at : at + 8], 2) for at in range(0, len(bits) - 7, 8))


def test_promise_25_the_port_is_opened_again_ever_more_rarely() -> None:
    assert (BACK_OFF[0], BACK_OFF[-1]) == (figure(25, "first").seconds, figure(25, "last").seconds)
    assert list(BACK_OFF) == sorted(BACK_OFF)
