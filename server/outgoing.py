"""What a core asks its shell to do; the only way out of the cores.

A core never writes to a socket: it returns a list of these, in order, and the shell carries them
out on the same call stack. The two that each tick makes are not frozen, which takes half the time.
"""

from __future__ import annotations

from dataclasses import dataclass

from openpendant.simplemsg import Message

from .access.account_changes import AccountChange
from .access.admission import VerifyJob
from .controller_path import ControllerPath
from .planning.jobs import Job
from .planning.plan_store import StoredMotion
from .store.requests import Request


@dataclass(frozen=True, slots=True)
class Send:
    """Write a message to one connection; never dropped.

    Attributes:
        session: number of the connection.
        message: what to write.
    """

    session: int
    message: Message


@dataclass(slots=True)
class Spread:
    """Write state to connections of one port, encoded once; skipped for those that read too slowly.

    Attributes:
        sessions: numbers of the connections.
        message: what to write.
    """

    sessions: tuple[int, ...]
    message: Message


@dataclass(frozen=True, slots=True)
class Close:
    """Close a connection after what was written.

    Attributes:
        session: number of the connection.
        reason: for the log.
    """

    session: int
    reason: str


@dataclass(slots=True)
class Forward:
    """Write a message to the controller's motion connection.

    Attributes:
        message: what to write.
    """

    message: Message


@dataclass(frozen=True, slots=True)
class ForwardStop:
    """Write a stop on every open motion connection to the controller, at once.

    Attributes:
        message: the stop in the controller's dialect.
    """

    message: Message


@dataclass(frozen=True, slots=True)
class Answer:
    """Write the answer to a controller's own request, on the connection that it came from.

    Attributes:
        path: the connection.
        message: the answer.
    """

    path: ControllerPath
    message: Message


@dataclass(frozen=True, slots=True)
class DropLink:
    """Close the controller's motion connection and connect anew.

    Attributes:
        reason: for the log.
    """

    reason: str


@dataclass(frozen=True, slots=True)
class Plan:
    """Give a job to the planning process.

    Attributes:
        job: what to plan.
    """

    job: Job


@dataclass(frozen=True, slots=True)
class Withdraw:
    """Tell the planning process that nobody waits for the answer to a job any more.

    One that comes all the same is ignored.

    Attributes:
        job_id: number of the job.
    """

    job_id: int


@dataclass(frozen=True, slots=True)
class Keep:
    """Store a motion that began, with its certificate.

    Attributes:
        motion: the motion.
    """

    motion: StoredMotion


@dataclass(frozen=True, slots=True)
class Errand:
    """Ask the store for something; the answer comes back to the core as an event.

    Attributes:
        errand_id: number of the errand.
        request: what is asked.
    """

    errand_id: int
    request: Request


@dataclass(frozen=True, slots=True)
class CheckPassword:
    """Have a password checked; whether it is right comes back as an event.

    Attributes:
        job: what to compare.
    """

    job: VerifyJob


@dataclass(frozen=True, slots=True)
class ChangeAccount:
    """Have an account changed; whether it was comes back as an event.

    Attributes:
        change: what is wanted.
    """

    change: AccountChange


@dataclass(frozen=True, slots=True)
class Query:
    """Ask the controller something beside motion, on its state connection.

    There it waits for no answer to a point, and none waits for it.

    Attributes:
        message: the question.
    """

    message: Message


@dataclass(frozen=True, slots=True)
class Warn:
    """Write one line to the log, as a warning.

    Attributes:
        text: the line.
    """

    text: str


Outgoing = (
    Send
    | Spread
    | Close
    | Forward
    | ForwardStop
    | Answer
    | DropLink
    | Plan
    | Withdraw
    | Keep
    | Errand
    | CheckPassword
    | ChangeAccount
    | Query
    | Warn
)
