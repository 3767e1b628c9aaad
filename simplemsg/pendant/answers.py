"""Answers to a request: one verdict, and one outcome where it was accepted."""

from enum import IntEnum
from typing import Annotated

from ..declaration import Int, Real, Reply, Text, Topic, message
from ..verdicts import VerdictCode
from .places import from_server


class OutcomeKind(IntEnum):
    """How an accepted request ended."""

    COMPLETED = 1
    ABORTED = 2


@message(
    from_server(
        65002,
        "verdict",
        "Answers a request; the header says accepted (success) or refused (failure).",
    )
)
class Verdict(Reply):
    """VERDICT: the one answer to every request but hello and management."""

    request_id: Annotated[int, Int("of the request")]
    code: Annotated[int, Int("0 accepted, else an entry of the catalogue", values=VerdictCode)]
    joint: Annotated[int, Int("index of the joint at fault, -1 for none")]
    value: Annotated[float, Real("the value at fault, SI")]
    limit: Annotated[float, Real("the limit that it breaks, SI")]
    text: Annotated[str, Text("one sentence with the numbers", size=160)]


@message(from_server(65003, "outcome", "Ends an accepted request: completed or aborted."))
class Outcome(Topic):
    """OUTCOME: comes once for each accepted motion request, to the connection that made it."""

    request_id: Annotated[int, Int("of the request")]
    outcome: Annotated[int, Int("1 completed, 2 aborted", values=OutcomeKind)]
    code: Annotated[int, Int("0 completed, else an entry of the catalogue", values=VerdictCode)]
    joint: Annotated[int, Int("index of the joint at fault, -1 for none")]
    value: Annotated[float, Real("the value at fault, SI")]
    limit: Annotated[float, Real("the limit that it breaks, SI")]
    plan_time: Annotated[float, Real("time that planning took", "s")]
    motion_time: Annotated[float, Real("planned duration of the motion", "s")]
    text: Annotated[str, Text("one sentence with the numbers", size=160)]
