"""Checks on clients: pure functions of what was observed, and their register.

Owns how single observations become one finding. A check that saw nothing to look at is not
applicable, one broken rule fails it, and a known habit makes it deviate; so no check can pass
without having looked.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Protocol, TypeVar

from ..check import (
    PASSED,
    Check,
    CheckFinding,
    Register,
    TestedRole,
    deviates,
    failed,
    not_applicable,
)
from .reports import ReportHistory
from .trace import ClientTrace
from .trajectories import Motions

_SHOWN = 3
"""Observations told in full; the rest is counted."""


@dataclass(frozen=True, slots=True)
class Habit:
    """A departure from the rule that a known program is known for.

    Attributes:
        name: the program and what it does.
        detail: what was seen.
    """

    name: str
    detail: str


Problem = str | Habit
"""Fault of one thing that was looked at: in words, or by a known habit."""


@dataclass(frozen=True, slots=True)
class Observed:
    """All that a check may look at.

    Attributes:
        trace: the packets and connections.
        motions: what the client asked the robot to do.
        reports: what the controller told of itself.
    """

    trace: ClientTrace
    motions: Motions
    reports: ReportHistory


Judge = Callable[[Observed], CheckFinding]


ClientCheck = Check[Judge]

REGISTER: Register[Judge] = Register(TestedRole.CLIENT)

client_check = REGISTER.add
"""Registers a check on clients; see `Register.add`."""


class Located(Protocol):
    """Something that a report can point at."""

    @property
    def where(self) -> str:
        """Time and connection in words."""
        ...


@dataclass(frozen=True, slots=True)
class Moment:
    """A time at which something could have been sent, but was not.

    Attributes:
        time: since the start of the trace [ns].
    """

    time: int

    @property
    def where(self) -> str:
        """The time in words."""
        return f"at {self.time / 1e9:.3f} s"


_Item = TypeVar("_Item", bound=Located)


class Tally:
    """Observations of one check, on their way to a finding."""

    def __init__(self) -> None:
        """Make a tally that has looked at nothing yet."""
        self._looked = 0
        self._broken: list[str] = []
        self._habits: dict[str, list[str]] = {}

    def look(self, item: Located, problem: Problem | None) -> None:
        """Note that something was looked at, and what was wrong with it."""
        self._looked += 1
        match problem:
            case Habit(name=name, detail=detail):
                self._habits.setdefault(name, []).append(f"{item.where}: {detail}")
            case str():
                self._broken.append(f"{item.where}: {problem}")

    def finding(self, nothing: str) -> CheckFinding:
        """Return what all of it comes to.

        Args:
            nothing: why the check is not applicable where nothing was looked at.
        """
        if self._broken:
            return failed(_listed(self._broken))
        if self._habits:
            seen = [line for lines in self._habits.values() for line in lines]
            return deviates("; ".join(self._habits), _listed(seen))
        return PASSED if self._looked else not_applicable(nothing)


def each(
    items: Iterable[_Item], rule: Callable[[_Item], Problem | None], nothing: str
) -> CheckFinding:
    """Judge things one by one.

    Args:
        items: what to look at.
        rule: what is wrong with one of them; None for nothing.
        nothing: why the check is not applicable where there are none.
    """
    tally = Tally()
    for item in items:
        tally.look(item, rule(item))
    return tally.finding(nothing)


def _listed(lines: list[str]) -> str:
    more = len(lines) - _SHOWN
    return "; ".join(lines[:_SHOWN]) + (f"; and {more} more" if more > 0 else "")
