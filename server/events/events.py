"""Events: everything that can happen to a cell from outside, as values for `CellCore.handle`.

Plain data. `checks_freeze` of an event is True if the cell must check, before it handles the event,
whether the event loop stood still: nothing may start after a freeze that the watchdog has ended
with a STOP. The two most frequent events are not frozen, which halves their cost.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import ClassVar, TypeAlias

import openpendant.simplemsg as wire

from ..refusal import Refusal
from ..settings.cell_settings import ControllerPath
from .effects import Ask, Backend


class Port(Enum):
    """Protocol that a connection was accepted for."""

    PENDANT = "pendant protocol"
    ROS_MOTION = "ROS-Industrial motion"
    ROS_STATE = "ROS-Industrial state"


# Of clients.


@dataclass(frozen=True, slots=True)
class Opened:
    """A client connected.

    Attributes:
        session: number of the connection, unique among all cells.
    """

    checks_freeze: ClassVar[bool] = False

    session: int
    port: Port
    address: str


@dataclass(frozen=True, slots=True)
class Closed:
    """A client's connection ended, by itself or by us; a second one is ignored."""

    checks_freeze: ClassVar[bool] = False

    session: int


@dataclass(frozen=True, slots=True)
class StopReceived:
    """A client's STOP arrived; it acts before the messages that the client sent earlier.

    Attributes:
        session: number of the connection, which `may_stop`.
    """

    checks_freeze: ClassVar[bool] = True

    session: int
    message: wire.Message


@dataclass(slots=True)
class Received:
    """A client sent a message.

    Attributes:
        message: the message, or what came in its place.
    """

    checks_freeze: ClassVar[bool] = True

    session: int
    message: wire.Arrival


@dataclass(frozen=True, slots=True)
class Misdirected:
    """A client that no cell has welcomed asked for a cell that cannot serve it."""

    checks_freeze: ClassVar[bool] = False

    session: int
    refusal: Refusal


@dataclass(frozen=True, slots=True)
class ClientFailed:
    """The server failed on a client's message: the robot is stopped, then the connection closed.

    Attributes:
        incident: its number in the log.
    """

    checks_freeze: ClassVar[bool] = False

    session: int
    incident: str


@dataclass(frozen=True, slots=True)
class Skipped:
    """Clients read too slowly for a state message.

    Attributes:
        sessions: numbers of the connections, once for each message that was left out.
    """

    checks_freeze: ClassVar[bool] = False

    sessions: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class NoticesMissed:
    """Clients read too slowly for a notice of a change, which they were not sent.

    Attributes:
        sessions: numbers of the connections.
    """

    checks_freeze: ClassVar[bool] = False

    sessions: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class Regranted:
    """The grant of a connection changed, because its account was changed."""

    checks_freeze: ClassVar[bool] = False

    session: int


# Of the controller.


@dataclass(frozen=True, slots=True)
class PathChanged:
    """A connection to the controller was made or lost."""

    checks_freeze: ClassVar[bool] = False

    path: ControllerPath
    up: bool


@dataclass(slots=True)
class ControllerReport:
    """The controller sent a message.

    Attributes:
        message: the message, or what came in its place.
        pending: replies that the connection still owes us.
    """

    # Checked before the report is handled: the controller's answer after a freeze must not release
    # the set-points of the lost time.
    checks_freeze: ClassVar[bool] = True

    path: ControllerPath
    message: wire.Received
    pending: int


@dataclass(frozen=True, slots=True)
class ControllerGarbled:
    """The bytes of a connection to the controller cannot be decoded any more."""

    checks_freeze: ClassVar[bool] = False

    path: ControllerPath
    problem: str


# Of the server's own parts.


@dataclass(frozen=True, slots=True)
class Answered:
    """A question was answered.

    Attributes:
        answer: the backend's answer: a `PlanAnswer` for a job, an `Answer` for a request to the
            store; for a password True if it is right, None if not checked; for a change of an
            account the refusal, None if it was made.
    """

    ask: Ask
    answer: object

    @property
    def checks_freeze(self) -> bool:
        """True if a motion may start on it, as on a plan or on a program that was loaded."""
        return self.ask.backend in (Backend.PLANNER, Backend.STORE)


@dataclass(frozen=True, slots=True)
class Tick:
    """The control tick."""

    checks_freeze: ClassVar[bool] = True


@dataclass(frozen=True, slots=True)
class WatchdogStopped:
    """The watchdog has sent STOP: the next event latches a stop, as after any freeze."""

    checks_freeze: ClassVar[bool] = False


@dataclass(frozen=True, slots=True)
class ShutDown:
    """The server is going down."""

    checks_freeze: ClassVar[bool] = False


TICK = Tick()
"""One for all cells and all time."""

ClientEvent: TypeAlias = Opened | Closed | StopReceived | Received | Misdirected
"""Events whose failure must cost no more than one connection."""

Event: TypeAlias = (
    ClientEvent
    | ClientFailed
    | Skipped
    | NoticesMissed
    | Regranted
    | PathChanged
    | ControllerReport
    | ControllerGarbled
    | Answered
    | Tick
    | WatchdogStopped
    | ShutDown
)
