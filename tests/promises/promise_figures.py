"""Delays that were measured, whether each of them counts, and how they are judged.

Owns when a sample is void: an idle process of the server's priority was kept waiting meanwhile, by
more than the table of promises allows. What is void is told and measured again; where it is more
than a share of a run, the whole run is.
"""

import atexit
import sys
from functools import cache

import pytest
from promises.promise_table import COMMON, Figure, figure
from rigs.clock.busy_machine import SCALE
from rigs.clock.stall_watch import StallWatch

SLACK = figure(COMMON, "slack").bound
"""Times the bound in `make test`, where a few trials run on a machine that does other things."""

FEW = figure(COMMON, "few").count
"""Trials in `make test`."""

LATE = figure(COMMON, "idle").seconds
"""An idle process that waited for so much longer than it asked makes a sample void [s]."""

VOID_SHARE = figure(COMMON, "void_share").bound / 100.0
REPEATS = figure(COMMON, "repeats").count

_ENOUGH = 120
"""Of so many trials the 99th percentile is not the greatest."""


@cache
def idle_watch() -> StallWatch:
    """Return the idle process that all figures of this process are held against."""
    watch = StallWatch()
    atexit.register(watch.end)
    return watch


def trials_of(promised: Figure) -> list[object]:
    """Return the parameters `trials` and `slack` of a test: few of them, and in the soak all."""
    return [
        pytest.param(FEW, SLACK, id="few"),
        pytest.param(promised.trials, 1.0, id="many", marks=pytest.mark.soak),
    ]


class Figures:
    """Delays of one kind [ms], and those of the idle control in the same run.

    Attributes:
        name: what was measured.
        delays: those that count.
        idle: of the idle control.
        void: how many did not count.
    """

    def __init__(self, name: str, watch: StallWatch | None = None) -> None:
        """Begin a run; all share one idle process unless the test brings its own."""
        self.name = name
        self.delays: list[float] = []
        self.idle: list[float] = []
        self.void = 0
        self._watch = watch or idle_watch()
        self._spans: dict[int, tuple[float, float]] = {}
        self._repeats = 0

    def take(self, began: int, *delays: float) -> None:
        """Take delays [ms] that were measured from a time of the monotonic clock [ns] until now."""
        now = self._watch.now()
        for delay in delays:
            self._spans[len(self.delays)] = (began / 1e9, now)
            self.delays.append(delay)

    def need_more(self, trials: int, bound: float, slack: float = 1.0) -> bool:
        """Tell whether there are too few trials to judge.

        The 99th percentile of a hundred or fewer is the greatest of them: where that alone is over
        its bound [ms], there are more trials, until one of them does not decide any more.
        """
        if len(self.delays) < trials:
            return True
        self._leave_out_void()
        count = len(self.delays)
        if count < trials:
            return True
        return count < _ENOUGH and p99(self.delays) > bound * slack * SCALE

    def judge(self, bound: float, *, slack: float = 1.0, most: float | None = None) -> None:
        """Print all figures; fail where the 99th percentile, or the most, is over its bound [ms].

        The idle control excuses nothing: it is told beside, so that a machine that was busy with
        something else is not mistaken for a slow server.
        """
        self._leave_out_void()
        assert self.delays, f"{self.name}: nothing counts"
        said = f"{self.name}: {_told(self.delays)}; idle control {_told(self.idle)} ms"
        said += f"; p99 {p99(self.delays) / p99(self.idle):.1f} times the idle control's"
        said += f"; {self.void} void"
        tell(said)
        allowed = bound * slack * SCALE
        assert p99(self.delays) <= allowed, f"{said}; allowed: p99 {allowed:g} ms"
        if most is not None:
            allowed = most * slack * SCALE
            assert max(self.delays) <= allowed, f"{said}; allowed: max {allowed:g} ms"

    def _leave_out_void(self) -> None:
        """Leave out what was measured while the idle process was late; begin anew where it is much.

        Raises:
            AssertionError: the machine was late in each of the runs.
        """
        stalls = self._watch.stalls(LATE)
        void = {
            index
            for index, (began, ended) in self._spans.items()
            if any(stall_began <= ended and began <= woke for stall_began, woke in stalls)
        }
        if not void:
            return
        share = len(void) / len(self.delays)
        self.void += len(void)
        tell(f"{self.name}: {len(void)} of {len(self.delays)} void, an idle process was late")
        kept = [] if share > VOID_SHARE else [n for n in range(len(self.delays)) if n not in void]
        spans = {new: self._spans[n] for new, n in enumerate(kept) if n in self._spans}
        self.delays, self._spans = [self.delays[n] for n in kept], spans
        if share > VOID_SHARE:
            self._repeats += 1
            assert self._repeats <= REPEATS, f"{self.name}: {share:.0%} of {REPEATS + 1} runs void"
            self.idle = []


class Void:
    """Trials that a busy machine made void before they began; to five that count, one at most.

    Attributes:
        count: how many there were.
    """

    def __init__(self, figures: Figures, trials: int) -> None:
        self.count = 0
        self._figures = figures
        self._trials = trials

    def add(self) -> None:
        """Count one more; fail where there are too many for the trials that there are to be."""
        self.count += 1
        most = max(self._trials, len(self._figures.delays)) // 5
        assert self.count <= most, f"{self._figures.name}: {self.count} trials were void"


def tell(text: str) -> None:
    """Write figures where `pytest -s` and the report of a failure show them."""
    sys.stdout.write(f"{text}\n")


def p99(values: list[float]) -> float:
    """Return the 99th percentile; the greatest of a hundred or fewer."""
    return sorted(values)[len(values) * 99 // 100]


def _told(values: list[float]) -> str:
    middle = sorted(values)[len(values) // 2]
    return f"p50 {middle:.2f} p99 {p99(values):.2f} max {max(values):.2f} (n={len(values)})"
