"""What the benchmark of a room makes of the ticks that a pendant heard of."""

import pytest

from openpendant.tools.bench.jogging_pendants import PERIOD_NS, lateness

MS = 1_000_000


def grid(*late: int, phase: int) -> list[int]:
    """Return the times of ticks that were so many milliseconds late."""
    return [phase + number * PERIOD_NS + each * MS for number, each in enumerate(late)]


@pytest.mark.parametrize("phase", [1, 3 * MS, 9 * MS, PERIOD_NS - 1])
def test_lateness_is_counted_from_the_grid_wherever_it_lies(phase: int) -> None:
    assert lateness(grid(0, 1, 0, 3, 0, phase=phase)) == [0, 1 * MS, 0, 3 * MS, 0]


def test_a_skipped_tick_is_as_late_as_the_next_one() -> None:
    ticks = grid(0, 0, 0, 0, 0, phase=2 * MS)
    del ticks[2]
    assert lateness(ticks) == [0, 0, 10 * MS, 0, 0]
