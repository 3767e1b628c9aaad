"""Load of a connection: how much it sends, and how much of the event loop it takes.

A core asks for it by a `LoadQuestion`, because it is measured on clocks that no rerun has; the
answer is noted in the journal like any other.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(slots=True)
class ConnectionLoad:
    """What a connection sent, and took.

    Attributes:
        frames: whole frames that were taken of it.
        received: bytes that came.
        cost_ns: processor time of the event loop, for reading and doing what it asked [ns].
        unread: bytes that wait for it to read them.
    """

    frames: int = 0
    received: int = 0
    cost_ns: int = 0
    unread: int = 0


@dataclass(frozen=True, slots=True)
class LoadQuestion:
    """A question for the load of some connections in one second.

    Attributes:
        job_id: number of the question.
    """

    job_id: int
    sessions: tuple[int, ...]
