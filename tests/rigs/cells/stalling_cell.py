"""An emulated cell where server or emulator is not run for a time, on one clock."""

from collections.abc import Callable
from typing import Any, Literal

from rigs.cells.emulated_cell import EmulatedCell
from rigs.cells.server_rig import MS

from openpendant.server.events.events import Tick
from openpendant.server.settings.cell_settings import ControllerPath
from openpendant.simplemsg import Message, Received

Who = Literal["server", "emulator"]


class StallingCell(EmulatedCell):
    """A cell either end of which may not be run for a time; what arrives waits in its sockets."""

    stalled: Who | None = None

    def __init__(self, **settings: Any) -> None:
        self._to_server: list[tuple[ControllerPath, Received]] = []
        self._to_emulator: list[tuple[ControllerPath, Message]] = []
        super().__init__(**settings)

    def _hear(self, path: ControllerPath, received: Received) -> None:
        if self.stalled == "server":
            self._to_server.append((path, received))
        else:
            super()._hear(path, received)

    def _to_controller(self, path: ControllerPath, message: Message) -> None:
        if self.stalled == "emulator":
            self._to_emulator.append((path, message))
        else:
            super()._to_controller(path, message)

    def stall(
        self, who: Who, milliseconds: int, beat: tuple[int, Callable[[], None]] | None = None
    ) -> None:
        """Let time pass without one of the two; then it reads what waits, and has its tick.

        Args:
            who: is not run.
            milliseconds: for how long.
            beat: a pendant's, and every how many ms; those to a server that stalls wait as one.
        """
        began, self.stalled = self.now, who
        for passed in range(0, milliseconds, 5):
            self.now += 5 * MS
            if beat is not None and who == "emulator" and passed % beat[0] == 0:
                beat[1]()
            if who == "server":
                self._from_controller(self.controller.advance(self.now))
                if self.now % (10 * MS) == 0:
                    for message in self.controller.state_messages(self.now):
                        self._hear(ControllerPath.STATE, message)
            elif self.now % (10 * MS) == 0:
                self.perform(self.core.handle(Tick(), self.now))
        self.stalled = None
        if who == "emulator":
            self.controller.was_away(began, self.now)
        waiting, self._to_server = self._to_server, []
        for path, received in waiting:
            self._hear(path, received)
        if beat is not None and who == "server":
            beat[1]()
        commands, self._to_emulator = self._to_emulator, []
        for path, command in commands:
            self._to_controller(path, command)
        self._from_controller(self.controller.advance(self.now))
        for message in self.controller.state_messages(self.now):
            self._hear(ControllerPath.STATE, message)
        self.perform(self.core.handle(Tick(), self.now))
