"""Trials of one way of letting go, whether each of them counts, and how they are judged."""

from __future__ import annotations

import atexit
import statistics
from collections.abc import Callable, Collection
from dataclasses import dataclass, field
from functools import cache
from multiprocessing import get_context

from promises.promise_figures import tell
from rigs.clock.busy_machine import SCALE
from rigs.clock.stall_watch import StallWatch

from browser.motion_tap import Ended, MovedOn
from browser.page_rig import Page

TRIALS = 10
MOST_TRIALS = 30
"""Where so many were not enough, the machine was busy with something else."""
MOST_FAILED = 10
"""Where so many did not even come to their end, a busy machine explains nothing any more."""

TICK = 0.010
"""Between two set-points of the server [s]."""

LATE = 0.020
"""An idle process that waited for so much longer than it asked makes a trial void [s].

A trial is void by no more than what the machine alone can add to it. Where the bound is shorter, as
much as the bound does: a whole tick late breaks a bound of a tick. It is no more where the bound is
longer: those of 250 ms leave a tick to spare, too.
"""

ALONE = get_context("fork").RLock()
"""Held while a robot is jogged and let go, and by what would disturb that: a page that is loaded, a
browser that is started. The workers of a run are forked with it: beside a trial of one of them the
others only see to it that nothing moves again.
"""

_NOTED = 0.005

SPEED = 20
"""Of a jog of these tests [% of the most in T1]: soon steady, and at rest after four steps."""


def ready_to_hold(page: Page) -> None:
    """Make a page ready while no other worker measures."""
    with ALONE:
        page.ready()
        page.run(
            f"const speed = document.querySelector('.speed input'); speed.value = {SPEED};"
            "speed.dispatchEvent(new Event('input'))"
        )


Trial = Callable[[str], Ended]
"""Jogs towards `plus` or `minus`, lets go, and returns what came of it."""


@cache
def _idle_watch() -> StallWatch:
    watch = StallWatch(_NOTED)
    atexit.register(watch.end)
    return watch


@dataclass
class HoldTrials:
    """What was measured; trials during which an idle process was late count for nothing.

    Attributes:
        bound: of the median [s]; the worst may take three times as long.
        void: trials that count for nothing.
    """

    name: str
    bound: float
    found: list[Ended] = field(default_factory=list)
    void: int = 0

    def run(self, trial: Trial, recover: Callable[[], None]) -> None:
        """Try it until ten trials count.

        Args:
            recover: what makes the page ready after a trial that failed beside a busy machine.

        Raises:
            MovedOn: in any trial, void or not.
        """
        watch, left_to_fail = _idle_watch(), MOST_FAILED
        for number in range(MOST_TRIALS):
            began = watch.now()
            failed: AssertionError | None = None
            try:
                found = trial(("plus", "minus")[number % 2])
                began, ended = found.began, found.at
            except MovedOn:
                raise
            except AssertionError as error:
                failed, ended = error, watch.now()
            stalls = watch.stalls(min(LATE, self.bound))
            if any(due <= ended and began <= woke for due, woke in stalls):
                self.void += 1
                if failed is not None:
                    tell(f"{self.name}: void: {failed}")
                    left_to_fail -= 1
                    if not left_to_fail:
                        raise AssertionError(f"{self.name}: not judged") from failed
                    recover()
                continue
            if failed is not None:
                raise failed
            self.found.append(found)
            if len(self.found) == TRIALS:
                return
        raise AssertionError(
            f"{self.name}: not judged, {self.void} of {MOST_TRIALS} trials were void"
        )

    def judge(self, kinds: Collection[str] = ("ramp",)) -> None:
        """Fail where the median is over the bound, or the worst over three times as much.

        Args:
            kinds: of `ramp` and `stop`, those that may end the jog.
        """
        times = sorted(1000 * (each.at - each.began) for each in self.found)
        told = f"{self.name}: {', '.join(f'{each:.1f}' for each in times)} ms; {self.void} void"
        told += f"; median {statistics.median(times):.1f}, bound {1000 * self.bound:.0f} ms"
        told += f"; idle control at most {1000 * _latest():.0f} ms late"
        tell(told)
        assert {each.kind for each in self.found} <= set(kinds), f"{told}; {self.found}"
        allowed = 1000 * self.bound * SCALE
        assert statistics.median(times) <= allowed, told
        assert times[-1] <= 3 * allowed, told


def _latest() -> float:
    return max((woke - due for due, woke in _idle_watch().stalls(0.0)), default=0.0)
