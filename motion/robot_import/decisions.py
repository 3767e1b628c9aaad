"""Facts that a description leaves open: asked for, assumed aloud, or refused.

Owns the record of where each fact of a new robot came from. What is asked and what is assumed is
`configuration`'s; how a person is asked and told is the caller's.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from typing import TypeAlias, TypeVar

from ..errors import BadArgument, RobotFileError

_Value = TypeVar("_Value")

Ask: TypeAlias = Callable[[str, str], str]
"""Asks a person: the question, and what no answer (an empty string) will mean."""


class Step(StrEnum):
    """The first paper's four steps of configuring a new robot."""

    MODEL = "1 model"
    PLANNING = "2 planning"
    CONTROLLER = "3 controller"
    PENDANT = "4 pendant"


class Outcome(StrEnum):
    """Where a fact came from."""

    DONE = "done"  # the description or an option states it, or it follows from what they state
    ASKED = "asked"
    DEFAULTED = "defaulted"


@dataclass(frozen=True, slots=True)
class Finding:
    """One fact of the new robot: `item` says which, `detail` what it is and why."""

    step: Step
    outcome: Outcome
    item: str
    detail: str


@dataclass(frozen=True, slots=True)
class Question:
    """A fact that is missing: what to ask, and the rule by which it is assumed otherwise."""

    step: Step
    item: str
    text: str
    rule: str


class Decisions:
    """Decides open facts, one after the other, and tells of each.

    Args:
        file: the description's name, for messages.
        tell: called with every finding as it is made.
        ask: asks a person; None to assume what is missing.
        strict: refuse what is missing, all of it at the end, instead of asking or assuming.
    """

    def __init__(
        self, file: str, tell: Callable[[Finding], None], ask: Ask | None, strict: bool
    ) -> None:
        self._file = file
        self._tell = tell
        self._ask = None if strict else ask
        self._strict = strict
        self._missing: list[tuple[str, str]] = []
        self.assumptions: list[str] = []

    def done(self, step: Step, item: str, detail: str) -> None:
        """Record a fact that is stated or follows."""
        self._tell(Finding(step, Outcome.DONE, item, detail))

    def assumed(self, step: Step, item: str, detail: str) -> None:
        """Record a fact that is assumed without a question worth asking."""
        self.assumptions.append(f"assumed: {item}: {detail}")
        self._tell(Finding(step, Outcome.DEFAULTED, item, detail))

    def decide(
        self,
        question: Question,
        default: _Value,
        show: Callable[[_Value], str],
        parse: Callable[[str], _Value],
    ) -> _Value:
        """Return what a person answers, or the default.

        Args:
            question: what is missing.
            default: the value assumed.
            show: puts a value into words.
            parse: reads an answer; raises `BadArgument` on one that is not accepted.
        """
        if self._strict:
            self._missing.append((question.item, f"is missing; accepted: {question.text}"))
            return default
        answer = self._answer(question, default, show, parse)
        if answer is None:
            self.assumed(question.step, question.item, f"{show(default)} ({question.rule})")
            return default
        self._tell(Finding(question.step, Outcome.ASKED, question.item, show(answer)))
        return answer

    def finish(self) -> None:
        """End the configuration.

        Raises:
            RobotFileError: something was missing and nothing may be assumed.
        """
        if self._missing:
            (field, problem), *more = self._missing
            raise RobotFileError(self._file, field, problem, tuple(more))

    def _answer(
        self,
        question: Question,
        default: _Value,
        show: Callable[[_Value], str],
        parse: Callable[[str], _Value],
    ) -> _Value | None:
        if self._ask is None:
            return None
        text = f"{question.item}: {question.text}"
        while typed := self._ask(text, show(default)).strip():
            try:
                return parse(typed)
            except BadArgument as error:
                text = f"{error}. {question.item}: {question.text}"
        return None
