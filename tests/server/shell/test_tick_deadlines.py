from __future__ import annotations

import pytest

from openpendant.server.shell.loop_timing import next_deadline

PERIOD = 0.5


@pytest.mark.parametrize(
    ("took", "due", "left_out"),
    [
        pytest.param(-0.0625, 0.5, 0, id="a timer that rang early: no second tick for it"),
        pytest.param(0.0, 0.5, 0, id="a short tick"),
        pytest.param(0.4375, 0.5, 0, id="nearly a period"),
        pytest.param(0.5, 0.5, 0, id="a period"),
        pytest.param(0.625, 0.5, 0, id="a little more than a period: caught up at once"),
        pytest.param(0.9375, 0.5, 0, id="nearly two periods: caught up at once"),
        pytest.param(1.0, 1.0, 1, id="two periods: one is left out"),
        pytest.param(2.25, 2.0, 3, id="a freeze: of four the last is made"),
    ],
)
def test_the_next_tick_is_due(took: float, due: float, left_out: int) -> None:
    last = 64.0
    assert next_deadline(last, last + took, PERIOD) == (last + due, left_out)


def test_lateness_does_not_add_up() -> None:
    due = start = 64.0
    for _ in range(100):
        due, left_out = next_deadline(due, due + PERIOD / 8, PERIOD)
        assert left_out == 0
    assert due == start + 100 * PERIOD
