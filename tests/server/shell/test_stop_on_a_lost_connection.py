"""A STOP that has arrived acts whatever becomes of its connection, and the journal repeats it.

Over real sockets on a virtual clock: what the kernel holds when a connection ends is read.
"""

import asyncio
import itertools
import select
import socket
import struct
from collections.abc import Callable
from pathlib import Path
from unittest.mock import Mock

import pytest
from rigs.cells.expectations import known
from rigs.cells.journalled_cell import journalled_cell
from rigs.clock.virtual_clock import VirtualLoop
from rigs.processes.app_on_loop import AppOnLoop, app_on_loop, clients_of, said, until

from openpendant.server.shell.client_connection import ClientConnection
from openpendant.simplemsg import CommType, Ping, codec_for
from openpendant.simplemsg.codec import PENDANT
from openpendant.simplemsg.pendant import (
    Authority,
    AuthorityAction,
    Management,
    ResetStop,
    SoftwareStop,
)
from openpendant.tools.packets.journals.reenactment import rerun

pytestmark = pytest.mark.virtual_clock

CODEC = codec_for(PENDANT)
STOP = CODEC.encode(SoftwareStop(1_000, "now"))
PING = CODEC.encode(Ping(comm_type=CommType.REQUEST))
RESET = struct.pack("ii", 1, 0)


def question(number: int) -> bytes:
    return CODEC.encode(Management(number, b'{"op":"snapshot"}'))


async def welcomed(served: AppOnLoop) -> tuple[socket.socket, ClientConnection]:
    before = set(served.app.clients.by_session)
    sock = await served.visitor(begin=said())
    await until(lambda: served.connections == len(before) + 1, 1.0)
    await until(lambda: bool(_read(sock)), 1.0)
    (session,) = set(served.app.clients.by_session) - before
    return sock, clients_of(served.app)[session]


def _read(sock: socket.socket) -> bytes:
    try:
        return sock.recv(65_536)
    except BlockingIOError:
        return b""


def is_stopped(served: AppOnLoop) -> bool:
    return served.app.cells[0].core.cell.stop is not None


def await_arrival(client: ClientConnection) -> None:
    """Wait, by the kernel's clock, until what was sent can be read; the loop does nothing."""
    accepted = known(client._transport).get_extra_info("socket").fileno()
    assert select.select([accepted], [], [], 10.0)[0]


def write(client: ClientConnection, data: bytes) -> None:
    """Write what is in no journal, as it answers nothing."""
    known(client._transport).write(data)


def reset_and_written_to(sock: socket.socket, client: ClientConnection) -> None:
    sock.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, RESET)
    sock.close()
    write(client, PING)


def ended_and_written_to(sock: socket.socket, client: ClientConnection) -> None:
    sock.close()
    write(client, PING)
    write(client, PING)


ENDS: dict[str, Callable[[socket.socket, ClientConnection], None]] = {
    "aborted": lambda _, client: client.abort("for a test"),
    "closed": lambda _, client: client.close("for a test"),
    "reset and written to": reset_and_written_to,
    "ended and written to": ended_and_written_to,
}


@pytest.mark.parametrize("end", ENDS.values(), ids=ENDS)
async def test_promise_19_what_has_arrived_when_a_connection_ends_is_read(
    end: Callable[[socket.socket, ClientConnection], None],
) -> None:
    async with app_on_loop() as served:
        for _ in range(10):
            sock, client = await welcomed(served)
            sock.send(CODEC.encode(ResetStop(1)) + PING * 40 + STOP)
            await_arrival(client)
            assert not is_stopped(served)
            end(sock, client)
            await until(lambda: served.connections == 0, 1.0)
            assert is_stopped(served)
            core = served.app.cells[0].core
            core.cell.stop = None


async def test_who_asks_and_does_not_read_is_cut_off_and_his_stop_is_not_lost() -> None:
    """The answers of the first few questions are more than may wait; the rest is still to come."""
    async with app_on_loop() as served:
        sock = await served.visitor(window=1_024, begin=said())
        stream = b"".join(question(number) for number in range(1, 2_000)) + STOP
        sending = asyncio.ensure_future(asyncio.get_running_loop().sock_sendall(sock, stream))
        await until(lambda: is_stopped(served), 3.0)
        await until(lambda: served.connections == 0, 3.0)
        sending.cancel()
        await asyncio.gather(sending, return_exceptions=True)


async def test_a_stop_acts_while_the_last_answers_wait_to_leave() -> None:
    async with app_on_loop() as served:
        sock = await served.visitor(window=1_024, begin=said())
        await until(lambda: served.connections == 1, 1.0)
        (client,) = clients_of(served.app).values()
        await until(lambda: client.wire.byte_order is not None, 1.0)
        write(client, bytes(3_000_000))
        core = served.app.cells[0].core
        sock.send(STOP)
        await_arrival(client)
        client.close("for a test")
        await asyncio.sleep(0)
        assert is_stopped(served)
        core.cell.stop = None
        sock.send(STOP)
        await_arrival(client)
        await until(lambda: is_stopped(served), 0.02)
        assert served.connections == 1


def test_a_journal_with_stops_ahead_runs_again_with_identical_bytes(
    tmp_path: Path, virtual_loop: VirtualLoop
) -> None:
    file = tmp_path / "server.journal"

    async def live() -> None:
        loop = asyncio.get_running_loop()
        async with journalled_cell(tmp_path / "emulator.journal", file) as cell:
            core = cell.app.cells[0].core

            async def visitor() -> socket.socket:
                sock = socket.socket()
                sock.setblocking(False)
                await loop.sock_connect(sock, ("127.0.0.1", cell.pendant_port))
                await loop.sock_sendall(sock, said(Authority(1, AuthorityAction.REQUEST)))
                await asyncio.sleep(0.05)
                return sock

            holder = await visitor()
            flood = b"".join(question(number) for number in range(2, 60))
            await loop.sock_sendall(holder, flood + STOP + CODEC.encode(ResetStop(1_001)))
            await asyncio.sleep(0.5)
            assert core.cell.stop is None
            dying = await visitor()
            (*_, client) = clients_of(cell.app).values()
            dying.send(PING * 100 + STOP)
            await_arrival(client)
            reset_and_written_to(dying, client)
            await until(lambda: core.cell.stop is not None, 0.1)
            cut = await visitor()
            cut.send(STOP + bytes(4) + STOP)
            await asyncio.sleep(0.1)
            holder.close()
            cut.close()

    virtual_loop.run_until_complete(live())
    outcome = rerun(file)
    assert (outcome.difference, outcome.is_cut) == (None, False)
    assert '"ask": "gone"' in file.read_text()


def test_a_run_with_a_watchdogs_stop_runs_again_exactly(
    tmp_path: Path, virtual_loop: VirtualLoop
) -> None:
    file = tmp_path / "server.journal"

    async def live() -> None:
        async with journalled_cell(tmp_path / "emulator.journal", file) as cell:
            pendant = await cell.pendant()
            async with pendant.control():
                at = pendant.joints()
                await pendant.move_joints([at[0] + 0.5, *at[1:]], speed=0.1)
                await asyncio.sleep(0.5)
                tells_once = Mock(side_effect=itertools.chain([1], itertools.repeat(0)))
                cell.app._watchdog = Mock(beat=tells_once)
                await asyncio.sleep(0.1)
                assert cell.app.cells[0].core.cell.stop is not None
            await pendant.close()

    virtual_loop.run_until_complete(live())
    assert '"ask": "stopped"' in file.read_text()
    outcome = rerun(file)
    assert (outcome.difference, outcome.is_cut) == (None, False)
