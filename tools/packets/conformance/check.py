"""Checks, their findings and results, the same for both roles and in all reports of all versions.

Owns what a check is: a number, what gives it reason, and what looks and judges; and what it may
find. Knows no sockets, no messages and no clock.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from enum import Enum
from typing import Any, Generic, TypeVar

from .clauses import clause_of


class CheckVerdict(Enum):
    """Result of a check. A check that did not look never says PASSED."""

    PASSED = "passed"
    FAILED = "failed"
    DEVIATES = "deviates"
    NOT_APPLICABLE = "not applicable"


class Section(Enum):
    """Subject of a check; the first letter of its number."""

    FRAMING = "F"
    HEADER = "H"
    BYTE_ORDER = "B"
    REPLIES = "R"
    MOTION = "M"
    STOP = "S"
    LIMITS = "L"
    TOPICS = "T"
    STATUS = "Q"
    LINK = "K"
    MOTOMAN = "Y"
    PENDANT = "P"


@dataclass(frozen=True, slots=True)
class CheckFinding:
    """Finding of one check.

    Attributes:
        detail: what was seen, with numbers; why, where it is not applicable.
        habit: name of the known vendor habit, where it deviates.
    """

    verdict: CheckVerdict
    detail: str = ""
    habit: str = ""


PASSED = CheckFinding(CheckVerdict.PASSED)


def passed(detail: str) -> CheckFinding:
    """Return the finding of a rule that holds; `detail` says with which numbers."""
    return CheckFinding(CheckVerdict.PASSED, detail)


def failed(detail: str) -> CheckFinding:
    """Return the finding of a broken rule; `detail` says what was seen instead."""
    return CheckFinding(CheckVerdict.FAILED, detail)


def deviates(habit: str, detail: str) -> CheckFinding:
    """Return the finding of a known vendor habit, named."""
    return CheckFinding(CheckVerdict.DEVIATES, detail, habit)


def not_applicable(reason: str) -> CheckFinding:
    """Return the finding of a check that could not look."""
    return CheckFinding(CheckVerdict.NOT_APPLICABLE, reason)


class RuleBroken(Exception):
    """The target broke the rule of a check; the text says what was seen."""


class CannotJudge(Exception):
    """The check cannot look: something that it needs is missing; the text says what."""


class Profile(Enum):
    """Profile by which a server is judged; a check outside it is not run and not listed."""

    MINIMUM = "minimum"
    """The least that a home-made controller must do: docs/minimum-controller.md."""
    GENERIC = "generic"
    """All of ROS-Industrial simple message."""
    MOTOMAN = "motoman"
    """The Motoman dialect, MotoROS for ROS 1."""
    PENDANT = "pendant"
    """The pendant port of our own server and nothing else."""


class TestedRole(Enum):
    """End that is judged; the second letter of a check's number."""

    SERVER = "S"
    CLIENT = "C"


JudgeT = TypeVar("JudgeT")


@dataclass(frozen=True, slots=True)
class Check(Generic[JudgeT]):
    """One check on a server or on a client.

    Attributes:
        number: as in the tables of clauses, e.g. `FS03`.
        moves: it can only be judged by moving the robot.
        is_plain: it sends nothing, or nothing but whole points of standard form, STOP among them;
            only such a check is run on a target that does not tell frames apart by their header.
        deadline: it must be done by then [s]; what it leaves behind is put in order afterwards.
    """

    number: str
    title: str
    clause: str
    judge: JudgeT
    moves: bool = False
    profiles: frozenset[Profile] = frozenset()
    is_plain: bool = False
    deadline: float = 30.0

    @property
    def section(self) -> Section:
        """The section of the check."""
        return Section(self.number[0])


class Register(Generic[JudgeT]):
    """All checks of one role; their modules add them as they are imported."""

    def __init__(self, role: TestedRole) -> None:
        self._role = role
        self._checks: dict[str, Check[JudgeT]] = {}

    def add(
        self,
        number: str,
        *,
        moves: bool = False,
        profiles: frozenset[Profile] = frozenset(),
        is_plain: bool = False,
        deadline: float = 30.0,
    ) -> Callable[[JudgeT], JudgeT]:
        """Add a check of the tables of clauses; see `Check`.

        Raises:
            ValueError: the number is taken, is the other role's, or stands in no table.
        """
        if number in self._checks or number[1] != self._role.value:
            kind = self._role.name.lower()
            raise ValueError(f"{number} is taken, or no number of a check on {kind}s")
        title, clause = clause_of(number)

        def register(judge: JudgeT) -> JudgeT:
            self._checks[number] = Check(
                number, title, clause, judge, moves, profiles, is_plain, deadline
            )
            return judge

        return register

    def in_order(self, sections: Iterable[Section]) -> tuple[Check[JudgeT], ...]:
        """Return the checks section by section, by number."""
        place = {section: index for index, section in enumerate(sections)}
        return tuple(
            sorted(self._checks.values(), key=lambda check: (place[check.section], check.number))
        )


@dataclass(frozen=True, slots=True)
class Result:
    """A check with its finding."""

    check: Check[Any]
    finding: CheckFinding
    seconds: float = 0.0


@dataclass(frozen=True, slots=True)
class Judgement:
    """All results of one run.

    Attributes:
        subject: who was judged, e.g. `server 127.0.0.1:12000`.
        role: `server` or `client`: which end was judged.
    """

    subject: str
    role: str
    results: tuple[Result, ...]

    def count(self, verdict: CheckVerdict) -> int:
        """Return how many checks ended in a verdict."""
        return sum(result.finding.verdict is verdict for result in self.results)
