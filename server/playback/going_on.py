"""Whether a request to run a program is one to go on with the run that is paused.

Owns that rule: what goes on is the run as it was begun. A request that says otherwise is refused
with what is under way, because nobody would notice that a part of it was left out.
"""

from __future__ import annotations

from openpendant.simplemsg.pendant import ProgramRun, RunKind
from openpendant.simplemsg.verdicts import VerdictCode

from ..programs.linking import Linked
from ..programs.run_messages import Event, Resume, RunStatus, StepBack, StepForward
from ..refusal import Refusal
from .answers import not_the_one_under_way

GOING_ON: dict[RunKind, Event] = {
    RunKind.ALL: Resume(),
    RunKind.STEP_FORWARD: StepForward(),
    RunKind.STEP_BACKWARD: StepBack(),
}
"""What each request is to a run that is paused."""


def going_on_fault(
    message: ProgramRun, linked: Linked, loops: int, status: RunStatus
) -> Refusal | None:
    """Return why a request does not go on with a run.

    Args:
        message: the request.
        linked: what runs.
        loops: how often it was asked to; 0 for until it is stopped.
        status: where it is.
    """
    main, line = linked.main, status.stack[0].line if status.stack else 0
    if message.program != main:
        text = f"program {main!r} is under way; accepted: that, or another after a program stop"
        return Refusal(VerdictCode.PROGRAM_RUNNING, text)
    if message.line:
        text = (
            f"program {main!r} is under way in line {line}; accepted: line 0 to go on there,"
            f" or line {message.line} after a program stop"
        )
        return Refusal(VerdictCode.PROGRAM_RUNNING, text, value=message.line)
    running = linked.revisions[main]
    if message.revision not in (0, running):
        return not_the_one_under_way(message.program, message.revision, running)
    # A step is one statement, however often the whole is to run.
    if message.run == RunKind.ALL and message.loops != loops:
        text = (
            f"program {main!r} is under way {_often(loops)}; accepted: loops {loops} to go on,"
            f" or {message.loops} after a program stop"
        )
        return Refusal(VerdictCode.PROGRAM_RUNNING, text, value=message.loops, limit=loops)
    return None


def _often(loops: int) -> str:
    if not loops:
        return "until it is stopped"
    return "once" if loops == 1 else f"for {loops} loops"
