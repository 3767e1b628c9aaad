"""Messages that run a stored program, and those on its progress."""

from enum import IntEnum
from typing import Annotated

from ..declaration import Int, Message, Real, Text, Topic, message
from .places import from_server, to_server


class RunKind(IntEnum):
    """How much of a program is run."""

    ALL = 1
    STEP_FORWARD = 2
    STEP_BACKWARD = 3


class ProgramState(IntEnum):
    """What the program is doing."""

    NONE = 0
    RUNNING = 1
    PAUSED = 2
    AT_BREAKPOINT = 3
    STEPPED = 4


@message(to_server(65040, "program_run", "Runs a stored program, or one step of it."))
class ProgramRun(Message):
    """PROGRAM_RUN: the outcome comes when the program, or the step, has ended."""

    request_id: Annotated[int, Int("chosen by the pendant")]
    run: Annotated[int, Int("1 all, 2 step forward, 3 step backward", values=RunKind)]
    line: Annotated[int, Int("line to begin at, 0 for the first; 0 on a paused program resumes it")]
    loops: Annotated[int, Int("how often, 0 for until it is stopped; to resume: as begun")]
    revision: Annotated[int, Int("revision to run, 0 for the newest or that under way")]
    speed: Annotated[float, Real("fraction of the programmed speeds, above 0, up to 1")]
    program: Annotated[str, Text("name of the program", size=64)]


@message(from_server(65026, "program_report", "A program came to another line, paused or ended."))
class ProgramReport(Topic):
    """PROGRAM_REPORT: to every connection of the cell."""

    state: Annotated[int, Int("what it is doing", values=ProgramState)]
    line: Annotated[int, Int("its current line, 0 for none")]
    loop: Annotated[int, Int("which run of it this is, from 1")]
    revision: Annotated[int, Int("revision of that program in this run")]
    program: Annotated[str, Text("name of the program", size=64)]
    text: Annotated[str, Text("one sentence, empty for none", size=160)]
