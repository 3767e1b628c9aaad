"""How long the terminal pendant holds its enabling device (training), and that it says so.

In T1 with a robot behind it: long motions and programs run to their end while somebody strikes a
key now and then, and stop at once when nobody does.
"""

from collections.abc import Callable

import pytest
from promises.promise_table import figure
from rigs.cells.panel_rig import HELLO, MS, PanelRig, S, snapshot
from rigs.cells.program_cell import ProgramCell
from rigs.cells.server_rig import TICK, ServerRig, Shell, ready
from rigs.peers.server_clients import Pendant

from openpendant.simplemsg import pendant as messages
from openpendant.simplemsg.verdicts import VerdictCode as V
from openpendant.tools.pendants.panel import commands as do
from openpendant.tools.pendants.panel.panel import Panel
from openpendant.tools.pendants.panel.stop_key import EMULATED_TIMEOUT_NS, TIMEOUT_NS, WARNING_NS
from openpendant.tools.pendants.terminal import screen_text

LOSE = ["escape", "v", "no key"]


@pytest.fixture
def emulated(rig: PanelRig) -> PanelRig:
    rig.panel.controller_described(is_emulated=True)
    return rig


def shown(rig: PanelRig) -> str:
    return screen_text.banner(rig.panel, rig.now)


def test_at_an_emulated_controller_enabling_is_held_until_30_s_without_a_key(
    emulated: PanelRig,
) -> None:
    emulated.strike("v")
    assert emulated.wait(29_800) == []
    assert emulated.wait(200) == [do.Enable(False)]
    assert "no key for 30 s" in emulated.said


def test_every_key_renews_it(emulated: PanelRig) -> None:
    emulated.strike("v")
    for key in ("f1", "tab", "ß", "?", "up"):
        assert emulated.wait(28_000) == []
        assert do.Enable(False) not in emulated.strike(key)
    assert emulated.panel.enabling.is_on


def test_a_warning_stands_5_s_before_it_lapses_and_goes_with_a_key(emulated: PanelRig) -> None:
    emulated.strike("v")
    emulated.wait((EMULATED_TIMEOUT_NS - WARNING_NS) // MS - 200)
    assert shown(emulated) == ""
    emulated.wait(200)
    assert shown(emulated).startswith("enabling (training) lapses in 5 s")
    emulated.wait(4_000)
    assert shown(emulated).startswith("enabling (training) lapses in 1 s")
    emulated.strike("f1")
    assert shown(emulated) == ""


@pytest.mark.parametrize("wrong", ["stop", "stale"])
def test_what_is_worse_stands_in_the_place_of_the_warning(emulated: PanelRig, wrong: str) -> None:
    emulated.strike("v")
    emulated.wait(27_000)
    if wrong == "stop":
        emulated.state(stop=messages.StopKind.SOFTWARE)
    else:
        emulated.wait(500, fresh=False)
    assert shown(emulated).startswith(wrong.upper())


def test_no_warning_stands_all_the_time_where_5_s_are_all_there_is(rig: PanelRig) -> None:
    rig.strike("v")
    assert shown(rig) == ""


def lose_the_link(rig: PanelRig) -> None:
    rig.panel.lost("cable")
    rig.panel.cell.connected(HELLO, snapshot())
    rig.panel.connected()
    rig.state()


def hear_otherwise(rig: PanelRig) -> None:
    rig.panel.controller_described(is_emulated=False)


@pytest.mark.parametrize("change", [lose_the_link, hear_otherwise])
def test_a_controller_is_a_real_one_until_it_is_known_to_be_emulated(
    emulated: PanelRig, change: Callable[[PanelRig], None]
) -> None:
    change(emulated)
    emulated.strike("v")
    assert emulated.wait(4_800) == []
    assert emulated.wait(200) == [do.Enable(False)]


def test_it_lapses_at_once_where_it_was_held_for_longer_than_a_real_one_allows(
    emulated: PanelRig,
) -> None:
    emulated.strike("v")
    emulated.wait(TIMEOUT_NS // MS)
    hear_otherwise(emulated)
    assert emulated.wait(20) == [do.Enable(False)]


# With a robot.


class KeyboardHands:
    """A panel whose enabling device is that of a pendant of a server on a hand-driven clock."""

    def __init__(self, rig: Shell, pendant: Pendant, wait: Callable[[int], object]) -> None:
        self.panel = Panel()
        self.panel.cell.connected(HELLO, snapshot())
        self.panel.connected()
        self.panel.controller_described(is_emulated=True)
        self._rig, self._pendant, self._wait = rig, pendant, wait
        self._is_held = False

    def strike(self, key: str) -> None:
        self._perform(self.panel.key(key, self._rig.now))

    def pass_time(self, milliseconds: int) -> None:
        for _ in range(0, milliseconds, 50):
            self._perform(self.panel.tick(self._rig.now))
            self._pendant.send(messages.AuthorityBeat())
            if self._is_held:
                self._pendant.enable(1)
            self._wait(50)

    def _perform(self, commands: list[do.Command]) -> None:
        for command in commands:
            assert isinstance(command, do.Enable), command
            self._is_held = command.held
            self._pendant.enable(*((0, 1) if command.held else (0,)))


def long_motion() -> tuple[KeyboardHands, ServerRig, Pendant]:
    """Return the hands at a motion of more than a minute, in T1."""
    rig = ready(modes={"initial": "manual_reduced"})
    pendant = rig.holder()
    hands = KeyboardHands(rig, pendant, rig.wait)
    hands.strike("v")
    assert pendant.speed(0.02) is V.ACCEPTED
    assert pendant.move(1.5, 0.0) is V.ACCEPTED
    return hands, rig, pendant


def test_in_t1_a_motion_of_a_minute_runs_to_its_end_with_a_key_now_and_then() -> None:
    hands, rig, pendant = long_motion()
    began = rig.now
    while not pendant.outcomes():
        assert rig.now - began < 120 * S
        hands.pass_time(28_000)
        hands.strike("f2")
    assert pendant.outcomes()[0][1] is V.ACCEPTED
    assert rig.now - began > 60 * S


@pytest.mark.parametrize("how", LOSE)
def test_in_t1_a_motion_stops_within_a_tick_when_it_is_let_go_or_lapses(how: str) -> None:
    hands, rig, pendant = long_motion()
    hands.pass_time(1_000)
    at = rig.now
    if how == "no key":
        hands.strike("f2")
        at += EMULATED_TIMEOUT_NS
        hands.pass_time(31_000)
    else:
        hands.strike(how)
        hands.pass_time(100)
    assert 0 <= rig.stops[0] - at <= figure(32, "ticks").count * TICK
    assert pendant.outcomes()[0][1] is V.ENABLING_LOST


LONG_PROGRAM = "move PTP a\nwait 60 s\nmove PTP b\nwait 60 s\nmove PTP c\nwait 60 s\nmove PTP a\n"
WAITS = [
    pytest.param(10, id="of half a minute"),
    pytest.param(60, id="of 3 minutes", marks=pytest.mark.soak),
]


def long_program(wait: int) -> tuple[KeyboardHands, ProgramCell]:
    cell = ProgramCell(main=LONG_PROGRAM.replace("60", str(wait)))
    cell.user.mode(messages.OperatingMode.MANUAL_REDUCED)
    hands = KeyboardHands(cell, cell.user, cell.wait)
    hands.strike("v")
    assert cell.run() is V.ACCEPTED
    return hands, cell


@pytest.mark.parametrize("wait", WAITS)
def test_in_t1_a_long_program_runs_to_its_end_with_a_key_now_and_then(wait: int) -> None:
    hands, cell = long_program(wait)
    began = cell.now
    while not cell.user.outcomes():
        assert cell.now - began < 5 * wait * S
        hands.pass_time(29_000)
        hands.strike("f2")
    assert [code for _, code in cell.user.outcomes()] == [V.ACCEPTED]
    assert cell.now - began > 3 * wait * S


@pytest.mark.parametrize("how", ["escape", "v", "quickly"])
def test_in_t1_a_program_that_waits_ends_when_it_is_let_go(how: str) -> None:
    """However soon it is held again."""
    hands, cell = long_program(60)
    hands.pass_time(5_000)
    hands.strike("escape" if how == "quickly" else how)
    if how == "quickly":
        hands.strike("v")
    cell.wait(10)
    assert [code for _, code in cell.user.outcomes()] == [V.ENABLING_LOST]
