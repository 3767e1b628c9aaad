"""Table of benchmarks: their measurement and output.

The figure of one run says little on a shared machine; a ratio of two sides measured in turns says
more. Therefore each repetition takes one sample of the subject and one of its baseline, in
alternating order, and the ratio is the median of the repetitions' ratios.
"""

from __future__ import annotations

import statistics
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from dataclasses import asdict, dataclass
from enum import Enum
from typing import Any

Sample = Callable[[], float]
"""Takes one measurement and returns it in the benchmark's unit."""


class MissingRequirement(Exception):
    """Something that a benchmark needs is not installed; the text names it."""


@dataclass(frozen=True, slots=True)
class Sides:
    """Both sides of a benchmark."""

    subject: Sample
    baseline: Sample | None = None


class Judged(Enum):
    """Kind of figure that a bound applies to."""

    RATIO = "ratio to the baseline"
    VALUE = "median itself"


@dataclass(frozen=True, slots=True)
class Bound:
    """The largest accepted figure.

    Attributes:
        aim: the target for a later version; None without one.
    """

    most: float
    aim: float | None = None
    judged: Judged = Judged.RATIO


@dataclass(frozen=True, slots=True)
class Benchmark:
    """One row of the table.

    Attributes:
        name: short, unique, the first word naming what it is about.
        prepare: opens what both sides need (servers, files), yields the sides, and closes it.
        bound: None for a figure that is only shown.
        repetitions: samples of each side; a quick run takes a third of them.
    """

    name: str
    unit: str
    prepare: Callable[[], AbstractContextManager[Sides]]
    bound: Bound | None = None
    repetitions: int = 15


@dataclass(frozen=True, slots=True)
class BenchmarkResult:
    """Measured figures of one benchmark.

    Attributes:
        median: of the subject's samples.
        baseline: median of the baseline's samples, None without a baseline.
        ratio: median of the ratios, None without a baseline.
        bound: largest accepted figure, None where there is none.
        aim: the target for a later version.
        judged: the figure that `bound` applies to.
        verdict: "ok", "over", or "" where there is no bound.
    """

    name: str
    median: float
    unit: str
    baseline: float | None
    ratio: float | None
    bound: float | None
    aim: float | None
    judged: str
    verdict: str


def measure(benchmark: Benchmark, quick: bool = False) -> BenchmarkResult:
    """Run one benchmark."""
    repetitions = benchmark.repetitions
    if quick:
        repetitions = min(repetitions, max(3, repetitions // 3))
    with benchmark.prepare() as sides:
        subject, baseline = _interleaved(sides, repetitions)
    median = statistics.median(subject)
    ratio = None
    if baseline:
        ratio = statistics.median(s / b for s, b in zip(subject, baseline, strict=True))
    bound = benchmark.bound
    return BenchmarkResult(
        name=benchmark.name,
        median=median,
        unit=benchmark.unit,
        baseline=statistics.median(baseline) if baseline else None,
        ratio=ratio,
        bound=None if bound is None else bound.most,
        aim=None if bound is None else bound.aim,
        judged="" if bound is None else bound.judged.value,
        verdict=_verdict(bound, median, ratio),
    )


def _interleaved(sides: Sides, repetitions: int) -> tuple[list[float], list[float]]:
    samples: tuple[list[float], list[float]] = ([], [])
    order = [(sides.subject, samples[0])]
    if sides.baseline is not None:
        order.append((sides.baseline, samples[1]))
    for sample, _ in order:
        sample()  # warms caches up
    for _ in range(repetitions):
        for sample, into in order:
            into.append(sample())
        order.reverse()
    return samples


def _verdict(bound: Bound | None, median: float, ratio: float | None) -> str:
    if bound is None:
        return ""
    figure = median if bound.judged is Judged.VALUE else ratio
    if figure is None:
        raise ValueError("a bound on the ratio needs a baseline")
    return "ok" if figure <= bound.most else "over"


def render(rows: Sequence[BenchmarkResult]) -> str:
    """Return the rows as a table of plain text."""
    heading = ("name", "median", "unit", "baseline", "ratio", "bound", "aim", "")
    return aligned([heading, *(_cells(row) for row in rows)], left=(0, 2))


def aligned(rows: Sequence[tuple[str, ...]], left: Sequence[int]) -> str:
    """Return rows of cells in columns: those of `left` are text, all others figures."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return "\n".join(
        "  ".join(
            cell.ljust(width) if at in left else cell.rjust(width)
            for at, (cell, width) in enumerate(zip(row, widths, strict=True))
        ).rstrip()
        for row in rows
    )


def _cells(row: BenchmarkResult) -> tuple[str, ...]:
    limit_unit = f" {row.unit}" if row.judged == Judged.VALUE.value else ""
    return (
        row.name,
        figure(row.median),
        row.unit,
        figure(row.baseline),
        "" if row.ratio is None else f"{row.ratio:.2f}",
        "" if row.bound is None else f"{row.bound:g}{limit_unit}",
        "" if row.aim is None else f"{row.aim:g}{limit_unit}",
        row.verdict,
    )


def figure(value: float | None) -> str:
    """Return a figure with its significant digits; empty for None."""
    if value is None:
        return ""
    return f"{value:.0f}" if abs(value) >= 100 else f"{value:.3g}"


def as_json(rows: Sequence[BenchmarkResult]) -> list[dict[str, Any]]:
    """Return the rows as JSON objects."""
    return [asdict(row) for row in rows]
