from __future__ import annotations

import asyncio
import socket
from collections.abc import Iterator
from unittest.mock import AsyncMock, Mock

import pytest

from openpendant.server.events.events import ControllerReport
from openpendant.server.settings.cell_settings import ControllerLink, ControllerPath
from openpendant.server.shell.controller_connection import ControllerConnection
from openpendant.simplemsg import (
    STANDARD,
    CommType,
    Connection,
    HeaderOnly,
    JointTrajPt,
    Message,
    MsgType,
    ReplyCode,
    Role,
    SpecialSequence,
    joint_array,
)

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
    connection = made_connection(inbox)
    connection.connection_made(transport)
    return connection, cell, transport


def owed(cell: Mock) -> list[int]:
    return [
        event.pending
        for event in (call.args[0] for call in cell.deliver.call_args_list)
        if isinstance(event, ControllerReport)
    ]


@pytest.mark.parametrize("together", [True, False])
def test_answers_that_come_together_are_judged_as_if_each_came_alone(
    wire: socket.socket, together: bool
) -> None:
    connection, cell, transport = connected(wire)
    for sequence in (SpecialSequence.STOP, 0, 1):
        connection.send(point(sequence))
    controller = Connection(Role.SERVER, STANDARD, ControllerLink().order)
    controller.receive(b"".join(call.args[0] for call in transport.write.call_args_list))
    answers = [
        controller.send(
            HeaderOnly(
                MsgType.JOINT_TRAJ_PT, comm_type=CommType.REPLY, reply_code=ReplyCode.SUCCESS
            )
        )
        for _ in range(3)
    ]
    for data in [b"".join(answers)] if together else answers:
        connection.data_received(data)
    assert owed(cell) == [2, 1, 0]


def test_what_is_sent_because_of_an_answer_counts_for_those_behind_it(wire: socket.socket) -> None:
    connection, cell, transport = connected(wire)
    for sequence in (0, 1):
        connection.send(point(sequence))
    controller = Connection(Role.SERVER, STANDARD, ControllerLink().order)
    controller.receive(b"".join(call.args[0] for call in transport.write.call_args_list))
    answer = HeaderOnly(
        MsgType.JOINT_TRAJ_PT, comm_type=CommType.REPLY, reply_code=ReplyCode.SUCCESS
    )
    cell.deliver.side_effect = lambda *_: (
        connection.send(point(2)) if len(owed(cell)) == 1 else None
    )
    connection.data_received(controller.send(answer) + controller.send(answer))
    assert owed(cell) == [1, 1]


@pytest.mark.asyncio
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
