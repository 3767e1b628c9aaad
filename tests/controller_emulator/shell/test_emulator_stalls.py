"""A process that was not run for a time blames nobody for it: what arrived is taken first."""

from __future__ import annotations

import asyncio

import pytest
from rigs.cells.controller_rig import MS, ControllerRig, full_point

from openpendant.controller_emulator.error_codes import ErrorCode
from openpendant.controller_emulator.interpolation.servo import StartRule
from openpendant.simplemsg import JointTrajPtFull, ReplyCode

SPEED = 0.1
SUCCESS = ReplyCode.SUCCESS


def cruising(points: int) -> list[JointTrajPtFull]:
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
    assert rig.stream(*cruising(points)) == [SUCCESS] * points
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
    assert rig.stream(*cruising(40)[21:]) == [SUCCESS] * 19
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


def test_a_motion_that_ends_at_rest_ends_in_its_time() -> None:
    rig = ControllerRig()
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
        service = Service(build_controller(settings, now), settings)
        service.journal._clock = lambda: now
        service.tick(1)
        now += milliseconds * MS
        service.tick(2)
        return service.controller.referee.events["stalls"]

    assert asyncio.run(counted()) == (milliseconds > 30)
