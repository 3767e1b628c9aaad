"""The bridge's core with the compiled firmware before it, in place of the emulated keypad."""

from pathlib import Path
from typing import Any, cast

from rigs.cells.keypad_rig import KeypadRig
from rigs.cells.panel_rig import MS

from .simulated_board import Board, Firmware


class SimulatedKeypad:
    """A simulated board with the calls of `EmulatedKeypad`."""

    def __init__(self, board: Board) -> None:
        self.board = board
        self.pressed: set[int] = set()
        self._now = 0

    @property
    def lcd(self) -> list[str]:
        """What the display shows."""
        return self.board.lcd()

    def start(self, now: int, reset_cause: int = 1) -> None:
        """Switch it on, or press its reset button [ns]."""
        self._now = now
        for order in ("off", "on") if reset_cause == 1 else ("reset",):
            self.board.order(order)
        self.board.order("sent")

    def press(self, key: int) -> None:
        self.pressed.add(key)
        self.board.down(key)

    def let_go(self, key: int) -> None:
        self.pressed.discard(key)
        self.board.up(key)

    def tick(self, now: int) -> None:
        """Let its time pass up to now [ns]."""
        self.board.order("run", (now - self._now) / MS)
        self._now = now

    def output(self) -> bytes:
        """Return what it sent."""
        return bytes.fromhex(self.board.order("sent")["bytes"])

    def receive(self, data: bytes) -> None:
        """Take bytes of the bridge."""
        self.board.send_bytes(data)


class FirmwareRig(KeypadRig):
    """A keypad of compiled firmware that is ready unless a test says otherwise."""

    def __init__(self, program: Path, firmware: Firmware, **options: Any) -> None:
        super().__init__(**{**options, "ready": False})
        self.board = Board.started(program, firmware)
        self.emulated = cast(Any, SimulatedKeypad(self.board))
        if options.get("ready", True):
            self.plug_in()
            self.asked.clear()
