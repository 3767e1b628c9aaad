"""Effects: the actions that a core requests of its shell; a core has no other output.

A core never writes to a socket: it returns a list of effects in order, and the shell carries them
out on the same call stack. The two that each tick makes are not frozen, which halves their cost.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import Enum
from typing import TypeAlias, get_args

from openpendant.simplemsg import Message

from ..access.accounts import AccountChange
from ..access.admission import VerifyJob
from ..access.connection_loads import LoadQuestion
from ..planning.jobs import Job
from ..planning.plan_store import StoredMotion
from ..settings.cell_settings import ControllerPath
from ..store.requests import Request

Question: TypeAlias = Job | Request | VerifyJob | AccountChange | LoadQuestion
"""Questions that a core can ask of a backend, which answers later."""


class Backend(Enum):
    """Backend that answers a question, by its word in a journal."""

    PLANNER = "planner"
    STORE = "store"
    PASSWORDS = "passwords"
    ACCOUNTS = "accounts"
    LOADS = "loads"


BACKENDS: Mapping[type[Question], Backend] = {
    **dict.fromkeys(get_args(Job), Backend.PLANNER),
    **dict.fromkeys(get_args(Request), Backend.STORE),
    VerifyJob: Backend.PASSWORDS,
    AccountChange: Backend.ACCOUNTS,
    LoadQuestion: Backend.LOADS,
}
"""Backend of each class of questions."""


@dataclass(frozen=True, slots=True)
class Send:
    """Write a message to one connection; never dropped."""

    session: int
    message: Message


@dataclass(slots=True)
class Broadcast:
    """Write state to connections of one port, encoded once; slow readers are skipped."""

    sessions: tuple[int, ...]
    message: Message


@dataclass(frozen=True, slots=True)
class Notify:
    """Write a notice of a change to connections; who reads slowly is skipped, and told of later."""

    sessions: tuple[int, ...]
    message: Message


@dataclass(frozen=True, slots=True)
class Close:
    """Close a connection after what was written.

    Attributes:
        reason: for the log.
    """

    session: int
    reason: str


@dataclass(frozen=True, slots=True)
class CutOff:
    """Close a connection at once, of whatever cell; what was not written is lost.

    Attributes:
        reason: for the log.
    """

    session: int
    reason: str


@dataclass(frozen=True, slots=True)
class HoldClient:
    """Let wait what a connection sends from now on, but for what stops or keeps alive.

    What it asked last is read elsewhere, and nothing that was sent behind it may act before.
    """

    session: int


@dataclass(frozen=True, slots=True)
class ReleaseClient:
    """Go on with what a connection sent while it was held, in its order."""

    session: int


@dataclass(slots=True)
class SendToController:
    """Write a message to the controller's motion connection."""

    message: Message


@dataclass(frozen=True, slots=True)
class SendStop:
    """Write a STOP on every open motion connection to the controller, at once."""

    message: Message


@dataclass(frozen=True, slots=True)
class AnswerController:
    """Write the answer to a controller's own request, on the connection that it came from."""

    path: ControllerPath
    message: Message


@dataclass(frozen=True, slots=True)
class ReconnectController:
    """Close the controller's motion connection and connect anew.

    Attributes:
        reason: for the log.
    """

    reason: str


@dataclass(frozen=True, slots=True)
class Ask:
    """Pass a question to its backend; the answer comes back to the core as an event.

    Attributes:
        id: number of the question among those to the same backend.
    """

    id: int
    question: Question

    @property
    def backend(self) -> Backend:
        """Backend that answers it."""
        return BACKENDS[type(self.question)]


@dataclass(frozen=True, slots=True)
class Cancel:
    """Withdraw a question from the planner; only a planner's question can be cancelled.

    An answer that arrives later is ignored.
    """

    id: int


@dataclass(frozen=True, slots=True)
class WithdrawCheck:
    """Take a password from the queue of those to be checked: its connection ended.

    Its answer comes all the same: that it was not checked, or the outcome if it was begun.

    Attributes:
        id: number of the question.
    """

    id: int


@dataclass(frozen=True, slots=True)
class StorePlan:
    """Store a started motion with its certificate."""

    motion: StoredMotion


@dataclass(frozen=True, slots=True)
class QueryController:
    """Ask the controller something beside motion, on its state connection.

    On that connection neither the question nor a point waits for the other's answer.
    """

    message: Message


@dataclass(frozen=True, slots=True)
class LogLine:
    """Write a line to the server's log, as a warning; the shell says of which cell."""

    text: str


@dataclass(frozen=True, slots=True)
class Then:
    """Work out what else follows once what stands before it has left.

    So a stop waits for nobody who is told of it, and has left whatever fails in the telling.

    Attributes:
        step: returns the effects that stand in its place.
    """

    step: Callable[[], list[Effect]]


Effect = (
    Send
    | Broadcast
    | Notify
    | Close
    | CutOff
    | HoldClient
    | ReleaseClient
    | SendToController
    | SendStop
    | AnswerController
    | ReconnectController
    | Ask
    | Cancel
    | WithdrawCheck
    | StorePlan
    | QueryController
    | LogLine
    | Then
)
