"""A scripted server and a pendant client on it, for the tests of the client library."""

from collections.abc import AsyncIterator

import pytest
from rigs.peers.scripted_pendant_server import ScriptedPendantServer, scripted_server

from openpendant.tools.pendants.client import PendantClient


@pytest.fixture
async def server() -> AsyncIterator[ScriptedPendantServer]:
    async with scripted_server() as running:
        yield running


@pytest.fixture
async def pendant(server: ScriptedPendantServer) -> AsyncIterator[PendantClient]:
    async with await PendantClient.connect("127.0.0.1", server.port) as connected:
        await connected.next_state()
        yield connected
