"""The table of `docs/access.md`, row by row, through a gateway and past it, on real sockets.

What the server makes of each row is promise 41; here it is that the gateway adds nothing and takes
nothing away: a tab may do what its person may from the same address without a gateway.
"""

import asyncio
import json
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import AsyncExitStack, asynccontextmanager
from itertools import count
from pathlib import Path
from typing import Any

import pytest
from rigs.cells.rights import LOGIN_FOR_ALL, LOOKS_ON, ONLY_STOP, SINGLE_USER, Rights
from rigs.processes.guarded_server import PASSWORDS, GuardedServer, cheap_logins, guarded_server
from rigs.processes.web_gateway import LOOPBACK, SECRET, WEB, GatewayRig, Tab, running_gateway

from openpendant.simplemsg.pendant import (
    PROTOCOL_VERSION,
    Authority,
    AuthorityAction,
    Hello,
    HelloReply,
    Lobby,
    LobbyReply,
    Login,
    LoginKind,
    Management,
    ResetStop,
    SoftwareStop,
    State,
    Verdict,
)
from openpendant.simplemsg.verdicts import VerdictCode as V
from openpendant.tools.pendants.web import cli
from openpendant.tools.pendants.web.admission import Browser
from openpendant.tools.pendants.web.relay import Ending
from openpendant.tools.pendants.web.server_exposure import (
    NotAsked,
    NotGuarded,
    check_logins_are_demanded,
)
from openpendant.tools.pendants.web.server_link import GatewayIdentity, Server

pytestmark = pytest.mark.realtime

LAN, LAN_6 = "192.0.2.7", "2001:db8:0:7::1"
ALONE = "127.0.0.2"

accounts = pytest.mark.parametrize("has_accounts", [False, True], ids=["no accounts", "accounts"])


@pytest.fixture(autouse=True)
def _cheap_logins() -> Iterator[None]:
    with cheap_logins():
        yield


@asynccontextmanager
async def known_server(folder: Path, *, has_accounts: bool) -> AsyncIterator[GuardedServer]:
    """Run a server that knows a gateway of this machine, and one that is alone at its address."""
    file = folder / "secret"
    file.write_text(SECRET)
    file.chmod(0o600)
    gateways = [
        {"name": "web", "address": LOOPBACK, "secret_file": str(file)},
        {"name": "own", "address": ALONE, "secret_file": str(file)},
    ]
    async with guarded_server(folder, has_accounts=has_accounts, gateways=gateways) as server:
        yield server


async def rights(tab: Tab) -> Rights:
    """Say hello and try everything."""
    await tab.tell(Lobby(1))
    shows = "holder" in json.loads((await tab.answer(LobbyReply)).body)["cells"][0]
    await tab.tell(Hello(PROTOCOL_VERSION, 100.0, "", "somebody"))
    await tab.answer(HelloReply)
    numbers = count(2)

    async def code(make: Callable[[int], Any]) -> V:
        request = make(next(numbers))
        await tab.tell(request)
        return V((await tab.answer(Verdict, request_id=request.request_id)).code)

    async def asked(op: str) -> dict[str, Any]:
        number = next(numbers)
        await tab.tell(Management(number, json.dumps({"op": op}).encode()))
        body = (await tab.answer(Management, request_id=number)).body
        answer: dict[str, Any] = json.loads(body)
        return answer

    basis = str((await asked("access.whoami"))["basis"])
    observed = V((await asked("snapshot")).get("code", V.ACCEPTED))
    await asyncio.sleep(0.1)
    moves = await code(lambda number: Authority(number, AuthorityAction.REQUEST))
    stops = await code(lambda number: SoftwareStop(number, "enough"))
    resets = await code(ResetStop)
    # Before the login, which gives more of everything.
    sends = any(isinstance(each, State) for each in tab.told)
    logs_in = await code(lambda number: Login(number, LoginKind.PASSWORD, "ann", PASSWORDS["ann"]))
    return Rights(basis, shows, observed, sends, moves, stops, resets, logs_in)


@accounts
@pytest.mark.parametrize(
    "identity", [None, WEB], ids=["no gateway to the server", "through the gateway"]
)
async def test_a_tab_of_this_machine_may_do_what_a_program_of_it_may(
    tmp_path: Path, identity: GatewayIdentity | None, has_accounts: bool
) -> None:
    async with (
        known_server(tmp_path, has_accounts=has_accounts) as server,
        running_gateway(server.port, identity) as rig,
    ):
        assert await rights(await rig.tab()) == (LOOKS_ON if has_accounts else SINGLE_USER)


@accounts
async def test_a_tab_may_do_what_its_person_may_from_the_same_address(
    tmp_path: Path, has_accounts: bool
) -> None:
    of_this_machine = LOOKS_ON if has_accounts else SINGLE_USER
    of_another = LOGIN_FOR_ALL if has_accounts else ONLY_STOP
    wanted = {LAN: of_another, LAN_6: of_another, "127.0.0.1": of_this_machine}
    async with known_server(tmp_path, has_accounts=has_accounts) as server, proxied(server) as rig:
        found = {
            address: await rights(await rig.tab(X_Forwarded_For=address)) for address in wanted
        }
    assert found == wanted


@asynccontextmanager
async def proxied(server: GuardedServer) -> AsyncIterator[GatewayRig]:
    """Run a gateway that takes this machine's proxy at its word, whatever the server demands."""

    async def is_guarded(*_: object) -> None:
        """Let a server without accounts be reached, to see what it makes of it."""

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(cli, "check_logins_are_demanded", is_guarded)
        async with running_gateway(server.port, WEB, proxies=[LOOPBACK]) as rig:
            yield rig


@accounts
async def test_whoever_is_not_believed_gets_no_connection(
    tmp_path: Path, has_accounts: bool
) -> None:
    async with (
        known_server(tmp_path, has_accounts=has_accounts) as server,
        AsyncExitStack() as stack,
    ):
        forged = {
            "another secret": GatewayIdentity("web", SECRET[::-1]),
            "no secret": GatewayIdentity("web", ""),
            "another name": GatewayIdentity("own", SECRET),
            "no name": GatewayIdentity("", SECRET),
        }
        found = {}
        for row, identity in forged.items():
            link = Server("cell", LOOPBACK, server.port, None)
            with pytest.raises(NotAsked, match="does not know this gateway"):
                await check_logins_are_demanded([link], identity)
            if identity.name:
                rig = await stack.enter_async_context(running_gateway(server.port, identity))
                tab = await rig.tab()
                await tab.tell(Hello(PROTOCOL_VERSION, 0.0, "", "somebody"))
                found[row] = (await tab.closed())[0]
        assert set(found.values()) == {Ending.NOT_FORWARDED}, found


@accounts
async def test_from_an_address_that_only_a_gateway_has_it_must_say_for_whom(
    tmp_path: Path, has_accounts: bool
) -> None:
    async with known_server(tmp_path, has_accounts=has_accounts) as server:
        async with running_gateway(server.port, own_address=ALONE) as silent:
            tab = await silent.tab()
            await tab.tell(Hello(PROTOCOL_VERSION, 0.0, "", "somebody"))
            assert (await tab.answer(Verdict)).code == V.FORWARD_FIRST
            assert (await tab.closed())[0] == Ending.SERVER_ENDED
        own = GatewayIdentity("own", SECRET)
        async with running_gateway(server.port, own, own_address=ALONE) as telling:
            of_this_machine = LOOKS_ON if has_accounts else SINGLE_USER
            assert await rights(await telling.tab()) == of_this_machine


async def test_a_tab_cannot_say_itself_whose_it_is(tmp_path: Path) -> None:
    async with known_server(tmp_path, has_accounts=False) as server, proxied(server) as rig:
        tab = await rig.tab(X_Forwarded_For=LAN)
        await tab.send(WEB.forwarded(Browser(LOOPBACK, is_encrypted=False)))
        assert (await tab.closed())[0] == Ending.SERVER_ENDED


async def test_a_gateway_asks_before_it_listens_on_a_network(tmp_path: Path) -> None:
    (tmp_path / "open").mkdir()
    (tmp_path / "guarded").mkdir()
    async with known_server(tmp_path / "open", has_accounts=False) as server:
        with pytest.raises(NotGuarded, match="openpendant users add NAME --role admin"):
            async with running_gateway(server.port, WEB, host="0.0.0.0"):
                pass
    with pytest.raises(NotAsked, match="nobody listens"):
        async with running_gateway(server.port, WEB, host="0.0.0.0"):
            pass
    async with (
        known_server(tmp_path / "guarded", has_accounts=True) as server,
        running_gateway(server.port, WEB, host="0.0.0.0") as rig,
    ):
        assert rig.port
