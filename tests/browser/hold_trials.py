"""Trials of one way of letting go, whether each of them counts, and how they are judged."""

from __future__ import annotations

import statistics
from collections.abc import Callable, Collection
from dataclasses import dataclass, field

from promises.promise_figures import idle_watch, tell

from browser.motion_tap import Ended

TRIALS = 10
MOST_TRIALS = 30
"""Where so many were not enough, the machine was busy with something else."""

TICK = 0.010
"""Between two set-points of the server [s]."""

LATE = 0.020
"""An idle process that waited for so much longer than it asked makes a trial void [s]: as long as
the shortest of the bounds."""

Trial = Callable[[str], Ended]
"""Jogs towards `plus` or `minus`, lets go, and returns what came of it."""


@dataclass
class HoldTrials:
    """What was measured; trials during which an idle process was late count for nothing."""

    name: str
    found: list[Ended] = field(default_factory=list)
    void: int = 0

    def run(self, trial: Trial, recover: Callable[[], None]) -> None:
        """Try it until ten trials count.

        Args:
            recover: what makes the page ready after a trial that failed beside a busy machine.
        """
        watch = idle_watch()
        for number in range(MOST_TRIALS):
            began = watch.now()
            failed: AssertionError | None = None
            try:
                found = trial(("plus", "minus")[number % 2])
                began, ended = found.began, found.at
            except AssertionError as error:
                failed, ended = error, watch.now()
            stalls = watch.stalls(LATE)
            if any(due <= ended and began <= woke for due, woke in stalls):
                self.void += 1
                if failed is not None:
                    tell(f"{self.name}: void: {failed}")
                    recover()
                continue
            if failed is not None:
                raise failed
            self.found.append(found)
            if len(self.found) == TRIALS:
                return
        raise AssertionError(f"{self.name}: {self.void} of {MOST_TRIALS} trials void")

    def judge(self, bound: float, kinds: Collection[str] = ("ramp",)) -> None:
        """Fail where the median is over the bound [s], or the worst over three times as much.

        Args:
            kinds: of `ramp` and `stop`, those that may end the jog.
        """
        times = sorted(1000 * (each.at - each.began) for each in self.found)
        told = f"{self.name}: {', '.join(f'{each:.1f}' for each in times)} ms; {self.void} void"
        told += (
            f"; bound {1000 * bound:.0f} ms; idle control at most {1000 * _latest():.0f} ms late"
        )
        tell(told)
        assert {each.kind for each in self.found} <= set(kinds), f"{told}; {self.found}"
        assert statistics.median(times) <= 1000 * bound, told
        assert times[-1] <= 3000 * bound, told


def _latest() -> float:
    return max((woke - due for due, woke in idle_watch().stalls(0.0)), default=0.0)
