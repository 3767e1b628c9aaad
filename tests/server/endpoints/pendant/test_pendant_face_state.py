from __future__ import annotations

from types import SimpleNamespace
from typing import cast

import pytest
from rigs.cells.server_rig import ServerRig, ready

from openpendant.motion.jog import jog_commands as motion_jog
from openpendant.motion.jog.jog_commands import JogCause
from openpendant.server.cell import state_report
from openpendant.server.cell.execution.setpoint_sources import JogRows
from openpendant.server.events.effects import Broadcast
from openpendant.server.events.events import Skipped
from openpendant.simplemsg.pendant import Activity, JogReason, LinkState, State, Subscribe
from openpendant.simplemsg.verdicts import VerdictCode as V


@pytest.mark.parametrize(("rate", "count"), [(0.0, 0), (1.0, 1), (25.0, 25), (100.0, 100)])
def test_state_comes_at_the_rate_that_was_asked_for(rate: float, count: int) -> None:
    rig = ready()
    pendant = rig.pendant(state_rate=rate)
    rig.wait(10)
    pendant.got.clear()
    rig.wait(1_000)
    assert len(pendant.all(State)) == count


def test_a_rate_above_the_tick_is_the_ticks() -> None:
    rig = ready(tick_rate=100)
    pendant = rig.pendant(state_rate=125.0)
    rig.wait(1_000)
    assert len(pendant.all(State)) == 100


def test_the_rate_can_be_changed() -> None:
    rig = ready()
    pendant = rig.pendant(state_rate=100.0)
    assert pendant.code(Subscribe(5, 0.0)) is V.ACCEPTED
    rig.wait(100)
    assert pendant.all(State) == []


def test_state_carries_where_the_robot_is_what_it_does_and_how_old_that_is() -> None:
    rig = ready()
    holder = rig.holder()
    pendant = rig.pendant(state_rate=100.0)
    holder.move(1.0, 0.5)
    rig.wait(500)
    rig.controller.reports = False
    rig.wait(120)
    state = pendant.all(State)[-1]
    assert state.positions[:2] == rig.core.cell.feedback.position
    assert (state.activity, state.request_id, state.holder) == (
        Activity.MOVING,
        holder.last_request,
        holder.session,
    )
    assert state.age == pytest.approx(0.12)
    assert state.link == LinkState.STALE
    assert (state.time_s * 10**9 + state.time_ns) == rig.now


def test_before_the_first_report_the_age_is_minus_1_and_no_field_valid() -> None:
    rig = ServerRig()
    pendant = rig.pendant(state_rate=100.0)
    rig.wait(10)
    (state,) = pendant.all(State)
    assert (state.age, state.valid_fields, state.link) == (-1.0, 0, LinkState.DOWN)


def test_state_is_encoded_once_for_all_and_who_was_too_slow_is_told_how_often() -> None:
    rig = ready()
    pendants = [rig.pendant(state_rate=100.0) for _ in range(3)]
    out = rig.wait(10)
    assert [item.sessions for item in out if isinstance(item, Broadcast)] == [
        tuple(pendant.session for pendant in pendants)
    ]
    rig.core.handle(Skipped((pendants[1].session,)), 0)
    rig.core.handle(Skipped((pendants[1].session,)), 0)
    rig.wait(10)
    assert [pendant.all(State)[-1].dropped for pendant in pendants] == [0, 2, 0]
    assert len({pendant.all(State)[-1].sequence for pendant in pendants}) == 1


def test_those_who_missed_equally_many_are_told_so_in_one_encoding() -> None:
    rig = ready()
    pendants = [rig.pendant(state_rate=100.0) for _ in range(3)]
    rig.wait(10)
    for pendant in (pendants[0], pendants[2]):
        rig.core.handle(Skipped((pendant.session,)), 0)
    out = rig.wait(10)
    first, second, third = (pendant.session for pendant in pendants)
    spread = [item.sessions for item in out if isinstance(item, Broadcast)]
    assert spread == [(first, third), (second,)]
    assert [pendant.all(State)[-1].dropped for pendant in pendants] == [1, 0, 1]


@pytest.mark.parametrize("reason", list(motion_jog.JogSlowdown))
def test_every_reason_of_a_jogger_has_its_number_on_the_wire(
    reason: motion_jog.JogSlowdown,
) -> None:
    state = State.__new__(State)
    rows = SimpleNamespace(step=SimpleNamespace(scale=0.5, cause=JogCause(reason, 1.0, 0.5, 2)))
    state_report._tell_jog(state, cast(JogRows, rows))
    assert state.jog_reason is JogReason[reason.name]
    assert (state.jog_scale, state.jog_joint) == (0.5, 2)
