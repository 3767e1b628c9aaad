"""Run tasks: the one present activity of a run, be it a motion, a wait, a question or a request.

Owns the end of each. A task that waits counts the time by a stopwatch that a pause holds.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

from openpendant.simplemsg.pendant.management.statements import (
    Attach,
    Detach,
    IfInput,
    ReadInput,
    SetOutput,
    WaitInput,
)
from openpendant.simplemsg.verdicts import VerdictCode

from ...refusal import Refusal
from .control_flow import Position
from .motion_blocks import Gathered
from .run_events import AttachToTool, DetachFromTool, QueryInput, WriteOutput

INPUT_PERIOD_NS = 50_000_000
"""Time between two reads of an input that is waited for, and longest for an answer [ns]."""


class Stopwatch:
    """Stopwatch that counts time [ns], but not while it is held."""

    def __init__(self, now: int) -> None:
        self._counted = 0
        self._since: int | None = now

    def hold(self, now: int) -> None:
        """Hold the count."""
        self._counted, self._since = self.elapsed(now), None

    def go_on(self, now: int) -> None:
        """Resume the count."""
        if self._since is None:
            self._since = now

    def elapsed(self, now: int) -> int:
        """Return the time counted so far [ns]."""
        return self._counted + (0 if self._since is None else now - self._since)


@dataclass(slots=True)
class MotionTask:
    """Block that is being planned or run.

    Attributes:
        gathered: the block; the run is behind it when it is done.
        place: the move of the block that is under way.
        back: True if it goes back along the last executed move.
    """

    request: int
    gathered: Gathered
    place: int = 0
    back: bool = False

    @property
    def moves_left(self) -> int:
        """Number of moves that it still ends, the present one included."""
        return len(self.gathered.positions) - self.place


@dataclass(slots=True)
class WaitTask:
    """Wait for a time.

    Attributes:
        duration: how much [ns].
    """

    watch: Stopwatch
    duration: int
    behind: Position


@dataclass(slots=True)
class InputTask:
    """Wait for a value of an input.

    Attributes:
        request: the question that is open; 0 for none.
        asked: time counted when it was asked last [ns].
    """

    statement: WaitInput
    watch: Stopwatch
    request: int
    asked: int
    behind: Position

    def timed_out(self, now: int) -> bool:
        """Return True if the wait has reached its limit; an answer on its way comes first."""
        limit, waited = self.statement.timeout, self.watch.elapsed(now)
        if limit is None or waited < round(limit * 1e9):
            return False
        return self.request == 0 or waited - self.asked >= INPUT_PERIOD_NS

    def timeout_refusal(self, now: int) -> Refusal:
        """Return the refusal of a wait that reached its limit."""
        waited, limit = self.watch.elapsed(now) / 1e9, self.statement.timeout or 0.0
        wanted = "on" if self.statement.value else "off"
        text = f"input {self.statement.signal} was not {wanted} after {waited:.3f} s"
        return Refusal(VerdictCode.INPUT_TIMEOUT, text, value=waited, limit=limit)

    def wants_to_ask(self, now: int) -> bool:
        """Return True if it is time to read the input again."""
        return self.request == 0 and self.watch.elapsed(now) - self.asked >= INPUT_PERIOD_NS


@dataclass(slots=True)
class QuestionTask:
    """One read of an input."""

    request: int
    statement: ReadInput | IfInput
    position: Position


@dataclass(slots=True)
class RequestTask:
    """Change of an output, or of an object of the scene."""

    request: int
    behind: Position


Question: TypeAlias = WaitInput | ReadInput | IfInput
Effect: TypeAlias = SetOutput | Attach | Detach
Task: TypeAlias = MotionTask | WaitTask | InputTask | QuestionTask | RequestTask


def step_forward_fault(task: Task | None) -> Refusal | None:
    """Return the reason why a step out of a pause would run more than the present statement."""
    if not isinstance(task, MotionTask) or task.moves_left < 2:
        return None
    left = task.moves_left
    text = f"{left} moves that zones join are left, a step is one; accepted: {_FROM_JOINED_MOVES}"
    return Refusal(VerdictCode.STEP_FORWARD_REFUSED, text, value=left, limit=1)


def step_back_fault(task: Task | None) -> Refusal | None:
    """Return the reason why there is no step back out of the present activity."""
    if task is None:
        return None
    joined = isinstance(task, MotionTask) and task.moves_left > 1
    accepted = _FROM_JOINED_MOVES if joined else "step forward, then back along all of it"
    text = f"a statement is half done; accepted: {accepted}"
    return Refusal(VerdictCode.STEP_BACK_REFUSED, text)


_FROM_JOINED_MOVES = "resume, or a program stop and then a step from the line that is wanted"


def asked(
    statement: Question | Effect, request: int, position: Position, behind: Position, now: int
) -> tuple[Task, QueryInput | WriteOutput | AttachToTool | DetachFromTool]:
    """Return the task of a statement with a request to others, and that request."""
    match statement:
        case WaitInput(signal):
            watch = Stopwatch(now)
            return InputTask(statement, watch, request, 0, behind), QueryInput(request, signal)
        case ReadInput(signal) | IfInput(signal):
            return QuestionTask(request, statement, position), QueryInput(request, signal)
        case SetOutput(signal, value):
            return RequestTask(request, behind), WriteOutput(request, signal, value)
        case Attach(scene_object):
            return RequestTask(request, behind), AttachToTool(request, scene_object)
        case Detach(scene_object):
            return RequestTask(request, behind), DetachFromTool(request, scene_object)
