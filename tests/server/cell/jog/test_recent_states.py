from __future__ import annotations

import pytest

from openpendant.server.endpoints.pendant.notifications import RECENT_NS, RecentStates
from openpendant.simplemsg.verdicts import VerdictCode as V


@pytest.mark.parametrize("rate", [50, 100, 250])
def test_all_of_the_last_half_second_may_be_quoted_at_any_tick_rate(rate: int) -> None:
    states, period = RecentStates(), 1_000_000_000 // rate
    for sequence in range(1000):
        states.sent(sequence, sequence * period)
    now = 999 * period
    oldest = 999 - RECENT_NS // period
    assert all(states.fault(sequence, now) is None for sequence in range(oldest, 1000))
    stale = states.fault(oldest - 1, now)
    assert stale is not None
    assert stale.code is V.PRESS_STALE
    assert "the newest is 999" in stale.text
