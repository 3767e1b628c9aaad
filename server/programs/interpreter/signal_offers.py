"""Signals that a controller offers to programs, and the refusals of missing ones."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeAlias

from openpendant.simplemsg.verdicts import VerdictCode

from ...refusal import Refusal

SignalKind: TypeAlias = Literal["input", "output"]


@dataclass(frozen=True, slots=True)
class OfferedSignals:
    """Numbers of signals; they are numbered from 0."""

    inputs: int
    outputs: int

    def absent(self, kind: SignalKind, signal: int) -> Refusal | None:
        """Return the reason why there is no such signal; None if there is one."""
        count = self.inputs if kind == "input" else self.outputs
        if 0 <= signal < count:
            return None
        accepted = f"0 to {count - 1}" if count else "none, there is not one"
        text = f"{kind} {signal}; accepted: {accepted}"
        return Refusal(VerdictCode.NO_SIGNAL, text, value=signal, limit=count - 1)


Offer: TypeAlias = OfferedSignals | Refusal | None
"""Signals that a controller offers; or why it offers none; None while that is unknown."""
