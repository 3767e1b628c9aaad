from __future__ import annotations

from collections.abc import Callable

import pytest
from promises.promise_table import figure
from rigs.cells.robot_cell_situations import (
    GOAL,
    codes,
    emergency_stop,
    error,
    in_motion,
    in_planning,
    in_settling,
    keep_beating,
    moving,
    no_power,
)
from rigs.cells.server_rig import MS, TICK, ServerRig, ready
from rigs.peers.server_clients import Pendant

from openpendant.server.events.effects import Send, SendStop
from openpendant.server.events.events import Tick
from openpendant.server.settings.cell_settings import ControllerPath
from openpendant.simplemsg import ControllerMode, JointTrajPtFull, TriState
from openpendant.simplemsg.pendant import Activity, Outcome
from openpendant.simplemsg.verdicts import VerdictCode as V


def test_promise_5_stale_feedback_aborts_on_the_first_tick_after_250_ms() -> None:
    rig, pendant = moving()
    seen = rig.now
    rig.controller.reports = False
    lost = figure(5, "lost").ns
    rig.wait(lost // MS)
    assert rig.stops == []
    rig.wait(10)
    assert rig.stops == [seen + lost + figure(5, "ticks").count * TICK]
    assert codes(pendant) == [V.FEEDBACK_STALE]


@pytest.mark.parametrize(
    ("spoil", "code"),
    [
        (emergency_stop, V.CONTROLLER_STOPPED),
        (error, V.CONTROLLER_STOPPED),
        (no_power, V.CONTROLLER_STOPPED),
    ],
)
@pytest.mark.parametrize("phase", [in_motion, in_settling])
def test_the_controllers_own_stop_aborts_within_a_tick(
    phase: Callable[[ServerRig, Pendant], None],
    spoil: Callable[[ServerRig, Pendant], None],
    code: V,
) -> None:
    rig = ready()
    pendant = rig.holder()
    phase(rig, pendant)
    rig.controller.reports = True
    spoil(rig, pendant)
    assert codes(pendant) == [code]
    assert rig.stops == [rig.now]


@pytest.mark.parametrize("phase", [in_motion, in_planning])
def test_a_change_of_the_controllers_mode_stops(
    phase: Callable[[ServerRig, Pendant], None],
) -> None:
    rig = ready()
    pendant = rig.holder()
    phase(rig, pendant)
    pendant.got.clear()
    rig.controller.mode = ControllerMode.MANUAL
    rig.wait(10)
    told = codes(pendant) if phase is in_motion else [code for _, code in pendant.verdicts()]
    assert told == [V.CONTROLLER_STOPPED]
    assert rig.core.cell.driving.request is None


def test_an_error_that_the_controller_showed_before_ends_no_motion_until_it_comes_back() -> None:
    rig = ready()
    pendant = rig.holder()
    status = rig.controller.status(rig.now)
    status.in_error, status.error_code = TriState.TRUE, 7
    rig.hear(ControllerPath.STATE, status)
    assert pendant.move(*GOAL) is V.ACCEPTED
    rig.now += TICK
    rig.hear(ControllerPath.STATE, status)
    rig.tick()
    assert rig.activity() is Activity.MOVING
    rig.wait(10)
    rig.hear(ControllerPath.STATE, status)
    rig.now += TICK
    rig.tick()
    assert codes(pendant) == [V.CONTROLLER_STOPPED]


def test_a_robot_that_does_not_follow_is_sent_no_more_than_the_lead_and_stopped() -> None:
    rig, pendant = moving()
    rig.controller.stop(rig.now)
    rig.controller.coasts = True
    before = [point for point in rig.controller.points if isinstance(point, JointTrajPtFull)]
    frozen_at = max(p.time for p in before if p.positions[0] <= rig.controller.position[0])
    keep_beating(rig, pendant, 2_000)
    points = [point for point in rig.controller.points if isinstance(point, JointTrajPtFull)]
    assert max(point.time for point in points) <= frozen_at + rig.settings.controller.lead + 0.01
    assert codes(pendant) == [V.NOT_FOLLOWING]
    assert rig.stops


def test_the_abort_is_told_in_the_same_list_as_the_stop() -> None:
    rig, _ = moving()
    rig.controller.reports = False
    rig.now += 260 * MS
    out = rig.core.handle(Tick(), rig.now)
    assert isinstance(out[0], SendStop)
    assert isinstance(out[1], Send)
    assert isinstance(out[1].message, Outcome)
