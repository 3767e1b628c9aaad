"""Rubbish on the line: no motion, whatever it is, and good again soon after it."""

import random
from copy import deepcopy

import pytest
from rigs.cells.keypad_rig import KeypadRig
from rigs.data.example_counts import counts

from openpendant.tools.pendants.panel import commands as do

JOINTS = do.JOINTS


def recording() -> tuple[KeypadRig, bytes]:
    """Return a keypad that is ready, and what it sends while keys are struck from then on."""
    rig = KeypadRig()
    before = deepcopy(rig)
    sent = bytearray()

    def note(data: bytes) -> bytes:
        sent.extend(data)
        return data

    rig.up = note
    rig.press("1")
    rig.press("5")
    rig.let_go()
    rig.strike("2A")
    return before, bytes(sent)


def spoiled(data: bytes, chance: random.Random) -> bytes:
    """Return bytes with bits flipped, bytes lost, doubled or swapped."""
    line = bytearray(data)
    for _ in range(chance.randint(1, 6)):
        place = chance.randrange(len(line) - 1)
        match chance.randrange(4):
            case 0:
                line[place] ^= 1 << chance.randrange(8)
            case 1:
                del line[place]
            case 2:
                line.insert(place, line[place])
            case 3:
                line[place], line[place + 1] = line[place + 1], line[place]
    return bytes(line)


def moves(commands: list[do.Command]) -> set[do.Command]:
    return {each for each in commands if isinstance(each, do.PressJog | do.AimJog)}


@pytest.mark.parametrize("count", counts(500, 10_000))
def test_a_spoiled_recording_moves_nothing_that_it_would_not_have_moved(count: int) -> None:
    rig, clean = recording()
    chance = random.Random(5)
    wanted = moves(deepcopy(rig).feed(clean))
    # What one of two keys moves alone, where the frame of the other one was lost.
    wanted |= {do.AimJog(JOINTS, ((axis, sign),)) for axis, sign in ((0, 1), (1, -1), (1, 1))}
    assert len(wanted) >= 3
    for _ in range(count):
        one = deepcopy(rig)
        assert moves(one.feed(spoiled(clean, chance))) <= wanted


def test_noise_between_the_frames_of_a_held_key_ends_nothing() -> None:
    rig = KeypadRig()
    chance = random.Random(8)
    rig.up = lambda data: chance.randbytes(chance.randrange(30)) + data
    rig.press("1")
    assert rig.wait(3_000) == []
    assert rig.keypad.is_jogging
    assert rig.let_go() == [do.ReleaseJog()]


@pytest.mark.parametrize("size", [1, 2, 7])
def test_the_same_bytes_do_the_same_however_they_are_portioned(size: int) -> None:
    rig, clean = recording()
    whole = deepcopy(rig).feed(clean)
    asked = [each for at in range(0, len(clean), size) for each in rig.feed(clean[at : at + size])]
    assert asked == whole


def test_below_57600_baud_a_key_is_one_increment_and_nothing_is_held() -> None:
    rig = KeypadRig(baud=9_600)
    asked = rig.press("15", 30)
    asked += rig.wait(100)
    increments = next(each for each in asked if isinstance(each, do.StepJog)).increments
    assert [axis for axis, _ in increments] == [0, 1]
    assert [value for _, value in increments] == pytest.approx([0.0087266, -0.0087266], abs=1e-6)
    assert asked[0] == do.Enable(True)
    assert rig.wait(1_500) == []
    rig.keypad.step_over()
    assert rig.wait(40) == [do.Enable(False)]
    rig.let_go()
    rig.strike("A")
    assert rig.keypad.jog.step.degrees == 2.5


def test_an_increment_lets_enabling_go_after_two_seconds_at_the_latest() -> None:
    rig = KeypadRig(baud=9_600)
    rig.strike("1")
    rig.wait(100)
    assert rig.wait(1_800) == []
    assert rig.wait(200) == [do.Enable(False)]
