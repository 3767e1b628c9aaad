"""Referee: a record of everything that a correct sender would not have done.

Owns counting and reporting. It judges nothing itself, so that what is refused and what is recorded
cannot differ. Bounded memory: the first violations in full, all of them counted.
"""

from __future__ import annotations

import math
from collections import Counter
from typing import NamedTuple

from ..error_codes import ViolationKind


class Violation(NamedTuple):
    """One violation of a sender.

    Attributes:
        joint: name of the joint, empty where it is no joint's fault.
        value: what was asked for [SI units of the kind].
        time: since the controller started [s].
    """

    kind: ViolationKind
    joint: str
    value: float
    limit: float
    sequence: int
    time: float
    link: int

    def as_dict(self) -> dict[str, object]:
        """Return the violation as JSON knows it; a non-finite value becomes text."""
        return {
            "kind": self.kind.value,
            "joint": self.joint,
            "value": _finite_or_text(self.value),
            "limit": _finite_or_text(self.limit),
            "sequence": self.sequence,
            "time": round(self.time, 6),
            "link": self.link,
        }

    def __str__(self) -> str:
        joint = f" {self.joint}" if self.joint else ""
        return (
            f"{self.time:.3f} s, link {self.link}, point {self.sequence}:"
            f" {self.kind.value}{joint} {self.value!r}, limit {self.limit!r}"
        )


class Referee:
    """Record of the violations and events of one run.

    Attributes:
        kept: the first violations, in full.
        events: how many other things happened, such as `points-accepted`.
    """

    def __init__(self, keep: int = 100) -> None:
        self._keep = keep
        self.kept: list[Violation] = []
        self.counts: Counter[ViolationKind] = Counter()
        self.events: Counter[str] = Counter()

    @property
    def total(self) -> int:
        """Number of violations."""
        return self.counts.total()

    def note(self, violation: Violation) -> None:
        """Record a violation."""
        self.counts[violation.kind] += 1
        if len(self.kept) < self._keep:
            self.kept.append(violation)

    def count(self, event: str, times: int = 1) -> None:
        """Count an event that is no violation."""
        if times:
            self.events[event] += times

    def as_dict(self) -> dict[str, object]:
        """Return the whole record as JSON knows it."""
        return {
            "violations": self.total,
            "by_kind": {kind.value: self.counts[kind] for kind in ViolationKind},
            "first": [violation.as_dict() for violation in self.kept],
            "events": dict(sorted(self.events.items())),
        }

    def __str__(self) -> str:
        lines = [f"referee: {self.total} violations"]
        lines += [f"  {kind.value}: {count}" for kind, count in sorted(self.counts.items())]
        lines += [f"  {violation}" for violation in self.kept]
        if self.total > len(self.kept):
            lines.append(f"  and {self.total - len(self.kept)} more")
        lines += [f"  {event}: {count}" for event, count in sorted(self.events.items())]
        return "\n".join(lines)


def _finite_or_text(value: float) -> float | str:
    return value if math.isfinite(value) else str(value)
