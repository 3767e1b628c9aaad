"""A jog as the client holds it: the press, its beats, aiming anew, letting go."""

import asyncio
import itertools

import pytest
from rigs.peers.scripted_pendant_server import ScriptedPendantServer

from openpendant.simplemsg.pendant import (
    JogBeat,
    JogEnd,
    JogRelease,
    JogSpace,
    JogStart,
    JogStep,
    JogUndo,
)
from openpendant.simplemsg.verdicts import VerdictCode
from openpendant.tools.pendants.client import Aborted, PendantClient, Refused, WrongArgument

pytestmark = pytest.mark.virtual_clock


async def test_a_press_quotes_the_newest_state_and_declares_its_deadline(
    server: ScriptedPendantServer, pendant: PendantClient
) -> None:
    await asyncio.sleep(0.41)
    async with pendant.jog({1: 0.5, 3: -1.0}, deadline=0.2):
        start = server.one(JogStart)
    assert (start.press, start.space, start.value_count) == (1, JogSpace.JOINTS, 6)
    assert start.values[:6] == (0.0, 0.5, 0.0, -1.0, 0.0, 0.0)
    assert start.deadline == pytest.approx(0.2)
    assert server.sequence - start.state_sequence <= 1


async def test_a_tool_jog_names_its_frame(
    server: ScriptedPendantServer, pendant: PendantClient
) -> None:
    async with pendant.jog_tool(x=0.5, c=-0.25, frame="tool"):
        start = server.one(JogStart)
    assert (start.space, start.frame, start.value_count) == (JogSpace.TOOL, "tool", 6)
    assert start.values[:6] == (0.5, 0.0, 0.0, 0.0, 0.0, -0.25)


async def test_a_held_press_is_beaten_every_50_ms_with_counted_beats(
    server: ScriptedPendantServer, pendant: PendantClient
) -> None:
    async with pendant.jog({0: 1.0}) as jog:
        await jog.hold(1.0)
    beats = server.all(JogBeat)
    assert [beat.beat for beat in beats] == list(range(1, len(beats) + 1))
    assert {beat.press for beat in beats} == {1}
    times = server.times(JogBeat)
    gaps = [after - before for before, after in itertools.pairwise(times)]
    assert max(gaps) < 0.06
    assert 16 <= len(times) <= 20


async def test_leaving_releases_and_tells_how_the_robot_came_to_rest(
    server: ScriptedPendantServer, pendant: PendantClient
) -> None:
    async with pendant.jog({0: 1.0}) as jog:
        assert not jog.is_over
    assert server.one(JogRelease).press == 1
    account = jog.account
    assert account is not None
    assert (account.reason, account.stop_time, account.joint_distance, account.tool_distance) == (
        JogEnd.RELEASED,
        0.0625,
        0.03125,
        0.015625,
    )
    assert account.positions == (0.5,) * 6
    count = len(server.all(JogBeat))
    await asyncio.sleep(0.3)
    assert len(server.all(JogBeat)) == count


async def test_an_error_in_the_block_releases_too(
    server: ScriptedPendantServer, pendant: PendantClient
) -> None:
    with pytest.raises(ZeroDivisionError):
        async with pendant.jog({0: 1.0}):
            _ = 1 / 0
    assert server.one(JogRelease).press == 1


async def test_a_cancelled_block_releases_at_once(
    server: ScriptedPendantServer, pendant: PendantClient
) -> None:
    async def hold_for_ever() -> None:
        async with pendant.jog({0: 1.0}) as jog:
            await jog.hold(1e6)

    holding = asyncio.get_running_loop().create_task(hold_for_ever())
    await asyncio.sleep(0.2)
    cancelled_at = asyncio.get_running_loop().time()
    holding.cancel()
    await asyncio.gather(holding, return_exceptions=True)
    assert server.times(JogRelease) == [pytest.approx(cancelled_at, abs=0.002)]


async def test_aiming_anew_takes_over_with_a_new_press_and_one_release(
    server: ScriptedPendantServer, pendant: PendantClient
) -> None:
    async with pendant.jog({0: 1.0}) as jog:
        await jog.hold(0.2)
        await jog.aim({2: -0.5})
        server.end_jog(1, JogEnd.REPLACED)
        await jog.hold(0.2)
        await jog.aim_tool(z=0.5)
        server.end_jog(2, JogEnd.REPLACED)
        await jog.hold(0.2)
    assert [start.press for start in server.all(JogStart)] == [1, 2, 3]
    beaten = [beat.press for beat in server.all(JogBeat)]
    assert beaten == sorted(beaten)  # no press is beaten once another has taken over
    assert all(beaten.count(press) >= 3 for press in (1, 2, 3))
    assert server.one(JogRelease).press == 3
    assert jog.account is not None
    assert jog.account.press == 3


async def test_a_refused_aim_leaves_the_held_press_alive(
    server: ScriptedPendantServer, pendant: PendantClient
) -> None:
    async with pendant.jog({0: 1.0}) as jog:
        server.refusals[JogStart] = (VerdictCode.UNKNOWN_FRAME, "no frame 'table'")
        with pytest.raises(Refused):
            await jog.aim_tool(x=1.0, frame="table")
        await jog.hold(0.2)
    assert {beat.press for beat in server.all(JogBeat)} == {1}
    assert server.one(JogRelease).press == 1


async def test_a_refused_press_raises_with_cause_and_numbers_and_beats_no_more(
    server: ScriptedPendantServer, pendant: PendantClient
) -> None:
    server.refusals[JogStart] = (VerdictCode.NOT_ENABLED, "it is released")
    with pytest.raises(Refused) as refused:
        async with pendant.jog({0: 1.0}):
            pytest.fail("the block of a refused jog must not run")
    error = refused.value
    assert (error.code, error.joint, error.value, error.limit) == (
        VerdictCode.NOT_ENABLED,
        2,
        7.0,
        6.25,
    )
    assert error.cause
    assert error.remedy
    await asyncio.sleep(0.3)
    assert server.all(JogBeat) == []


async def test_a_stop_ends_the_hold_and_raises_what_it_was(
    server: ScriptedPendantServer, pendant: PendantClient
) -> None:
    async def stop_it() -> None:
        await asyncio.sleep(0.2)
        server.end_jog(1, JogEnd.STOPPED, VerdictCode.STOPPED)

    stopping = asyncio.get_running_loop().create_task(stop_it())
    began = asyncio.get_running_loop().time()
    with pytest.raises(Aborted) as aborted:
        async with pendant.jog({0: 1.0}) as jog:
            await jog.hold(10.0)
    await stopping
    assert aborted.value.code is VerdictCode.STOPPED
    assert asyncio.get_running_loop().time() - began < 0.3
    assert jog.account is not None
    assert jog.account.reason is JogEnd.STOPPED


async def test_a_jog_with_a_bound_lets_go_by_itself_unless_it_is_called_again(
    server: ScriptedPendantServer, pendant: PendantClient
) -> None:
    async with pendant.jog({0: 1.0}, longest=0.5) as jog:
        await jog.hold(2.0)
        began = asyncio.get_running_loop().time()
        await asyncio.sleep(3.0)
        last = server.times(JogBeat)[-1]
        assert 0.4 < last - began < 0.6


async def test_a_jog_without_states_is_refused_here(server: ScriptedPendantServer) -> None:
    async with await PendantClient.connect("127.0.0.1", server.port, state_rate=0) as blind:
        with pytest.raises(WrongArgument, match="subscribe"):
            async with blind.jog({0: 1.0}):
                pytest.fail("a press must quote a state")


async def test_a_joint_that_the_robot_does_not_have_is_named(pendant: PendantClient) -> None:
    with pytest.raises(WrongArgument, match="no joint 6; the robot has joints 0 to 5"):
        pendant.jog({6: 1.0})
    with pytest.raises(WrongArgument, match="no joint -1"):
        await pendant.step({-1: 0.1})


async def test_steps_and_undo_are_motions_with_an_end(
    server: ScriptedPendantServer, pendant: PendantClient
) -> None:
    await (await pendant.step({2: 0.25}, speed=0.5)).done()
    result = await (await pendant.step_tool(z=0.125, a=0.5, frame="tool")).done()
    await (await pendant.undo_jog(speed=0.5)).done()
    joints, tool = server.all(JogStep)
    assert (joints.space, joints.values[:3], joints.speed) == (1, (0.0, 0.0, 0.25), 0.5)
    assert (tool.space, tool.frame, tool.values[:6]) == (2, "tool", (0, 0, 0.125, 0.5, 0, 0))
    assert server.one(JogUndo).speed == 0.5
    assert (result.plan_time, result.motion_time) == (0.25, 0.5)
