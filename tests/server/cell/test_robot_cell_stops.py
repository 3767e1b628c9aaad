from collections.abc import Callable

import pytest
from promises.promise_table import figure
from rigs.cells.emulated_cell import EmulatedCell
from rigs.cells.expectations import only
from rigs.cells.robot_cell_situations import (
    GOAL,
    at_a_pad,
    codes,
    emergency_stop,
    error,
    in_control,
    in_idle,
    in_motion,
    in_planning,
    in_settling,
    in_stopping,
    keep_beating,
    moving,
    no_power,
    planning,
)
from rigs.cells.server_rig import MS, TICK, ServerRig, ready, worked_out
from rigs.motion.jog_pad import JogPad
from rigs.peers.scripted_controller import Fault
from rigs.peers.server_clients import Pendant

from openpendant import simplemsg
from openpendant.motion.description.robot import serial_robot
from openpendant.server.core.audit_trail import AuditTrail
from openpendant.server.events.cell_events import CellEvent
from openpendant.server.events.effects import (
    AnswerController,
    Effect,
    ReconnectController,
    Send,
    SendStop,
    SendToController,
)
from openpendant.server.events.events import ControllerReport, Received, ShutDown, Tick
from openpendant.server.settings.cell_settings import ControllerPath
from openpendant.simplemsg import (
    ControllerMode,
    HeaderOnly,
    JointTrajPtFull,
    Malformed,
    Message,
    MsgType,
    Ping,
    ReplyCode,
    TriState,
    Unasked,
)
from openpendant.simplemsg.errors import BodyFault
from openpendant.simplemsg.pendant import Activity, Outcome, SoftwareStop, State, Verdict
from openpendant.simplemsg.verdicts import VerdictCode as V

Happening = Callable[[ServerRig, Pendant], None]

PHASES = [in_idle, in_planning, in_motion, in_settling, in_stopping]


@pytest.mark.parametrize("phase", PHASES)
def test_promise_19_a_stop_leaves_first_whatever_the_cell_is_doing(phase: Happening) -> None:
    rig = ready()
    pendant, observer = rig.holder(), rig.pendant("observer")
    phase(rig, pendant)
    out = worked_out(rig.core.handle(Received(observer.session, SoftwareStop(1, "x")), rig.now))
    assert isinstance(out[0], SendStop)
    assert not any(isinstance(item, SendToController) for item in out)


@pytest.mark.parametrize("phase", PHASES)
def test_a_stop_is_there_to_leave_before_anybody_is_told_of_it(
    phase: Happening, monkeypatch: pytest.MonkeyPatch
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
def test_after_a_stop_no_point_leaves_until_somebody_asks_again(phase: Happening) -> None:
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


FAULT_CODES = {
    Fault.REFUSE: V.CONTROLLER_REFUSED,
    Fault.WRONG_TYPE: V.CONTROLLER_MISMATCH,
    Fault.SILENT: V.CONTROLLER_SILENT,
    Fault.LATE: V.CONTROLLER_SILENT,
    Fault.TWICE: V.CONTROLLER_MISMATCH,
    Fault.LINK_LOST: V.CONTROLLER_LOST,
}


@pytest.mark.parametrize("fault", Fault)
@pytest.mark.parametrize("place", ["first", "middle", "last"])
def test_promise_6_a_faulty_answer_ends_the_motion_with_a_stop_and_no_further_point(
    fault: Fault, place: str
) -> None:
    rig, pendant = in_control()
    count = 101  # samples of this move
    index = {"first": 0, "middle": 50, "last": count - 1}[place]
    rig.controller.faults = {index: fault}
    assert pendant.move(*GOAL) is V.ACCEPTED
    keep_beating(rig, pendant, 5_000)
    assert codes(pendant) == [FAULT_CODES[fault]]
    assert len(rig.stops) >= 1
    # A double answer lets one more point out: it is only known for one too many afterwards.
    spare = count if fault is Fault.TWICE else 0
    assert index + 1 <= len(rig.points) <= max(index + 1, spare)
    rig.controller.faults.clear()
    rig.path(ControllerPath.MOTION, True)
    keep_beating(rig, pendant, 500)
    assert pendant.move(0.2, 0.2) is V.ACCEPTED


@pytest.mark.parametrize("fault", [Fault.SILENT, Fault.LATE])
@pytest.mark.parametrize("index", [0, 50])
def test_promise_6_silence_ends_the_motion_500_ms_after_the_point_left(
    fault: Fault, index: int
) -> None:
    rig, pendant = in_control()
    rig.controller.faults = {index: fault}
    pendant.move(*GOAL)
    rig.wait(1_500)
    sent = next(time for time, item in rig.log if _is_point(item, index))
    assert rig.stops[0] == sent + figure(6, "silence").ns
    assert any(isinstance(item, ReconnectController) for _, item in rig.log)


@pytest.mark.parametrize(
    ("received", "code"),
    [
        (HeaderOnly(MsgType.JOINT_TRAJ_PT_FULL, reply_code=2), None),
        (Unasked(HeaderOnly(MsgType.JOINT_TRAJ_PT_FULL)), V.CONTROLLER_MISMATCH),
        (Malformed(14, 3, BodyFault("short", 14, 3, 1)), V.CONTROLLER_MISMATCH),
    ],
)
@pytest.mark.parametrize("phase", [in_settling, in_stopping, in_idle, in_planning])
def test_an_answer_nobody_asked_for_counts_only_while_points_are_at_stake(
    phase: Happening, received: simplemsg.Received, code: V | None
) -> None:
    rig, pendant = in_control()
    phase(rig, pendant)
    settled = len(codes(pendant))
    rig.hear(ControllerPath.MOTION, received)
    expected = [code] if phase is in_settling and code is not None else []
    assert codes(pendant)[settled:] == expected


@pytest.mark.parametrize("path", [ControllerPath.MOTION, ControllerPath.STATE])
@pytest.mark.parametrize("phase", [in_motion, in_settling])
def test_promise_5_a_lost_link_aborts_at_once(phase: Happening, path: ControllerPath) -> None:
    rig, pendant = in_control()
    phase(rig, pendant)
    out = rig.path(path, False)
    assert isinstance(out[0], SendStop)
    assert codes(pendant) == [V.CONTROLLER_LOST]


def test_losing_the_stop_connection_aborts_nothing() -> None:
    rig, pendant = moving()
    assert rig.path(ControllerPath.STOP, False) == []
    rig.wait(2_000)
    assert codes(pendant) == [V.ACCEPTED]


def test_promise_5_nothing_resumes_when_the_link_is_back() -> None:
    rig, pendant = moving()
    rig.path(ControllerPath.MOTION, False)
    before = len(rig.points)
    rig.path(ControllerPath.MOTION, True)
    keep_beating(rig, pendant, 1_000)
    assert len(rig.points) == before


def test_an_answer_that_comes_after_the_stop_is_not_taken_for_the_next_motions() -> None:
    rig, pendant = in_control()
    rig.controller.faults = {0: Fault.SILENT}
    pendant.move(*GOAL)
    rig.controller.faults.clear()
    pendant.release()
    pendant.take()
    rig.wait(20)
    assert rig.controller.awaited == 1
    before = len(rig.points)
    assert pendant.move(*GOAL) is V.ACCEPTED
    # The answer to the first motion's point: still owed, and a failure.
    rig.reply(HeaderOnly(MsgType.JOINT_TRAJ_PT_FULL, reply_code=2))
    assert codes(pendant) == [V.AUTHORITY_LOST, V.CONTROLLER_REFUSED]
    assert len(rig.points) - before <= 2


@pytest.mark.parametrize("path", list(ControllerPath))
@pytest.mark.parametrize(
    ("request_", "code"), [(Ping(), ReplyCode.SUCCESS), (SoftwareStop(99, "x"), ReplyCode.FAILURE)]
)
def test_a_request_of_the_controller_is_answered_where_it_came_from(
    path: ControllerPath, request_: Message, code: ReplyCode
) -> None:
    answer = only(AnswerController, ready().core.handle(ControllerReport(path, request_, 0), 0))
    assert (answer.path, answer.message.reply_code) == (path, code)


def _is_point(item: Effect, index: int) -> bool:
    return isinstance(item, SendToController) and getattr(item.message, "sequence", None) == index


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


@pytest.mark.parametrize("spoil", [emergency_stop, error, no_power])
@pytest.mark.parametrize("phase", [in_motion, in_settling])
def test_the_controllers_own_stop_aborts_within_a_tick(phase: Happening, spoil: Happening) -> None:
    rig, pendant = in_control()
    phase(rig, pendant)
    rig.controller.reports = True
    spoil(rig, pendant)
    assert codes(pendant) == [V.CONTROLLER_STOPPED]
    assert rig.stops == [rig.now]


@pytest.mark.parametrize("phase", [in_motion, in_planning])
def test_a_change_of_the_controllers_mode_stops(phase: Happening) -> None:
    rig, pendant = in_control()
    phase(rig, pendant)
    pendant.got.clear()
    rig.controller.mode = ControllerMode.MANUAL
    rig.wait(10)
    told = codes(pendant) if phase is in_motion else [code for _, code in pendant.verdicts()]
    assert told == [V.CONTROLLER_STOPPED]
    assert rig.core.cell.driving.request is None


def test_an_error_that_the_controller_showed_before_ends_no_motion_until_it_comes_back() -> None:
    rig, pendant = in_control()
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
