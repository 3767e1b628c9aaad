"""An emulated cell whose disk and planning process take their time where a test says so."""

import json
from typing import Any

from rigs.cells.emulated_cell import EmulatedCell
from rigs.cells.server_rig import job_of, worked_out
from rigs.peers.server_clients import Pendant

from openpendant.server.events.effects import Ask, Backend, Effect
from openpendant.server.planning.jobs import ProgramJob
from openpendant.server.planning.worker import job_planner
from openpendant.server.store.documents import DocumentKind
from openpendant.server.store.store_errors import StoreError
from openpendant.simplemsg.pendant import AuthorityBeat, Management


class BusyCell(EmulatedCell):
    """A cell with surroundings, and a pendant that holds the authority.

    Attributes:
        is_busy: what is asked of the disk, and of the planning process about programs, waits.
    """

    def __init__(self) -> None:
        self.is_busy = False
        self.waiting: list[Ask] = []
        super().__init__(has_surroundings=True)
        self.wait(100)
        self.user = self.holder()

    def perform(self, outgoing: list[Effect]) -> list[Effect]:
        here = []
        outgoing = worked_out(outgoing)
        for item in outgoing:
            match item:
                case Ask(question=question) if self.is_busy and (
                    item.backend is Backend.STORE or isinstance(question, ProgramJob)
                ):
                    self.waiting.append(item)
                case _:
                    here.append(item)
        super().perform(here)
        return outgoing

    def catch_up(self) -> None:
        """Do all that waits, and what follows."""
        self.is_busy = False
        waiting, self.waiting = self.waiting, []
        for item in waiting:
            if item.backend is Backend.STORE:
                self._run(item)
            else:
                self.answered(item, job_planner.answer(self.robot, job_of(item)))

    def fail(self, error: StoreError) -> None:
        self.is_busy = False
        waiting, self.waiting = self.waiting, []
        for item in waiting:
            self.answered(item, error)

    def begin(self, pendant: Pendant, op: str, **fields: Any) -> None:
        """Send a request whose answer may come later."""
        pendant.send(Management(77, json.dumps({"op": op, **fields}).encode()))

    def pass_time(self, milliseconds: int) -> None:
        """Let time pass while the pendant keeps its authority."""
        for _ in range(0, milliseconds, 100):
            self.user.send(AuthorityBeat())
            self.wait(100)

    def points(self, program: str = "main") -> dict[str, Any]:
        """Return the points of a program that is kept, by name."""
        body = json.loads(self.store.load(DocumentKind.PROGRAM, program).body)
        return {point["name"]: point for point in body["points"]}
