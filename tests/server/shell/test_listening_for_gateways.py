"""The listener: what comes from a gateway's address counts for the rate of nobody."""

import asyncio
import errno
import socket
from collections.abc import Iterator

import pytest

from openpendant.server.access import arrivals
from openpendant.server.access.arrivals import OF_ADDRESS_BURST, AddressRates
from openpendant.server.shell import listening
from openpendant.server.shell.listening import Listening

pytestmark = pytest.mark.virtual_clock

GATEWAY, OTHER = "127.0.1.1", "127.0.1.2"


@pytest.fixture(autouse=True)
def other_hosts(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Take every address but 127.0.0.1 for that of another host."""
    for module in (arrivals, listening):
        monkeypatch.setattr(module, "is_loopback", lambda address: address == "127.0.0.1")
    listening._charged.cache_clear()
    yield
    listening._charged.cache_clear()


class Taken(asyncio.Protocol):
    """Counts the connections that are let in, by address."""

    def __init__(self, taken: list[str]) -> None:
        self._taken = taken

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        self._taken.append(transport.get_extra_info("peername")[0])


def knock(address: str, port: int, count: int) -> list[socket.socket]:
    sockets = [socket.socket() for _ in range(count)]
    for sock in sockets:
        sock.setblocking(False)
        sock.bind((address, 0))
        assert sock.connect_ex(("127.0.0.1", port)) in (0, errno.EINPROGRESS)
    return sockets


async def test_promise_41_a_gateway_opens_more_connections_than_another_host_may() -> None:
    taken: list[str] = []
    rates = AddressRates()
    listens = Listening(lambda: True, rates, lambda address: address == GATEWAY)
    port = await listens.listen("127.0.0.1", 0, lambda: Taken(taken))
    sockets: list[socket.socket] = []
    for address in (GATEWAY, OTHER):
        sockets += knock(address, port, OF_ADDRESS_BURST + 10)
        await asyncio.sleep(0.9)
    listens.close()
    for sock in sockets:
        sock.close()
    assert taken.count(GATEWAY) == OF_ADDRESS_BURST + 10
    assert taken.count(OTHER) == OF_ADDRESS_BURST
    # The rate of the address that a gateway states is the one that its own connections count for.
    assert len(rates) == 1
    assert not rates.is_within(OTHER, int(asyncio.get_running_loop().time() * 1e9) - 10**9)
