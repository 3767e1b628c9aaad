"""The client's connection: hello, login, states, data, what it waits for, and its end."""

import asyncio
import itertools
import ssl
from collections.abc import Awaitable, Callable
from typing import Any

import pytest
from rigs.peers.scripted_pendant_server import SESSION, ScriptedPendantServer

from openpendant.simplemsg import Message, Ping
from openpendant.simplemsg import pendant as messages
from openpendant.simplemsg.verdicts import VerdictCode
from openpendant.tools.pendants.client import (
    ConnectionLost,
    PendantClient,
    Refused,
    StateSilent,
    Unanswered,
    Unreachable,
    WrongArgument,
)

pytestmark = pytest.mark.virtual_clock


async def test_hello_says_cell_name_and_rate(server: ScriptedPendantServer) -> None:
    async with await PendantClient.connect(
        "127.0.0.1", server.port, client="mine", cell="left", state_rate=50
    ) as pendant:
        hello = server.one(messages.Hello)
        assert (hello.protocol_version, hello.client, hello.cell, hello.state_rate) == (
            messages.PROTOCOL_VERSION,
            "mine",
            "left",
            50.0,
        )
        assert pendant.hello.session == SESSION
        assert pendant.offers(messages.Capability.JOG)
        assert not pendant.offers(messages.Capability.RECORDING)


@pytest.mark.parametrize(
    ("secret", "kind"),
    [("password", messages.LoginKind.PASSWORD), ("pairing", messages.LoginKind.PAIRING)],
)
async def test_a_secret_is_shown_after_hello(
    server: ScriptedPendantServer, secret: str, kind: messages.LoginKind
) -> None:
    options: dict[str, Any] = {secret: "canary 7"}
    async with await PendantClient.connect("127.0.0.1", server.port, user="ada", **options):
        login = server.one(messages.Login)
    assert (login.kind, login.name, login.secret) == (kind, "ada", "canary 7")


@pytest.mark.parametrize("user", ["", "kim"])
async def test_a_guest_without_a_name_is_called_as_the_pendant(
    server: ScriptedPendantServer, user: str
) -> None:
    async with await PendantClient.connect(
        "127.0.0.1", server.port, client="bench 2", user=user, pairing="ABC234"
    ) as pendant:
        await pendant.login("", pairing="ABC234")
    assert [login.name for login in server.all(messages.Login)] == [user or "bench 2", "bench 2"]


async def test_a_wrong_password_is_refused_and_the_connection_closed(
    server: ScriptedPendantServer,
) -> None:
    server.refusals[messages.Login] = (VerdictCode.LOGIN_FAILED, "no such name or password")
    with pytest.raises(Refused) as refused:
        await PendantClient.connect("127.0.0.1", server.port, user="ada", password="canary 7")
    assert refused.value.code is VerdictCode.LOGIN_FAILED
    assert "canary" not in str(refused.value)


async def test_a_login_needs_exactly_one_secret(pendant: PendantClient) -> None:
    for secrets in ({}, {"password": "a", "pairing": "b"}):
        with pytest.raises(WrongArgument, match="either a password or a pairing code"):
            await pendant.login("ada", **secrets)


async def test_states_are_the_newest_only_for_a_slow_reader(
    server: ScriptedPendantServer, pendant: PendantClient
) -> None:
    seen: list[int] = []
    async for state in pendant.states():
        seen.append(state.sequence)
        assert server.sequence - state.sequence <= 1
        if len(seen) == 4:
            break
        await asyncio.sleep(0.2)
    assert all(after - before >= 4 for before, after in itertools.pairwise(seen))


async def test_a_fast_reader_sees_each_state_once(pendant: PendantClient) -> None:
    seen: list[int] = []
    async for state in pendant.states():
        seen.append(state.sequence)
        if len(seen) == 5:
            break
    assert seen == list(range(seen[0], seen[0] + 5))


async def test_news_reach_their_callbacks(
    server: ScriptedPendantServer, pendant: PendantClient
) -> None:
    heard: list[object] = []
    pendant.on_stop = heard.append
    pendant.on_mode = heard.append
    pendant.on_program = heard.append
    pendant.on_authority = heard.append
    news = [
        messages.StopChanged(
            stop=messages.StopKind.SOFTWARE, session=3, client="other", reason="why"
        ),
        messages.ModeChanged(mode=messages.OperatingMode.AUTOMATIC, session=3, client="other"),
        messages.ProgramReport(
            state=messages.ProgramState.RUNNING, line=4, loop=1, revision=2, program="p", text=""
        ),
        messages.AuthorityChanged(
            holder=3, reason=messages.AuthorityReason.GRANTED, client="other"
        ),
    ]
    for message in news:
        server.send(message)
    await pendant.next_state()
    assert heard == news


async def test_a_callback_that_raises_is_reported_and_breaks_nothing(
    pendant: PendantClient,
) -> None:
    reports: list[dict[str, Any]] = []
    loop = asyncio.get_running_loop()
    loop.set_exception_handler(lambda _, context: reports.append(context))

    def stumble(state: messages.State) -> None:
        raise ZeroDivisionError(state.sequence)

    pendant.on_state = stumble
    await pendant.next_state()
    await pendant.next_state()
    loop.set_exception_handler(None)
    assert isinstance(reports[0]["exception"], ZeroDivisionError)
    assert "State" in reports[0]["message"]


async def test_a_management_request_is_answered_by_a_dictionary(
    server: ScriptedPendantServer, pendant: PendantClient
) -> None:
    server.answers["cells"] = {"cells": []}
    assert await pendant.manage({"op": "cells"}) == {"cells": []}
    assert server.one(messages.Management).body == b'{"op": "cells"}'


async def test_a_refused_management_request_raises_its_code(pendant: PendantClient) -> None:
    with pytest.raises(Refused) as refused:
        await pendant.manage({"op": "nonsense"})
    assert refused.value.code is VerdictCode.BAD_ARGUMENT
    assert refused.value.text == "no such op"


@pytest.mark.parametrize("request_", [{"op": float("nan")}, {"op": object()}])
async def test_a_request_that_is_no_json_never_leaves(
    server: ScriptedPendantServer, pendant: PendantClient, request_: dict[str, Any]
) -> None:
    with pytest.raises(WrongArgument, match="no JSON"):
        await pendant.manage(request_)
    assert server.all(messages.Management) == []


async def test_waiting_for_a_state_that_never_comes_ends_and_says_so(
    pendant: PendantClient,
) -> None:
    with pytest.raises(TimeoutError, match=r"no such state came within 0.5 s"):
        await pendant.wait_until(lambda state: state.sequence < 0, within=0.5)


@pytest.mark.parametrize("wait", [PendantClient.next_state, PendantClient.home])
async def test_a_server_that_falls_silent_ends_what_waits_within_20_s(
    wait: Callable[[PendantClient], Awaitable[object]],
    server: ScriptedPendantServer,
    pendant: PendantClient,
) -> None:
    server.mutes = True
    began = asyncio.get_running_loop().time()
    with pytest.raises(ConnectionLost, match="said nothing for 15 s"):
        await wait(pendant)
    assert 15.0 < asyncio.get_running_loop().time() - began <= 20.1
    assert len(server.all(Ping)) >= 3


async def test_a_server_that_hangs_up_ends_what_waits(
    server: ScriptedPendantServer, pendant: PendantClient
) -> None:
    server.completes = False
    motion = await pendant.home()
    server.hang_up()
    with pytest.raises(ConnectionLost):
        await motion.done()
    with pytest.raises(ConnectionLost):
        await pendant.stop()


async def test_whoever_is_sent_away_waits_for_no_state_until_he_has_logged_in(
    server: ScriptedPendantServer, pendant: PendantClient
) -> None:
    waiting = asyncio.create_task(pendant.wait_until(lambda state: state.sequence < 0))
    await asyncio.sleep(0)
    server.end_motion(0, VerdictCode.LOGIN_NEEDED)
    for wait in (waiting, pendant.next_state()):
        with pytest.raises(Refused) as refused:
            await wait
        assert refused.value.code is VerdictCode.LOGIN_NEEDED
    await pendant.login("kim", pairing="ABC234")
    assert isinstance(await pendant.next_state(), messages.State)


# How long it waits, for what, and what it says when it has waited long enough.


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
    think(server, messages.Management, LONG)
    assert await pendant.manage({"op": "programs.dry_run", "name": "p"}) == {"duration": 1.5}


async def test_a_motion_that_is_planned_late_tells_its_outcome(
    server: ScriptedPendantServer, pendant: PendantClient
) -> None:
    think(server, messages.Home, LONG)
    assert (await (await pendant.home()).done()).motion_time == 0.5


async def test_what_is_not_planned_and_not_answered_does_not_claim_a_lost_link(
    server: ScriptedPendantServer, pendant: PendantClient
) -> None:
    think(server, messages.SetMode, LONG)
    with pytest.raises(Unanswered, match="no verdict within 35 s; the request may be carried out"):
        await pendant.set_mode(messages.OperatingMode.AUTOMATIC)
    await pendant.pause()


HUNG = ["snapshot", "why", "users.list", "access.sessions", "programs.list", "programs.load"]


async def test_operations_that_are_not_planned_and_not_answered_are_given_up_after_35_s(
    server: ScriptedPendantServer, pendant: PendantClient
) -> None:
    think(server, messages.Management, 2 * LONG)
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
    assert isinstance(await pendant.next_state(), messages.State)


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


def logged_out(server: ScriptedPendantServer, holder: int) -> None:
    server.send(
        messages.AuthorityChanged(
            holder=holder, reason=messages.AuthorityReason.LOGGED_OUT, client=""
        )
    )


@pytest.mark.parametrize(
    "lose",
    [
        lambda server: logged_out(server, 0),
        lambda server: logged_out(server, SESSION),
        lambda server: server.end_motion(0, VerdictCode.LOGIN_NEEDED),
        lambda server: server.hang_up(),
    ],
    ids=["logged out", "logged out as the holder", "sent away", "without a connection"],
)
async def test_whoever_has_no_login_or_no_connection_is_not_in_control(
    lose: Callable[[ScriptedPendantServer], None],
    server: ScriptedPendantServer,
    pendant: PendantClient,
) -> None:
    await pendant.take_control()
    lose(server)
    await asyncio.sleep(0.01)
    assert not pendant.in_control
