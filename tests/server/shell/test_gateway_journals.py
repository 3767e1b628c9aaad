"""A gateway on sockets: it speaks for others; no journal holds its secret, and no rerun asks it."""

import asyncio
import json
from collections.abc import AsyncIterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import asynccontextmanager
from pathlib import Path

import pytest
from rigs.cells.admission_desk import BOOK
from rigs.cells.gateway_rig import SECRET
from rigs.peers.server_clients import hello
from rigs.processes.bare_app import NoAccess
from rigs.processes.judged_server import HOST, ROBOT, LoopPlanner

from openpendant.motion.description.robot import serial_robot
from openpendant.server.access import gateways
from openpendant.server.access.passwords import Secret
from openpendant.server.cli.serve import kept_journal
from openpendant.server.settings.server_settings import make_server_settings
from openpendant.server.shell.app import App
from openpendant.server.shell.cell_shell import CellParts
from openpendant.server.store.store_client import AbsentStore
from openpendant.simplemsg import PENDANT, ByteOrder, Connection, HeaderOnly, Message, Role
from openpendant.simplemsg.journal import Journal
from openpendant.simplemsg.pendant import MAX_PENDANT_FRAME, Forwarded, HelloReply, LobbyReply
from openpendant.simplemsg.pendant import Lobby as LobbyRequest
from openpendant.tools.packets.journals.reenactment import rerun
from openpendant.tools.pendants.client import PendantClient

pytestmark = pytest.mark.virtual_clock

LAN = "192.0.2.7"
GUESS = "f00d" * 16
SETTINGS = make_server_settings(
    {
        "robot": ROBOT,
        "listen": {"pendant_port": 0, "ros_motion_port": "off", "ros_state_port": "off"},
        "gateways": [{"name": "web", "address": HOST, "secret_file": "gateway.secret"}],
    },
    "test",
)


@asynccontextmanager
async def served(journal: Journal, *, has_accounts: bool = False) -> AsyncIterator[int]:
    parts = [CellParts(SETTINGS.cells[0], serial_robot(ROBOT), LoopPlanner())]
    secrets, access = {"web": Secret(SECRET)}, NoAccess()
    if has_accounts:
        access.book = BOOK
    app = App(parts, journal, AbsentStore(), access, gateway_secrets=secrets)
    async with app.running() as bound:
        await asyncio.sleep(0.1)
        yield bound.pendant


async def told(port: int, *messages: Message) -> list[object]:
    """Connect, say all and return what is answered before the connection is quiet."""
    wire = Connection(Role.CLIENT, PENDANT, ByteOrder.LITTLE, max_frame=MAX_PENDANT_FRAME)
    reader, writer = await asyncio.open_connection(HOST, port)
    writer.write(b"".join(map(wire.send, messages)))
    await asyncio.sleep(0.2)
    found: list[object] = []
    while True:
        try:
            data = await asyncio.wait_for(reader.read(65_536), 0.05)
        except TimeoutError:
            break
        if not data:
            break
        found += wire.receive(data)
    writer.close()
    return found


def stated(secret: str = SECRET) -> Forwarded:
    return Forwarded("web", secret, LAN, 1)


@pytest.mark.parametrize("has_accounts", [False, True])
async def test_a_journal_of_a_gateway_holds_no_secret_and_is_run_again_to_the_byte(
    tmp_path: Path, has_accounts: bool
) -> None:
    journal, file = Journal(), tmp_path / "journal"
    with kept_journal(journal, file, SETTINGS):
        async with served(journal, has_accounts=has_accounts) as port:
            browser = await told(port, stated(), LobbyRequest(1), hello("a browser"))
            forged = await told(port, stated(GUESS), hello("a stranger"))
            silent = await told(port)
            own = await told(port, hello("a pendant"))
            await asyncio.sleep(2.5)
    assert [type(each) for each in browser] == [HeaderOnly, LobbyReply, HelloReply]
    assert isinstance(browser[1], LobbyReply)
    (cell,) = json.loads(browser[1].body)["cells"]
    assert (cell["robot"], cell["display"], cell["login_needed"]) == (
        *(ROBOT, "Universal Robots UR5 (CB3)", True),
    )
    assert [type(each) for each in forged] == [HeaderOnly]
    assert silent == []
    assert isinstance(own[0], HelloReply)
    text = file.read_text("utf-8")
    for secret in (SECRET, GUESS):
        assert secret not in text
        assert secret.encode().hex() not in text
    assert LAN.encode().hex() in text
    assert ('"ask": "rate"' in text) == has_accounts
    with ThreadPoolExecutor(1) as thread:  # a rerun has a loop of its own
        outcome = thread.submit(rerun, file).result()
    assert outcome.difference is None
    assert not outcome.is_cut


async def test_a_rerun_asks_no_gateway_s_secret(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    journal, file = Journal(), tmp_path / "journal"
    with kept_journal(journal, file, SETTINGS):
        async with served(journal) as port:
            await told(port, stated(), hello("a browser"))
    monkeypatch.setattr(gateways, "_is_secret", lambda gateway, secret: False)
    with ThreadPoolExecutor(1) as thread:
        assert thread.submit(rerun, file).result().difference is None


async def test_the_client_asks_the_lobby_before_any_hello() -> None:
    async with served(Journal()) as port:
        lobby = await PendantClient.lobby(HOST, port)
        async with await PendantClient.connect(HOST, port, state_rate=0) as pendant:
            assert (await pendant.cells())["cells"][0]["connections"] == 1
            assert await pendant.access.exposure() == {"logins_demanded": False, "tls": False}
    (cell,) = lobby["cells"]
    assert (cell["cell"], cell["robot"], cell["login_needed"]) == ("cell", ROBOT, False)
    assert cell["connections"] == 0
