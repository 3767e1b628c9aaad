"""How long the client waits, for what, and what it says when it has waited long enough."""

from __future__ import annotations

import asyncio
import ssl
from collections.abc import Awaitable, Callable

import pytest
from rigs.peers.scripted_pendant_server import SESSION, ScriptedPendantServer

from openpendant.simplemsg import Message
from openpendant.simplemsg.pendant import (
    AuthorityChanged,
    AuthorityReason,
    Home,
    Management,
    SetMode,
    State,
)
from openpendant.simplemsg.verdicts import VerdictCode
from openpendant.tools.pendants.client import (
    ConnectionLost,
    OperatingMode,
    PendantClient,
    StateSilent,
    Unanswered,
    Unreachable,
    WrongArgument,
)

pytestmark = [pytest.mark.virtual_clock, pytest.mark.asyncio]

LONG = 100.0
"""A class that asks for dry runs waits so long, and longer [s]."""


def think(server: ScriptedPendantServer, kind: type[Message], seconds: float) -> None:
    """Have the server answer requests of one type so late; the link lives meanwhile."""
    answer = server._answer

    def answered(message: Message) -> None:
        if not isinstance(message, kind):
            answer(message)
            return
        line = server.lines[-1]

        def late() -> None:
            server._answered = line
            answer(message)
            server._answered = None

        asyncio.get_running_loop().call_later(seconds, late)

    server._answer = answered  # type: ignore[method-assign]


# What is planned.


async def test_a_dry_run_that_waits_for_others_is_answered_at_last(
    server: ScriptedPendantServer, pendant: PendantClient
) -> None:
    server.answers["programs.dry_run"] = {"duration": 1.5}
    think(server, Management, LONG)
    assert await pendant.manage({"op": "programs.dry_run", "name": "p"}) == {"duration": 1.5}


async def test_a_motion_that_is_planned_late_tells_its_outcome(
    server: ScriptedPendantServer, pendant: PendantClient
) -> None:
    think(server, Home, LONG)
    assert (await (await pendant.home()).done()).motion_time == 0.5


async def test_a_plan_that_is_awaited_on_a_dead_link_ends_with_the_link(
    server: ScriptedPendantServer, pendant: PendantClient
) -> None:
    server.mutes = True
    began = asyncio.get_running_loop().time()
    with pytest.raises(ConnectionLost, match="said nothing for 15 s"):
        await pendant.home()
    assert asyncio.get_running_loop().time() - began < 20.0


async def test_what_is_not_planned_and_not_answered_does_not_claim_a_lost_link(
    server: ScriptedPendantServer, pendant: PendantClient
) -> None:
    think(server, SetMode, LONG)
    with pytest.raises(Unanswered, match="no verdict within 35 s; the request may be carried out"):
        await pendant.set_mode(OperatingMode.AUTOMATIC)
    await pendant.pause()


HUNG = ["snapshot", "why", "users.list", "access.sessions", "programs.list", "programs.load"]


async def test_operations_that_are_not_planned_and_not_answered_are_given_up_after_35_s(
    server: ScriptedPendantServer, pendant: PendantClient
) -> None:
    think(server, Management, 2 * LONG)
    began = asyncio.get_running_loop().time()

    async def given_up(op: str) -> float:
        with pytest.raises(Unanswered, match="no verdict within 35 s"):
            await asyncio.wait_for(pendant.manage({"op": op}), LONG)
        return asyncio.get_running_loop().time() - began

    waits = await asyncio.gather(*(given_up(op) for op in HUNG))
    assert dict(zip(HUNG, waits, strict=True)) == pytest.approx(dict.fromkeys(HUNG, 35.0), abs=0.1)


# What ends while somebody waits.


async def test_a_wait_that_is_cancelled_as_the_link_ends_keeps_no_other_from_hearing_of_it(
    pendant: PendantClient,
) -> None:
    waits = [asyncio.create_task(pendant.next_state()) for _ in range(20)]
    await asyncio.sleep(0)
    for wait in waits[::2]:
        wait.cancel()
    pendant._conversation._end(None)
    ends = await asyncio.gather(*waits, return_exceptions=True)
    assert [type(end) for end in ends] == [asyncio.CancelledError, ConnectionLost] * 10


async def test_a_client_that_was_closed_blames_nobody_else(pendant: PendantClient) -> None:
    waiting = asyncio.create_task(pendant.next_state())
    await asyncio.sleep(0)
    await pendant.close()
    with pytest.raises(ConnectionLost, match="the client is closed"):
        await waiting
    with pytest.raises(ConnectionLost, match="the client is closed"):
        await pendant.stop()


async def test_a_close_does_not_wait_for_what_a_dead_link_does_not_take(
    pendant: PendantClient, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(pendant._conversation, "close", lambda: None)  # nothing is flushed
    async with asyncio.timeout(5.0):
        await pendant.close()


async def test_a_port_that_begins_no_tls_is_given_up_after_ten_seconds() -> None:
    listener = await asyncio.get_running_loop().create_server(asyncio.Protocol, "127.0.0.1", 0)
    port = listener.sockets[0].getsockname()[1]
    began = asyncio.get_running_loop().time()
    with pytest.raises(Unreachable, match="may not speak TLS"):
        await PendantClient.connect("127.0.0.1", port, tls=ssl.create_default_context())
    assert asyncio.get_running_loop().time() - began == pytest.approx(10.0, abs=0.5)
    listener.close()


# States that come no more.


async def the_next(pendant: PendantClient) -> None:
    await pendant.next_state()


async def all_of_them(pendant: PendantClient) -> None:
    async for _ in pendant.states():
        pass


async def a_certain_one(pendant: PendantClient) -> None:
    await pendant.wait_until(lambda state: state.sequence < 0, within=60.0)


@pytest.mark.parametrize("wait", [the_next, all_of_them, a_certain_one])
async def test_whoever_waits_for_states_that_a_living_server_does_not_send_hears_of_it(
    wait: Callable[[PendantClient], Awaitable[None]],
    server: ScriptedPendantServer,
    pendant: PendantClient,
) -> None:
    server.lines[-1].telling.cancel()  # type: ignore[union-attr]
    await asyncio.sleep(1.0)
    began = asyncio.get_running_loop().time()
    with pytest.raises(StateSilent, match=r"no state for \d+ s, though the server answers"):
        await wait(pendant)
    assert 4.0 < asyncio.get_running_loop().time() - began < 8.0
    server.tell_state()
    asyncio.get_running_loop().call_later(3.0, server.tell_state)
    assert isinstance(await pendant.next_state(), State)


async def first_without(server: ScriptedPendantServer) -> PendantClient:
    """Connect to a server that shows its state to nobody who has not logged in."""
    server.tell_state = lambda: None  # type: ignore[method-assign]
    pendant = await PendantClient.connect("127.0.0.1", server.port)
    server.lines[-1].telling.cancel()  # type: ignore[union-attr]
    return pendant


async def test_whoever_never_logged_in_and_sees_nothing_is_told_to_log_in(
    server: ScriptedPendantServer,
) -> None:
    async with await first_without(server) as pendant:
        with pytest.raises(StateSilent, match="never logged in: log in where"):
            await asyncio.wait_for(pendant.next_state(), LONG)


async def test_a_task_that_waits_for_states_is_not_failed_while_somebody_types_a_secret(
    server: ScriptedPendantServer,
) -> None:
    async with await first_without(server) as pendant:
        waiting = asyncio.create_task(pendant.next_state())
        await asyncio.sleep(50.0)
        await pendant.login("kim", password="secret")
        await asyncio.sleep(4.0)
        assert not waiting.done()
        await asyncio.sleep(4.0)
        with pytest.raises(StateSilent, match="answers; connect again and look"):
            await waiting


async def test_a_wait_for_states_that_are_given_up_meanwhile_ends_at_once(
    server: ScriptedPendantServer, pendant: PendantClient
) -> None:
    server.lines[-1].telling.cancel()  # type: ignore[union-attr]
    waiting = asyncio.create_task(pendant.next_state())
    await asyncio.sleep(0.1)
    began = asyncio.get_running_loop().time()
    await pendant.subscribe(0)
    with pytest.raises(WrongArgument, match="subscribe to the state first"):
        await waiting
    assert asyncio.get_running_loop().time() - began < 0.1


async def test_states_at_the_slowest_rate_are_waited_for(
    server: ScriptedPendantServer, pendant: PendantClient
) -> None:
    server.lines[-1].telling.cancel()  # type: ignore[union-attr]
    for _ in range(20):
        asyncio.get_running_loop().call_later(2.0, server.tell_state)
        await pendant.next_state()


async def test_states_that_nobody_asked_for_are_not_waited_for(
    server: ScriptedPendantServer,
) -> None:
    async with await PendantClient.connect("127.0.0.1", server.port, state_rate=0) as blind:
        with pytest.raises(WrongArgument, match="subscribe"):
            await blind.next_state()


@pytest.mark.parametrize("holder", [0, SESSION])
async def test_whoever_is_logged_out_is_not_in_control(
    holder: int, server: ScriptedPendantServer, pendant: PendantClient
) -> None:
    await pendant.take_control()
    server.send(AuthorityChanged(holder=holder, reason=AuthorityReason.LOGGED_OUT, client=""))
    await pendant.next_state()
    assert not pendant.in_control


async def test_whoever_is_sent_away_is_not_in_control(
    server: ScriptedPendantServer, pendant: PendantClient
) -> None:
    await pendant.take_control()
    server.end_motion(0, VerdictCode.LOGIN_NEEDED)
    await asyncio.sleep(0.01)
    assert not pendant.in_control


async def test_a_client_without_a_connection_is_not_in_control(
    server: ScriptedPendantServer, pendant: PendantClient
) -> None:
    await pendant.take_control()
    server.hang_up()
    await asyncio.sleep(0.01)
    assert not pendant.in_control
