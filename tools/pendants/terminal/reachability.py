"""Findings of a dry run of the open program: reachable points and duration.

Owns the parsing of the server's answer. The findings name their program and revision, because those
about another revision are not valid for this one.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, TypeVar

from openpendant.simplemsg.verdicts import VerdictCode

from .wording import in_screen_units

REACHABLE = ""
"""Stands where a refusal would, for what can be reached."""

_Key = TypeVar("_Key")


@dataclass(frozen=True, slots=True)
class DryRunFindings:
    """The findings of one dry run.

    Attributes:
        name: of the program.
        revision: the checked revision.
        duration: of the program [s].
        is_endless: a loop of it never ends, so the duration is that of two passes.
        is_complete: every branch was run to its end.
        is_checked: every signal of it was checked against the controller's signals.
        is_refused: a move cannot be run, or a point cannot be reached.
        elsewhere: refusals in called programs, each with its place.
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
    def read(cls, name: str, revision: int, answer: dict[str, Any]) -> DryRunFindings:
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
        """Return why a statement cannot run; `REACHABLE` if it can, None if that is not known.

        Args:
            line: of the statement in the program's text.
            point: target of its move; empty for none.
        """
        return self._lines.get(line) or self._points.get(point, self._lines.get(line))

    @property
    def summary(self) -> str:
        """The findings in one line."""
        passes = " for two passes of its endless loop" if self.is_endless else ""
        partly = "" if self.is_complete else ", not every branch was walked"
        partly += "" if self.is_checked else ", its signals are not known yet"
        if self.is_refused:
            return (
                f"dry run: REFUSED, {self.duration:.1f} s without what is refused{passes}{partly}"
            )
        return f"dry run: all reachable, {self.duration:.1f} s{passes}{partly}"


def _worst(verdicts: Iterable[tuple[_Key, str]]) -> dict[_Key, str]:
    """Return one verdict for each key; a refusal replaces an acceptance."""
    worst: dict[_Key, str] = {}
    for key, refusal in verdicts:
        worst[key] = worst.get(key) or refusal
    return worst


def _refusal(verdict: dict[str, Any]) -> str:
    """Return the refusal in degrees and millimetres; `REACHABLE` where there is none."""
    if verdict["reachable"]:
        return REACHABLE
    code = verdict["code"]
    name = VerdictCode(code).name if code in set(VerdictCode) else str(code)
    # The place, which a move's text begins with, is known from where it is shown.
    place = f"{verdict.get('program')}, line {verdict.get('line')}, point {verdict.get('point')}: "
    return f"{name}: {in_screen_units(verdict['text'].removeprefix(place))}"
