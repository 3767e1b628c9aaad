"""What a dry run found about the open program: which points can be reached, and how long it takes.

Owns the reading of the server's answer. Which program and revision it is about is part of it: what
was found about another revision says nothing of this one.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, TypeVar

from openpendant.simplemsg.verdicts import VerdictCode

from .screen_units import in_screen_units

REACHABLE = ""
"""Stands where a refusal would, for what can be reached."""

_Key = TypeVar("_Key")


@dataclass(frozen=True, slots=True)
class DryRun:
    """The findings of one dry run.

    Attributes:
        name: of the program.
        revision: that was walked.
        duration: of the program [s].
        is_endless: whether a loop of it never ends, so that the duration is of two passes.
        is_complete: whether every branch was walked to its end.
        is_checked: whether every signal of it was looked up at the controller.
        is_refused: whether some move cannot be run, or some point not be reached.
        elsewhere: refusals in programs that this one calls, each with its place.
    """

    name: str
    revision: int
    duration: float
    is_endless: bool
    is_complete: bool
    is_checked: bool
    is_refused: bool
    elsewhere: tuple[str, ...]
    _lines: Mapping[int, str]
    _points: Mapping[str, str]

    @classmethod
    def read(cls, name: str, revision: int, answer: dict[str, Any]) -> DryRun:
        """Read the answer to `programs.dry_run`.

        Args:
            name: of the program.
            revision: that it had before and after.
            answer: the JSON object.
        """
        steps: list[dict[str, Any]] = [
            *answer["moves"],
            *answer["scene"],
            *(step for step in answer["statements"] if not step["reachable"]),
        ]
        own = [step for step in steps if step["program"] == name]
        called = [step for step in steps if step["program"] != name and not step["reachable"]]
        return cls(
            name,
            revision,
            float(answer["duration"]),
            bool(answer["endless"]),
            bool(answer["complete"]),
            not answer["unchecked"],
            bool(answer["refused"]),
            tuple(f"{each['program']} line {each['line']}: {_refusal(each)}" for each in called),
            _worst((int(step["line"]), _refusal(step)) for step in own),
            _worst((str(point["point"]), _refusal(point)) for point in answer["points"]),
        )

    def refusal(self, line: int, point: str) -> str | None:
        """Return why a statement cannot be run; `REACHABLE`, or None where nothing was told of it.

        Args:
            line: of the statement in the program's text.
            point: that it moves to; empty for none.
        """
        return self._lines.get(line) or self._points.get(point, self._lines.get(line))

    @property
    def summary(self) -> str:
        """The findings in a few words."""
        passes = " for two passes of its endless loop" if self.is_endless else ""
        partly = "" if self.is_complete else ", not every branch was walked"
        partly += "" if self.is_checked else ", its signals are not known yet"
        if self.is_refused:
            return (
                f"dry run: REFUSED, {self.duration:.1f} s without what is refused{passes}{partly}"
            )
        return f"dry run: all reachable, {self.duration:.1f} s{passes}{partly}"


def _worst(verdicts: Iterable[tuple[_Key, str]]) -> dict[_Key, str]:
    """Return one verdict for each key: a refusal before none."""
    worst: dict[_Key, str] = {}
    for key, refusal in verdicts:
        worst[key] = worst.get(key) or refusal
    return worst


def _refusal(verdict: dict[str, Any]) -> str:
    """Return why something is refused, in degrees and millimetres; `REACHABLE` where it is not."""
    if verdict["reachable"]:
        return REACHABLE
    code = verdict["code"]
    name = VerdictCode(code).name if code in set(VerdictCode) else str(code)
    # The place, which a move's text begins with, is known from where it is shown.
    place = f"{verdict.get('program')}, line {verdict.get('line')}, point {verdict.get('point')}: "
    return f"{name}: {in_screen_units(verdict['text'].removeprefix(place))}"
