from collections.abc import Callable

import pytest
from rigs.cells.emulated_cell import EmulatedCell
from rigs.cells.robot_cell_situations import (
    GOAL,
    at_a_pad,
    codes,
    in_control,
    in_idle,
    in_motion,
    in_planning,
    in_settling,
    in_stopping,
    keep_beating,
    moving,
    planning,
)
from rigs.cells.server_rig import MS, ServerRig, ready, worked_out
from rigs.motion.jog_pad import JogPad
from rigs.peers.server_clients import Pendant

from openpendant.motion.description.robot import serial_robot
from openpendant.server.core.audit_trail import AuditTrail
from openpendant.server.events.cell_events import CellEvent
from openpendant.server.events.effects import ReconnectController, SendStop, SendToController
from openpendant.server.events.events import Received, ShutDown, Tick
from openpendant.server.settings.cell_settings import ControllerPath
from openpendant.simplemsg.pendant import (
    Activity,
    Outcome,
    SoftwareStop,
    State,
    Verdict,
)
from openpendant.simplemsg.verdicts import VerdictCode as V

PHASES = [in_idle, in_planning, in_motion, in_settling, in_stopping]


@pytest.mark.parametrize("phase", PHASES)
def test_promise_19_a_stop_leaves_first_whatever_the_cell_is_doing(
    phase: Callable[[ServerRig, Pendant], None],
) -> None:
    rig = ready()
    pendant, observer = rig.holder(), rig.pendant("observer")
    phase(rig, pendant)
    out = worked_out(rig.core.handle(Received(observer.session, SoftwareStop(1, "x")), rig.now))
    assert isinstance(out[0], SendStop)
    assert not any(isinstance(item, SendToController) for item in out)


@pytest.mark.parametrize("phase", PHASES)
def test_a_stop_is_there_to_leave_before_anybody_is_told_of_it(
    phase: Callable[[ServerRig, Pendant], None], monkeypatch: pytest.MonkeyPatch
) -> None:
    rig = ready()
    pendant = rig.holder()
    phase(rig, pendant)
    told: list[CellEvent] = []

    def fail(_: AuditTrail, event: CellEvent, now: int) -> None:
        told.append(event)
        raise RuntimeError

    monkeypatch.setattr(AuditTrail, "on_cell_event", fail)
    stop, *rest = rig.core.handle(Received(pendant.session, SoftwareStop(1, "x")), rig.now)
    assert isinstance(stop, SendStop)
    assert told == []
    with pytest.raises(RuntimeError):
        worked_out(rest)


def test_a_motion_link_that_does_not_answer_a_stop_for_two_seconds_is_dropped() -> None:
    rig = ready()
    observer = rig.pendant("observer")
    # It goes nowhere.
    rig.core.handle(Received(observer.session, SoftwareStop(1, "x")), rig.now)
    dropped = [
        after
        for after in range(0, 3_000, 10)
        if any(
            isinstance(item, ReconnectController)
            for item in rig.core.handle(Tick(), rig.now + after * MS)
        )
    ]
    assert dropped == [2_000]


@pytest.mark.parametrize("phase", PHASES)
def test_after_a_stop_no_point_leaves_until_somebody_asks_again(
    phase: Callable[[ServerRig, Pendant], None],
) -> None:
    rig, pendant = in_control()
    phase(rig, pendant)
    pendant.stop()
    before = len(rig.points)
    rig.come_to_rest()
    keep_beating(rig, pendant, 3_000)
    assert pendant.reset() is V.ACCEPTED
    keep_beating(rig, pendant, 1_000)
    assert len(rig.points) == before
    assert rig.activity() is Activity.IDLE
    assert pendant.move(0.3, 0.3) is V.ACCEPTED


def test_a_stop_while_planning_refuses_the_request_and_drops_the_late_plan() -> None:
    rig, pendant = planning()
    planned = pendant.last_request
    pendant.got.clear()
    pendant.stop()
    assert pendant.verdicts() == [(planned, V.STOPPED), (planned + 1, V.ACCEPTED)]
    assert rig.plan() == []
    assert rig.points == []


def test_a_stop_in_motion_aborts_it_once() -> None:
    rig, pendant = moving()
    pendant.stop("look out")
    pendant.stop("again")
    rig.wait(500)
    assert codes(pendant) == [V.STOPPED]
    assert "look out" in pendant.all(Outcome)[0].text


def test_a_stop_is_repeated_every_100_ms_until_the_robot_is_seen_at_rest() -> None:
    rig, pendant = moving()
    rig.controller.coasts = True
    began = rig.now
    pendant.stop()
    rig.wait(350)
    assert [time - began for time in rig.stops] == [0, 100 * MS, 200 * MS, 300 * MS]
    assert pendant.reset() is V.MOVING
    rig.come_to_rest()
    rig.wait(10)
    assert pendant.reset() is V.ACCEPTED


def test_a_stop_of_a_robot_that_moves_without_us_is_repeated_as_well() -> None:
    rig = ready()
    pendant = rig.pendant()
    rig.controller.coasts = True
    report = rig.controller.feedback(rig.now)
    report.velocities = (0.5,) + (0.0,) * 9
    rig.controller.reports = False
    rig.hear(ControllerPath.STATE, report)
    pendant.stop()
    rig.wait(100)
    assert len(rig.stops) == 2


def test_stopping_ends_5_s_after_the_reports_ended_because_nobody_can_see_it_stand() -> None:
    rig, pendant = moving()
    rig.path(ControllerPath.STATE, False)
    began = rig.now
    keep_beating(rig, pendant, 5_000)
    assert rig.activity() is Activity.STOPPING
    rig.wait(10)
    assert (rig.activity(), rig.now) == (Activity.IDLE, began + 5_010 * MS)
    assert pendant.move(*GOAL) is V.CONTROLLER_DOWN


def test_shutting_down_stops_the_robot_and_aborts_the_motion() -> None:
    rig, pendant = moving()
    out = rig.perform(rig.core.handle(ShutDown(), rig.now))
    assert isinstance(out[0], SendStop)
    assert codes(pendant) == [V.SHUTTING_DOWN]
    assert rig.core.cell.is_moving
    rig.wait(20)
    assert not rig.core.cell.is_moving


def test_a_stop_is_not_reset_while_somebody_else_moves_the_robot() -> None:
    rig, pendant = in_control()
    pendant.stop()
    rig.wait(200)
    assert not rig.core.cell.is_busy
    rig.controller.be_moved((0.1, 0.0), (0.2, 0.0))
    rig.wait(20)
    assert pendant.reset() is V.MOVING
    rig.controller.be_moved((0.2, 0.0))
    rig.wait(500)
    assert pendant.reset() is V.ACCEPTED


def test_an_enabling_device_that_was_pressed_before_the_reset_does_not_enable_after_it() -> None:
    _, pad = at_a_pad(modes={"initial": "manual_reduced"})
    pad.pendant.stop()
    pad.let_go()
    pad.squeeze()
    assert pad.pendant.reset() is V.ACCEPTED
    assert pad.press(1.0, 0.0) is V.NOT_ENABLED
    pad.let_go()
    pad.squeeze()
    assert pad.press(1.0, 0.0) is V.ACCEPTED


def test_while_the_state_says_stopping_a_reset_is_refused_and_from_idle_on_it_is_not() -> None:
    """So a pendant that stops and resets at once waits for a state."""
    cell = EmulatedCell()
    pendant = cell.pendant("hand", state_rate=100.0)
    pendant.take()
    assert pendant.move(*serial_robot("ur5").home_position[:5], 0.5) is V.ACCEPTED
    cell.wait(500)
    pendant.stop()
    seen = []
    for _ in range(100):
        cell.wait(10)
        seen.append((Activity(pendant.all(State)[-1].activity), pendant.reset()))
        if seen[-1][1] is V.ACCEPTED:
            break
    *before, last = seen
    assert set(before) == {(Activity.STOPPING, V.MOVING)}
    assert last == (Activity.IDLE, V.ACCEPTED)


@pytest.mark.parametrize(
    ("reason", "text"), [("tea", "software stop by pad: tea"), ("", "software stop by pad")]
)
def test_a_motion_that_is_refused_names_who_stopped_and_why_where_that_was_given(
    reason: str, text: str
) -> None:
    pad = JogPad(ready(modes={"initial": "manual_reduced"}))
    pad.squeeze()
    pad.pendant.stop(reason)
    assert pad.press(1.0, 0.0) is V.STOP_LATCHED
    assert pad.pendant.all(Verdict)[-1].text == text
