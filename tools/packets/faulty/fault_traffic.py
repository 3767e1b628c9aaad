"""What the fault proxy keeps of a rule and of a connection while it runs.

Owns who awaits a reply, in which order replies go out, and how many requests are remembered.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field
from random import Random

from ..trace import Direction
from . import fault_rules as faults
from .fault_lane import Lane

MAX_AWAITED = 4096
"""Requests of one direction that are remembered until their reply comes."""

OPPOSITE = {
    Direction.TO_SERVER: Direction.TO_CLIENT,
    Direction.TO_CLIENT: Direction.TO_SERVER,
}


@dataclass(slots=True)
class Prepared:
    """A rule with its place in the script, its chance and its counts."""

    number: int
    rule: faults.Rule
    msg_type: int | None
    chance: Random
    fitted: int = 0
    done: int = 0


@dataclass(slots=True)
class Awaited:
    """A request that the peer owes a reply, and what is to become of that reply."""

    lost_by: Prepared | None = None
    withheld_by: Prepared | None = None
    answer: bytes | None = None


def _ledgers() -> dict[Direction, deque[Awaited]]:
    return {direction: deque(maxlen=MAX_AWAITED) for direction in Direction}


@dataclass(slots=True)
class Traffic:
    """One connection: its lanes, and by direction of the request, who awaits what."""

    opened: int
    lanes: dict[Direction, Lane]
    awaited: dict[Direction, deque[Awaited]] = field(default_factory=_ledgers)


def pay(traffic: Traffic, asked: Direction, now: int) -> None:
    """Send the proxy's own answers whose turn has come: replies keep the order of requests."""
    awaited = traffic.awaited[asked]
    while awaited and (answer := awaited[0].answer) is not None:
        awaited.popleft()
        traffic.lanes[OPPOSITE[asked]].put(answer, now)


def nanoseconds(ms: float) -> int:
    """Return milliseconds as integer nanoseconds."""
    return round(ms * 1e6)
