"""Comparison of two commits, row by row: medians, quartiles, their ratio, and its verdict.

Owns when a row counts as worse. Knows nothing of processes and of git.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from enum import Enum
from typing import Any

from .table import aligned, figure

TOLERANCE = 0.03
"""A row that is worse by no more than this share is as good."""


class RowVerdict(Enum):
    """Result of comparing a row."""

    WORSE = "worse"
    SAME = "same"
    BETTER = "better"
    NEW = "new"
    LEFT_OUT = "left out"
    FAILED = "not measured"

    @property
    def is_failure(self) -> bool:
        """True if such a row makes the comparison fail."""
        return self in (RowVerdict.WORSE, RowVerdict.FAILED)


@dataclass(frozen=True, slots=True)
class Quartiles:
    """The quartiles of some figures."""

    first: float
    median: float
    third: float

    @property
    def spread(self) -> float:
        """From the first to the third."""
        return 0.0 if self.first == self.third else self.third - self.first


@dataclass(frozen=True, slots=True)
class Comparison:
    """A row of both commits.

    Attributes:
        base: of the earlier commit; None where it has no such row.
        head: of the later one; None where it was not measured.
        ratio: of the later figure to the earlier one, in each turn; None where one is missing.
    """

    name: str
    unit: str
    base: Quartiles | None
    head: Quartiles | None
    ratio: Quartiles | None
    verdict: RowVerdict


def compare(
    name: str, unit: str, base: Sequence[float | None], head: Sequence[float | None]
) -> Comparison:
    """Judge a row.

    It is worse where the median of the turns' ratios is above 1 by more than `TOLERANCE`, and by
    more than the spread between the ratios' quartiles. Ratios within a turn are judged, not medians
    over all turns, because what else the machine does changes from turn to turn.

    Args:
        name: of the benchmark.
        unit: of the figures, of which smaller ones are better.
        base: figures of the earlier commit, one a turn; None where a turn has none.
        head: the same of the later commit.
    """
    before = [value for value in base if value is not None]
    after = [value for value in head if value is not None]
    ratio = None
    if len(before) == len(base) and len(after) == len(head):
        ratio = quartiles([_ratio(*pair) for pair in zip(after, before, strict=True)])
        verdict = judge(ratio)
    elif not before:
        # Neither has it where a library that it needs is not installed.
        verdict = RowVerdict.NEW if after else RowVerdict.LEFT_OUT
    else:
        verdict = RowVerdict.FAILED
    return Comparison(
        name=name,
        unit=unit,
        base=quartiles(before) if before else None,
        head=quartiles(after) if after else None,
        ratio=ratio,
        verdict=verdict,
    )


def judge(ratio: Quartiles) -> RowVerdict:
    """Return the verdict on the ratios of the later figures to the earlier ones."""
    least = max(TOLERANCE, ratio.spread)
    if ratio.median - 1 > least:
        return RowVerdict.WORSE
    return RowVerdict.BETTER if 1 - ratio.median > least else RowVerdict.SAME


def quartiles(figures: Sequence[float]) -> Quartiles:
    """Return the quartiles of one figure or more, interpolated between those that there are."""
    ordered = sorted(figures)
    return Quartiles(_at(ordered, 0.25), _at(ordered, 0.5), _at(ordered, 0.75))


def _at(ordered: Sequence[float], share: float) -> float:
    place = share * (len(ordered) - 1)
    below, above = ordered[math.floor(place)], ordered[math.ceil(place)]
    return below if below == above else below + (above - below) * (place - math.floor(place))


def _ratio(later: float, earlier: float) -> float:
    if earlier:
        return later / earlier
    return math.inf if later else 1.0


def render(comparisons: Sequence[Comparison]) -> str:
    """Return the comparisons as a table of plain text."""
    heading = ("name", "unit", "base", "quartiles", "now", "quartiles", "ratio", "quartiles", "")
    rows = [heading, *(_cells(each) for each in comparisons)]
    return aligned(rows, left=(0, 1))


def _cells(row: Comparison) -> tuple[str, ...]:
    ratio = ("", "")
    if row.ratio is not None:
        ratio = f"{row.ratio.median:.3f}", f"{row.ratio.first:.3f}-{row.ratio.third:.3f}"
    shown = row.verdict.value if row.verdict is not RowVerdict.SAME else ""
    return (row.name, row.unit, *_figures(row.base), *_figures(row.head), *ratio, shown)


def _figures(found: Quartiles | None) -> tuple[str, str]:
    if found is None:
        return "", ""
    return figure(found.median), f"{figure(found.first)}-{figure(found.third)}"


def as_json(comparisons: Sequence[Comparison]) -> list[dict[str, Any]]:
    """Return the comparisons as JSON objects; an infinite ratio is null."""
    rows = [asdict(each) for each in comparisons]
    for row in rows:
        row["verdict"] = row["verdict"].value
        if row["ratio"] is not None:
            row["ratio"] = {
                name: value if math.isfinite(value) else None
                for name, value in row["ratio"].items()
            }
    return rows
