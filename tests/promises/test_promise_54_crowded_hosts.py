"""Promise 54 on the clock: hosts that hold all they get and come all the time keep nobody out.

A whole server with accounts, over loopback: 127.0.0.1 is this machine, and its other addresses
stand for other hosts.
"""

import asyncio
import errno
import socket
import ssl
from collections import Counter
from collections.abc import AsyncIterator, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import asynccontextmanager
from pathlib import Path
from types import ModuleType

import pytest
from promises.promise_table import figure
from rigs.cells.admission_desk import BOOK, is_right
from rigs.peers.server_clients import hello
from rigs.peers.tls_certificates import make_certificate
from rigs.processes.app_on_loop import clients_of
from rigs.processes.bare_app import NoAccess
from rigs.processes.judged_server import HOST, ROBOT, LoopPlanner

from openpendant.motion.description.robot import serial_robot
from openpendant.server.access import arrivals, places
from openpendant.server.access.access_backend import DeliverCheck
from openpendant.server.access.admission import VerifyJob
from openpendant.server.cli.serve import kept_journal
from openpendant.server.settings.server_settings import make_server_settings
from openpendant.server.shell import listening
from openpendant.server.shell.app import App
from openpendant.server.shell.cell_shell import CellParts
from openpendant.server.store.store_client import AbsentStore
from openpendant.simplemsg import PENDANT, ByteOrder, Connection, Message, Role
from openpendant.simplemsg.journal import Journal
from openpendant.simplemsg.pendant import (
    MAX_PENDANT_FRAME,
    Login,
    LoginKind,
    SoftwareStop,
    Verdict,
)
from openpendant.simplemsg.verdicts import VerdictCode as V
from openpendant.tools.packets.journals.reenactment import rerun
from openpendant.tools.pendants.client import PendantClient

pytestmark = pytest.mark.virtual_clock

CHECK = 0.25
"""Time of a password check [s]."""

TURNS = 0.002
"""What the loop's turns take on the virtual clock, at most [s]."""

LET_IN = figure(54, "let_in").seconds
CONNECTS = figure(54, "connects").count
OF_ADDRESS, IN_ALL = figure(54, "of_address").count, figure(54, "strangers").count
RATE, AT_ONCE = figure(54, "address_rate").count, figure(54, "address_burst").count


@pytest.fixture(autouse=True)
def other_hosts(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Take every address but 127.0.0.1 for that of another host."""
    for module in (arrivals, places, listening):
        monkeypatch.setattr(module, "is_loopback", lambda address: address == HOST)
    listening._charged.cache_clear()
    yield
    listening._charged.cache_clear()


class Accounts(NoAccess):
    """Accounts whose passwords are checked one after the other, each for a while."""

    def __init__(self) -> None:
        super().__init__()
        self.book = BOOK
        self._free_at = 0.0

    def check(self, job: VerifyJob, deliver: DeliverCheck) -> None:
        loop = asyncio.get_running_loop()
        self._free_at = max(self._free_at, loop.time()) + CHECK
        loop.call_at(self._free_at, deliver, is_right(job))


PORTS = {"pendant_port": 0, "ros_motion_port": "off", "ros_state_port": "off"}
SETTINGS = make_server_settings({"robot": ROBOT, "listen": PORTS}, "test")


@asynccontextmanager
async def guarded(
    tls: ssl.SSLContext | None = None, journal: Journal | None = None
) -> AsyncIterator[tuple[App, int]]:
    served = [CellParts(SETTINGS.cells[0], serial_robot(ROBOT), LoopPlanner())]
    app = App(served, journal or Journal(), AbsentStore(), Accounts(), tls=tls)
    async with app.running() as bound:
        await asyncio.sleep(0.1)
        yield app, bound.pendant


def is_open(sock: socket.socket) -> bool:
    """Return True if the server has not closed a connection; else close it, too."""
    try:
        while data := sock.recv(4_096):
            assert data
    except BlockingIOError:
        return True
    except ConnectionResetError:
        pass
    sock.close()
    return False


class Host:
    """A host that connects all the time, says hello, and holds what it gets."""

    def __init__(self, address: str, port: int) -> None:
        self.address = address
        self._port = port
        self._held: list[socket.socket] = []
        wire = Connection(Role.CLIENT, PENDANT, ByteOrder.LITTLE)
        self._hello = wire.send(hello("a host"))

    def connect(self) -> None:
        sock = socket.socket()
        sock.setblocking(False)
        sock.bind((self.address, 0))
        assert sock.connect_ex((HOST, self._port)) in (0, errno.EINPROGRESS)
        self._held.append(sock)
        try:
            sock.send(self._hello)
        except OSError:  # reset already, or not accepted by the system yet
            return

    @property
    def held(self) -> int:
        """How many connections it holds; what was closed is let go of."""
        self._held = [sock for sock in self._held if is_open(sock)]
        return len(self._held)

    def let_go(self) -> None:
        for sock in self._held:
            sock.close()
        self._held.clear()

    async def flood(self) -> None:
        while True:
            for _ in range(CONNECTS // 100):
                self.connect()
            await asyncio.sleep(0.01)
            assert self.held < 100


@asynccontextmanager
async def flooded(port: int, hosts: int) -> AsyncIterator[list[Host]]:
    """Have hosts connect all the time."""
    crowd = [Host(f"127.0.1.{number}", port) for number in range(1, hosts + 1)]
    floods = [asyncio.create_task(host.flood()) for host in crowd]
    try:
        yield crowd
        assert not any(flood.done() for flood in floods)
    finally:
        for flood in floods:
            flood.cancel()
        await asyncio.gather(*floods, return_exceptions=True)
        for host in crowd:
            host.let_go()
        await asyncio.sleep(0.05)


class Visitor:
    """Somebody else, from an address of his own."""

    def __init__(self, address: str, port: int) -> None:
        self._address, self._port = address, port
        self._wire = Connection(Role.CLIENT, PENDANT, ByteOrder.LITTLE, max_frame=MAX_PENDANT_FRAME)

    async def say(self, *messages: Message) -> float:
        """Connect, say all, and wait until the last is accepted; return how long that took [s]."""
        loop = asyncio.get_running_loop()
        began = loop.time()
        with socket.socket() as sock:
            sock.setblocking(False)
            sock.bind((self._address, 0))
            await loop.sock_connect(sock, (HOST, self._port))
            await loop.sock_sendall(sock, b"".join(map(self._wire.send, messages)))
            while True:
                data = await loop.sock_recv(sock, 65_536)
                assert data, "the server hung up"
                for told in self._wire.receive(data):
                    if isinstance(told, Verdict):
                        assert told.code == V.ACCEPTED, told
                        return loop.time() - began

    async def log_in(self) -> float:
        return await self.say(
            hello("teacher"), Login(1, LoginKind.PASSWORD, "ann", "ann's password")
        )

    async def stop(self) -> float:
        return await self.say(hello("a stranger"), SoftwareStop(1, "stop"))


def by_address(app: App) -> Counter[str]:
    return Counter(client.address for client in clients_of(app).values())


@pytest.mark.parametrize("hosts", [1, 5])
async def test_promise_54_whoever_comes_from_elsewhere_is_let_in_beside_a_flood(
    hosts: int,
) -> None:
    async with guarded() as (app, port), flooded(port, hosts) as crowd:
        for trial in range(6):
            await asyncio.sleep(0.3 + 0.0037 * trial)
            took = await asyncio.gather(
                Visitor(f"127.0.2.{trial + 1}", port).log_in(),
                Visitor(f"127.0.3.{trial + 1}", port).stop(),
            )
            assert took[0] <= LET_IN + CHECK + TURNS
            assert took[1] <= LET_IN + TURNS
            assert app.cells[0].core.cell.stop is not None
            held = by_address(app)
            assert all(held[host.address] <= OF_ADDRESS for host in crowd), held
        # They hold what they may, and that is shared.
        assert all(8 < held[host.address] for host in crowd), held
        assert min(hosts * OF_ADDRESS, IN_ALL) <= held.total() <= IN_ALL + 3
        assert app.overruns == 0


async def test_promise_54_a_journal_of_crowded_hosts_is_run_again_to_the_byte(
    tmp_path: Path,
) -> None:
    journal, file = Journal(), tmp_path / "journal"
    with kept_journal(journal, file, SETTINGS):
        async with guarded(journal=journal) as (_, port), flooded(port, 5):
            await asyncio.sleep(1.0)
            ann = await PendantClient.connect(HOST, port, user="ann", password="ann's password")
            async with ann:
                listed = await ann.access.connections()
                assert {each["address"] for each in listed["connections"]} >= {"127.0.1.3", HOST}
                assert any(each["cost"] > 0 for each in listed["connections"])
                await ann.access.close(listed["connections"][0]["session"])
                assert (await ann.access.bar("192.0.2.66"))["closed"] == 0
                await asyncio.sleep(0.5)
    with ThreadPoolExecutor(1) as thread:  # a rerun has a loop of its own
        outcome = thread.submit(rerun, file).result()
    assert outcome.difference is None
    assert not outcome.is_cut
    text = file.read_text("utf-8")
    assert '"on": "loads"' in text
    assert text.count('"on": "opened"') > 64


async def test_promise_54_of_a_flood_an_address_gets_its_rate_and_the_rest_is_closed_at_once() -> (
    None
):
    async with guarded() as (app, port):
        host = Host("127.0.1.1", port)
        for _ in range(100):
            host.connect()
            await asyncio.sleep(0.001)
        await asyncio.sleep(0.5)
        assert host.held == by_address(app)["127.0.1.1"] == OF_ADDRESS
        # Within 0.1 s its burst and one of its rate are let in, and no more has a number.
        assert AT_ONCE <= app.clients.next_session() - 1 <= AT_ONCE + RATE // 10
        host.let_go()


async def test_this_machine_waits_as_without_accounts_and_loses_nobody() -> None:
    async with guarded() as (app, port):
        host = Host(HOST, port)
        for _ in range(50):
            host.connect()
        await asyncio.sleep(2.0)
        assert by_address(app)[HOST] == 50
        host.let_go()


async def test_half_open_handshakes_by_the_hundred_keep_nobody_from_agreeing_on_tls(
    tmp_path: Path,
) -> None:
    certificate, key = make_certificate(tmp_path)
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.load_cert_chain(certificate, key)
    trusted = ssl.create_default_context(cafile=str(certificate))
    async with guarded(context) as (app, port):
        crowd = [Host(f"127.0.1.{number}", port) for number in range(1, 8)]
        for host in crowd:
            host._hello = b""
        for _ in range(80):  # until more than there are places for agree on TLS
            for host in crowd:
                host.connect()
            await asyncio.sleep(0.02)
        loop = asyncio.get_running_loop()
        began = loop.time()
        _, writer = await asyncio.open_connection(
            HOST, port, ssl=trusted, server_hostname=HOST, local_addr=("127.0.2.1", 0)
        )
        assert loop.time() - began <= LET_IN + TURNS
        await asyncio.sleep(0.01)
        assert by_address(app) == {"127.0.2.1": 1}
        writer.close()
        for host in crowd:
            host.let_go()
        await asyncio.sleep(0.01)


@pytest.mark.parametrize("module", [arrivals, places, listening])
def test_the_addresses_of_other_hosts_are_other_hosts(module: ModuleType) -> None:
    assert [module.is_loopback(each) for each in ("127.0.1.1", HOST)] == [False, True]
