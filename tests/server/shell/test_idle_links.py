from __future__ import annotations

import socket
from pathlib import Path

import pytest
from rigs.peers.own_network import printed_in_own_network

from openpendant.controller_emulator.shell import links
from openpendant.server.shell.client_connection import prepare_socket
from openpendant.server.shell.controller_connection import UNANSWERED

PLUG = Path(__file__).parents[2] / "rigs" / "peers" / "loose_plug.py"


def option(sock: socket.socket, name: str) -> int:
    number = getattr(socket, name, None)
    if number is None:
        pytest.skip(f"{name} is not known here")
    return sock.getsockopt(socket.IPPROTO_TCP, number)


@pytest.mark.parametrize("side", ["server", "emulator"])
def test_a_link_between_server_and_controller_ends_with_the_second_lost_probe(side: str) -> None:
    with socket.socket() as sock:
        if side == "server":
            prepare_socket(sock, UNANSWERED)
        else:
            links._prepare(sock)
        first = option(sock, "TCP_KEEPIDLE")
        second = first + option(sock, "TCP_KEEPINTVL")
        assert second < option(sock, "TCP_USER_TIMEOUT") / 1000 < second + first


@pytest.mark.realtime
def test_a_loose_plug_costs_an_idle_pendant_and_not_the_controller() -> None:
    assert printed_in_own_network(PLUG) == "down up"
