"""A stretch of a slowed-down run in which its scale changes evenly: plain arithmetic of one phase.

Owns how far the run comes in it. Which phase follows which is told by `time_scaling`.
"""

from __future__ import annotations

from typing import NamedTuple


class Phase(NamedTuple):
    """A time of constant dσ/dt.

    Attributes:
        begin: when, from the start of the run [s].
        time: τ then [s].
        scale: σ then.
        rate: dσ/dt [1/s].
        lasts: how long [s]; infinite if nothing will change.
    """

    begin: float
    time: float
    scale: float
    rate: float
    lasts: float

    def at(self, elapsed: float) -> tuple[float, float]:
        """Return τ and σ after a time in this phase [s]."""
        scale = max(self.scale + self.rate * elapsed, 0.0)
        return self.time + 0.5 * (self.scale + scale) * elapsed, scale
