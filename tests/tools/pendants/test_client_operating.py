"""The client's authority, modes, speeds, enabling (training) and stops."""

import asyncio

import pytest
from rigs.peers.scripted_pendant_server import SESSION, ScriptedPendantServer

from openpendant.simplemsg.pendant import (
    Authority,
    AuthorityAction,
    AuthorityBeat,
    AuthorityChanged,
    AuthorityReason,
    AuthorityWanted,
    Enabling,
    EnablingPosition,
    Home,
    MotionControl,
    OperatingMode,
    ProgramRun,
    ResetStop,
    RunKind,
    SetMode,
    SetSpeed,
    SoftwareStop,
)
from openpendant.simplemsg.verdicts import VerdictCode
from openpendant.tools.pendants.client import Aborted, PendantClient, Refused

pytestmark = pytest.mark.virtual_clock

RELEASED, HELD, PANIC = EnablingPosition


def has_control(pendant: PendantClient) -> bool:
    return pendant.in_control


async def test_control_is_taken_beaten_each_second_and_given_back(
    server: ScriptedPendantServer, pendant: PendantClient
) -> None:
    async with pendant.control():
        assert has_control(pendant)
        await asyncio.sleep(3.5)
        assert len(server.all(AuthorityBeat)) == 3
    assert not has_control(pendant)
    await asyncio.sleep(2)
    assert len(server.all(AuthorityBeat)) == 3
    assert [asked.action for asked in server.all(Authority)] == [
        AuthorityAction.REQUEST,
        AuthorityAction.RELEASE,
    ]


async def test_control_can_be_taken_over(
    server: ScriptedPendantServer, pendant: PendantClient
) -> None:
    async with pendant.control(force=True):
        assert server.one(Authority).action == AuthorityAction.FORCE


async def test_refused_control_runs_no_block(
    server: ScriptedPendantServer, pendant: PendantClient
) -> None:
    server.refusals[Authority] = (VerdictCode.HELD_BY_OTHER, "held by ada")
    with pytest.raises(Refused, match="held by ada"):
        async with pendant.control():
            pytest.fail("without control the block must not run")
    assert not pendant.in_control


async def test_whoever_holds_control_hears_who_wants_it(
    server: ScriptedPendantServer, pendant: PendantClient
) -> None:
    heard: list[str] = []
    async with pendant.control(wanted=lambda reply_to: heard.append(reply_to.client)):
        server.send(AuthorityWanted(session=9, client="bob"))
        await pendant.next_state()
    server.send(AuthorityWanted(session=9, client="too late"))
    await pendant.next_state()
    assert heard == ["bob"]


async def test_control_that_was_taken_over_is_no_longer_beaten(
    server: ScriptedPendantServer, pendant: PendantClient
) -> None:
    async with pendant.control():
        server.send(AuthorityChanged(holder=SESSION, reason=AuthorityReason.GRANTED, client="us"))
        await pendant.next_state()
        assert has_control(pendant)
        server.send(AuthorityChanged(holder=9, reason=AuthorityReason.TAKEN_OVER, client="bob"))
        await pendant.next_state()
        assert not has_control(pendant)
        await asyncio.sleep(3)
    assert server.all(AuthorityBeat) == []


async def test_enabling_is_released_first_held_every_50_ms_and_let_go(
    server: ScriptedPendantServer, pendant: PendantClient
) -> None:
    async with pendant.enabling():
        await asyncio.sleep(0.52)
    await pendant.next_state()
    positions = [message.position for message in server.all(Enabling)]
    assert positions[:2] == [RELEASED, HELD]
    assert positions[2:-1] == [HELD] * 10
    assert positions[-1] == RELEASED


async def test_enabling_pressed_through_says_panic_until_it_is_let_go(
    server: ScriptedPendantServer, pendant: PendantClient
) -> None:
    async with pendant.enabling() as device:
        device.press_through()
        await asyncio.sleep(0.11)
        device.let_go()
        device.hold()
        assert device.position is HELD
    await pendant.next_state()
    positions = [message.position for message in server.all(Enabling)]
    assert positions == [RELEASED, HELD, PANIC, PANIC, PANIC, RELEASED, HELD, RELEASED]


async def test_mode_speed_pause_and_stops_are_one_message_each(
    server: ScriptedPendantServer, pendant: PendantClient
) -> None:
    await pendant.set_mode(OperatingMode.MANUAL_HIGH)
    await pendant.set_speed(0.5, tool_speed=0.125)
    await pendant.pause()
    await pendant.resume()
    await pendant.program_stop()
    await pendant.stop("seen something")
    await pendant.reset_stop()
    assert server.one(SetMode).mode == OperatingMode.MANUAL_HIGH
    assert (server.one(SetSpeed).override, server.one(SetSpeed).tool_speed) == (0.5, 0.125)
    assert [message.action for message in server.all(MotionControl)] == [1, 2, 3]
    assert server.one(SoftwareStop).reason == "seen something"
    assert len(server.all(ResetStop)) == 1


async def test_home_and_programs_are_motions_with_an_end(
    server: ScriptedPendantServer, pendant: PendantClient
) -> None:
    await (await pendant.home("zero", speed=0.5)).done()
    run = await pendant.run_program("pick", run=RunKind.STEP_FORWARD, line=3, loops=0, revision=5)
    await run.done()
    assert (server.one(Home).target, server.one(Home).speed) == ("zero", 0.5)
    sent = server.one(ProgramRun)
    assert (sent.program, sent.run, sent.line) == ("pick", RunKind.STEP_FORWARD, 3)
    assert (sent.loops, sent.revision) == (0, 5)


async def test_an_aborted_motion_says_why(
    server: ScriptedPendantServer, pendant: PendantClient
) -> None:
    server.completes = False
    motion = await pendant.home()
    assert not motion.is_over
    server.end_motion(motion.request_id, VerdictCode.PROGRAM_STOPPED)
    with pytest.raises(Aborted) as aborted:
        await motion.done()
    assert aborted.value.code is VerdictCode.PROGRAM_STOPPED
    assert aborted.value.cause.startswith("A program stop")
    assert motion.is_over
