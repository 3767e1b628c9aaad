import asyncio
import logging
import socket
import struct
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from unittest.mock import AsyncMock, Mock

import pytest
from promises.promise_table import figure
from rigs.cells.expectations import expect
from rigs.cells.server_rig import MS
from rigs.peers.own_network import printed_in_own_network
from rigs.peers.server_clients import hello

from openpendant.controller_emulator.shell import links
from openpendant.server.events.events import ControllerReport, Port
from openpendant.server.refusal import Refusal
from openpendant.server.settings.cell_settings import CellSettings, ControllerLink, ControllerPath
from openpendant.server.shell.client_connection import ClientConnection
from openpendant.server.shell.clients import MOST_ORDERS, MOST_TURNED_AWAY, Clients, Rejections
from openpendant.server.shell.controller_connection import ControllerConnection
from openpendant.server.shell.socket_options import CONTROLLER_UNANSWERED, prepare_socket
from openpendant.simplemsg import (
    STANDARD,
    ByteOrder,
    CommType,
    Connection,
    HeaderOnly,
    JointTrajPt,
    Message,
    MsgType,
    Ping,
    Received,
    ReplyCode,
    Role,
    SpecialSequence,
    joint_array,
)
from openpendant.simplemsg.pendant import Verdict
from openpendant.simplemsg.verdicts import VerdictCode as V

NONE = joint_array(())


def point(sequence: int) -> Message:
    return JointTrajPt(sequence=sequence, joints=NONE, velocity=0.1, duration=0.0)


@pytest.fixture
def wire() -> Iterator[socket.socket]:
    with socket.socket() as made:
        yield made


def made_connection(inbox: Mock) -> ControllerConnection:
    link = ControllerLink()
    return ControllerConnection(inbox, Mock(), 0, "", ControllerPath.MOTION, link)


def connected(wire: socket.socket) -> tuple[ControllerConnection, Mock, Mock]:
    inbox, transport = Mock(is_noted=False), Mock(spec=asyncio.Transport)
    cell = Mock()
    inbox.entrance.return_value = cell.deliver
    transport.get_extra_info.return_value = wire
    transport.is_closing.return_value = False
    transport.get_write_buffer_size.return_value = 0
    connection = made_connection(inbox)
    connection.connection_made(transport)
    return connection, cell, transport


def owed(cell: Mock) -> list[int]:
    return [
        event.pending
        for event in (call.args[0] for call in cell.deliver.call_args_list)
        if isinstance(event, ControllerReport)
    ]


def answers(connection: ControllerConnection, transport: Mock, *sequences: int) -> list[bytes]:
    """Send points, and return the controller's answers to them."""
    for sequence in sequences:
        connection.send(point(sequence))
    controller = Connection(Role.SERVER, STANDARD, ControllerLink().order)
    controller.receive(b"".join(call.args[0] for call in transport.write.call_args_list))
    taken = HeaderOnly(
        MsgType.JOINT_TRAJ_PT, comm_type=CommType.REPLY, reply_code=ReplyCode.SUCCESS
    )
    return [controller.send(taken) for _ in sequences]


@pytest.fixture
def _no_slow_moment(monkeypatch: pytest.MonkeyPatch) -> None:
    """A turn that ends early, as in a slow moment, leaves some of what came for the next."""
    monkeypatch.setattr("openpendant.server.shell.controller_connection.thread_time_ns", lambda: 0)


@pytest.mark.usefixtures("_no_slow_moment")
@pytest.mark.parametrize("together", [True, False])
def test_answers_that_come_together_are_judged_as_if_each_came_alone(
    wire: socket.socket, together: bool
) -> None:
    connection, cell, transport = connected(wire)
    data = answers(connection, transport, SpecialSequence.STOP, 0, 1)
    for each in [b"".join(data)] if together else data:
        connection.data_received(each)
    assert owed(cell) == [2, 1, 0]


@pytest.mark.usefixtures("_no_slow_moment")
def test_what_is_sent_because_of_an_answer_counts_for_those_behind_it(wire: socket.socket) -> None:
    connection, cell, transport = connected(wire)
    data = answers(connection, transport, 0, 1)
    cell.deliver.side_effect = lambda *_: (
        connection.send(point(2)) if len(owed(cell)) == 1 else None
    )
    connection.data_received(b"".join(data))
    assert owed(cell) == [1, 1]


@pytest.mark.virtual_clock
@pytest.mark.parametrize(
    ("fault", "said"),
    [
        (OSError(111, "Connection refused"), "Connection refused"),
        (UnicodeError("label empty"), "UnicodeError: label empty"),
        (RuntimeError("of ours"), "RuntimeError: of ours"),
    ],
)
async def test_whatever_keeps_it_from_connecting_is_said_once_and_it_tries_again(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture, fault: Exception, said: str
) -> None:
    loop = asyncio.get_running_loop()
    connect = AsyncMock(side_effect=fault)
    monkeypatch.setattr(loop, "create_connection", connect)
    connection = made_connection(Mock())
    keeper = asyncio.create_task(connection.keep_up())
    await asyncio.sleep(1.7)
    assert not keeper.done()
    keeper.cancel()
    assert connect.await_count == 4
    (record,) = caplog.records
    assert said in record.getMessage()
    assert "127.0.0.1:12000" in record.getMessage()


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
    transport.get_write_buffer_size.return_value = 0
    client = ClientConnection(inbox, Mock(), port, processor_time=lambda: 0)
    client.connection_made(transport)
    counts = []
    client.data_received(PING * 40)
    for _ in taken:
        counts.append(inbox.received.call_count)
        await asyncio.sleep(0)
    assert counts == taken


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
            prepare_socket(sock, CONTROLLER_UNANSWERED)
        else:
            links._prepare(sock)
        first = option(sock, "TCP_KEEPIDLE")
        second = first + option(sock, "TCP_KEEPINTVL")
        assert second < option(sock, "TCP_USER_TIMEOUT") / 1000 < second + first


@pytest.mark.realtime
def test_a_loose_plug_costs_an_idle_pendant_and_not_the_controller() -> None:
    assert printed_in_own_network(PLUG) == "down up"


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


START = 5_000 * MS
FULL = Refusal(V.NO_PLACE, "more than 16 connections; come again in 5 s", value=5)


@dataclass
class Visitor(ClientConnection):
    port: Port = Port.PENDANT
    session: int = 1
    done: list[Message | str] = field(default_factory=list)

    def send(self, message: Message) -> None:
        self.done.append(message)

    def close(self, reason: str) -> None:
        self.done.append(f"closed: {reason}")

    def abort(self, reason: str) -> None:
        self.done.append(f"cut off: {reason}")


def turned_away(port: Port = Port.PENDANT) -> tuple[Rejections, Visitor]:
    doors, visitor = Rejections(), Visitor(port=port)
    doors.reject(visitor, FULL, START)
    return doors, visitor


def test_a_hello_is_answered_with_the_advice_and_closed_once() -> None:
    doors, visitor = turned_away()
    assert not visitor.done
    doors.receive(1, hello("tester"))
    doors.receive(1, hello("tester"))
    doors.check_deadlines(START + 1_000 * MS)
    first, *ended = visitor.done
    said = expect(Verdict, first)
    assert (said.code, said.value, said.text) == (V.NO_PLACE, 5.0, FULL.text)
    assert ended == [f"closed: {FULL.text}"]


@pytest.mark.parametrize("other", [Ping(), Verdict(1, 0, -1, 0.0, 0.0, "")])
def test_whoever_says_something_else_gets_no_answer(other: Received) -> None:
    doors, visitor = turned_away()
    doors.receive(1, other)
    assert visitor.done == [f"closed: {FULL.text}"]


def test_promise_20_whoever_says_nothing_is_cut_off_after_30_ms() -> None:
    doors, visitor = turned_away()
    doors.check_deadlines(START + figure(20, "hearing").ns - 1)
    assert not visitor.done
    doors.check_deadlines(START + figure(20, "hearing").ns)
    doors.check_deadlines(START + 40 * MS)
    assert visitor.done == [f"cut off: {FULL.text}"]


def test_whoever_left_is_forgotten() -> None:
    doors, visitor = turned_away()
    doors.forget(1)
    doors.check_deadlines(START + 40 * MS)
    doors.receive(1, hello("tester"))
    assert not visitor.done


@pytest.mark.parametrize("port", [Port.ROS_MOTION, Port.ROS_STATE])
def test_a_ros_client_is_cut_off_at_once(port: Port) -> None:
    _, visitor = turned_away(port)
    assert visitor.done == [f"cut off: {FULL.text}"]


def test_no_more_than_so_many_wait_for_their_answer() -> None:
    doors = Rejections()
    visitors = [Visitor(session=number) for number in range(MOST_TURNED_AWAY + 1)]
    for visitor in visitors:
        doors.reject(visitor, FULL, START)
    assert [number for number, each in enumerate(visitors) if each.done] == [MOST_TURNED_AWAY]
    doors.hang_up()
    assert all(len(each.done) == 1 for each in visitors)
