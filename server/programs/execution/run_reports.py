"""Run reports: the state of a program's run as messages, and the lines of its text."""

from __future__ import annotations

from dataclasses import replace

from openpendant.simplemsg.pendant import ProgramReport, ProgramState
from openpendant.simplemsg.verdicts import VerdictCode

from ...events.cell_events import RunningProgram
from ...events.replies import cut
from ...refusal import Refusal
from ..interpreter.run_events import PauseReason, RunState, RunStatus
from ..language.linking import Linked

_NAME_BYTES = 64
_TEXT_BYTES = 160

_PAUSES = {
    PauseReason.BREAKPOINT: ProgramState.AT_BREAKPOINT,
    PauseReason.STEP: ProgramState.STEPPED,
}


def program_state(status: RunStatus) -> ProgramState:
    """Return the state of a program; NONE before its start and after its end."""
    match status.state:
        case RunState.RUNNING:
            return ProgramState.RUNNING
        case RunState.PAUSED:
            return _PAUSES.get(status.pause, ProgramState.PAUSED)
    return ProgramState.NONE


def running_program(linked: Linked, status: RunStatus) -> RunningProgram | None:
    """Return what everybody may see of a program; None where it is not under way."""
    state = program_state(status)
    if state is ProgramState.NONE:
        return None
    name, line = _place(linked, status)
    return RunningProgram(name, state, line, linked.revisions[name])


def program_report(linked: Linked, status: RunStatus, ended: Refusal | None) -> ProgramReport:
    """Return the message with the place of a program's run.

    Args:
        ended: what ended it from outside; None for nothing.
    """
    name, line = _place(linked, status)
    return ProgramReport(
        state=program_state(status),
        line=line,
        loop=status.passes,
        revision=linked.revisions[name],
        program=cut(name, _NAME_BYTES),
        text=cut(_text(status, ended), _TEXT_BYTES),
    )


def noted(report: ProgramReport, text: str) -> ProgramReport:
    """Return the report with an additional sentence."""
    return replace(report, text=cut(text, _TEXT_BYTES))


def _place(linked: Linked, status: RunStatus) -> tuple[str, int]:
    """Return the program and line of the run, line 0 before and after it."""
    if not status.stack:
        return linked.main, 0
    return status.stack[-1].program, status.stack[-1].line


def _text(status: RunStatus, ended: Refusal | None) -> str:
    refusal = ended or status.failure
    if refusal is not None:
        return refusal.sentence
    if status.state is RunState.FINISHED:
        return "finished"
    if status.approaching:
        return "on the slow way to its first point"
    return ""


def start_index(linked: Linked, line: int) -> int | Refusal:
    """Return the number of the statement on a line, from 0; of the first for line 0."""
    lines = linked.lines[linked.main]
    if not line:
        return 0
    if line in lines:
        return lines.index(line)
    accepted = f"0, or {lines[0]} to {lines[-1]}" if lines else "0, the program is empty"
    text = f"no statement is on line {line} of {linked.main!r}; accepted: {accepted}"
    return Refusal(VerdictCode.BAD_ARGUMENT, text, value=line)
