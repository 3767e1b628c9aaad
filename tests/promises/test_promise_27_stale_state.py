"""Promise 27: every state message says how old it is, and old is called stale from 100 ms on."""

import itertools
from typing import Any

import pytest
from promises.promise_table import figure
from rigs.cells.server_rig import MS, TICK, ServerRig, ready

from openpendant.simplemsg.pendant import LinkState, State

STALE = figure(27, "stale").ns


def silent_for(milliseconds: int, **settings: Any) -> tuple[ServerRig, list[State]]:
    """Let a controller fall silent; return the states told since."""
    rig = ready(**settings)
    pendant = rig.pendant(state_rate=100.0)
    rig.wait(100)
    rig.controller.reports = False
    pendant.got.clear()
    rig.wait(milliseconds)
    return rig, pendant.all(State)


def test_promise_27_the_age_grows_with_the_clock_and_stale_is_told_beyond_100_ms() -> None:
    _, states = silent_for(500)
    assert [round(state.age * 1e9) for state in states] == [n * TICK for n in range(1, 51)]
    for state in states:
        is_old = round(state.age * 1e9) > STALE
        assert (state.link == LinkState.STALE) == is_old


@pytest.mark.parametrize("late", [0, 1, 9_999_999])
def test_promise_27_the_flag_turns_between_100_ms_and_the_next_nanosecond(late: int) -> None:
    rig, _ = silent_for(90)
    rig.now += STALE - 90 * MS + late
    assert (rig.core.cell.link_state(rig.now) is LinkState.STALE) == (late > 0)


def test_promise_27_a_controller_that_reports_slowly_is_not_called_stale_between_two() -> None:
    """As amended: from two and a half of its declared periods on."""
    _, states = silent_for(500, controller={"state_period": 0.1})
    stale = [state.age for state in states if state.link == LinkState.STALE]
    assert min(stale) == pytest.approx(figure(27, "periods").bound * 0.1 + 0.01)


def test_promise_27_messages_are_numbered_and_their_time_never_stands_still() -> None:
    _, states = silent_for(300)
    for one, two in itertools.pairwise(states):
        assert two.sequence > one.sequence
        assert (two.time_s, two.time_ns) > (one.time_s, one.time_ns)
        assert two.age > one.age


def test_promise_27_what_is_fresh_again_is_called_so_at_once() -> None:
    rig, _ = silent_for(300)
    pendant = rig.pendant(state_rate=100.0)
    rig.controller.reports = True
    rig.wait(10)
    (state,) = pendant.all(State)
    assert (state.age, state.link) == (0.0, LinkState.UP)
