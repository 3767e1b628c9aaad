"""Findings of checks: verdict and observation, used by both roles.

Knows no sockets, no messages and no clock.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum


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
        verdict: how it ended.
        detail: what was seen, with numbers; why, where it is not applicable.
        habit: name of the known vendor habit, where it deviates.
    """

    verdict: CheckVerdict
    detail: str = ""
    habit: str = ""


PASSED = CheckFinding(CheckVerdict.PASSED)


def failed(detail: str) -> CheckFinding:
    """Return the finding of a broken rule; `detail` says what was seen instead."""
    return CheckFinding(CheckVerdict.FAILED, detail)


def deviates(habit: str, detail: str) -> CheckFinding:
    """Return the finding of a known vendor habit, named."""
    return CheckFinding(CheckVerdict.DEVIATES, detail, habit)


def not_applicable(reason: str) -> CheckFinding:
    """Return the finding of a check that could not look."""
    return CheckFinding(CheckVerdict.NOT_APPLICABLE, reason)
