"""What the tester does to a robot: nothing without permission, and never much with it."""

import asyncio
import struct
import tracemalloc
from collections.abc import Callable
from dataclasses import replace

import pytest
from rigs.faults.faulty_servers import LIMITS, START, checks_named, sound_server, words_of
from rigs.peers.fixed_layout_controllers import Receiver, clipping, fanuc, running, staubli

from openpendant.simplemsg import STANDARD as STANDARD_MESSAGES
from openpendant.simplemsg import ByteOrder, codec_for
from openpendant.tools.packets.conformance.check import (
    PASSED,
    Check,
    CheckFinding,
    CheckVerdict,
    Judgement,
    Profile,
)
from openpendant.tools.packets.conformance.server.checks import STANDARD, ServerCheck
from openpendant.tools.packets.conformance.server.monitor import INTERRUPTED, Watch
from openpendant.tools.packets.conformance.server.moving import ready
from openpendant.tools.packets.conformance.server.runner import applicable, judge
from openpendant.tools.packets.conformance.server.target import Target
from openpendant.tools.packets.conformance.server.wire import Wire

pytestmark = pytest.mark.virtual_clock

CONTROLLERS = pytest.mark.parametrize("receive", [fanuc, staubli, clipping])


def detail_of(judgement: Judgement, number: str) -> str:
    return next(r.finding.detail for r in judgement.results if r.check.number == number)


@CONTROLLERS
@pytest.mark.parametrize("profile", [Profile.GENERIC, Profile.MINIMUM])
async def test_without_permission_no_controller_is_moved(
    receive: Receiver, profile: Profile
) -> None:
    async with running(receive) as (robot, options):
        await judge(replace(options, profile=profile, limits=LIMITS))
    assert robot.farthest == 0.0
    assert robot.points == 0


@CONTROLLERS
@pytest.mark.parametrize("among", ["moving", pytest.param("all", marks=pytest.mark.conformance)])
async def test_with_permission_no_controller_is_moved_far(receive: Receiver, among: str) -> None:
    # What does not move sends no point with permission either: it is tried in `make conformance`.
    async with running(receive) as (robot, options):
        permitted = replace(options, may_move=True)
        checks = [e for e in applicable(permitted) if e.moves or among == "all"]
        await judge(permitted, checks=checks)
    assert robot.points > 0
    assert robot.farthest < options.amplitude + 0.03


async def test_what_a_controller_of_fixed_layout_would_take_for_a_point_is_not_sent() -> None:
    async with running(fanuc) as (_, options):
        judgement = await judge(options)
    assert "a lone PING is not answered" in detail_of(judgement, "FS18")
    (ping,) = [r for r in judgement.results if r.check.number == "RS01"]
    assert ping.finding.habit == "ABB, Fanuc, Stäubli: PING is not known"
    assert words_of(judgement, CheckVerdict.FAILED) == []


def moving_check(body: Callable[[Target], object]) -> ServerCheck:
    return Check("MS90", "made up", "", body, moves=True, profiles=STANDARD)  # type: ignore[arg-type]  # any coroutine will do


async def _run_away(target: Target) -> CheckFinding:
    mover = await ready(target)
    far = tuple(value + 1.0 for value in mover.start)
    await mover.accepted(0, far, 5.0)
    await asyncio.sleep(20.0)
    return PASSED


async def test_a_robot_that_goes_too_far_is_stopped_and_the_check_fails() -> None:
    async with sound_server(may_move=True) as (service, options):
        judgement = await judge(options, checks=[moving_check(_run_away), *checks_named(["MS02"])])
        first, second = judgement.results
        assert first.finding.verdict is CheckVerdict.FAILED
        assert "it was sent STOP" in first.finding.detail
        assert second.finding.verdict is CheckVerdict.PASSED
        assert service.controller.motion(service.now)[0] == pytest.approx(START, abs=1e-3)


async def test_a_robot_that_goes_too_far_again_and_again_is_not_moved_any_more() -> None:
    async with sound_server(may_move=True) as (_, options):
        checks = [moving_check(_run_away)] * 3
        judgement = await judge(options, checks=[*checks, *checks_named(["MS01"])])
        assert "it went too far 3 times" in detail_of(judgement, "MS01")


async def test_the_way_back_is_slow() -> None:
    async with sound_server(may_move=True, amplitude=0.2) as (service, options):
        fastest = 0.0

        async def look() -> None:
            nonlocal fastest
            while True:
                await asyncio.sleep(0.01)
                fastest = max(fastest, *map(abs, service.controller.motion(service.now)[1]))

        looking = asyncio.create_task(look())
        await judge(options, checks=checks_named(["MS09", "MS10", "MS12", "SS02"]))
        looking.cancel()
        assert fastest < 0.2


@pytest.mark.parametrize("after", [0.5, 4.0, 9.0, 14.0])
async def test_an_interrupted_run_leaves_a_robot_that_stands(after: float) -> None:
    async with sound_server(may_move=True) as (service, options):

        def plan(interrupt: Callable[[], None]) -> None:
            asyncio.get_running_loop().call_later(after, interrupt)

        checks = [entry for entry in applicable(options) if entry.moves]
        judgement = await judge(options, checks=checks, on_start=plan)
        assert service.controller.status(service.now).in_motion == 0
        assert judgement.results[-1].finding.detail == INTERRUPTED
        assert words_of(judgement, CheckVerdict.FAILED) == []
        assert len(judgement.results) == len(checks)


async def test_an_interrupted_motion_is_sent_stop_on_two_links() -> None:
    async with sound_server(may_move=True) as (service, options):
        interrupts: list[Callable[[], None]] = []

        async def interrupt_in_motion(target: Target) -> CheckFinding:
            await (await ready(target)).set_off(5.0)
            before = service.controller.referee.events["stops"]
            asyncio.get_running_loop().call_soon(interrupts[0])
            try:
                await asyncio.sleep(5.0)
            finally:
                stops.append(before)
            return PASSED

        stops: list[int] = []
        await judge(options, checks=[moving_check(interrupt_in_motion)], on_start=interrupts.append)
        assert service.controller.referee.events["stops"] == stops[0] + 2
        assert service.controller.status(service.now).in_motion == 0


async def test_large_frames_do_not_fill_the_memory() -> None:
    wire = Wire("state", codec_for(STANDARD_MESSAGES, ByteOrder.LITTLE, 4))
    watch = Watch(wire)
    large = struct.pack("<4i", 65_535, 9999, 1, 0) + bytes(65_523)
    tracemalloc.start()
    for _ in range(600):
        wire.data_received(large)
    size, _ = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert len(watch.frames) == 600
    assert size < 2_000_000
