"""A jog that is over stays over, and a press whose verdict is late, or never comes, is let go."""

import asyncio
import dataclasses
from collections.abc import Awaitable, Callable
from contextlib import suppress

import pytest
from rigs.peers.scripted_pendant_server import ScriptedPendantServer

from openpendant.simplemsg import Message
from openpendant.simplemsg.pendant import JogBeat, JogEnd, JogRelease, JogStart
from openpendant.simplemsg.verdicts import VerdictCode
from openpendant.tools.pendants.client import (
    Aborted,
    ConnectionLost,
    Jog,
    PendantClient,
    Refused,
    Unanswered,
)

pytestmark = pytest.mark.virtual_clock


def hang(seconds: float) -> None:
    """Let time pass without the event loop, as a program does that computes."""
    loop = asyncio.get_running_loop()
    loop._selector.now_ns += round(seconds * 1e9)  # type: ignore[attr-defined]


HANG = 0.3
"""A program whose loop hangs so long has missed every deadline [s]."""


async def refusal(call: Awaitable[object]) -> VerdictCode | int:
    with pytest.raises(Refused) as refused:
        await call
    return refused.value.code


def aims(jog: Jog) -> list[Awaitable[None]]:
    return [jog.aim({2: -0.5}), jog.aim_tool(z=0.5)]


# How a jog comes to its end; None: the server has not said so.


async def end_in_silence(server: ScriptedPendantServer, jog: Jog) -> None:
    server.end_jog(1, JogEnd.SILENT)
    await asyncio.sleep(0.01)


async def stop(server: ScriptedPendantServer, jog: Jog) -> None:
    server.end_jog(1, JogEnd.STOPPED, VerdictCode.STOPPED)
    await asyncio.sleep(0.01)


async def stop_by_an_override_of_0(server: ScriptedPendantServer, jog: Jog) -> None:
    server.end_jog(1, JogEnd.STOPPED)
    await asyncio.sleep(0.01)


async def release(server: ScriptedPendantServer, jog: Jog) -> None:
    await jog.release()


async def leave_alone(server: ScriptedPendantServer, jog: Jog) -> None:
    await asyncio.sleep(1.2)


async def hang_up_the_loop(server: ScriptedPendantServer, jog: Jog) -> None:
    hang(HANG)


async def hang_and_beat_again(server: ScriptedPendantServer, jog: Jog) -> None:
    hang(HANG)
    await asyncio.sleep(0.06)


End = Callable[[ScriptedPendantServer, Jog], Awaitable[None]]

BY_THE_SERVER: list[End] = [end_in_silence, stop, stop_by_an_override_of_0]
BY_OURSELVES: list[End] = [leave_alone, hang_up_the_loop, hang_and_beat_again]


@pytest.mark.parametrize("end", [*BY_THE_SERVER, release, *BY_OURSELVES])
async def test_an_aim_after_the_end_is_refused_here_and_no_press_leaves(
    end: End, server: ScriptedPendantServer, pendant: PendantClient
) -> None:
    with suppress(Aborted):  # leaving tells of the stop
        async with pendant.jog({0: 1.0}, longest=1.0) as jog:
            await jog.hold(0.12)
            await end(server, jog)
            for aim in aims(jog):
                assert await refusal(aim) is VerdictCode.PRESS_DEAD
    assert [start.press for start in server.all(JogStart)] == [1]


@pytest.mark.parametrize("end", [*BY_THE_SERVER, *BY_OURSELVES])
async def test_a_hold_after_another_end_than_the_release_raises(
    end: End, server: ScriptedPendantServer, pendant: PendantClient
) -> None:
    with suppress(Aborted):
        async with pendant.jog({0: 1.0}, longest=1.0) as jog:
            await jog.hold(0.12)
            await end(server, jog)
            with pytest.raises(Aborted):
                await jog.hold(1.0)


async def test_a_hold_whose_press_falls_silent_raises_and_says_why(
    server: ScriptedPendantServer, pendant: PendantClient
) -> None:
    async with pendant.jog({0: 1.0}) as jog:
        asyncio.get_running_loop().call_later(0.2, server.end_jog, 1, JogEnd.SILENT)
        with pytest.raises(Aborted, match="the server heard no beat within its deadline") as told:
            await jog.hold(10.0)
    assert told.value.code is VerdictCode.PRESS_DEAD
    assert jog.account is not None
    assert jog.account.reason is JogEnd.SILENT


async def test_a_hold_that_another_task_releases_returns(pendant: PendantClient) -> None:
    async with pendant.jog({0: 1.0}) as jog:
        holding = asyncio.create_task(jog.hold(10.0))
        await asyncio.sleep(0.1)
        await jog.release()
        await holding


async def test_a_hold_goes_on_while_another_task_aims(
    server: ScriptedPendantServer, pendant: PendantClient
) -> None:
    answer_with(server, JogEnd.REPLACED)
    async with pendant.jog({0: 1.0}) as jog:
        began = asyncio.get_running_loop().time()
        holding = asyncio.create_task(jog.hold(1.0))
        await asyncio.sleep(0.1)
        await jog.aim({1: 1.0})
        await holding
        assert asyncio.get_running_loop().time() - began == pytest.approx(1.0, abs=0.01)


def answer_with(server: ScriptedPendantServer, why: JogEnd, *, verdict_first: bool = True) -> None:
    """Have the server say of the first press, at the verdict on the second, how it ended."""
    judge = server._judge

    def judged(message: Message, request_id: int) -> None:
        takes_over = isinstance(message, JogStart) and message.press == 2
        if takes_over and not verdict_first:
            server.end_jog(1, why)
        judge(message, request_id)
        if takes_over and verdict_first:
            server.end_jog(1, why)

    server._judge = judged  # type: ignore[method-assign]


@pytest.mark.parametrize("verdict_first", [True, False])
async def test_a_press_that_began_another_motion_is_released_at_once(
    verdict_first: bool, server: ScriptedPendantServer, pendant: PendantClient
) -> None:
    """The server had ended the jog, and its word was under way when the press left."""
    answer_with(server, JogEnd.SILENT, verdict_first=verdict_first)
    async with pendant.jog({0: 1.0}) as jog:
        await jog.hold(0.12)
        assert await refusal(jog.aim({1: 1.0})) is VerdictCode.PRESS_DEAD
        assert server.one(JogRelease).press == 2
        beats = len(server.all(JogBeat))
        with pytest.raises(Aborted):
            await jog.hold(1.0)
    assert len(server.all(JogBeat)) == beats


async def test_a_press_that_was_late_is_beaten_no_more(
    server: ScriptedPendantServer, pendant: PendantClient
) -> None:
    async with pendant.jog({0: 1.0}) as jog:
        await jog.hold(0.12)
        hang(HANG)
        beats = len(server.all(JogBeat))
        await asyncio.sleep(0.3)
        assert len(server.all(JogBeat)) == beats


async def test_a_cancelled_aim_is_released_with_the_jog(
    server: ScriptedPendantServer, pendant: PendantClient
) -> None:
    """Nobody knows whether the server took it, until it is told to let go of both."""
    async with pendant.jog({0: 1.0}) as jog:
        aiming = asyncio.create_task(jog.aim({1: 1.0}))
        await asyncio.sleep(0)
        aiming.cancel()
        await asyncio.gather(aiming, return_exceptions=True)
        server.end_jog(1, JogEnd.REPLACED)
    assert [each.press for each in server.all(JogRelease)] == [2, 1]


async def test_an_aim_on_a_lost_connection_says_that_it_is_lost(
    server: ScriptedPendantServer, pendant: PendantClient
) -> None:
    with suppress(ConnectionLost):
        async with pendant.jog({0: 1.0}) as jog:
            server.hang_up()
            await asyncio.sleep(0.01)
            with pytest.raises(ConnectionLost):
                await jog.aim({1: 1.0})


# A press quotes a fresh state, or does not leave.


@pytest.mark.parametrize(("rate", "within"), [(10.0, 0.2), (2.0, 0.25), (25.0, 0.1), (125.0, 0.1)])
async def test_a_press_during_a_stall_is_refused_soon_and_never_sent(
    rate: float, within: float, server: ScriptedPendantServer, pendant: PendantClient
) -> None:
    await pendant.subscribe(rate)
    server.mutes = True
    await asyncio.sleep(1.0)
    loop = asyncio.get_running_loop()
    loop.call_later(0.5, setattr, server, "mutes", False)
    pressed = loop.time()
    assert await refusal(pendant.jog({0: 1.0}).__aenter__()) is VerdictCode.PRESS_STALE
    assert loop.time() - pressed == pytest.approx(within, abs=0.001)
    await asyncio.sleep(1.0)
    assert server.all(JogStart) == []


async def test_the_patience_of_a_press_follows_the_rate_that_was_granted(
    server: ScriptedPendantServer, pendant: PendantClient
) -> None:
    pendant.hello = dataclasses.replace(pendant.hello, max_state_rate=10.0)
    await pendant.subscribe(125.0)
    server.mutes = True
    await asyncio.sleep(1.0)
    pressed = asyncio.get_running_loop().time()
    assert await refusal(pendant.jog({0: 1.0}).__aenter__()) is VerdictCode.PRESS_STALE
    assert asyncio.get_running_loop().time() - pressed == pytest.approx(0.2, abs=0.001)


async def test_a_press_after_a_stall_quotes_the_newest_of_the_states_that_come_at_once(
    server: ScriptedPendantServer, pendant: PendantClient
) -> None:
    server.lines[-1].telling.cancel()  # type: ignore[union-attr]
    await asyncio.sleep(1.0)
    pressing = asyncio.create_task(pendant.jog({0: 1.0}).__aenter__())
    await asyncio.sleep(0)
    for _ in range(3):
        server.tell_state()
    jog = await pressing
    assert server.one(JogStart).state_sequence == server.sequence
    await jog.release()


async def test_an_aim_during_a_stall_is_refused_and_the_held_press_goes_on(
    server: ScriptedPendantServer, pendant: PendantClient
) -> None:
    async with pendant.jog({0: 1.0}) as jog:
        server.lines[-1].telling.cancel()  # type: ignore[union-attr]
        await jog.hold(0.5)
        assert await refusal(jog.aim({1: 1.0})) is VerdictCode.PRESS_STALE
        beats = len(server.all(JogBeat))
        await jog.hold(0.2)
        assert len(server.all(JogBeat)) > beats
    assert [start.press for start in server.all(JogStart)] == [1]


async def test_a_state_that_comes_while_the_program_hangs_comes_too_late(
    server: ScriptedPendantServer, pendant: PendantClient
) -> None:
    server.mutes = True
    await asyncio.sleep(1.0)
    pressing = asyncio.create_task(refusal(pendant.jog({0: 1.0}).__aenter__()))
    await asyncio.sleep(0.01)
    server.tell_state()
    hang(HANG)
    assert await pressing is VerdictCode.PRESS_STALE
    assert server.all(JogStart) == []


NEVER = 1e6
VERDICT_WITHIN = 5.0
"""What a press has to be judged in, as the documentation says [s]."""


def judge_late(server: ScriptedPendantServer, late: int, seconds: float) -> None:
    """Have the server judge one press so late; it ends the press before at the same time."""
    judge = server._judge

    def judged(message: Message, request_id: int) -> None:
        if not isinstance(message, JogStart) or message.press != late:
            judge(message, request_id)
            return
        server._jogs[late] = request_id

        def at_last() -> None:
            judge(message, request_id)
            if late - 1 in server._jogs:
                server.end_jog(late - 1, JogEnd.REPLACED)

        asyncio.get_running_loop().call_later(seconds, at_last)

    server._judge = judged  # type: ignore[method-assign]


def end_later(server: ScriptedPendantServer, seconds: float) -> None:
    """Have the robot ramp for so long after a release."""
    end_jog = server.end_jog

    def ended(press: int, *why: object) -> None:
        asyncio.get_running_loop().call_later(seconds, end_jog, press)

    server.end_jog = ended  # type: ignore[method-assign, assignment]


def beats(server: ScriptedPendantServer, press: int) -> int:
    return len([each for each in server.all(JogBeat) if each.press == press])


# No verdict.


async def test_a_press_without_a_verdict_is_given_up_after_5_s_and_let_go(
    server: ScriptedPendantServer, pendant: PendantClient
) -> None:
    judge_late(server, 1, NEVER)
    began = asyncio.get_running_loop().time()
    with pytest.raises(Unanswered, match="no verdict within 5 s"):
        await asyncio.wait_for(pendant.jog({0: 1.0}).__aenter__(), 60.0)
    assert asyncio.get_running_loop().time() - began == pytest.approx(VERDICT_WITHIN, abs=0.01)
    await asyncio.sleep(0.01)
    assert server.one(JogRelease).press == 1
    beaten = len(server.all(JogBeat))
    await asyncio.sleep(1.0)
    assert len(server.all(JogBeat)) == beaten


async def test_a_first_press_that_is_cancelled_before_its_verdict_is_let_go(
    server: ScriptedPendantServer, pendant: PendantClient
) -> None:
    judge_late(server, 1, NEVER)
    with pytest.raises(TimeoutError):
        await asyncio.wait_for(pendant.jog({0: 1.0}).__aenter__(), 0.2)
    await asyncio.sleep(0.01)
    assert server.one(JogRelease).press == 1


async def test_an_aim_without_a_verdict_lets_go_of_both_presses_and_of_the_jog(
    server: ScriptedPendantServer, pendant: PendantClient
) -> None:
    async with pendant.jog({0: 1.0}) as jog:
        judge_late(server, 2, NEVER)
        with pytest.raises(Unanswered):
            await asyncio.wait_for(jog.aim({1: 1.0}), 60.0)
        await asyncio.sleep(0.01)
        assert [each.press for each in server.all(JogRelease)] == [2, 1]
        beaten = len(server.all(JogBeat))
        with pytest.raises(Aborted, match="no verdict came within 5 s of press 2"):
            await jog.hold(1.0)
        with pytest.raises(Refused, match="the jog is over") as refused:
            await jog.aim({2: 1.0})
        assert refused.value.code is VerdictCode.PRESS_DEAD
        assert len(server.all(JogBeat)) == beaten


async def test_a_robot_of_which_nobody_says_that_it_stands_is_not_awaited_for_ever(
    server: ScriptedPendantServer, pendant: PendantClient
) -> None:
    jog = await pendant.jog({0: 1.0}).__aenter__()
    server._jogs.clear()
    server.end_jog = lambda *_: None  # type: ignore[method-assign]
    with pytest.raises(Unanswered, match="no word within 35 s that the robot stands"):
        await asyncio.wait_for(jog.release(), 60.0)


# A take-over that is given up, or late.


async def test_leaving_after_a_cancelled_aim_waits_for_the_press_that_took_over(
    server: ScriptedPendantServer, pendant: PendantClient
) -> None:
    loop = asyncio.get_running_loop()
    async with pendant.jog({0: 1.0}) as jog:
        judge_late(server, 2, 0.1)
        aiming = asyncio.create_task(jog.aim({1: 1.0}))
        await asyncio.sleep(0.05)
        aiming.cancel()
        await asyncio.gather(aiming, return_exceptions=True)
        await asyncio.sleep(0.07)  # the server takes it, and ends the press before
        end_later(server, 0.5)
        left = loop.time()
    assert jog.account is not None
    assert (jog.account.press, jog.account.reason) == (2, JogEnd.RELEASED)
    assert loop.time() - left == pytest.approx(0.5, abs=0.05)


async def test_leaving_after_a_cancelled_aim_that_was_refused_tells_of_the_press_before(
    server: ScriptedPendantServer, pendant: PendantClient
) -> None:
    async with pendant.jog({0: 1.0}) as jog:
        server.refusals[JogStart] = (VerdictCode.UNKNOWN_FRAME, "no frame 'table'")
        aiming = asyncio.create_task(jog.aim_tool(x=1.0, frame="table"))
        await asyncio.sleep(0)
        aiming.cancel()
        await asyncio.gather(aiming, return_exceptions=True)
        server.refusals[JogRelease] = (VerdictCode.NOTHING_TO_CONTROL, "press 2 is not held")
    assert jog.account is not None
    assert (jog.account.press, jog.account.reason) == (1, JogEnd.RELEASED)
    assert pendant._line._accounts == {}
    assert pendant._conversation._outcomes == {}


async def test_a_press_that_takes_over_is_beaten_though_the_one_before_is_late(
    server: ScriptedPendantServer, pendant: PendantClient
) -> None:
    async with pendant.jog({0: 1.0}) as jog:
        await jog.hold(0.14)  # beaten at 0.1 s
        judge_late(server, 2, 0.3)
        aiming = asyncio.create_task(jog.aim({1: 1.0}))
        await asyncio.sleep(0)
        hang(0.12)
        await aiming
        await jog.hold(0.5)
        assert beats(server, 2) >= 10


async def test_the_bound_of_a_jog_does_not_run_out_while_an_aim_waits(
    server: ScriptedPendantServer, pendant: PendantClient
) -> None:
    async with pendant.jog({0: 1.0}, longest=0.5) as jog:
        server.lines[-1].telling.cancel()  # type: ignore[union-attr]
        await asyncio.sleep(0.45)
        asyncio.get_running_loop().call_later(0.07, server.tell_state)
        await jog.aim({1: 1.0})
        server.end_jog(1, JogEnd.REPLACED)
        await jog.hold(0.5)
    assert beats(server, 2) >= 8
