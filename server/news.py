"""What happens in a cell, as told to both faces: the fate of requests, the authority, the stop.

Plain data. A request that `ask` or `move_joints` took is told of once as `Begun` or `Refused`, and
one that began once more as `Ended`.
"""

from __future__ import annotations

from dataclasses import dataclass

from .authority import Change, Holder
from .refusal import Refusal


@dataclass(frozen=True, slots=True)
class Request:
    """Who asked for a motion.

    Attributes:
        session: number of the connection.
        request_id: the asker's own number for it.
    """

    session: int
    request_id: int


@dataclass(frozen=True, slots=True)
class LatchedStop:
    """A software stop that waits for its reset.

    Attributes:
        by: who stopped.
        reason: as given.
        at: when [ns].
    """

    by: Holder
    reason: str
    at: int


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
    """

    request: Request
    refusal: Refusal | None
    plan_time: float
    motion_time: float


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


News = Begun | Refused | Ended | AuthorityMoved | StopMoved
