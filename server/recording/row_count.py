"""What is counted of a recording's rows: how many, how long, at which rate, with which gaps.

Owns what duration and rate are; whoever passes rows on, while they are recorded or afterwards,
counts by it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any


@dataclass(slots=True)
class RowCount:
    """What was counted of rows so far, taken in order.

    Attributes:
        rows: how many.
        first: time of the first [s].
        last: time of the last [s].
        gaps: between rows.
        longest_gap: the longest of them [s].
        in_gaps: time spent in them [s].
    """

    rows: int = 0
    first: float = 0.0
    last: float = 0.0
    gaps: int = 0
    longest_gap: float = 0.0
    in_gaps: float = 0.0

    @property
    def duration(self) -> float:
        """From the first to the last row [s]."""
        return self.last - self.first

    @property
    def rate(self) -> float:
        """Rows a second, gaps left out [Hz]; 0 where there are too few to tell."""
        steps = self.rows - 1 - self.gaps
        covered = self.duration - self.in_gaps
        return steps / covered if steps > 0 and covered > 0.0 else 0.0

    @property
    def fields(self) -> dict[str, Any]:
        """The fields of a recording's description that say it."""
        return {
            "samples": self.rows,
            "duration": self.duration,
            "rate": self.rate,
            "gaps": self.gaps,
            "longest_gap": self.longest_gap,
        }

    def take(self, time: float, *, after_gap: bool = False) -> None:
        """Count the next row.

        Args:
            time: of the row [s].
            after_gap: whether a gap lies before it; before the first row there is none.
        """
        if not self.rows:
            self.first = time
        elif after_gap:
            gap = time - self.last
            self.gaps += 1
            self.longest_gap = max(self.longest_gap, gap)
            self.in_gaps += gap
        self.rows += 1
        self.last = time

    def take_more(self, rows: int, last: float) -> None:
        """Count rows that follow one that was taken, without a gap.

        Args:
            rows: how many.
            last: time of the last of them [s]; without meaning where there are none.
        """
        if rows:
            self.rows += rows
            self.last = last
