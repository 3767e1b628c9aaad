"""Checks on clients: pure functions of what was observed, and their register.

Owns how single observations become one finding. A check that saw nothing to look at is not
applicable, one broken rule fails it, and a known habit makes it deviate; so no check can pass
without having looked.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Protocol, TypeVar

from openpendant.simplemsg import MOTOMAN

from ..check import (
    PASSED,
    CannotJudge,
    Check,
    CheckFinding,
    Register,
    Section,
    TestedRole,
    deviates,
    failed,
    not_applicable,
)
from .trace import ClientTrace, ReportHistory
from .trajectories import Motions, SentPoint, SentTrajectory

NO_TRAJECTORY = "the client sent no trajectory"

_SHOWN = 3
"""Observations told in full; the rest is counted."""


@dataclass(frozen=True, slots=True)
class Habit:
    """A departure from the rule that a known program is known for."""

    name: str
    detail: str


Problem = str | Habit
"""Fault of one thing that was looked at: in words, or by a known habit."""


@dataclass(frozen=True, slots=True)
class Observed:
    """All that a check may look at."""

    trace: ClientTrace
    motions: Motions
    reports: ReportHistory

    def points(self) -> list[SentPoint]:
        """Return all points of all trajectories."""
        return self.motions.steps

    def trajectories(self) -> list[SentTrajectory]:
        """Return all trajectories."""
        return self.motions.trajectories

    def full_trajectories(self) -> list[SentTrajectory]:
        """Return the trajectories that begin with a point of type 14 or 2016."""
        return [item for item in self.motions.trajectories if item.steps[0].is_full]


class Located(Protocol):
    """Something that a report can point at."""

    @property
    def where(self) -> str:
        """Time and connection in words."""
        ...


@dataclass(frozen=True, slots=True)
class Moment:
    """A time at which something could have been sent, but was not."""

    time: int

    @property
    def where(self) -> str:
        """The time in words."""
        return f"at {self.time / 1e9:.3f} s"


Observation = tuple[Located, Problem | None]
Judge = Callable[[Observed], CheckFinding]
ClientCheck = Check[Judge]

REGISTER: Register[Judge] = Register(TestedRole.CLIENT)

_Item = TypeVar("_Item", bound=Located)


def client_check(
    number: str, nothing: str
) -> Callable[[Callable[[Observed], Iterable[Observation]]], Judge]:
    """Register a check that yields what it looks at, each with what is wrong with it.

    A check of the Motoman section applies in that dialect only.
    """
    is_motoman = number.startswith(Section.MOTOMAN.value)

    def register(look: Callable[[Observed], Iterable[Observation]]) -> Judge:
        def judge(seen: Observed) -> CheckFinding:
            if is_motoman and seen.trace.setup.dialect is not MOTOMAN:
                return not_applicable("not the Motoman dialect")
            try:
                return finding_of(look(seen), nothing)
            except CannotJudge as error:
                return not_applicable(str(error))

        return REGISTER.add(number)(judge)

    return register


def rule_check(
    number: str, items: Callable[[Observed], Iterable[_Item]], nothing: str
) -> Callable[[Callable[[_Item, Observed], Problem | None]], Judge]:
    """Register a rule: what is wrong with one of some things, None for nothing."""

    def register(rule: Callable[[_Item, Observed], Problem | None]) -> Judge:
        return client_check(number, nothing)(
            lambda seen: ((item, rule(item, seen)) for item in items(seen))
        )

    return register


def finding_of(observations: Iterable[Observation], nothing: str) -> CheckFinding:
    """Return what all observations of one check come to."""
    looked = False
    broken: list[str] = []
    habits: dict[str, list[str]] = {}
    for item, problem in observations:
        looked = True
        match problem:
            case Habit(name=name, detail=detail):
                habits.setdefault(name, []).append(f"{item.where}: {detail}")
            case str():
                broken.append(f"{item.where}: {problem}")
    if broken:
        return failed(_listed(broken))
    if habits:
        seen = [line for lines in habits.values() for line in lines]
        return deviates("; ".join(habits), _listed(seen))
    return PASSED if looked else not_applicable(nothing)


def _listed(lines: list[str]) -> str:
    more = len(lines) - _SHOWN
    return "; ".join(lines[:_SHOWN]) + (f"; and {more} more" if more > 0 else "")
