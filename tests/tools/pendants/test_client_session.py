"""The client's connection: hello, login, states, data, and its end."""

from __future__ import annotations

import asyncio
import itertools
from typing import Any

import pytest
from rigs.peers.scripted_pendant_server import SESSION, ScriptedPendantServer

from openpendant.simplemsg import Ping
from openpendant.simplemsg.pendant import (
    AuthorityChanged,
    AuthorityReason,
    Capability,
    Hello,
    Login,
    LoginKind,
    Management,
    ModeChanged,
    OperatingMode,
    ProgramReport,
    ProgramState,
    State,
    StopChanged,
    StopKind,
)
from openpendant.simplemsg.verdicts import VerdictCode
from openpendant.tools.pendants.client import ConnectionLost, PendantClient, Refused, WrongArgument

pytestmark = [pytest.mark.virtual_clock, pytest.mark.asyncio]


async def test_hello_says_cell_name_and_rate(server: ScriptedPendantServer) -> None:
    async with await PendantClient.connect(
        "127.0.0.1", server.port, client="mine", cell="left", state_rate=50
    ) as pendant:
        hello = server.one(Hello)
        assert (hello.protocol_version, hello.client, hello.cell, hello.state_rate) == (
            2,
            "mine",
            "left",
            50.0,
        )
        assert pendant.hello.session == SESSION
        assert pendant.offers(Capability.JOG)
        assert not pendant.offers(Capability.RECORDING)


@pytest.mark.parametrize(
    ("secret", "kind"), [("password", LoginKind.PASSWORD), ("pairing", LoginKind.PAIRING)]
)
async def test_a_secret_is_shown_after_hello(
    server: ScriptedPendantServer, secret: str, kind: LoginKind
) -> None:
    options: dict[str, Any] = {secret: "canary 7"}
    async with await PendantClient.connect("127.0.0.1", server.port, user="ada", **options):
        login = server.one(Login)
    assert (login.kind, login.name, login.secret) == (kind, "ada", "canary 7")


@pytest.mark.parametrize("user", ["", "kim"])
async def test_a_guest_without_a_name_is_called_as_the_pendant(
    server: ScriptedPendantServer, user: str
) -> None:
    async with await PendantClient.connect(
        "127.0.0.1", server.port, client="bench 2", user=user, pairing="ABC234"
    ) as pendant:
        await pendant.login("", pairing="ABC234")
    assert [login.name for login in server.all(Login)] == [user or "bench 2", "bench 2"]


async def test_a_wrong_password_is_refused_and_the_connection_closed(
    server: ScriptedPendantServer,
) -> None:
    server.refusals[Login] = (VerdictCode.LOGIN_FAILED, "no such name or password")
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
        StopChanged(stop=StopKind.SOFTWARE, session=3, client="other", reason="why"),
        ModeChanged(mode=OperatingMode.AUTOMATIC, session=3, client="other"),
        ProgramReport(state=ProgramState.RUNNING, line=4, loop=1, revision=2, program="p", text=""),
        AuthorityChanged(holder=3, reason=AuthorityReason.GRANTED, client="other"),
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

    def stumble(state: State) -> None:
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
    assert server.one(Management).body == b'{"op": "cells"}'


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
    assert server.all(Management) == []


async def test_waiting_for_a_state_that_never_comes_ends_and_says_so(
    pendant: PendantClient,
) -> None:
    with pytest.raises(TimeoutError, match=r"no such state came within 0.5 s"):
        await pendant.wait_until(lambda state: state.sequence < 0, within=0.5)


async def test_a_server_that_falls_silent_ends_what_waits_within_20_s(
    server: ScriptedPendantServer, pendant: PendantClient
) -> None:
    server.mutes = True
    began = asyncio.get_running_loop().time()
    with pytest.raises(ConnectionLost, match="said nothing for 15 s"):
        await pendant.next_state()
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
    assert isinstance(await pendant.next_state(), State)
