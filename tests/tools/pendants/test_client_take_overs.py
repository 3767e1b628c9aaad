"""A press whose verdict is late, or never comes: what is beaten, what is let go, what is told."""

import asyncio

import pytest
from rigs.peers.scripted_pendant_server import ScriptedPendantServer
from rigs.processes.hanging_program import hang

from openpendant.simplemsg import Message
from openpendant.simplemsg.pendant import JogBeat, JogEnd, JogRelease, JogStart
from openpendant.simplemsg.verdicts import VerdictCode
from openpendant.tools.pendants.client import Aborted, PendantClient, Refused, Unanswered

pytestmark = pytest.mark.virtual_clock

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
