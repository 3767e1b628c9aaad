"""What happens in a cell, as told to its faces: requests, programs, authority, stop and mode.

Plain data. A request that `ask` or `move_joints` took is told of once as `Begun` or `Refused`, and
one that began once more as `Ended`.
"""

from __future__ import annotations

from dataclasses import dataclass

from openpendant.simplemsg.pendant import OperatingMode
from openpendant.simplemsg.verdicts import VerdictCode

from .authority import Change, Holder
from .driving.standstill_watch import UncommandedMotion
from .driving.stop_account import StopAccount
from .refusal import Refusal


@dataclass(frozen=True, slots=True)
class Request:
    """Who asked for a motion.

    Attributes:
        session: number of the connection.
        request_id: the asker's own number for it.
        program: number of the program desk's question, where a program asked for its client; 0
            where the client asked, who then is told itself.
    """

    session: int
    request_id: int
    program: int = 0


@dataclass(frozen=True, slots=True)
class LatchedStop:
    """A software or protective stop that waits for its reset.

    Attributes:
        by: who stopped; session 0 is the server itself.
        reason: as given.
        at: when [ns].
        is_protective: the server stopped by itself.
        code: why, where it did; its remedy is that of the stop.
    """

    by: Holder
    reason: str
    at: int
    is_protective: bool = False
    code: VerdictCode = VerdictCode.PROTECTIVE_STOP


@dataclass(frozen=True, slots=True)
class Begun:
    """A request was planned, certified and started.

    Attributes:
        request: whose.
    """

    request: Request


@dataclass(frozen=True, slots=True)
class Refused:
    """A request was refused after planning; nothing moved.

    Attributes:
        request: whose.
        refusal: why.
    """

    request: Request
    refusal: Refusal


@dataclass(frozen=True, slots=True)
class Ended:
    """A motion ended.

    Attributes:
        request: whose.
        refusal: why it was aborted; None where it arrived.
        plan_time: wall time that planning took [s].
        motion_time: planned duration [s].
        jog: how a jog came to rest; None for any other motion.
        waypoints_left: how many waypoints the robot had not passed.
    """

    request: Request
    refusal: Refusal | None
    plan_time: float
    motion_time: float
    jog: StopAccount | None = None
    waypoints_left: int = 0


@dataclass(frozen=True, slots=True)
class AuthorityMoved:
    """The motion authority changed hands.

    Attributes:
        change: to whom and why.
    """

    change: Change


@dataclass(frozen=True, slots=True)
class StopMoved:
    """The software stop was latched or reset.

    Attributes:
        stop: the latched stop, None after a reset.
        by: who did it.
    """

    stop: LatchedStop | None
    by: Holder


@dataclass(frozen=True, slots=True)
class ModeMoved:
    """The mode of operation changed.

    Attributes:
        mode: the mode now.
        by: who did it; session 0 is the controller.
    """

    mode: OperatingMode
    by: Holder


@dataclass(frozen=True, slots=True)
class Interrupted:
    """Something happened that ends what moves or waits to move, whether or not anything did.

    What moved has been stopped by then, and its end was told of.

    Attributes:
        refusal: what happened.
    """

    refusal: Refusal


@dataclass(frozen=True, slots=True)
class ProgramBegan:
    """A run of a program began.

    Attributes:
        name: of the program that was asked for, whatever it calls.
        revision: the one of it that runs.
        by: who runs it.
    """

    name: str
    revision: int
    by: Holder


@dataclass(frozen=True, slots=True)
class ProgramEnded:
    """A run of a program ended.

    Attributes:
        run: as it began.
        refusal: why, where it did not come to its end; else None.
    """

    run: ProgramBegan
    refusal: Refusal | None


@dataclass(frozen=True, slots=True)
class MovedUncommanded:
    """The robot moved although nobody commanded it; nothing was stopped.

    Attributes:
        motion: how it moved.
    """

    motion: UncommandedMotion


News = (
    Begun
    | Refused
    | Ended
    | AuthorityMoved
    | StopMoved
    | ModeMoved
    | Interrupted
    | ProgramBegan
    | ProgramEnded
    | MovedUncommanded
)
