"""What a check says and what it found; the common ground of both roles and of every report.

Knows no sockets, no messages and no clock.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum


class Verdict(Enum):
    """How a check ended. A check that did not look never says PASSED."""

    PASSED = "passed"
    FAILED = "failed"
    DEVIATES = "deviates"
    NOT_APPLICABLE = "not applicable"


class Section(Enum):
    """What a check is about; the first letter of its number."""

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
class CheckInfo:
    """A check's identity, the same in every report of every version.

    Attributes:
        number: section letter, role letter (S judges servers, C judges clients) and two digits,
            e.g. `FS03`; never reused.
        title: what must hold, as a sentence.
        clause: what gives it reason: a clause, a REP, or behaviour observed of a named program.
        section: what it is about.
        moves: it can only be judged by moving the robot.
    """

    number: str
    title: str
    clause: str
    section: Section
    moves: bool = False


@dataclass(frozen=True, slots=True)
class Finding:
    """What one check found.

    Attributes:
        verdict: how it ended.
        detail: what was seen, with numbers; why, where it is not applicable.
        habit: name of the known vendor habit, where it deviates.
    """

    verdict: Verdict
    detail: str = ""
    habit: str = ""


PASSED = Finding(Verdict.PASSED)


def failed(detail: str) -> Finding:
    """Return the finding of a broken rule; `detail` says what was seen instead."""
    return Finding(Verdict.FAILED, detail)


def deviates(habit: str, detail: str) -> Finding:
    """Return the finding of a known vendor habit, named."""
    return Finding(Verdict.DEVIATES, detail, habit)


def not_applicable(reason: str) -> Finding:
    """Return the finding of a check that could not look."""
    return Finding(Verdict.NOT_APPLICABLE, reason)


@dataclass(frozen=True, slots=True)
class Result:
    """A check with its finding.

    Attributes:
        check: what was judged.
        finding: what was found.
        seconds: how long it took [s].
    """

    check: CheckInfo
    finding: Finding
    seconds: float = 0.0


@dataclass(frozen=True, slots=True)
class Judgement:
    """All results of one run.

    Attributes:
        subject: who was judged, e.g. `server 127.0.0.1:12000`.
        role: `server` or `client`: which end was judged.
        results: in the order in which they were found.
    """

    subject: str
    role: str
    results: tuple[Result, ...]

    def count(self, verdict: Verdict) -> int:
        """Return how many checks ended in a verdict."""
        return sum(result.finding.verdict is verdict for result in self.results)
