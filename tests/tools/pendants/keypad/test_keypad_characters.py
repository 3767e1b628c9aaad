"""Plain characters: increments only, and silence as their check."""

import math
import random
from dataclasses import replace

import pytest
from rigs.cells.panel_rig import HELLO, MS, snapshot
from rigs.peers.scripted_pendant_server import SESSION, state

from openpendant.simplemsg.pendant import Activity, OperatingMode, State
from openpendant.tools.pendants.keypad.characters import CharacterReader
from openpendant.tools.pendants.keypad.keypad import Keypad
from openpendant.tools.pendants.keypad.keys import LABELS
from openpendant.tools.pendants.keypad.line import KeypadLine
from openpendant.tools.pendants.panel import commands as do
from openpendant.tools.pendants.panel.commands import Command

STEP = math.radians(0.5)


def read(*sent: tuple[int, bytes], until: int = 1_000) -> str:
    """Return the labels of the keys that count, of bytes at their times [ms]."""
    reader, keys = CharacterReader(), []
    for at, data in sent:
        keys += reader.receive(data, at * MS)
    return "".join(LABELS[key] for key in [*keys, *reader.tick(until * MS)])


@pytest.mark.parametrize("label", LABELS)
def test_each_label_alone_is_its_key(label: str) -> None:
    assert read((10, label.encode())) == label


@pytest.mark.parametrize(
    ("sent", "keys"),
    [
        ([(0, b"1"), (20, b"5")], "15"),  # the firmware never sends two within 20 ms
        ([(0, b"1"), (20, b"5"), (40, b"9")], "15"),  # a pair is two
        ([(0, b"1"), (250, b"2")], "12"),
        ([(0, b"1"), (100, b"2")], "1"),  # neither of a pair nor a fifth of a second later
        ([(0, b"1\r\n")], "1"),
        ([(0, b"12")], ""),  # no silence between
        ([(0, b"1"), (4, b"2")], ""),
        ([(0, b"1"), (3, b"x")], ""),
        ([(0, b"x"), (100, b"1")], ""),  # barred
        ([(0, b"x"), (201, b"1")], "1"),
        ([(0, b"xD")], "D"),  # STOP needs no silence
        ([(0, b"1D")], "D"),
    ],
)
def test_a_character_counts_in_silence_only(sent: list[tuple[int, bytes]], keys: str) -> None:
    assert read(*sent) == keys


def test_a_million_random_bytes_count_as_nothing_but_stop() -> None:
    chance = random.Random(11)
    reader, keys = CharacterReader(), []
    now = 0
    for _ in range(10_000):
        now += chance.randrange(3) * MS
        keys += reader.receive(chance.randbytes(100), now)
    assert set(keys) == {LABELS.index("D")}
    assert reader.bad > 100_000


class CharacterRig:
    """A keypad that sends plain characters, in control in T1."""

    def __init__(self) -> None:
        self.keypad = Keypad(KeypadLine(), characters=True)
        self.now = 1_000 * MS
        self.keypad.cell.connected(HELLO, snapshot())
        self.keypad.connected()
        self.keypad.controller_described(is_emulated=True)
        self.values: dict[str, object] = {}

    def state(self) -> State:
        shown = replace(state(1), holder=SESSION, operating_mode=OperatingMode.MANUAL_REDUCED)
        return replace(shown, **self.values)  # type: ignore[arg-type]  # fields by name

    def send(self, data: bytes, wait: int = 300) -> list[Command]:
        asked: list[Command] = []
        for step in range(wait // 20):
            self.now += 20 * MS
            self.keypad.cell.take_state(self.state(), self.now)
            if step < len(data):
                asked += self.keypad.receive(data[step : step + 1], self.now)
            asked += self.keypad.tick(self.now)
        return asked


@pytest.fixture
def rig() -> CharacterRig:
    return CharacterRig()


def test_a_character_is_one_increment_with_enabling_held_until_its_outcome(
    rig: CharacterRig,
) -> None:
    enable, step = rig.send(b"1")
    assert enable == do.Enable(True)
    assert isinstance(step, do.StepJog)
    assert dict(step.increments) == pytest.approx({0: STEP})
    rig.keypad.step_over()
    assert rig.send(b"") == [do.Enable(False)]


def test_two_characters_are_one_increment_of_both_axes(rig: CharacterRig) -> None:
    (_, step) = rig.send(b"15")
    assert isinstance(step, do.StepJog)
    assert [(axis, value > 0) for axis, value in step.increments] == [(0, True), (1, False)]


def test_a_character_while_the_robot_moves_is_lost(rig: CharacterRig) -> None:
    rig.values["activity"] = Activity.MOVING
    assert rig.send(b"1") == []
    rig.values.clear()
    assert rig.send(b"") == []


def test_a_b_and_c_of_base_change_roll_pitch_and_yaw(rig: CharacterRig) -> None:
    rig.send(b"C")
    assert rig.keypad.jog.frame == "base"
    (_, move) = rig.send(b"93")
    assert isinstance(move, do.MoveToPose)
    assert move.position == pytest.approx((0.5, 0.25, 0.751))
    assert move.orientation == pytest.approx((0, 0, math.sin(STEP / 2), math.cos(STEP / 2)))


def test_a_and_b_change_the_size_by_its_ladder(rig: CharacterRig) -> None:
    rig.send(b"A")
    assert (rig.keypad.jog.step.millimetres, rig.keypad.jog.step.degrees) == (5.0, 2.5)
    rig.send(b"B")
    rig.send(b"B")
    assert rig.keypad.jog.step.millimetres == 0.1


def test_no_character_takes_control(rig: CharacterRig) -> None:
    rig.values["holder"] = 0
    assert rig.send(b"1") == []
    assert "--take-control" in rig.keypad.messages.newest


def test_d_stops_always(rig: CharacterRig) -> None:
    assert do.StopRobot("STOP key") in rig.keypad.receive(b"xxD", rig.now)


def test_a_controller_that_may_be_real_is_moved_by_no_character(rig: CharacterRig) -> None:
    rig.keypad.controller_described(is_emulated=False)
    assert rig.send(b"1") == []
    assert "enabling button" in rig.keypad.messages.newest
