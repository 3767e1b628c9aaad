"""Jogs as the client holds them; its authority, modes, speeds, enabling (training) and stops."""

import asyncio
import itertools

import pytest
from rigs.peers.scripted_pendant_server import SESSION, ScriptedPendantServer

from openpendant.simplemsg import pendant as messages
from openpendant.simplemsg.verdicts import VerdictCode
from openpendant.tools.pendants.client import Aborted, PendantClient, Refused, WrongArgument

pytestmark = pytest.mark.virtual_clock


async def test_a_press_quotes_the_newest_state_and_declares_its_deadline(
    server: ScriptedPendantServer, pendant: PendantClient
) -> None:
    await asyncio.sleep(0.41)
    async with pendant.jog({1: 0.5, 3: -1.0}, deadline=0.2):
        start = server.one(messages.JogStart)
    assert (start.press, start.space, start.value_count) == (1, messages.JogSpace.JOINTS, 6)
    assert start.values[:6] == (0.0, 0.5, 0.0, -1.0, 0.0, 0.0)
    assert start.deadline == pytest.approx(0.2)
    assert server.sequence - start.state_sequence <= 1


async def test_a_tool_jog_names_its_frame(
    server: ScriptedPendantServer, pendant: PendantClient
) -> None:
    async with pendant.jog_tool(x=0.5, c=-0.25, frame="tool"):
        start = server.one(messages.JogStart)
    assert (start.space, start.frame, start.value_count) == (messages.JogSpace.TOOL, "tool", 6)
    assert start.values[:6] == (0.5, 0.0, 0.0, 0.0, 0.0, -0.25)


async def test_a_held_press_is_beaten_every_50_ms_with_counted_beats(
    server: ScriptedPendantServer, pendant: PendantClient
) -> None:
    async with pendant.jog({0: 1.0}) as jog:
        await jog.hold(1.0)
    beats = server.all(messages.JogBeat)
    assert [beat.beat for beat in beats] == list(range(1, len(beats) + 1))
    assert {beat.press for beat in beats} == {1}
    times = server.times(messages.JogBeat)
    gaps = [after - before for before, after in itertools.pairwise(times)]
    assert max(gaps) < 0.06
    assert 16 <= len(times) <= 20


async def test_leaving_releases_and_tells_how_the_robot_came_to_rest(
    server: ScriptedPendantServer, pendant: PendantClient
) -> None:
    async with pendant.jog({0: 1.0}) as jog:
        assert not jog.is_over
    assert server.one(messages.JogRelease).press == 1
    account = jog.account
    assert account is not None
    assert (account.reason, account.stop_time, account.joint_distance, account.tool_distance) == (
        messages.JogEnd.RELEASED,
        0.0625,
        0.03125,
        0.015625,
    )
    assert account.positions == (0.5,) * 6
    count = len(server.all(messages.JogBeat))
    await asyncio.sleep(0.3)
    assert len(server.all(messages.JogBeat)) == count


async def test_an_error_in_the_block_releases_too(
    server: ScriptedPendantServer, pendant: PendantClient
) -> None:
    with pytest.raises(ZeroDivisionError):
        async with pendant.jog({0: 1.0}):
            _ = 1 / 0
    assert server.one(messages.JogRelease).press == 1


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
    assert server.times(messages.JogRelease) == [pytest.approx(cancelled_at, abs=0.002)]


async def test_aiming_anew_takes_over_with_a_new_press_and_one_release(
    server: ScriptedPendantServer, pendant: PendantClient
) -> None:
    async with pendant.jog({0: 1.0}) as jog:
        await jog.hold(0.2)
        await jog.aim({2: -0.5})
        server.end_jog(1, messages.JogEnd.REPLACED)
        await jog.hold(0.2)
        await jog.aim_tool(z=0.5)
        server.end_jog(2, messages.JogEnd.REPLACED)
        await jog.hold(0.2)
    assert [start.press for start in server.all(messages.JogStart)] == [1, 2, 3]
    beaten = [beat.press for beat in server.all(messages.JogBeat)]
    assert beaten == sorted(beaten)  # no press is beaten once another has taken over
    assert all(beaten.count(press) >= 3 for press in (1, 2, 3))
    assert server.one(messages.JogRelease).press == 3
    assert jog.account is not None
    assert jog.account.press == 3


async def test_a_refused_aim_leaves_the_held_press_alive(
    server: ScriptedPendantServer, pendant: PendantClient
) -> None:
    async with pendant.jog({0: 1.0}) as jog:
        server.refusals[messages.JogStart] = (VerdictCode.UNKNOWN_FRAME, "no frame 'table'")
        with pytest.raises(Refused):
            await jog.aim_tool(x=1.0, frame="table")
        await jog.hold(0.2)
    assert {beat.press for beat in server.all(messages.JogBeat)} == {1}
    assert server.one(messages.JogRelease).press == 1


async def test_a_refused_press_raises_with_cause_and_numbers_and_beats_no_more(
    server: ScriptedPendantServer, pendant: PendantClient
) -> None:
    server.refusals[messages.JogStart] = (VerdictCode.NOT_ENABLED, "it is released")
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
    assert server.all(messages.JogBeat) == []


async def test_a_stop_ends_the_hold_and_raises_what_it_was(
    server: ScriptedPendantServer, pendant: PendantClient
) -> None:
    async def stop_it() -> None:
        await asyncio.sleep(0.2)
        server.end_jog(1, messages.JogEnd.STOPPED, VerdictCode.STOPPED)

    stopping = asyncio.get_running_loop().create_task(stop_it())
    began = asyncio.get_running_loop().time()
    with pytest.raises(Aborted) as aborted:
        async with pendant.jog({0: 1.0}) as jog:
            await jog.hold(10.0)
    await stopping
    assert aborted.value.code is VerdictCode.STOPPED
    assert asyncio.get_running_loop().time() - began < 0.3
    assert jog.account is not None
    assert jog.account.reason is messages.JogEnd.STOPPED


async def test_a_jog_with_a_bound_lets_go_by_itself_unless_it_is_called_again(
    server: ScriptedPendantServer, pendant: PendantClient
) -> None:
    async with pendant.jog({0: 1.0}, longest=0.5) as jog:
        await jog.hold(2.0)
        began = asyncio.get_running_loop().time()
        await asyncio.sleep(3.0)
        last = server.times(messages.JogBeat)[-1]
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
    joints, tool = server.all(messages.JogStep)
    assert (joints.space, joints.values[:3], joints.speed) == (1, (0.0, 0.0, 0.25), 0.5)
    assert (tool.space, tool.frame, tool.values[:6]) == (2, "tool", (0, 0, 0.125, 0.5, 0, 0))
    assert server.one(messages.JogUndo).speed == 0.5
    assert (result.plan_time, result.motion_time) == (0.25, 0.5)


RELEASED, HELD, PANIC = messages.EnablingPosition


def has_control(pendant: PendantClient) -> bool:
    return pendant.in_control


async def test_control_is_taken_beaten_each_second_and_given_back(
    server: ScriptedPendantServer, pendant: PendantClient
) -> None:
    async with pendant.control():
        assert has_control(pendant)
        await asyncio.sleep(3.5)
        assert len(server.all(messages.AuthorityBeat)) == 3
    assert not has_control(pendant)
    await asyncio.sleep(2)
    assert len(server.all(messages.AuthorityBeat)) == 3
    assert [asked.action for asked in server.all(messages.Authority)] == [
        messages.AuthorityAction.REQUEST,
        messages.AuthorityAction.RELEASE,
    ]


async def test_control_can_be_taken_over(
    server: ScriptedPendantServer, pendant: PendantClient
) -> None:
    async with pendant.control(force=True):
        assert server.one(messages.Authority).action == messages.AuthorityAction.FORCE


async def test_refused_control_runs_no_block(
    server: ScriptedPendantServer, pendant: PendantClient
) -> None:
    server.refusals[messages.Authority] = (VerdictCode.HELD_BY_OTHER, "held by ada")
    with pytest.raises(Refused, match="held by ada"):
        async with pendant.control():
            pytest.fail("without control the block must not run")
    assert not pendant.in_control


async def test_whoever_holds_control_hears_who_wants_it(
    server: ScriptedPendantServer, pendant: PendantClient
) -> None:
    heard: list[str] = []
    async with pendant.control(wanted=lambda reply_to: heard.append(reply_to.client)):
        server.send(messages.AuthorityWanted(session=9, client="bob"))
        await pendant.next_state()
    server.send(messages.AuthorityWanted(session=9, client="too late"))
    await pendant.next_state()
    assert heard == ["bob"]


async def test_control_that_was_taken_over_is_no_longer_beaten(
    server: ScriptedPendantServer, pendant: PendantClient
) -> None:
    async with pendant.control():
        server.send(
            messages.AuthorityChanged(
                holder=SESSION, reason=messages.AuthorityReason.GRANTED, client="us"
            )
        )
        await pendant.next_state()
        assert has_control(pendant)
        server.send(
            messages.AuthorityChanged(
                holder=9, reason=messages.AuthorityReason.TAKEN_OVER, client="bob"
            )
        )
        await pendant.next_state()
        assert not has_control(pendant)
        await asyncio.sleep(3)
    assert server.all(messages.AuthorityBeat) == []


async def test_enabling_is_released_first_held_every_50_ms_and_let_go(
    server: ScriptedPendantServer, pendant: PendantClient
) -> None:
    async with pendant.enabling():
        await asyncio.sleep(0.52)
    await pendant.next_state()
    positions = [message.position for message in server.all(messages.Enabling)]
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
    positions = [message.position for message in server.all(messages.Enabling)]
    assert positions == [RELEASED, HELD, PANIC, PANIC, PANIC, RELEASED, HELD, RELEASED]


async def test_mode_speed_pause_and_stops_are_one_message_each(
    server: ScriptedPendantServer, pendant: PendantClient
) -> None:
    await pendant.set_mode(messages.OperatingMode.MANUAL_HIGH)
    await pendant.set_speed(0.5, tool_speed=0.125)
    await pendant.pause()
    await pendant.resume()
    await pendant.program_stop()
    await pendant.stop("seen something")
    await pendant.reset_stop()
    assert server.one(messages.SetMode).mode == messages.OperatingMode.MANUAL_HIGH
    assert (server.one(messages.SetSpeed).override, server.one(messages.SetSpeed).tool_speed) == (
        0.5,
        0.125,
    )
    assert [message.action for message in server.all(messages.MotionControl)] == [1, 2, 3]
    assert server.one(messages.SoftwareStop).reason == "seen something"
    assert len(server.all(messages.ResetStop)) == 1


async def test_home_and_programs_are_motions_with_an_end(
    server: ScriptedPendantServer, pendant: PendantClient
) -> None:
    await (await pendant.home("zero", speed=0.5)).done()
    run = await pendant.run_program(
        "pick", run=messages.RunKind.STEP_FORWARD, line=3, loops=0, revision=5
    )
    await run.done()
    assert (server.one(messages.Home).target, server.one(messages.Home).speed) == ("zero", 0.5)
    sent = server.one(messages.ProgramRun)
    assert (sent.program, sent.run, sent.line) == ("pick", messages.RunKind.STEP_FORWARD, 3)
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
