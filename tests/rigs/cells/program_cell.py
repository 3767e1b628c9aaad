"""An emulated cell with programs in its store, and a pendant that runs them."""

from rigs.cells.emulated_cell import EmulatedCell
from rigs.peers.server_clients import Pendant

from openpendant.motion.trajectory.trajectory import Trajectory
from openpendant.server.events.effects import Effect, StorePlan
from openpendant.server.programs.language.parser import parse
from openpendant.server.programs.language.printer import statement_lines
from openpendant.server.programs.language.program_json import program_to_json
from openpendant.server.store.documents import DocumentKind
from openpendant.simplemsg import pendant as messages
from openpendant.simplemsg.verdicts import VerdictCode

A = (0.0, -1.5, 1.5, -1.5, -1.5, 0.0)

HEAD = """openpendant-program/1
program "{name}" robot ur5
point a joints 0 -1.5 1.5 -1.5 -1.5 0 rad
point b joints 0.1 -1.5 1.5 -1.5 -1.5 0 rad
point c joints 0.2 -1.4 1.5 -1.5 -1.5 0 rad
"""
BODY_LINE = statement_lines(parse(HEAD.format(name="main") + "move PTP a\n"))[0]
"""Line of the first statement in the canonical text."""


class ProgramCell(EmulatedCell):
    """A cell whose pendant holds the authority; `motions` are those that began."""

    def __init__(self, **programs: str) -> None:
        self.motions: list[Trajectory] = []
        super().__init__()
        self.user = self.holder()
        for name, statements in programs.items():
            self.keep(name, statements)

    def perform(self, outgoing: list[Effect]) -> list[Effect]:
        self.motions += [
            item.motion.certified.trajectory.trajectory()
            for item in outgoing
            if isinstance(item, StorePlan)
        ]
        return super().perform(outgoing)

    def keep(self, name: str, statements: str, expected_revision: int = 0) -> None:
        self.store.save(
            DocumentKind.PROGRAM,
            name,
            program_to_json(parse(HEAD.format(name=name) + statements)),
            expected_revision=expected_revision,
            author="test",
        )

    def run(
        self,
        program: str = "main",
        kind: messages.RunKind = messages.RunKind.ALL,
        *,
        line: int = 0,
        loops: int = 1,
        speed: float = 1.0,
        revision: int = 0,
        by: Pendant | None = None,
    ) -> VerdictCode | None:
        pendant = by or self.user
        request = messages.ProgramRun(pendant._next(), kind, line, loops, revision, speed, program)
        return pendant.code(request)

    def control(self, action: messages.MotionControlAction) -> VerdictCode | None:
        return self.user.control(action)

    def pass_time(self, milliseconds: int) -> None:
        """Let time pass while the pendant keeps its authority."""
        for _ in range(0, milliseconds, 10):
            if self.now % 500_000_000 == 0:
                self.user.send(messages.AuthorityBeat())
            self.wait(10)

    def until_outcomes(self, count: int = 1, most: int = 60_000) -> list[VerdictCode]:
        """Let time pass until the pendant has so many outcomes; return their codes."""
        for _ in range(0, most, 10):
            if len(self.user.outcomes()) >= count:
                break
            self.pass_time(10)
        return [code for _, code in self.user.outcomes()]

    def until_state(self, state: messages.ProgramState, most: int = 20_000) -> None:
        """Let time pass until the program is in a state."""
        for _ in range(0, most, 10):
            if self.reports()[-1].state == state:
                return
            self.pass_time(10)
        raise AssertionError(f"the program is {self.reports()[-1]}")

    def reports(self) -> list[messages.ProgramReport]:
        return self.user.all(messages.ProgramReport)
