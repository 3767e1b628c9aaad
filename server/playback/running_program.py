"""What everybody may see of the program that is under way in a cell; plain data."""

from __future__ import annotations

from dataclasses import dataclass

from openpendant.simplemsg.pendant import ProgramState


@dataclass(frozen=True, slots=True)
class RunningProgram:
    """A program under way, which also waits or is paused.

    Attributes:
        name: of the program, or of the one that it calls right now.
        state: what it is doing.
        line: its line in the program's text, from 1; 0 before the first statement.
        revision: the one of that program that the run began with.
    """

    name: str
    state: ProgramState
    line: int
    revision: int

    @property
    def is_paused(self) -> bool:
        """Whether it goes on only if somebody asks for it."""
        return self.state is not ProgramState.RUNNING
