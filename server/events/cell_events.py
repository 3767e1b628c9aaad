"""Events of a cell, as published to its endpoints: requests, programs, authority, stop and mode.

Plain data. A request that `ask` or `move_joints` took is published once as `MotionStarted` or
`MotionRefused`. One that started is published again as `MotionEnded`, for a jog with the account of
its stop (`StopAccount`). `RunningProgram` is what everybody may see of the program that runs in a
cell, or is loaded to run.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import TypeAlias

from openpendant.simplemsg.pendant import Activity, JogEnd, OperatingMode, ProgramState
from openpendant.simplemsg.verdicts import VerdictCode

from ..control import AuthorityChange, Holder
from ..planning.jobs import PlaybackPlan
from ..refusal import Refusal


@dataclass(frozen=True, slots=True)
class UncommandedMotion:
    """Motion of a robot without a command.

    Attributes:
        at: time of its detection [ns].
        joint: index of the joint that moved farthest.
        way: distance that it moved [rad or m].
        within: time in which it did [s].
        unit: unit of the distance.
    """

    at: int
    joint: int
    way: float
    within: float
    unit: str

    @property
    def sentence(self) -> str:
        """What happened, with its numbers."""
        return (
            f"joint {self.joint + 1} moved by {self.way:.4f} {self.unit} within {self.within:.2f} s"
            " without a command of this server"
        )


@dataclass(frozen=True, slots=True)
class StopAccount:
    """Stop of a jog, from the end of its press to rest.

    Attributes:
        time: from its end to rest, by the set-points sent after it [s].
        joint_distance: greatest distance that a joint moved in that time [rad or m].
        began_at: (n,) joints at the end of the press, as sent [rad or m].
        ended_at: (n,) joints at rest [rad or m].
    """

    press: int
    reason: JogEnd
    time: float
    joint_distance: float
    began_at: tuple[float, ...]
    ended_at: tuple[float, ...]


class MotionOwner(Enum):
    """Owner of a motion: the part that asked for it; only the owner handles its events."""

    PENDANT = "pendant"
    PLAN = "plan"
    PROGRAM = "program"
    RECORDING = "recording"
    ROS = "ROS-Industrial"


@dataclass(frozen=True, slots=True)
class MotionRequest:
    """Request for a motion: its sender and its owner.

    Attributes:
        request_id: the client's own number for it.
        program: number of the block, where a program asked on behalf of its client; else 0.
        owner: the part that asked for it.
    """

    session: int
    request_id: int
    program: int = 0
    owner: MotionOwner = MotionOwner.PENDANT


@dataclass(frozen=True, slots=True)
class StopLatch:
    """Latched software or protective stop, until its reset.

    Attributes:
        by: who stopped; session 0 is the server itself.
        at: time of the stop [ns].
        code: cause of a protective stop; its remedy is that of the stop.
    """

    by: Holder
    reason: str
    at: int
    is_protective: bool = False
    code: VerdictCode = VerdictCode.PROTECTIVE_STOP

    @property
    def sentence(self) -> str:
        """The stop, and its reason where one was given."""
        what = "protective stop" if self.is_protective else f"software stop by {self.by.name}"
        return f"{what}: {self.reason}" if self.reason else what


@dataclass(frozen=True, slots=True)
class MotionStarted:
    """A request was planned, certified and started.

    Attributes:
        playback: for a recording, the speed asked for and the one possible.
    """

    request: MotionRequest
    playback: PlaybackPlan | None = None


@dataclass(frozen=True, slots=True)
class MotionRefused:
    """A request was refused after planning; nothing moved."""

    request: MotionRequest
    refusal: Refusal


@dataclass(frozen=True, slots=True)
class MotionEnded:
    """A motion ended.

    Attributes:
        refusal: why it was aborted; None if it arrived.
        plan_time: wall time that planning took [s].
        motion_time: planned duration [s].
        waypoints_left: number of waypoints that the robot had not passed.
    """

    request: MotionRequest
    refusal: Refusal | None
    plan_time: float
    motion_time: float
    jog: StopAccount | None = None
    waypoints_left: int = 0


@dataclass(frozen=True, slots=True)
class AuthorityTransferred:
    """The motion authority changed hands."""

    change: AuthorityChange


@dataclass(frozen=True, slots=True)
class StopLatchChanged:
    """The software stop was latched or reset.

    Attributes:
        stop: the latched stop, None after a reset.
    """

    stop: StopLatch | None
    by: Holder


@dataclass(frozen=True, slots=True)
class OperatingModeChanged:
    """The mode of operation changed.

    Attributes:
        by: who did it; session 0 is the controller.
    """

    mode: OperatingMode
    by: Holder


@dataclass(frozen=True, slots=True)
class Interruption:
    """Interruption of every motion and of every request that waits for one, if there is any.

    A motion has been stopped by then, and its end was published.
    """

    refusal: Refusal


@dataclass(frozen=True, slots=True)
class ProgramStarted:
    """A run of a program started.

    Attributes:
        name: of the program that was requested, not of one that it calls.
    """

    name: str
    revision: int
    by: Holder


@dataclass(frozen=True, slots=True)
class ProgramEnded:
    """A run of a program ended.

    Attributes:
        refusal: why, where it did not come to its end; else None.
    """

    run: ProgramStarted
    refusal: Refusal | None


@dataclass(frozen=True, slots=True)
class UncommandedMotionSeen:
    """The robot moved without a command; nothing was stopped."""

    motion: UncommandedMotion


MotionEvent: TypeAlias = MotionStarted | MotionRefused | MotionEnded
"""Start, refusal or end of a motion; only its owner handles them."""

CellEvent: TypeAlias = (
    MotionEvent
    | AuthorityTransferred
    | StopLatchChanged
    | OperatingModeChanged
    | Interruption
    | ProgramStarted
    | ProgramEnded
    | UncommandedMotionSeen
)


@dataclass(frozen=True, slots=True)
class RunningProgram:
    """A program in progress: running, waiting, paused, or still being loaded.

    Attributes:
        name: of the program, or of the one that it calls at present.
        state: its state; NONE while it is being loaded.
        line: its line in the program's text, from 1; 0 before the first statement.
        revision: the revision of that program in the run; while it is being loaded, the requested
            one, 0 for the newest.
    """

    name: str
    state: ProgramState
    line: int
    revision: int

    @property
    def is_paused(self) -> bool:
        """True while the program continues only on request."""
        return not self.is_loading and self.state is not ProgramState.RUNNING

    @property
    def is_loading(self) -> bool:
        """True while the program was requested and has not started."""
        return self.state is ProgramState.NONE

    @property
    def activity(self) -> Activity:
        """Activity of the cell while no motion of the program is planned or executed."""
        if self.is_loading:
            return Activity.PLANNING
        return Activity.PAUSED if self.is_paused else Activity.IDLE
