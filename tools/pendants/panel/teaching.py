"""The open program on the pendant: selection, edits, dry run and run requests.

Owns the request of each teach and run key, that only the shown revision runs, and that a run
without a successful dry run needs a confirmation. The server owns the program; the pendant reloads
it after every edit.
"""

from __future__ import annotations

from functools import partial

from openpendant.simplemsg.pendant import RunKind

from .commands import ApplyEdit, AskDryRun, Command, RunProgram
from .keyboard import Intent
from .messages import Messages
from .prompts import Choice
from .taught_program import (
    DeleteStatement,
    DryRunFindings,
    HistoryStep,
    ProgramEdit,
    RecordHere,
    TaughtProgram,
    TouchUpHere,
    Way,
)


class Teaching:
    """The open program of one pendant.

    Attributes:
        program: as it was loaded last; None for none.
        is_walking: whether a dry run is under way that was asked for here.
    """

    def __init__(self, messages: Messages) -> None:
        self.program: TaughtProgram | None = None
        self.selected = 0
        self.is_walking = False
        self._dry_run: DryRunFindings | None = None
        self._messages = messages

    def opened(self, program: TaughtProgram) -> None:
        """Take a program that was loaded, or reloaded after an edit."""
        old = self.program
        if old is None or old.name != program.name:
            self.selected = 0
        elif len(program.lines) > len(old.lines):
            # A point was added before the selected one, or behind the last: that one is it now.
            appended = program.lines[: len(old.lines)] == old.lines
            self.selected = len(program.lines) - 1 if appended else self.selected
        self.program = program
        self.select(0)

    def closed(self) -> None:
        """Close the open program: the store has it no more."""
        self.program = None
        self.select(0)

    def select(self, by: int) -> None:
        """Select a statement before or behind the selected one."""
        last = 0 if self.program is None else max(0, len(self.program.lines) - 1)
        self.selected = max(0, min(self.selected + by, last))

    def asked(self, intent: Intent, way: Way) -> Choice | Command | None:
        """Return the command or question of a teach or run key."""
        program = self.program
        if program is None:
            self._messages.add("no program is open; n opens one")
            return None
        match intent:
            case Intent.STEP_FORWARD:
                return RunProgram(program.name, program.revision, RunKind.STEP_FORWARD)
            case Intent.STEP_BACKWARD:
                return RunProgram(program.name, program.revision, RunKind.STEP_BACKWARD)
            case Intent.DRY_RUN:
                return self._ask_dry_run(program)
            case Intent.RUN:
                return self._run_choice(program)
            case Intent.UNDO_EDIT:
                return ApplyEdit(HistoryStep.UNDO)
            case Intent.REDO_EDIT:
                return ApplyEdit(HistoryStep.REDO)
            case Intent.RECORD:
                return ApplyEdit(RecordHere(way))
        return self._edit(program, intent, way)

    def _edit(self, program: TaughtProgram, intent: Intent, way: Way) -> Choice | Command | None:
        if not program.lines:
            self._messages.add("the program is empty; 1 records a point")
            return None
        line, point = program.lines[self.selected].strip(), program.targets[self.selected]
        match intent:
            case Intent.INSERT:
                return ApplyEdit(RecordHere(way, self.selected))
            case Intent.TOUCH_UP if not point:
                self._messages.add(f"{line} moves to no point")
                return None
            case Intent.TOUCH_UP:
                return _confirm(f"Touch up {point}?", TouchUpHere(self.selected))
        return _confirm(f"Delete {line}?", DeleteStatement(self.selected))

    def walked(self, dry_run: DryRunFindings | None) -> None:
        """Take the findings of a dry run; None where it gave none."""
        self.is_walking = False
        if dry_run is None:
            return
        self._dry_run = dry_run
        self._messages.add(f"{dry_run.name}, {dry_run.summary}")
        for refusal in dry_run.elsewhere:
            self._messages.add(refusal)

    @property
    def dry_run(self) -> DryRunFindings | None:
        """The dry run of the open program in its shown revision; None where there is none."""
        found, program = self._dry_run, self.program
        if found is None or program is None:
            return None
        is_of_it = (found.name, found.revision) == (program.name, program.revision)
        return found if is_of_it else None

    def refusal(self, statement: int) -> str | None:
        """Return why a statement cannot run; empty where it can, None where that is not known."""
        program, found = self.program, self.dry_run
        if program is None or found is None:
            return None
        return found.refusal(program.line_of(statement), program.targets[statement])

    def _ask_dry_run(self, program: TaughtProgram) -> Command | None:
        if self.is_walking:
            self._messages.add("a dry run is under way")
            return None
        self.is_walking = True
        return AskDryRun(program.name)

    def _run_choice(self, program: TaughtProgram) -> Choice:
        name, line = program.name, program.line_of(self.selected)
        run = partial(RunProgram, name, program.revision, RunKind.ALL)
        ways = {
            "1": ("all", run()),
            "2": (f"from {self.selected + 1}", run(line)),
            "3": ("loop", run(loops=0)),
        }
        doubt = self._doubt(program)
        if not doubt:
            return Choice(f"Run {name}", ways)
        self._messages.add(f"{doubt}; . makes a dry run" if self.dry_run is None else doubt)
        title = "No dry run. Run?" if self.dry_run is None else "REFUSED points. Run?"
        # The key that asked is harmless where nothing is asked a second time; 1 records a point.
        return Choice(
            f"Run {name}",
            {
                key: (text, Choice(title, {"5": ("yes", each)}))
                for key, (text, each) in ways.items()
            },
        )

    def _doubt(self, program: TaughtProgram) -> str:
        """Return the reason to confirm a run first; empty for none."""
        found = self.dry_run
        if found is None:
            return f"no dry run was made of {program.name}, revision {program.revision}"
        if not found.is_refused:
            return ""
        lines = enumerate(program.lines)
        bad = [line.strip() for index, line in lines if self.refusal(index)]
        return f"the dry run refused {', '.join(bad) or 'a point'}"


def _confirm(title: str, edit: ProgramEdit) -> Choice:
    return Choice(title, {"1": ("yes", ApplyEdit(edit))})
