"""Every decision about motion: conditions, stops, faults of the controller, and who hears of it."""

from __future__ import annotations

import math
from collections.abc import Callable

import pytest
from server_rig import LIMITS, MS, TICK, Fault, Pendant, ServerRig, ready

from openpendant.motion.limits import float32_ceiling
from openpendant.server.outgoing import DropLink, Forward, ForwardStop, Outgoing, Send
from openpendant.server.refusal import Refusal
from openpendant.server.robot_cell import ControllerPath
from openpendant.simplemsg import (
    ControllerMode,
    HeaderOnly,
    Malformed,
    MsgType,
    Received,
    TriState,
    Unasked,
)
from openpendant.simplemsg.errors import BodyFault
from openpendant.simplemsg.pendant import (
    Activity,
    AuthorityBeat,
    Outcome,
    SoftwareStop,
    StopChanged,
    Verdict,
)
from openpendant.simplemsg.verdicts import VerdictCode as V

GOAL = (1.0, 0.5)


def codes(pendant: Pendant) -> list[V]:
    return [code for _, code in pendant.outcomes()]


def moving(milliseconds: int = 300) -> tuple[ServerRig, Pendant]:
    """Return a rig in the middle of a motion, and who asked for it."""
    rig = ready()
    pendant = rig.holder()
    assert pendant.move(*GOAL) is V.ACCEPTED
    rig.wait(milliseconds)
    assert rig.activity() is Activity.MOVING
    return rig, pendant


def keep_beating(rig: ServerRig, pendant: Pendant, milliseconds: int) -> None:
    for _ in range(0, milliseconds, 500):
        pendant.send(AuthorityBeat())
        rig.wait(min(500, milliseconds))


# A motion that goes well.


def test_a_joint_move_is_accepted_and_completed() -> None:
    rig = ready()
    pendant = rig.holder()
    assert pendant.move(*GOAL) is V.ACCEPTED
    rig.wait(3_000)
    assert codes(pendant) == [V.ACCEPTED]
    assert rig.controller.position == GOAL
    assert rig.stops == []
    assert rig.activity() is Activity.IDLE


def test_the_first_point_leaves_on_the_call_stack_of_the_request() -> None:
    rig = ready()
    pendant = rig.holder()
    pendant.move(*GOAL)
    assert rig.points[0].sequence == 0


def test_a_planned_path_is_accepted_when_its_plan_is_there() -> None:
    rig = ready(plans_at_once=False)
    pendant = rig.holder()
    assert pendant.path((0.1, 0.1), GOAL) is None
    assert rig.activity() is Activity.PLANNING
    pendant.got.clear()
    rig.plan()
    assert rig.activity() is Activity.MOVING
    rig.wait(3_000)
    assert codes(pendant) == [V.ACCEPTED]


# Conditions.


def no_authority(rig: ServerRig, pendant: Pendant) -> None:
    pendant.release()


def latched(rig: ServerRig, pendant: Pendant) -> None:
    pendant.stop()


def no_motion_link(rig: ServerRig, pendant: Pendant) -> None:
    rig.path(ControllerPath.MOTION, False)


def no_state_link(rig: ServerRig, pendant: Pendant) -> None:
    rig.path(ControllerPath.STATE, False)


def stale(rig: ServerRig, pendant: Pendant) -> None:
    rig.controller.reports = False
    rig.wait(110)


def not_finite(rig: ServerRig, pendant: Pendant) -> None:
    rig.controller.position = (math.nan, 0.0)
    rig.wait(10)


def emergency_stop(rig: ServerRig, pendant: Pendant) -> None:
    rig.controller.e_stopped = True
    rig.wait(10)


def error(rig: ServerRig, pendant: Pendant) -> None:
    rig.controller.error_code = 7
    rig.wait(10)


def no_power(rig: ServerRig, pendant: Pendant) -> None:
    rig.controller.powered = False
    rig.wait(10)


def shutting_down(rig: ServerRig, pendant: Pendant) -> None:
    rig.core.shut_down(rig.now)


def already_moving(rig: ServerRig, pendant: Pendant) -> None:
    pendant.move(0.5, 0.5)


def lease_run_out(rig: ServerRig, pendant: Pendant) -> None:
    rig.wait(2_990)
    rig.now += TICK
    rig.report()


@pytest.mark.parametrize(
    ("spoil", "code"),
    [
        (no_authority, V.NOT_IN_CONTROL),
        (lease_run_out, V.NOT_IN_CONTROL),
        (latched, V.STOP_LATCHED),
        (no_motion_link, V.CONTROLLER_DOWN),
        (no_state_link, V.CONTROLLER_DOWN),
        (stale, V.FEEDBACK_STALE),
        (not_finite, V.NOT_FINITE),
        (emergency_stop, V.CONTROLLER_NOT_READY),
        (error, V.CONTROLLER_NOT_READY),
        (no_power, V.CONTROLLER_NOT_READY),
        (shutting_down, V.SHUTTING_DOWN),
        (already_moving, V.MOVING),
    ],
)
def test_no_motion_starts_where_a_condition_is_missing(
    spoil: Callable[[ServerRig, Pendant], None], code: V
) -> None:
    rig = ready()
    pendant = rig.holder()
    spoil(rig, pendant)
    before = len(rig.points)
    assert pendant.move(*GOAL) is code
    assert pendant.path((0.1, 0.1), GOAL) is code
    assert len(rig.points) == before


@pytest.mark.parametrize(("age_ns", "code"), [(0, V.ACCEPTED), (1, V.FEEDBACK_STALE)])
def test_a_motion_starts_from_a_report_of_100_ms_and_no_older(age_ns: int, code: V) -> None:
    rig = ready()
    pendant = rig.holder()
    rig.now += 100 * MS + age_ns
    assert pendant.move(*GOAL) is code


def test_a_controller_that_never_reported_is_not_moved() -> None:
    rig = ServerRig()
    pendant = rig.holder()
    for path in ControllerPath:
        rig.path(path, True)
    assert pendant.move(*GOAL) is V.FEEDBACK_STALE


def test_a_second_request_while_planning_is_refused() -> None:
    rig = ready(plans_at_once=False)
    pendant = rig.holder()
    pendant.path((0.1, 0.1), GOAL)
    assert pendant.move(*GOAL) is V.PLANNING


@pytest.mark.parametrize("joint", [0, 1])
@pytest.mark.parametrize("side", ["lower", "upper"])
def test_a_limit_that_was_rounded_to_4_bytes_is_taken_as_the_limit(joint: int, side: str) -> None:
    rig = ready()
    pendant = rig.holder()
    limit = float(getattr(LIMITS, side)[joint])
    goal = [0.0, 0.0]
    goal[joint] = math.copysign(float32_ceiling(abs(limit)), limit)
    assert pendant.move(*goal) is V.ACCEPTED


def test_a_target_beyond_a_limit_is_refused_with_joint_value_and_limit() -> None:
    rig = ready()
    pendant = rig.holder()
    assert pendant.move(0.0, 2.0000005) is V.OUT_OF_RANGE
    verdict = pendant.all(Verdict)[-1]
    assert (verdict.joint, verdict.limit) == (1, 2.0)
    assert verdict.value == 2.0000005
    assert rig.points == []


# Stops.


def in_idle(rig: ServerRig, pendant: Pendant) -> None:
    return


def in_planning(rig: ServerRig, pendant: Pendant) -> None:
    rig.plans_at_once = False
    pendant.path((0.1, 0.1), GOAL)


def in_motion(rig: ServerRig, pendant: Pendant) -> None:
    pendant.move(*GOAL)
    rig.wait(300)


def in_settling(rig: ServerRig, pendant: Pendant) -> None:
    rig.controller.coasts = True
    pendant.move(0.1, 0.0)
    rig.wait(200)
    rig.controller.reports = False
    rig.wait(160)


def in_stopping(rig: ServerRig, pendant: Pendant) -> None:
    in_motion(rig, pendant)
    rig.controller.coasts = True
    pendant.release()
    pendant.take()


PHASES = [in_idle, in_planning, in_motion, in_settling, in_stopping]


@pytest.mark.parametrize("phase", PHASES)
def test_a_stop_leaves_first_whatever_the_cell_is_doing(
    phase: Callable[[ServerRig, Pendant], None],
) -> None:
    rig = ready()
    pendant, observer = rig.holder(), rig.pendant("observer")
    phase(rig, pendant)
    out = rig.core.receive(observer.session, SoftwareStop(1, "x"), rig.now)
    assert isinstance(out[0], ForwardStop)
    assert not any(isinstance(item, Forward) for item in out)


@pytest.mark.parametrize("phase", PHASES)
def test_after_a_stop_no_point_leaves_until_somebody_asks_again(
    phase: Callable[[ServerRig, Pendant], None],
) -> None:
    rig = ready()
    pendant = rig.holder()
    phase(rig, pendant)
    pendant.stop()
    before = len(rig.points)
    if rig.jobs:
        rig.plan()
    rig.controller.coasts = False
    rig.controller.reports = True
    rig.controller.stop(rig.now)
    keep_beating(rig, pendant, 3_000)
    assert pendant.reset() is V.ACCEPTED
    keep_beating(rig, pendant, 1_000)
    assert len(rig.points) == before
    assert rig.activity() is Activity.IDLE
    assert pendant.move(0.3, 0.3) is V.ACCEPTED


def test_a_stop_while_planning_refuses_the_request_and_drops_the_late_plan() -> None:
    rig = ready(plans_at_once=False)
    pendant = rig.holder()
    pendant.path((0.1, 0.1), GOAL)
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


def test_a_stop_is_latched_once_and_told_to_all() -> None:
    rig, pendant = moving()
    other = rig.pendant("other")
    other.stop("mine")
    pendant.stop("too late")
    assert [change.reason for change in pendant.all(StopChanged)] == ["mine"]
    assert rig.core.cell.stop is not None
    assert rig.core.cell.stop.reason == "mine"


def test_a_stop_is_repeated_every_100_ms_until_the_robot_is_seen_at_rest() -> None:
    rig, pendant = moving()
    rig.controller.coasts = True
    began = rig.now
    pendant.stop()
    rig.wait(350)
    assert [time - began for time in rig.stops] == [0, 100 * MS, 200 * MS, 300 * MS]
    assert pendant.reset() is V.MOVING
    rig.controller.coasts = False
    rig.controller.stop(rig.now)
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
    assert rig.activity() is Activity.IDLE
    assert rig.now == began + 5_010 * MS
    assert pendant.move(*GOAL) is V.CONTROLLER_DOWN


def test_shutting_down_stops_the_robot_and_aborts_the_motion() -> None:
    rig, pendant = moving()
    out = rig.perform(rig.core.shut_down(rig.now))
    assert isinstance(out[0], ForwardStop)
    assert codes(pendant) == [V.SHUTTING_DOWN]
    assert rig.core.cell.is_moving
    rig.wait(20)
    assert not rig.core.cell.is_moving


# The authority.


def test_a_lease_that_runs_out_in_motion_aborts_it_at_that_tick() -> None:
    rig = ready()
    pendant = rig.holder()
    pendant.move(*GOAL, speed=0.1)
    began = rig.now
    rig.wait(2_990)
    assert rig.stops == []
    rig.wait(10)
    assert rig.stops == [began + 3_000 * MS]
    assert codes(pendant) == [V.AUTHORITY_LOST]


def test_a_lease_that_runs_out_while_planning_refuses_the_request() -> None:
    rig = ready(plans_at_once=False)
    pendant = rig.holder()
    pendant.path((0.1, 0.1), GOAL)
    pendant.got.clear()
    rig.wait(3_000)
    assert pendant.verdicts() == [(pendant.last_request, V.AUTHORITY_LOST)]
    assert rig.plan() == []


def test_giving_the_authority_back_in_motion_stops_it() -> None:
    rig, pendant = moving()
    assert pendant.release() is V.ACCEPTED
    assert codes(pendant) == [V.AUTHORITY_LOST]
    assert len(rig.stops) == 1


@pytest.mark.parametrize("planning", [True, False])
def test_a_holder_that_disconnects_leaves_nothing_moving(planning: bool) -> None:
    rig = ready(plans_at_once=not planning)
    pendant, other = rig.holder(), rig.pendant("other")
    pendant.path((0.1, 0.1), GOAL)
    told = len(pendant.got)
    pendant.close()
    if planning:
        rig.plan()
    rig.wait(100)
    assert len(rig.stops) == (0 if planning else 1)
    assert len(rig.points) <= 10
    assert len(pendant.got) == told
    assert other.take() is V.ACCEPTED


# What planning may answer.


def test_a_plan_that_is_refused_moves_nothing() -> None:
    rig = ready(plans_at_once=False)
    pendant = rig.holder()
    pendant.path((0.1, 0.1), GOAL)
    pendant.got.clear()
    rig.plan(Refusal(V.PLANNER_FAILED))
    assert pendant.verdicts() == [(pendant.last_request, V.PLANNER_FAILED)]
    assert rig.activity() is Activity.IDLE
    assert rig.points == []


def test_a_plan_is_worth_nothing_once_the_robot_stands_elsewhere() -> None:
    rig = ready(plans_at_once=False)
    pendant = rig.holder()
    pendant.path((0.1, 0.1), GOAL)
    rig.controller.position = (0.02, 0.0)
    rig.wait(20)
    pendant.got.clear()
    rig.plan()
    assert pendant.verdicts() == [(pendant.last_request, V.NOT_STANDING)]


@pytest.mark.parametrize("spoil", [emergency_stop, error, no_power, stale])
def test_a_plan_is_worth_nothing_once_a_condition_is_missing(
    spoil: Callable[[ServerRig, Pendant], None],
) -> None:
    rig = ready(plans_at_once=False)
    pendant = rig.holder()
    pendant.path((0.1, 0.1), GOAL)
    spoil(rig, pendant)
    rig.plan()
    assert rig.points == []
    assert rig.activity() is Activity.IDLE


def test_a_plan_that_comes_twice_starts_one_motion() -> None:
    rig = ready(plans_at_once=False)
    pendant = rig.holder()
    pendant.path((0.1, 0.1), GOAL)
    planned = rig.planned(rig.jobs[0])
    rig.plan()
    assert rig.core.planned(planned, rig.now) == []


def test_the_plan_of_a_refused_request_does_not_serve_the_next() -> None:
    rig = ready(plans_at_once=False)
    pendant = rig.holder()
    pendant.path((0.1, 0.1), GOAL)
    pendant.release()
    pendant.take()
    pendant.path((0.1, 0.1), (0.2, 0.2))
    assert rig.plan() == []
    rig.plan()
    assert rig.activity() is Activity.MOVING


# Faults of the controller's answers, in every phase of a motion.

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
def test_a_faulty_answer_ends_the_motion_with_a_stop_and_no_further_point(
    fault: Fault, place: str
) -> None:
    rig = ready()
    pendant = rig.holder()
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
def test_silence_ends_the_motion_500_ms_after_the_point_left(fault: Fault, index: int) -> None:
    rig = ready()
    pendant = rig.holder()
    rig.controller.faults = {index: fault}
    pendant.move(*GOAL)
    rig.wait(1_500)
    sent = next(time for time, item in rig.log if _is_point(item, index))
    assert rig.stops[0] == sent + 500 * MS
    assert any(isinstance(item, DropLink) for _, item in rig.log)


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
    phase: Callable[[ServerRig, Pendant], None], received: Received, code: V | None
) -> None:
    rig = ready()
    pendant = rig.holder()
    phase(rig, pendant)
    settled = len(codes(pendant))
    rig.hear(ControllerPath.MOTION, received)
    expected = [code] if phase is in_settling and code is not None else []
    assert codes(pendant)[settled:] == expected


@pytest.mark.parametrize("path", [ControllerPath.MOTION, ControllerPath.STATE])
@pytest.mark.parametrize("phase", [in_motion, in_settling])
def test_a_lost_link_aborts_at_once(
    phase: Callable[[ServerRig, Pendant], None], path: ControllerPath
) -> None:
    rig = ready()
    pendant = rig.holder()
    phase(rig, pendant)
    out = rig.path(path, False)
    assert isinstance(out[0], ForwardStop)
    assert codes(pendant) == [V.CONTROLLER_LOST]


def test_losing_the_stop_connection_aborts_nothing() -> None:
    rig, pendant = moving()
    assert rig.path(ControllerPath.STOP, False) == []
    rig.wait(2_000)
    assert codes(pendant) == [V.ACCEPTED]


def test_nothing_resumes_when_the_link_is_back() -> None:
    rig, pendant = moving()
    rig.path(ControllerPath.MOTION, False)
    before = len(rig.points)
    rig.path(ControllerPath.MOTION, True)
    keep_beating(rig, pendant, 1_000)
    assert len(rig.points) == before


def test_an_answer_that_comes_after_the_stop_is_not_taken_for_the_next_motions() -> None:
    rig = ready()
    pendant = rig.holder()
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


# The controller's reports.


def test_stale_feedback_aborts_on_the_first_tick_after_250_ms() -> None:
    rig, pendant = moving()
    seen = rig.now
    rig.controller.reports = False
    rig.wait(250)
    assert rig.stops == []
    rig.wait(10)
    assert rig.stops == [seen + 260 * MS]
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
    assert rig.core.cell.request is None


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


def test_a_robot_that_stops_short_of_its_goal_has_not_arrived() -> None:
    rig, pendant = moving()
    rig.controller.stop(rig.now)
    rig.controller.coasts = True
    keep_beating(rig, pendant, 4_000)
    assert codes(pendant) == [V.NOT_ARRIVED]
    assert rig.stops


def test_a_request_of_the_controller_is_answered_on_the_motion_link_only() -> None:
    rig = ready()
    request = SoftwareStop(99, "x")
    out = rig.core.on_controller(ControllerPath.MOTION, request, 0, 0)
    assert [type(item) for item in out] == [Forward]
    for path in (ControllerPath.STATE, ControllerPath.STOP):
        assert rig.core.on_controller(path, request, 0, 0) == []


def test_the_abort_is_told_in_the_same_list_as_the_stop() -> None:
    rig, _ = moving()
    rig.controller.reports = False
    rig.now += 260 * MS
    out = rig.core.tick(rig.now)
    assert isinstance(out[0], ForwardStop)
    assert isinstance(out[1], Send)
    assert isinstance(out[1].message, Outcome)


def _is_point(item: Outgoing, index: int) -> bool:
    return isinstance(item, Forward) and getattr(item.message, "sequence", None) == index
