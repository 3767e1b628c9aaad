"""The one thing that a run is doing: a motion, a wait, a question or a request.

Owns when each is over. A task that waits counts the time by a stopwatch that a pause holds.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

from openpendant.simplemsg.verdicts import VerdictCode

from ..refusal import Refusal
from .control_flow import Position
from .motion_blocks import Gathered
from .run_messages import AttachObject, DetachObject, WriteOutput
from .statements import Attach, Detach, IfInput, ReadInput, SetOutput, WaitInput

INPUT_PERIOD_NS = 50_000_000
"""Time between two looks at an input that is waited for [ns]."""


class Stopwatch:
    """Counts time [ns], but not while it is held."""

    def __init__(self, now: int) -> None:
        self._counted = 0
        self._since: int | None = now

    def hold(self, now: int) -> None:
        """Stop counting."""
        self._counted, self._since = self.elapsed(now), None

    def go_on(self, now: int) -> None:
        """Count again."""
        if self._since is None:
            self._since = now

    def elapsed(self, now: int) -> int:
        """Return the time counted so far [ns]."""
        return self._counted + (0 if self._since is None else now - self._since)


@dataclass(slots=True)
class MotionTask:
    """A block is being planned or run.

    Attributes:
        request: its number.
        gathered: the block; the run is behind it when it is done.
        place: the move of the block that is under way.
        back: whether it goes back along the last executed move.
    """

    request: int
    gathered: Gathered
    place: int = 0
    back: bool = False


@dataclass(slots=True)
class WaitTask:
    """Time is to pass.

    Attributes:
        watch: counts it.
        duration: how much [ns].
        behind: where the run is afterwards.
    """

    watch: Stopwatch
    duration: int
    behind: Position


@dataclass(slots=True)
class InputTask:
    """An input is to take a value.

    Attributes:
        statement: which input, which value and how long at most.
        watch: counts the time since the wait began.
        request: the question that is open; 0 for none.
        asked: time counted when it was asked last [ns].
        behind: where the run is afterwards.
    """

    statement: WaitInput
    watch: Stopwatch
    request: int
    asked: int
    behind: Position

    def timed_out(self, now: int) -> bool:
        """Tell whether the wait is as long as it may be."""
        limit = self.statement.timeout
        return limit is not None and self.watch.elapsed(now) >= round(limit * 1e9)

    def timeout_refusal(self, now: int) -> Refusal:
        """Return why the wait is over."""
        waited, limit = self.watch.elapsed(now) / 1e9, self.statement.timeout or 0.0
        wanted = "on" if self.statement.value else "off"
        text = f"input {self.statement.signal} was not {wanted} after {waited:.3f} s"
        return Refusal(VerdictCode.INPUT_TIMEOUT, text, value=waited, limit=limit)

    def wants_to_ask(self, now: int) -> bool:
        """Tell whether it is time to look at the input again."""
        return self.request == 0 and self.watch.elapsed(now) - self.asked >= INPUT_PERIOD_NS


@dataclass(slots=True)
class QuestionTask:
    """An input is read once."""

    request: int
    statement: ReadInput | IfInput
    position: Position


@dataclass(slots=True)
class RequestTask:
    """An output, or an object of the scene, is being changed."""

    request: int
    behind: Position


Task: TypeAlias = MotionTask | WaitTask | InputTask | QuestionTask | RequestTask


def effect_action(
    request: int, statement: SetOutput | Attach | Detach
) -> WriteOutput | AttachObject | DetachObject:
    """Return what is to be done for a statement with an effect."""
    match statement:
        case SetOutput(signal, value):
            return WriteOutput(request, signal, value)
        case Attach(scene_object):
            return AttachObject(request, scene_object)
        case Detach(scene_object):
            return DetachObject(request, scene_object)
