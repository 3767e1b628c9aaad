"""What everybody may see of the program that is under way in a cell, or loaded for that."""

from __future__ import annotations

from dataclasses import dataclass

from openpendant.simplemsg.pendant import Activity, ProgramState


@dataclass(frozen=True, slots=True)
class RunningProgram:
    """A program under way, which also waits, is paused, or is still being loaded.

    Attributes:
        name: of the program, or of the one that it calls right now.
        state: what it is doing; NONE while it is loaded.
        line: its line in the program's text, from 1; 0 before the first statement.
        revision: the one of that program that the run began with; while it is loaded, the one that
            was asked for, 0 for the newest.
    """

    name: str
    state: ProgramState
    line: int
    revision: int

    @property
    def is_paused(self) -> bool:
        """Whether it goes on only if somebody asks for it."""
        return not self.is_loading and self.state is not ProgramState.RUNNING

    @property
    def is_loading(self) -> bool:
        """Whether it was asked for, and has not begun yet."""
        return self.state is ProgramState.NONE

    @property
    def activity(self) -> Activity:
        """What the cell does with it while no motion of it is planned or moves."""
        if self.is_loading:
            return Activity.PLANNING
        return Activity.PAUSED if self.is_paused else Activity.IDLE
