"""A scripted server and a pendant client on it, and the panel of a terminal pendant."""

from collections.abc import AsyncIterator

import pytest
from rigs.cells.panel_rig import PanelRig
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


@pytest.fixture
def rig() -> PanelRig:
    return PanelRig()
