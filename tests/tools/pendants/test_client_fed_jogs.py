"""Jogs of devices that beat by themselves: nothing leaves that was not fed."""

import asyncio

import pytest
from rigs.peers.scripted_pendant_server import ScriptedPendantServer

from openpendant.simplemsg import pendant as messages
from openpendant.simplemsg.verdicts import VerdictCode
from openpendant.tools.pendants.client import PendantClient, Refused

pytestmark = pytest.mark.virtual_clock

JOINT_1 = (1.0, 0.0, 0.0, 0.0, 0.0, 0.0)
TWO_JOINTS = (1.0, -1.0, 0.0, 0.0, 0.0, 0.0)


async def test_a_fed_jog_beats_when_it_is_fed_and_never_by_itself(
    server: ScriptedPendantServer, pendant: PendantClient
) -> None:
    loop = asyncio.get_running_loop()
    fed = []
    async with pendant.fed_jog(JOINT_1, deadline=0.15) as jog:
        for pause in (0.05, 0.1, 0.02):
            await asyncio.sleep(pause)
            fed.append(loop.time())
            jog.beat()
    assert [beat.beat for beat in server.all(messages.JogBeat)] == [1, 2, 3]
    assert server.times(messages.JogBeat) == pytest.approx(fed, abs=0.002)


async def test_a_beat_that_comes_too_late_does_not_leave(
    server: ScriptedPendantServer, pendant: PendantClient
) -> None:
    async with pendant.fed_jog(JOINT_1, deadline=0.15) as jog:
        await asyncio.sleep(0.2)
        jog.beat()
        await asyncio.sleep(0.01)
    assert server.all(messages.JogBeat) == []


async def test_letting_go_leaves_at_once_and_ends_the_beats(
    server: ScriptedPendantServer, pendant: PendantClient
) -> None:
    async with pendant.fed_jog(JOINT_1) as jog:
        jog.let_go()
        jog.beat()
        await asyncio.sleep(0.01)
        assert server.one(messages.JogRelease).press == 1
    assert server.all(messages.JogBeat) == []
    assert jog.account is not None
    assert len(server.all(messages.JogRelease)) == 1


async def test_a_press_whose_verdict_is_still_to_come_is_let_go_too(
    server: ScriptedPendantServer, pendant: PendantClient
) -> None:
    server.mutes = True
    jog = pendant.fed_jog(JOINT_1)
    pressing = asyncio.ensure_future(jog.__aenter__())
    await asyncio.sleep(0.01)
    jog.let_go()
    await asyncio.sleep(0.01)
    assert [each.press for each in server.all(messages.JogRelease)] == [1]
    pressing.cancel()
    await asyncio.gather(pressing, return_exceptions=True)


async def test_a_jog_that_was_let_go_before_it_was_pressed_moves_nothing(
    server: ScriptedPendantServer, pendant: PendantClient
) -> None:
    jog = pendant.fed_jog(JOINT_1)
    jog.let_go()
    with pytest.raises(Refused) as refused:
        await jog.__aenter__()
    assert refused.value.code == VerdictCode.PRESS_DEAD
    assert server.all(messages.JogStart) == []


async def test_another_aim_takes_over_and_the_newest_is_let_go(
    server: ScriptedPendantServer, pendant: PendantClient
) -> None:
    async with pendant.fed_jog(JOINT_1) as jog:
        await jog.aim_at(TWO_JOINTS)
        server.end_jog(1, messages.JogEnd.REPLACED)
        await asyncio.sleep(0.01)
        jog.let_go()
    first, second = server.all(messages.JogStart)
    assert (first.values[:6], second.values[:6]) == (JOINT_1, TWO_JOINTS)
    assert [each.press for each in server.all(messages.JogRelease)] == [2]


async def test_a_fed_jog_of_the_tool_names_its_frame(
    server: ScriptedPendantServer, pendant: PendantClient
) -> None:
    async with pendant.fed_jog(JOINT_1, frame="tool"):
        start = server.one(messages.JogStart)
    assert (start.space, start.frame) == (messages.JogSpace.TOOL, "tool")


async def test_a_fed_enabling_device_gives_no_sign_by_itself(
    server: ScriptedPendantServer, pendant: PendantClient
) -> None:
    async with pendant.fed_enabling() as device:
        await asyncio.sleep(0.01)
        before = len(server.all(messages.Enabling))
        await asyncio.sleep(0.3)
        assert len(server.all(messages.Enabling)) == before
        device.beat()
        await asyncio.sleep(0.01)
        (_, _, sign) = server.all(messages.Enabling)
        assert sign.position == messages.EnablingPosition.HELD
    await asyncio.sleep(0.01)
    assert server.all(messages.Enabling)[-1].position == messages.EnablingPosition.RELEASED


async def test_the_sign_of_a_fed_device_goes_in_front_of_each_beat(
    server: ScriptedPendantServer, pendant: PendantClient
) -> None:
    async with pendant.fed_enabling(), pendant.fed_jog(JOINT_1) as jog:
        await asyncio.sleep(0.05)
        before = len(server.got)
        jog.beat()
        await asyncio.sleep(0.01)
        came = [type(each) for _, each in server.got[before:]]
    assert came == [messages.Enabling, messages.JogBeat]
