"""The shell round a client's connection: what it says about a connection that was lost."""

from __future__ import annotations

import logging
from unittest.mock import Mock

import pytest

from openpendant.server.client_connection import ClientConnection
from openpendant.server.core import Port


@pytest.mark.parametrize(
    ("reason", "said"), [(ConnectionResetError(104, "reset by peer"), 1), (None, 0)]
)
def test_why_a_connection_was_lost_is_logged(
    reason: Exception | None, said: int, caplog: pytest.LogCaptureFixture
) -> None:
    clients = Mock()
    client = ClientConnection(clients, Port.PENDANT)
    with caplog.at_level(logging.INFO, logger="openpendant.server"):
        client.connection_lost(reason)
    assert caplog.text.count("reset by peer") == said
    clients.dismiss.assert_called_once_with(client)
