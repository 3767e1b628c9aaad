"""A keypad's core, an emulated keypad and the line between them, on a clock that a test moves."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from rigs.cells.panel_rig import HELLO, MS, snapshot
from rigs.peers.scripted_pendant_server import SESSION, state

from openpendant.simplemsg.pendant import OperatingMode
from openpendant.tools.pendants.keypad.emulated_keypad import EmulatedKeypad
from openpendant.tools.pendants.keypad.keypad import EnablingSource, Keypad
from openpendant.tools.pendants.keypad.keys import LABELS
from openpendant.tools.pendants.keypad.line import KeypadLine, LineState
from openpendant.tools.pendants.keypad.pages import page
from openpendant.tools.pendants.panel import commands as do
from openpendant.tools.pendants.panel.commands import Command

TICK = 20
STATE = 40

MOVES = (do.PressJog, do.AimJog, do.StepJog, do.HoldMotion, do.PulseJog, do.PlayBack, do.GoHome)
"""What lets the robot move."""


def as_it_is(data: bytes) -> bytes:
    """Return bytes as they are."""
    return data


def key(label: str) -> int:
    """Return the number of a key, by what is printed on it."""
    return LABELS.index(label)


class KeypadRig:
    """A keypad that is ready unless a test says otherwise, in T1 and in control.

    Attributes:
        asked: what the core asked for, each with its time [ms].
        up: what becomes of the keypad's bytes on their way; nothing unless a test changes it.
        down: likewise of the bridge's.
        is_cut: the cable is pulled.
    """

    def __init__(
        self,
        *,
        ready: bool = True,
        connected: bool = True,
        baud: int = 115_200,
        dof: int = 6,
        enabling: EnablingSource = EnablingSource.KEY,
    ) -> None:
        self.now = 100_000 * MS
        self.keypad = Keypad(KeypadLine(baud=baud), enabling)
        self.emulated = EmulatedKeypad(baud)
        self.asked: list[tuple[int, Command]] = []
        self.up: Callable[[bytes], bytes] = as_it_is
        self.down: Callable[[bytes], bytes] = as_it_is
        self.is_cut = False
        self._sequence = 0
        self.changes: dict[str, Any] = {}
        self.tells_state = connected
        if connected:
            self.keypad.cell.connected(HELLO, snapshot(dof))
            self.keypad.connected()
            self.keypad.controller_described(is_emulated=True)
            self.state()
        if ready:
            self.plug_in()
            assert self.keypad.line.state is LineState.READY
            self.asked.clear()

    @property
    def time(self) -> int:
        """The time [ms]."""
        return self.now // MS

    def plug_in(self) -> None:
        """Switch the keypad on, and wait until its display shows a page."""
        self.emulated.start(self.now)
        self.keypad.line.opened(self.now)
        self.wait(400)

    def state(self, **changes: Any) -> None:
        """Let a state come that differs from that of an idle cell in our control."""
        self.changes = {**self.changes, **changes}
        self._sequence += 1
        values = {"holder": SESSION, "operating_mode": OperatingMode.MANUAL_REDUCED, **self.changes}
        self.keypad.cell.take_state(replace(state(self._sequence), **values), self.now)

    def wait(self, milliseconds: int) -> list[Command]:
        """Let time pass; return what was asked for meanwhile, but for beats that feed nothing."""
        before = len(self.asked)
        for _ in range(milliseconds):
            self._step()
        return [each for _, each in self.asked[before:] if each != do.FeedBeat()]

    def _step(self) -> None:
        self.now += MS
        if self.tells_state and self.time % STATE == 0:
            self.state()
        self.emulated.tick(self.now)
        sent = self.up(self.emulated.output())
        if sent and not self.is_cut:
            self._note(self.keypad.receive(sent, self.now))
        if self.time % TICK == 0:
            self._note(self.keypad.tick(self.now))
            self.keypad.line.show(page(self.keypad, self.now))
        answered = self.down(self.keypad.line.output())
        if answered and not self.is_cut:
            self.emulated.receive(answered)

    def _note(self, commands: list[Command]) -> None:
        self.asked += [(self.time, each) for each in commands]

    def feed(self, data: bytes) -> list[Command]:
        """Hand bytes to the core at once, as if the port had them."""
        commands = self.keypad.receive(data, self.now)
        self._note(commands)
        return [each for each in commands if each != do.FeedBeat()]

    def press(self, labels: str, wait: int = 20) -> list[Command]:
        """Press keys one after the other, and wait after each."""
        asked = []
        for label in labels:
            self.emulated.press(key(label))
            asked += self.wait(wait)
        return asked

    def let_go(self, labels: str = "", wait: int = 30) -> list[Command]:
        """Let go of keys, of all where none is said."""
        for number in [key(label) for label in labels] or list(self.emulated.pressed):
            self.emulated.let_go(number)
        return self.wait(wait)

    def strike(self, labels: str) -> list[Command]:
        """Press and let go of keys, one after the other."""
        return [each for label in labels for each in self.press(label) + self.let_go(label)]

    def menu(self) -> None:
        """Open the menu."""
        self.press("C", 850)
        self.let_go()

    @property
    def moves(self) -> list[Command]:
        """All that was asked for that lets the robot move."""
        return [each for _, each in self.asked if isinstance(each, MOVES)]

    def times(self, kind: type[Command]) -> list[int]:
        """Return when commands of a kind were asked for [ms]."""
        return [at for at, each in self.asked if isinstance(each, kind)]

    @property
    def rows(self) -> list[str]:
        """The display, after whatever is on its way to it."""
        self.wait(250)
        return list(self.emulated.lcd)
