"""STOP, emergency stop, under-run, lost link, stall: every way from motion to rest."""

import asyncio

import pytest
from rigs.cells.controller_rig import (
    FAILURE,
    LIMITS,
    LINK,
    MS,
    STOP,
    SUCCESS,
    ControllerRig,
    full_point,
    ratio_point,
)

from openpendant.controller_emulator.error_codes import ErrorCode
from openpendant.controller_emulator.interpolation.servo import StartRule
from openpendant.controller_emulator.interpolation.stop_ramp import AxisLimits, Ramp
from openpendant.simplemsg import CommType, JointTrajPtFull
from openpendant.simplemsg.pendant import OperatorAction, OperatorEvent

E_STOP, RESET = OperatorAction.EMERGENCY_STOP, OperatorAction.RESET

# Half a second to 1 rad/s (the elbow: half of that), one second of it, half a second to rest.
RAMP_UP = (
    full_point(0, 0.0, (0.0, 0.0), acceleration=(2.0, 1.0)),
    full_point(1, 0.5, (0.25, 0.125), (1.0, 0.5), (0.0, 0.0)),
    full_point(2, 1.5, (1.25, 0.625), (1.0, 0.5), (0.0, 0.0)),
    full_point(3, 2.0, (1.5, 0.75)),
)
CRUISING_MS = 1000


def cruising() -> ControllerRig:
    rig = ControllerRig()
    assert rig.stream(*RAMP_UP) == [SUCCESS] * 4
    rig.wait(CRUISING_MS)
    assert rig.velocity == pytest.approx((1.0, 0.5), abs=0.05)
    return rig


def assert_ramps_down(rig: ControllerRig, *, from_now: bool = True) -> None:
    speed = rig.velocity
    states = rig.states(1000)
    slowing = [s for s in states if any(s[1])]
    assert len(slowing) == pytest.approx(250, abs=15)
    for _, velocity, acceleration in slowing:
        assert velocity[1] == pytest.approx(velocity[0] * speed[1] / speed[0], rel=1e-6)
        assert abs(acceleration[0]) == pytest.approx(LIMITS.acceleration[0])
    assert not rig.status.in_motion


def test_stop_is_answered_at_once_and_ramps_at_full_deceleration_in_proportion() -> None:
    rig = cruising()
    assert rig.send(STOP) == [(LINK, 11, SUCCESS)]
    assert rig.status.in_motion
    assert not rig.status.motion_possible
    assert_ramps_down(rig)
    assert rig.status.motion_possible


@pytest.mark.parametrize("milliseconds", [0, 1, 250, 500, 501, 1200, 1600, 1999, 2000, 5000])
def test_stop_at_any_phase_ends_at_rest_and_lets_a_fresh_trajectory_in(milliseconds: int) -> None:
    rig = ControllerRig()
    rig.stream(*RAMP_UP)
    rig.wait(milliseconds)
    before = rig.velocity
    assert rig.code(STOP) == SUCCESS
    assert rig.velocity == before
    rig.wait(600)
    assert rig.velocity == (0.0, 0.0)
    assert not rig.status.in_motion
    assert not rig.status.in_error
    assert rig.stream(full_point(0, 0.0, rig.position)) == [SUCCESS]


def test_stop_is_taken_from_any_link_and_in_either_message() -> None:
    for stop in (STOP, full_point(-4, 0.0, ())):
        rig = cruising()
        assert rig.code(stop, link=2) == SUCCESS
        assert rig.status.in_motion
        assert_ramps_down(rig)


def test_stop_as_a_topic_stops_and_is_not_answered() -> None:
    rig = cruising()
    assert rig.send(ratio_point(-4, (), 0.0, comm_type=CommType.TOPIC)) == []
    assert_ramps_down(rig)


def test_a_first_point_during_the_ramp_waits_for_rest_and_is_then_answered() -> None:
    rig = cruising()
    rig.send(STOP)
    assert rig.code(ratio_point(0, (0.5, 0.2), 2.0)) is None
    assert rig.wait(200) == []
    assert rig.wait(100) == [(LINK, 11, SUCCESS)]
    rig.wait(2000)
    assert rig.position == pytest.approx((0.5, 0.2), abs=1e-7)


def test_points_of_the_stopped_trajectory_are_refused() -> None:
    rig = cruising()
    rig.send(STOP)
    assert rig.code(full_point(4, 2.5, (1.5, 0.75))) == FAILURE
    assert not rig.violations


def test_an_emergency_stop_latches_and_powers_the_drives_off_at_rest() -> None:
    rig = cruising()
    rig.operate(E_STOP)
    status = rig.status
    assert (status.e_stopped, status.drives_powered, status.motion_possible) == (1, 1, 0)
    assert_ramps_down(rig)
    assert (rig.status.drives_powered, rig.status.in_motion) == (0, 0)
    assert rig.code(ratio_point(0, (0.1, 0.1), 1.0)) == FAILURE
    assert rig.code(STOP) == SUCCESS
    assert rig.status.e_stopped == 1


def test_reset_moves_nothing_and_makes_motion_possible_again() -> None:
    rig = cruising()
    rig.operate(E_STOP)
    rig.wait(1000)
    stood = rig.position
    rig.operate(RESET)
    rig.wait(1000)
    status = rig.status
    assert rig.position == stood
    assert (status.e_stopped, status.drives_powered, status.motion_possible) == (0, 1, 1)
    assert rig.code(ratio_point(0, (0.5, 0.5), 2.0)) == SUCCESS


def test_reset_is_refused_while_the_axes_move() -> None:
    rig = cruising()
    rig.operate(E_STOP)
    assert rig.code(OperatorEvent(RESET)) == FAILURE
    assert rig.status.e_stopped == 1


def test_the_operator_message_is_obeyed_only_where_it_is_enabled(rig: ControllerRig) -> None:
    assert rig.code(OperatorEvent(E_STOP)) == SUCCESS
    assert rig.status.e_stopped == 1
    assert rig.code(OperatorEvent(77)) == FAILURE
    rig = ControllerRig(operator_events=False)
    assert rig.code(OperatorEvent(E_STOP)) == FAILURE
    assert rig.status.e_stopped == 0


def test_an_under_run_starts_the_ramp_at_the_time_of_the_last_point(rig: ControllerRig) -> None:
    rig.stream(*RAMP_UP[:2])
    rig.wait(500)
    at_point = rig.position
    assert at_point == pytest.approx((0.25, 0.125), abs=1e-9)
    assert rig.status.error_code == ErrorCode.BUFFER_UNDERRUN
    assert rig.status.in_error == 1
    rig.wait(250)
    assert rig.velocity == (0.0, 0.0)
    assert rig.position[0] - at_point[0] == pytest.approx(1.0 / (2 * 4.0))


def test_a_stream_that_ends_too_fast_to_stop_at_its_last_point_runs_dry() -> None:
    rig = ControllerRig(start_rule=StartRule(points=3, lead=0, wait=20 * MS, patience=20 * MS))
    speeding_up = (0.02, 0.08, 0.18, 0.30, 0.42)
    rig.stream(*(ratio_point(n, (q, 0.0), 0.1) for n, q in enumerate(speeding_up)))
    rig.wait(600)
    assert rig.status.error_code == ErrorCode.BUFFER_UNDERRUN
    rig.wait(1000)
    assert rig.velocity == (0.0, 0.0)
    assert not rig.violations


def test_a_late_tick_finds_the_under_run_at_its_own_time() -> None:
    early, late = ControllerRig(), ControllerRig()
    for rig in (early, late):
        rig.stream(*RAMP_UP[:2])
    early.states(900)
    late.wait(900)
    assert early.position == late.position


def test_a_silent_sender_of_points_at_speed_is_an_under_run_even_before_the_start() -> None:
    rule = StartRule(points=2, lead=50 * MS, wait=20 * MS, patience=200 * MS)
    rig = ControllerRig(start_rule=rule)
    rig.stream(full_point(0, 0.0, (0.0, 0.0)), full_point(1, 0.01, (2e-4, 0.0), (0.04, 0.0)))
    rig.wait(199)
    assert not any(rig.velocity)
    rig.wait(50)
    assert rig.status.error_code == ErrorCode.BUFFER_UNDERRUN


def test_a_lost_link_starts_the_ramp_at_once_and_flushes() -> None:
    rig = cruising()
    rig.lose()
    assert rig.status.error_code == ErrorCode.LINK_LOST
    assert_ramps_down(rig)
    assert rig.code(RAMP_UP[3], link=2) == FAILURE


def test_a_lost_link_that_does_not_own_the_motion_changes_nothing() -> None:
    rig = cruising()
    rig.lose(link=2)
    rig.wait(1000)
    assert rig.position == pytest.approx((1.5, 0.75))
    assert not rig.status.in_error


def test_a_stop_that_would_leave_the_range_brakes_that_joint_harder() -> None:
    ramp = Ramp((0.0, 1.9), (2.0, 0.8), AxisLimits(LIMITS, 0.05))
    assert ramp.final[1] <= 2.0
    assert ramp.duration == pytest.approx(0.5)


def test_stopping_at_rest_takes_no_time(rig: ControllerRig) -> None:
    rig.send(STOP)
    assert not rig.status.in_motion
    assert rig.status.motion_possible


SPEED = 0.1


def cruise(points: int) -> list[JointTrajPtFull]:
    """Points every 10 ms: speeding up in 50 ms, then on and on at one speed."""
    out = [full_point(0, 0.0, (0.0, 0.0))]
    for number in range(1, points):
        time = number / 100
        ramp = min(time, 0.05)
        at = SPEED * (ramp * ramp / 0.1 + time - ramp)
        out.append(full_point(number, time, (at, 0.0), (SPEED * ramp / 0.05, 0.0)))
    return out


def moving(points: int) -> ControllerRig:
    """Return a rig that got so many points and has moved for 100 ms."""
    rig = ControllerRig(start_rule=StartRule(1, 0, 0, 0))
    assert rig.stream(*cruise(points)) == [SUCCESS] * points
    rig.wait(100)
    return rig


def away(rig: ControllerRig, milliseconds: int) -> None:
    since = rig.now
    rig.now += milliseconds * MS
    rig.controller.was_away(since, rig.now)


def test_a_stall_longer_than_the_stock_runs_nothing_dry_and_the_axes_go_on() -> None:
    rig = moving(21)
    before = rig.position[0]
    away(rig, 200)
    rig.wait(0)
    assert rig.status.error_code == ErrorCode.NONE
    assert rig.position[0] >= before
    assert rig.velocity[0] == pytest.approx(SPEED)
    assert rig.stream(*cruise(40)[21:]) == [SUCCESS] * 19
    rig.wait(100)
    assert rig.status.error_code == ErrorCode.NONE


@pytest.mark.parametrize("milliseconds", [200, 95])  # the stock lasts for 100
def test_what_does_not_come_soon_after_a_stall_is_missed(milliseconds: int) -> None:
    rig = moving(21)
    away(rig, milliseconds)
    rig.wait(19)
    assert rig.status.error_code == ErrorCode.NONE
    rig.wait(2)
    assert rig.status.error_code == ErrorCode.BUFFER_UNDERRUN


def test_a_stall_that_the_stock_outlasts_changes_nothing() -> None:
    stalled, other = moving(60), moving(60)
    away(stalled, 200)
    stalled.wait(0)
    other.wait(200)
    assert stalled.state == other.state


def test_a_buffer_that_had_run_dry_before_the_stall_is_not_filled_by_it() -> None:
    rig = moving(21)
    rig.wait(99)
    away(rig, 5)
    rig.wait(16)
    assert rig.status.error_code == ErrorCode.BUFFER_UNDERRUN


def test_a_motion_that_ends_at_rest_ends_in_its_time(rig: ControllerRig) -> None:
    rig.stream(full_point(0, 0.0, (0.0, 0.0)), full_point(1, 0.5, (0.1, 0.0)))
    rig.wait(100)
    away(rig, 400)
    rig.wait(0)
    assert rig.status.in_motion == 0
    assert rig.position[0] == pytest.approx(0.1, abs=1e-7)


def test_a_start_that_waits_for_points_waits_as_much_longer() -> None:
    rig = ControllerRig(start_rule=StartRule(points=3, lead=0, wait=20 * MS, patience=20 * MS))
    rig.stream(full_point(0, 0.0, (0.0, 0.0)), full_point(1, 0.5, (0.1, 0.0)))
    away(rig, 200)
    rig.wait(10)
    assert not any(rig.velocity)
    rig.wait(11)
    assert any(rig.velocity)


def test_a_stop_ramp_takes_no_longer() -> None:
    rig = moving(60)
    rig.stream(full_point(-4, 0.0, (0.0, 0.0)))
    away(rig, 200)
    rig.wait(0)
    assert rig.velocity == (0.0, 0.0)


@pytest.mark.parametrize("milliseconds", [29, 31])
def test_only_a_time_that_no_timer_explains_is_a_stall(milliseconds: int) -> None:
    from openpendant.controller_emulator.shell.build import build_controller
    from openpendant.controller_emulator.shell.service import Service
    from openpendant.controller_emulator.shell.settings import EmulatorSettings

    async def counted() -> int:
        settings = EmulatorSettings()
        now = 1_000 * MS
        service = Service(build_controller(settings, now), settings, clock=lambda: now)
        service.tick(1)
        now += milliseconds * MS
        service.tick(2)
        return service.controller.referee.events["stalls"]

    assert asyncio.run(counted()) == (milliseconds > 30)
