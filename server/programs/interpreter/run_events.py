"""Run events and actions: the input and the output of a program's run, and the signals it may use.

Every action that takes time has a request number; its answer quotes it. An answer to a request that
is no longer open, as after a stop, changes nothing.

Owns the refusal of a signal that the controller does not have.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import Literal, TypeAlias

from openpendant.simplemsg.verdicts import VerdictCode

from ...refusal import Refusal
from .motion_blocks import MotionBlock


class RunState(Enum):
    """State of a run."""

    IDLE = "not started"
    RUNNING = "running"
    PAUSED = "paused"
    FINISHED = "finished"
    FAILED = "failed"
    STOPPED = "stopped"


class PauseReason(Enum):
    """Reason for a pause of a run."""

    NONE = "not paused"
    REQUEST = "asked for"
    BREAKPOINT = "breakpoint"
    STEP = "single step done"


@dataclass(frozen=True, slots=True)
class RunPlace:
    """Statement of a run.

    Attributes:
        line: its line in the canonical text, from 1.
    """

    program: str
    index: int
    line: int


@dataclass(frozen=True, slots=True)
class RunStatus:
    """Published status of a run.

    Attributes:
        stack: the statements under way or coming next: of the main program first, then of each
            program that is called; empty before the start and at the end.
        passes: number of times that the main program was started.
        approaching: True if the robot is on its slow way to the first point.
    """

    state: RunState = RunState.IDLE
    pause: PauseReason = PauseReason.NONE
    stack: tuple[RunPlace, ...] = ()
    passes: int = 0
    approaching: bool = False
    failure: Refusal | None = None


@dataclass(frozen=True, slots=True)
class Start:
    """Event: start a run.

    Attributes:
        index: the statement of the main program to start with, from 0.
        passes: how often the main program runs; None for ever.
        step: True if to pause after the first statement.
    """

    index: int = 0
    passes: int | None = 1
    step: bool = False


@dataclass(frozen=True, slots=True)
class Pause:
    """Pause, a motion on its path."""


@dataclass(frozen=True, slots=True)
class Resume:
    """Go on after a pause."""


@dataclass(frozen=True, slots=True)
class StepForward:
    """Go on for one statement that takes time or has an effect."""


@dataclass(frozen=True, slots=True)
class StepBack:
    """Go back along the move that was executed last, to its start."""


@dataclass(frozen=True, slots=True)
class Stop:
    """End the run; nothing of it goes on by itself."""


@dataclass(frozen=True, slots=True)
class ReplaceBreakpoints:
    """Pause before these statements from now on: program and number from 0."""

    places: frozenset[tuple[str, int]]


@dataclass(frozen=True, slots=True)
class RequestDone:
    """A request was carried out; of a motion: the robot stands at its end."""

    request: int


@dataclass(frozen=True, slots=True)
class Passed:
    """The robot passed the end of one move of a block, by its place in the block."""

    request: int
    place: int


@dataclass(frozen=True, slots=True)
class InputValue:
    """The answer to `QueryInput`."""

    request: int
    value: bool


@dataclass(frozen=True, slots=True)
class RequestAborted:
    """A request was refused, or ended before it was done."""

    request: int
    refusal: Refusal


@dataclass(frozen=True, slots=True)
class TimePassed:
    """Event: time has passed."""


Event: TypeAlias = (
    Start
    | Pause
    | Resume
    | StepForward
    | StepBack
    | Stop
    | ReplaceBreakpoints
    | RequestDone
    | Passed
    | InputValue
    | RequestAborted
    | TimePassed
)


@dataclass(frozen=True, slots=True)
class RequestMotion:
    """Plan and run a block of moves from where the robot stands."""

    request: int
    block: MotionBlock


@dataclass(frozen=True, slots=True)
class PauseMotion:
    """Ramp down on the path, and stay there."""

    request: int


@dataclass(frozen=True, slots=True)
class ResumeMotion:
    """Go on along the path."""

    request: int


@dataclass(frozen=True, slots=True)
class StopMotion:
    """End the motion; it is not resumed."""

    request: int


@dataclass(frozen=True, slots=True)
class WriteOutput:
    """Give an output a value."""

    request: int
    signal: int
    value: bool


@dataclass(frozen=True, slots=True)
class QueryInput:
    """Action: read the value that an input has now; answered by `InputValue`."""

    request: int
    signal: int


@dataclass(frozen=True, slots=True)
class AttachToTool:
    """Let the tool carry an object of the scene."""

    request: int
    scene_object: str


@dataclass(frozen=True, slots=True)
class DetachFromTool:
    """Leave an object of the scene where it is."""

    request: int
    scene_object: str


@dataclass(frozen=True, slots=True)
class RunReport:
    """The status changed."""

    status: RunStatus


@dataclass(frozen=True, slots=True)
class Finished:
    """All passes are done."""


@dataclass(frozen=True, slots=True)
class Failed:
    """The run ended before its end."""

    refusal: Refusal


@dataclass(frozen=True, slots=True)
class EventRefused:
    """Action: the event before is not possible now; nothing changed."""

    refusal: Refusal


Action: TypeAlias = (
    RequestMotion
    | PauseMotion
    | ResumeMotion
    | StopMotion
    | WriteOutput
    | QueryInput
    | AttachToTool
    | DetachFromTool
    | RunReport
    | Finished
    | Failed
    | EventRefused
)


SignalKind: TypeAlias = Literal["input", "output"]


@dataclass(frozen=True, slots=True)
class OfferedSignals:
    """Numbers of signals; they are numbered from 0."""

    inputs: int
    outputs: int

    def absent(self, kind: SignalKind, signal: int) -> Refusal | None:
        """Return the reason why there is no such signal; None if there is one."""
        count = self.inputs if kind == "input" else self.outputs
        if 0 <= signal < count:
            return None
        accepted = f"0 to {count - 1}" if count else "none, there is not one"
        text = f"{kind} {signal}; accepted: {accepted}"
        return Refusal(VerdictCode.NO_SIGNAL, text, value=signal, limit=count - 1)


Offer: TypeAlias = OfferedSignals | Refusal | None
"""Signals that a controller offers; or why it offers none; None while that is unknown."""
