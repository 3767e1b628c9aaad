"""The open program on the pendant: what is selected, how it is edited and run.

Owns what each teach and run key asks for. The program itself is the server's; every edit is loaded
anew from there.
"""

from __future__ import annotations

from openpendant.simplemsg.pendant import RunKind

from .commands import Command, EditProgram, RunProgram
from .keyboard import Intent
from .messages import Messages
from .prompts import Choice
from .taught_program import (
    Change,
    DeleteStatement,
    ProgramEdit,
    RecordPoint,
    TaughtProgram,
    TouchUp,
    Way,
)


class Teaching:
    """The open program of one pendant.

    Attributes:
        program: as it was loaded last; None for none.
        selected: statement that edits are about, from 0.
    """

    def __init__(self, messages: Messages) -> None:
        """Begin without a program.

        Args:
            messages: takes what there is to say.
        """
        self.program: TaughtProgram | None = None
        self.selected = 0
        self._messages = messages

    def opened(self, program: TaughtProgram) -> None:
        """Take a program that was loaded, or loaded anew after an edit."""
        old = self.program
        if old is None or old.name != program.name:
            self.selected = 0
        elif len(program.lines) > len(old.lines):
            # A point was added before the selected one, or behind the last: that one is it now.
            appended = program.lines[: len(old.lines)] == old.lines
            self.selected = len(program.lines) - 1 if appended else self.selected
        self.program = program
        self.select(0)

    def select(self, by: int) -> None:
        """Select a statement before or behind the selected one."""
        last = 0 if self.program is None else max(0, len(self.program.lines) - 1)
        self.selected = max(0, min(self.selected + by, last))

    def asked(self, intent: Intent, way: Way) -> Choice | Command | None:
        """Return what a key asks of the program.

        Args:
            intent: of the key.
            way: how a recorded point is gone to.

        Returns:
            What is to be done, or asked first; None where it says why not.
        """
        program = self.program
        if program is None:
            self._messages.add("no program is open; n opens one")
            return None
        match intent:
            case Intent.STEP_FORWARD:
                return RunProgram(program.name, RunKind.STEP_FORWARD)
            case Intent.STEP_BACKWARD:
                return RunProgram(program.name, RunKind.STEP_BACKWARD)
            case Intent.RUN:
                return self._run_choice(program)
            case Intent.UNDO_EDIT:
                return EditProgram(Change.UNDO)
            case Intent.REDO_EDIT:
                return EditProgram(Change.REDO)
            case Intent.RECORD:
                return EditProgram(RecordPoint(way))
        return self._edit(program, intent, way)

    def _edit(self, program: TaughtProgram, intent: Intent, way: Way) -> Choice | Command | None:
        if not program.lines:
            self._messages.add("the program is empty; 1 records a point")
            return None
        line, point = program.lines[self.selected].strip(), program.targets[self.selected]
        match intent:
            case Intent.INSERT:
                return EditProgram(RecordPoint(way, self.selected))
            case Intent.TOUCH_UP if not point:
                self._messages.add(f"{line} moves to no point")
                return None
            case Intent.TOUCH_UP:
                return _confirm(f"Touch up {point}?", TouchUp(self.selected))
        return _confirm(f"Delete {line}?", DeleteStatement(self.selected))

    def _run_choice(self, program: TaughtProgram) -> Choice:
        name, line = program.name, program.line_of(self.selected)
        here = RunProgram(name, RunKind.ALL, line)
        return Choice(
            f"Run {name}",
            {
                "1": ("all", RunProgram(name, RunKind.ALL)),
                "2": (f"from {self.selected + 1}", here),
                "3": ("loop", RunProgram(name, RunKind.ALL, loops=0)),
            },
        )


def _confirm(title: str, edit: ProgramEdit) -> Choice:
    return Choice(title, {"1": ("yes", EditProgram(edit))})
