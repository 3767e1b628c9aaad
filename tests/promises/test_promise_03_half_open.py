"""Promise 3: a peer whose cable was pulled keeps neither authority nor connection for 3 s."""

import asyncio
import socket
from pathlib import Path

import pytest
from promises.promise_figures import tell
from promises.promise_table import figure
from rigs.cells.server_rig import TICK, ready
from rigs.motion.jog_pad import JogPad
from rigs.peers.own_network import printed_in_own_network
from rigs.processes.app_on_loop import app_on_loop, clients_of, said, until

from openpendant.simplemsg.pendant import AuthorityBeat, AuthorityChanged, AuthorityReason

FREE, CLOSED = figure(3, "free"), figure(3, "closed")
CABLE = Path(__file__).parents[1] / "rigs" / "peers" / "pulled_cable.py"


def test_promise_3_the_authority_of_a_silent_peer_is_free_after_three_seconds() -> None:
    rig = ready()
    pad = JogPad(rig)
    witness = rig.pendant("witness")
    last = rig.now
    pad.pendant.send(AuthorityBeat())
    while rig.core.cell.authority.holder is not None:
        rig.wait(10)
        assert rig.now - last <= FREE.ns + TICK
    assert rig.now - last >= FREE.ns
    (change,) = witness.all(AuthorityChanged)
    assert change.reason == AuthorityReason.EXPIRED


@pytest.mark.virtual_clock
async def test_promise_3_the_kernel_is_told_to_look_for_dead_peers() -> None:
    async with app_on_loop() as served:
        await served.visitor(begin=said())
        await until(lambda: served.connections == 1, 1.0)
        (client,) = clients_of(served.app).values()
        assert client._transport is not None
        accepted = client._transport.get_extra_info("socket")
        tcp = socket.IPPROTO_TCP
        assert accepted.getsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE) == 1
        idle, pause, count = (
            accepted.getsockopt(tcp, option)
            for option in (socket.TCP_KEEPIDLE, socket.TCP_KEEPINTVL, socket.TCP_KEEPCNT)
        )
        assert idle + pause * count <= CLOSED.seconds
        assert accepted.getsockopt(tcp, socket.TCP_USER_TIMEOUT) <= CLOSED.ms
        await asyncio.sleep(0)


@pytest.mark.realtime
def test_promise_3_a_pulled_cable_is_noticed_within_three_seconds() -> None:
    talking, listening = map(float, printed_in_own_network(CABLE).split())
    tell(f"promise 3: noticed after {talking:.2f} s with state under way, {listening:.2f} s idle")
    assert talking <= CLOSED.seconds
    assert listening <= CLOSED.seconds
