"""What the terminal pendant wants done: plain values that its shell turns into calls of the client.

Angles are rad, lengths m. Owns nothing but their form.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TypeAlias

from openpendant.simplemsg.pendant import OperatingMode, RunKind

from .taught_program import ProgramEdit

JOINTS = ""
"""Stands for the joints where a frame is chosen."""


@dataclass(frozen=True, slots=True)
class SoftwareStop:
    """Stop the robot and latch.

    Attributes:
        reason: told to everybody.
        press: which stroke of the stop key it is from, so that its verdict can be told apart.
    """

    reason: str
    press: int = field(default=0, compare=False)


@dataclass(frozen=True, slots=True)
class ResetStop:
    """Unlatch the stop."""


@dataclass(frozen=True, slots=True)
class TakeControl:
    """Ask for the motion authority, or take it over by role."""

    force: bool = False


@dataclass(frozen=True, slots=True)
class GiveControl:
    """Give the motion authority back."""


@dataclass(frozen=True, slots=True)
class Enable:
    """Press the enabling device (training) half way, or let it go."""

    held: bool


@dataclass(frozen=True, slots=True)
class SetMode:
    """Set the mode of operation."""

    mode: OperatingMode


@dataclass(frozen=True, slots=True)
class SetSpeed:
    """Set the speed override, and the cap of the tool's speed [m/s] unless 0."""

    override: float
    tool_speed: float = 0.0


@dataclass(frozen=True, slots=True)
class Pulse:
    """Jog for a moment; without another pulse the robot ramps to rest at the deadline.

    Attributes:
        frame: of the axes; `JOINTS` for joints.
        axes: each axis from 0 with its direction, 1 or -1.
        deadline: how long [s].
    """

    frame: str
    axes: tuple[tuple[int, int], ...]
    deadline: float


@dataclass(frozen=True, slots=True)
class Step:
    """Jog by one increment of some axes.

    Attributes:
        frame: of the axes; `JOINTS` for joints.
        increments: each axis from 0 with its increment [rad, m].
    """

    frame: str
    increments: tuple[tuple[int, float], ...]


@dataclass(frozen=True, slots=True)
class UndoJog:
    """Go back along the way of the last jog."""


@dataclass(frozen=True, slots=True)
class GoHome:
    """Move all joints to a named position, `home` or `zero`."""

    target: str


@dataclass(frozen=True, slots=True)
class MoveJoints:
    """Move all joints to a position.

    Attributes:
        goal: (n,) target of each joint [rad, m].
        name: the motion in words, for the messages.
    """

    goal: tuple[float, ...]
    name: str


@dataclass(frozen=True, slots=True)
class MoveTool:
    """Move the tool to a pose in base, in a straight line.

    Attributes:
        position: x, y, z [m].
        orientation: quaternion x, y, z, w.
        name: the motion in words, for the messages.
    """

    position: tuple[float, float, float]
    orientation: tuple[float, float, float, float]
    name: str


@dataclass(frozen=True, slots=True)
class AskWhy:
    """Ask the server why the robot does not move."""


@dataclass(frozen=True, slots=True)
class ListPrograms:
    """Ask which programs there are."""


@dataclass(frozen=True, slots=True)
class CreateProgram:
    """Make an empty program and load it."""

    name: str


@dataclass(frozen=True, slots=True)
class OpenProgram:
    """Load a program."""

    name: str


@dataclass(frozen=True, slots=True)
class ReloadProgram:
    """Load the open program anew, because somebody else has changed it."""

    name: str


@dataclass(frozen=True, slots=True)
class EditProgram:
    """Change the open program and load it anew."""

    edit: ProgramEdit


@dataclass(frozen=True, slots=True)
class AskDryRun:
    """Ask what would happen if a program ran; nothing moves."""

    name: str


@dataclass(frozen=True, slots=True)
class RunProgram:
    """Run a program or a step of it.

    Attributes:
        name: of the program.
        revision: the one that is shown, and the only one that may run.
        run: all of it, or one step.
        line: line to begin at; 0 for where it stands, or the first.
        loops: how often; 0 for until it is stopped.
    """

    name: str
    revision: int
    run: RunKind
    line: int = 0
    loops: int = 1


@dataclass(frozen=True, slots=True)
class Pause:
    """Pause on the path."""


@dataclass(frozen=True, slots=True)
class Resume:
    """Go on along the path."""


@dataclass(frozen=True, slots=True)
class StopProgram:
    """End the program or motion; nothing is latched."""


BeginsMotion: TypeAlias = (
    Pulse | Step | UndoJog | GoHome | MoveJoints | MoveTool | RunProgram | Resume
)
"""Whatever lets the robot begin to move, or go on; asked for on fresh values only."""

Command: TypeAlias = (
    BeginsMotion
    | SoftwareStop
    | ResetStop
    | TakeControl
    | GiveControl
    | Enable
    | SetMode
    | SetSpeed
    | AskWhy
    | ListPrograms
    | CreateProgram
    | OpenProgram
    | ReloadProgram
    | EditProgram
    | AskDryRun
    | Pause
    | StopProgram
)
