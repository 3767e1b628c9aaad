from __future__ import annotations

from unittest.mock import Mock

import pytest

from openpendant.server.events.events import Port
from openpendant.server.settings.cell_settings import CellSettings
from openpendant.server.shell.clients import MOST_ORDERS, Clients
from openpendant.simplemsg import ByteOrder

BIG, LITTLE = ByteOrder.BIG, ByteOrder.LITTLE


@pytest.fixture
def clients() -> Clients:
    return Clients([CellSettings()], Mock())


def client(address: str, port: Port = Port.ROS_MOTION) -> Mock:
    return Mock(cell=0, address=address, port=port, wire=Mock(byte_order=BIG))


def spoke(clients: Clients, address: str) -> None:
    clients.learn_byte_order(client(address))


def order_of(clients: Clients, address: str) -> ByteOrder:
    return clients.state_byte_order(client(address, Port.ROS_STATE))


def strangers(clients: Clients, count: int) -> None:
    for number in range(count):
        spoke(clients, f"2001:db8::{number:x}")


def test_the_last_of_many_addresses_are_remembered_and_the_oldest_forgotten(
    clients: Clients,
) -> None:
    spoke(clients, "10.0.0.1")
    strangers(clients, MOST_ORDERS - 1)
    assert order_of(clients, "10.0.0.1") is BIG
    strangers(clients, MOST_ORDERS)
    assert order_of(clients, "10.0.0.1") is LITTLE
    assert order_of(clients, f"2001:db8::{MOST_ORDERS - 1:x}") is BIG


def test_who_speaks_again_is_no_longer_the_oldest(clients: Clients) -> None:
    spoke(clients, "10.0.0.1")
    strangers(clients, MOST_ORDERS - 1)
    spoke(clients, "10.0.0.1")
    spoke(clients, "10.0.0.2")
    assert order_of(clients, "10.0.0.1") is BIG


def test_who_is_connected_is_not_forgotten_however_many_others_come(clients: Clients) -> None:
    clients.by_session[1] = client("10.0.0.1")
    clients.learn_byte_order(clients.by_session[1])
    strangers(clients, 3 * MOST_ORDERS)
    assert order_of(clients, "10.0.0.1") is BIG
    assert len(clients._orders) <= MOST_ORDERS + 1
