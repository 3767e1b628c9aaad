"""Commands of the terminal pendant's core: plain values that its shell turns into client calls.

Angles are rad, lengths m. Owns only their form.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum
from typing import TypeAlias

from openpendant.simplemsg.pendant import OperatingMode, RunKind

from .taught_program import ProgramEdit

JOINTS = ""
"""Stands for the joints where a frame is chosen."""


@dataclass(frozen=True, slots=True)
class StopRobot:
    """Stop the robot and latch.

    Attributes:
        press: number of the stop key's stroke, which the verdict is matched to.
    """

    reason: str
    press: int = field(default=0, compare=False)


@dataclass(frozen=True, slots=True)
class UnlatchStop:
    """Unlatch the stop."""


@dataclass(frozen=True, slots=True)
class TakeControl:
    """Request the motion authority, or take it over by role."""

    force: bool = False


@dataclass(frozen=True, slots=True)
class GiveControl:
    """Give the motion authority back."""


@dataclass(frozen=True, slots=True)
class Enable:
    """Press the enabling device (training) half way, or release it."""

    held: bool


@dataclass(frozen=True, slots=True)
class ChangeMode:
    """Set the mode of operation."""

    mode: OperatingMode


@dataclass(frozen=True, slots=True)
class ChangeSpeed:
    """Set the speed override, and the cap of the tool's speed [m/s] unless 0."""

    override: float
    tool_speed: float = 0.0


@dataclass(frozen=True, slots=True)
class PulseJog:
    """Jog for a short time; without another pulse the robot ramps to rest at the deadline.

    Attributes:
        frame: of the axes; `JOINTS` for joints.
        axes: each axis from 0 with its direction, 1 or -1.
        deadline: time until the ramp to rest starts [s].
    """

    frame: str
    axes: tuple[tuple[int, int], ...]
    deadline: float


@dataclass(frozen=True, slots=True)
class PressJog:
    """Jog while a key is held, as a device without an end of its keys cannot.

    Attributes:
        frame: of the axes; `JOINTS` for joints.
        axes: each axis from 0 with its direction, 1 or -1.
    """

    frame: str
    axes: tuple[tuple[int, int], ...]


@dataclass(frozen=True, slots=True)
class AimJog:
    """Go on with the held jog along other axes of its frame; begins nothing where it has ended."""

    frame: str
    axes: tuple[tuple[int, int], ...]


@dataclass(frozen=True, slots=True)
class FeedBeat:
    """Hand on a sign of the device: its keys are held as before."""


@dataclass(frozen=True, slots=True)
class ReleaseJog:
    """End the held jog."""


@dataclass(frozen=True, slots=True)
class StepJog:
    """Jog by one increment of some axes.

    Attributes:
        frame: of the axes; `JOINTS` for joints.
        increments: each axis from 0 with its increment [rad, m].
    """

    frame: str
    increments: tuple[tuple[int, float], ...]


@dataclass(frozen=True, slots=True)
class UndoJog:
    """Move back along the path of the last jog."""


@dataclass(frozen=True, slots=True)
class GoHome:
    """Move all joints to a named position, such as `home`."""

    target: str


@dataclass(frozen=True, slots=True)
class MoveJoints:
    """Move all joints to a position.

    Attributes:
        goal: (n,) target of each joint [rad, m].
    """

    goal: tuple[float, ...]
    name: str


@dataclass(frozen=True, slots=True)
class MoveToPose:
    """Move the tool to a pose in base, in a straight line.

    Attributes:
        position: x, y, z [m].
        orientation: quaternion x, y, z, w.
    """

    position: tuple[float, float, float]
    orientation: tuple[float, float, float, float]
    name: str


@dataclass(frozen=True, slots=True)
class AskWhy:
    """Ask the server why the robot does not move."""


@dataclass(frozen=True, slots=True)
class AskPrograms:
    """Request the names of the stored programs."""


@dataclass(frozen=True, slots=True)
class MakeProgram:
    """Create an empty program and load it."""

    name: str


@dataclass(frozen=True, slots=True)
class OpenProgram:
    """Load a program."""

    name: str


@dataclass(frozen=True, slots=True)
class ReloadProgram:
    """Reload the open program because another client has changed it."""

    name: str


@dataclass(frozen=True, slots=True)
class ApplyEdit:
    """Edit the open program and reload it."""

    edit: ProgramEdit


@dataclass(frozen=True, slots=True)
class AskDryRun:
    """Request a dry run of a program; nothing moves."""

    name: str


@dataclass(frozen=True, slots=True)
class RunProgram:
    """Run a program or a step of it.

    Attributes:
        revision: the shown one, and the only one that may run.
        line: line to start at; 0 for the present line, or the first.
        loops: number of passes; 0 until it is stopped.
    """

    name: str
    revision: int
    run: RunKind
    line: int = 0
    loops: int = 1


class CellList(Enum):
    """Lists of what the cell has beside programs; the value is their short name."""

    RECORDINGS = "record."
    FRAMES = "frames"
    TOOLS = "tools"
    SCENE = "scene"
    SIGNALS = "signals"
    PLANS = "plans"
    POSITIONS = "positions"


@dataclass(frozen=True, slots=True)
class AskList:
    """Request one of the cell's lists."""

    kind: CellList


@dataclass(frozen=True, slots=True)
class RecordMotion:
    """Begin a recording of the robot's motion."""

    name: str


@dataclass(frozen=True, slots=True)
class EndRecording:
    """End the recording under way."""


@dataclass(frozen=True, slots=True)
class PlayBack:
    """Move the robot as it was recorded."""

    name: str


@dataclass(frozen=True, slots=True)
class ChooseTool:
    """Select a tool; None is the bare flange.

    Attributes:
        revision: of the tools, as they were listed.
    """

    name: str | None
    revision: int


@dataclass(frozen=True, slots=True)
class SwitchOutput:
    """Switch an output of the controller."""

    number: int
    value: bool


@dataclass(frozen=True, slots=True)
class TeachPosition:
    """Keep where the robot stands as a named position; one of the same name is moved.

    Attributes:
        revision: of the positions, as they were listed.
    """

    name: str
    revision: int


@dataclass(frozen=True, slots=True)
class ForgetPosition:
    """Forget a named position.

    Attributes:
        revision: of the positions, as they were listed.
    """

    name: str
    revision: int


@dataclass(frozen=True, slots=True)
class PlanWay:
    """Have the way to a named position planned, to be looked at; nothing moves."""

    name: str


@dataclass(frozen=True, slots=True)
class ExecutePlan:
    """Move the robot exactly as a plan shows."""

    plan: int


@dataclass(frozen=True, slots=True)
class ForgetPlan:
    """Forget a plan."""

    plan: int


@dataclass(frozen=True, slots=True)
class AskPairingCode:
    """Request a code that makes whoever types it an operator of this cell; an admin may."""


@dataclass(frozen=True, slots=True)
class EndPairing:
    """End the code, and what its guests may do."""


@dataclass(frozen=True, slots=True)
class HoldMotion:
    """Begin a motion that goes on while a key is held, which holds the enabling device, too."""

    motion: UndoJog | GoHome | RunProgram | PlayBack | ResumeRobot


@dataclass(frozen=True, slots=True)
class LetGoMotion:
    """End the motion of a held key."""


@dataclass(frozen=True, slots=True)
class AskRetreat:
    """Ask the server which keys lead out of what the robot stands at."""


@dataclass(frozen=True, slots=True)
class PauseRobot:
    """Pause on the path."""


@dataclass(frozen=True, slots=True)
class ResumeRobot:
    """Continue along the path."""


@dataclass(frozen=True, slots=True)
class StopProgram:
    """End the program or motion; no stop is latched."""


BeginsMotion: TypeAlias = (
    PulseJog
    | PressJog
    | HoldMotion
    | StepJog
    | UndoJog
    | GoHome
    | MoveJoints
    | MoveToPose
    | RunProgram
    | PlayBack
    | ExecutePlan
    | ResumeRobot
)
"""Whatever lets the robot begin to move, or go on; asked for on fresh values only."""

ChangesList: TypeAlias = (
    RecordMotion
    | EndRecording
    | ChooseTool
    | SwitchOutput
    | TeachPosition
    | ForgetPosition
    | ForgetPlan
)
"""Whatever changes what one of the cell's lists has, and moves nothing."""

Command: TypeAlias = (
    BeginsMotion
    | StopRobot
    | UnlatchStop
    | TakeControl
    | GiveControl
    | Enable
    | ChangeMode
    | ChangeSpeed
    | AimJog
    | FeedBeat
    | ReleaseJog
    | LetGoMotion
    | AskRetreat
    | AskWhy
    | AskPrograms
    | MakeProgram
    | OpenProgram
    | ReloadProgram
    | ApplyEdit
    | AskDryRun
    | AskList
    | ChangesList
    | PlanWay
    | AskPairingCode
    | EndPairing
    | PauseRobot
    | StopProgram
)
