"""What a core asks its shell to do; the only way out of the cores.

A core never writes to a socket: it returns a list of these, in order, and the shell carries them
out on the same call stack.
"""

from __future__ import annotations

from dataclasses import dataclass

from openpendant.simplemsg import Message

from .controller_path import ControllerPath
from .jobs import Job
from .plan_store import StoredMotion


@dataclass(frozen=True, slots=True)
class Send:
    """Write a message to one connection; never dropped.

    Attributes:
        session: number of the connection.
        message: what to write.
    """

    session: int
    message: Message


@dataclass(frozen=True, slots=True)
class Spread:
    """Write state to several connections, encoded once; skipped for those that read too slowly.

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


@dataclass(frozen=True, slots=True)
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
class Keep:
    """Store a motion that began, with its certificate.

    Attributes:
        motion: the motion.
    """

    motion: StoredMotion


Outgoing = Send | Spread | Close | Forward | ForwardStop | Answer | DropLink | Plan | Keep
