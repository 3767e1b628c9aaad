"""Decisions on facts that a description leaves open: asked for, assumed with a report, or refused.

Owns the record of the source of each fact of a new robot; the values assumed for a joint that is
not fully described, by the rules that `docs/robots.md` lists; and the text form of such values:
screens use degrees and millimetres, and a text that is not accepted raises `BadArgument`. The
assumptions are cautious: a robot is moved slower than it could be, never faster than stated
anywhere. The questions, and their place, are `new_robot`'s; the dialogue with a person is the
caller's.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from typing import TypeAlias, TypeVar

from ..errors import BadArgument, RobotFileError
from .imported_chain import ImportedJoint

RAMP = 0.5
"""Time to full speed [s] where accelerations are not stated: acceleration = velocity / ramp."""


@dataclass(frozen=True, slots=True)
class AssumedLimits:
    """Range and speed [rad or m, s], and the rule in words."""

    lower: float
    upper: float
    velocity: float
    rule: str


REVOLUTE = AssumedLimits(-math.pi, math.pi, 1.0, "half a turn to either side")
CONTINUOUS = AssumedLimits(
    -2.0 * math.pi, 2.0 * math.pi, 1.0, "it turns without end; a turn to either side"
)
PRISMATIC = AssumedLimits(0.0, 1.0, 0.25, "a metre from its zero")


def assumed_limits(joint: ImportedJoint) -> AssumedLimits:
    """Return the assumed limits of a driven joint."""
    if joint.unit == "m":
        return PRISMATIC
    return CONTINUOUS if joint.continuous else REVOLUTE


def on_screen(value: float, unit: str) -> str:
    """Return a value [rad or m] in degrees or millimetres, with its unit."""
    return f"{1000.0 * value:zg} mm" if unit == "m" else f"{math.degrees(value):zg}°"


def typed_range(text: str, unit: str) -> tuple[float, float]:
    """Return two values in degrees or millimetres, the first less, as a range [rad or m]."""
    values = typed_values(text, (unit, unit))
    if not values[0] < values[1]:
        raise BadArgument("range", text, "the least value, then the greatest")
    return values[0], values[1]


def typed_rate(text: str, unit: str) -> float:
    """Return a rate above 0 per second, in degrees or millimetres, as [rad/s or m/s]."""
    (value,) = typed_values(text, (unit,))
    if not value > 0.0:
        raise BadArgument("speed", text, "more than 0")
    return value


def typed_values(text: str, units: tuple[str, ...]) -> tuple[float, ...]:
    """Return a finite number per unit, separated by spaces or commas, as [rad or m]."""
    accepted = f"{len(units)} finite numbers" if len(units) > 1 else "a finite number"
    try:
        values = [float(part) for part in text.replace(",", " ").split()]
    except ValueError:
        raise BadArgument("answer", text, accepted) from None
    if len(values) != len(units) or not all(map(math.isfinite, values)):
        raise BadArgument("answer", text, accepted)
    return tuple(
        value / 1000.0 if unit == "m" else math.radians(value)
        for value, unit in zip(values, units, strict=True)
    )


_Value = TypeVar("_Value")

Ask: TypeAlias = Callable[[str, str], str]
"""Asks a person: the question, and the meaning of no answer (an empty string)."""


class ImportStep(StrEnum):
    """The first paper's four steps of configuring a new robot."""

    MODEL = "1 model"
    PLANNING = "2 planning"
    CONTROLLER = "3 controller"
    PENDANT = "4 pendant"


class FactSource(StrEnum):
    """Source of a fact."""

    DONE = "done"  # the description or an option states it, or it follows from what they state
    ASKED = "asked"
    DEFAULTED = "defaulted"


@dataclass(frozen=True, slots=True)
class ImportedFact:
    """Fact of the new robot: its name in `item`, its value and source in `detail`."""

    step: ImportStep
    outcome: FactSource
    item: str
    detail: str


@dataclass(frozen=True, slots=True)
class MissingFact:
    """Fact that is missing: the question, and the rule of the assumption otherwise."""

    step: ImportStep
    item: str
    text: str
    rule: str


class Decisions:
    """Decisions on open facts, one after the other, with a report of each.

    Args:
        tell: called with every finding as it is made.
        ask: asks a person; None to assume what is missing.
        strict: refuse what is missing, all of it at the end, instead of asking or assuming.
    """

    def __init__(
        self, file: str, tell: Callable[[ImportedFact], None], ask: Ask | None, strict: bool
    ) -> None:
        self._file = file
        self._tell = tell
        self._ask = None if strict else ask
        self._strict = strict
        self._missing: list[tuple[str, str]] = []
        self.assumptions: list[str] = []

    def done(self, step: ImportStep, item: str, detail: str) -> None:
        """Record a fact that is stated or follows."""
        self._tell(ImportedFact(step, FactSource.DONE, item, detail))

    def assumed(self, step: ImportStep, item: str, detail: str) -> None:
        """Record a fact that is assumed without a question worth asking."""
        self.assumptions.append(f"assumed: {item}: {detail}")
        self._tell(ImportedFact(step, FactSource.DEFAULTED, item, detail))

    def decide(
        self,
        question: MissingFact,
        default: _Value,
        show: Callable[[_Value], str],
        parse: Callable[[str], _Value],
    ) -> _Value:
        """Return a person's answer, or the default; `parse` refuses an answer by `BadArgument`."""
        if self._strict:
            self._missing.append((question.item, f"is missing; accepted: {question.text}"))
            return default
        text = f"{question.item}: {question.text}"
        while self._ask is not None and (typed := self._ask(text, show(default)).strip()):
            try:
                answer = parse(typed)
            except BadArgument as error:
                text = f"{error}. {question.item}: {question.text}"
                continue
            self._tell(ImportedFact(question.step, FactSource.ASKED, question.item, show(answer)))
            return answer
        self.assumed(question.step, question.item, f"{show(default)} ({question.rule})")
        return default

    def finish(self) -> None:
        """End the configuration; `RobotFileError` if something missing may not be assumed."""
        if self._missing:
            (field, problem), *more = self._missing
            raise RobotFileError(self._file, field, problem, tuple(more))
