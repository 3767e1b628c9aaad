from __future__ import annotations

import asyncio
import logging
import struct
from unittest.mock import Mock

import pytest

from openpendant.server.events.events import Port
from openpendant.server.shell.client_connection import ClientConnection
from openpendant.simplemsg import CommType, MsgType

PING = struct.pack("<4i", 12, MsgType.PING, CommType.REQUEST, 0)


@pytest.mark.parametrize(
    ("reason", "said"), [(ConnectionResetError(104, "reset by peer"), 1), (None, 0)]
)
def test_why_a_connection_was_lost_is_logged(
    reason: Exception | None, said: int, caplog: pytest.LogCaptureFixture
) -> None:
    inbox = Mock()
    client = ClientConnection(inbox, Mock(), Port.PENDANT)
    with caplog.at_level(logging.INFO, logger="openpendant.server"):
        client.connection_lost(reason)
    assert caplog.text.count("reset by peer") == said
    inbox.closed.assert_called_once_with(client)


@pytest.mark.asyncio
@pytest.mark.parametrize(
    ("port", "taken"), [(Port.PENDANT, [16, 32, 40]), (Port.ROS_MOTION, [40, 40, 40])]
)
async def test_a_pendants_burst_leaves_each_turn_of_the_loop_time_for_others(
    port: Port, taken: list[int]
) -> None:
    inbox, transport = Mock(is_noted=False), Mock()
    inbox.wire_bytes.return_value = 0
    inbox.clients.read_ahead.return_value = 512 * 1024
    transport.get_extra_info.side_effect = {"peername": None, "socket": Mock()}.get
    transport.is_closing.return_value = False
    client = ClientConnection(inbox, Mock(), port)
    client.connection_made(transport)
    counts = []
    client.data_received(PING * 40)
    for _ in taken:
        counts.append(inbox.received.call_count)
        await asyncio.sleep(0)
    assert counts == taken
