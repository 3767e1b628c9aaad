from __future__ import annotations

from dataclasses import dataclass, field

import pytest
from promises.promise_table import figure
from rigs.peers.server_clients import hello

from openpendant.server.events.events import Port
from openpendant.server.refusal import Refusal
from openpendant.server.shell.client_connection import ClientConnection
from openpendant.server.shell.clients import MOST_TURNED_AWAY, Rejections
from openpendant.simplemsg import Message, Ping, Received
from openpendant.simplemsg.pendant import Verdict
from openpendant.simplemsg.verdicts import VerdictCode as V

MS = 1_000_000
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


def test_a_hello_is_answered_with_the_advice_and_closed_once() -> None:
    doors, visitor = Rejections(), Visitor()
    doors.reject(visitor, FULL, START)
    assert not visitor.done
    doors.receive(1, hello("tester"))
    doors.receive(1, hello("tester"))
    doors.check_deadlines(START + 1_000 * MS)
    said, *ended = visitor.done
    assert isinstance(said, Verdict)
    assert (said.code, said.value, said.text) == (V.NO_PLACE, 5.0, FULL.text)
    assert ended == [f"closed: {FULL.text}"]


@pytest.mark.parametrize("other", [Ping(), Verdict(1, 0, -1, 0.0, 0.0, "")])
def test_whoever_says_something_else_gets_no_answer(other: Received) -> None:
    doors, visitor = Rejections(), Visitor()
    doors.reject(visitor, FULL, START)
    doors.receive(1, other)
    assert visitor.done == [f"closed: {FULL.text}"]


def test_promise_20_whoever_says_nothing_is_cut_off_after_30_ms() -> None:
    doors, visitor = Rejections(), Visitor()
    doors.reject(visitor, FULL, START)
    doors.check_deadlines(START + figure(20, "hearing").ns - 1)
    assert not visitor.done
    doors.check_deadlines(START + figure(20, "hearing").ns)
    doors.check_deadlines(START + 40 * MS)
    assert visitor.done == [f"cut off: {FULL.text}"]


def test_whoever_left_is_forgotten() -> None:
    doors, visitor = Rejections(), Visitor()
    doors.reject(visitor, FULL, START)
    doors.forget(1)
    doors.check_deadlines(START + 40 * MS)
    doors.receive(1, hello("tester"))
    assert not visitor.done


@pytest.mark.parametrize("port", [Port.ROS_MOTION, Port.ROS_STATE])
def test_a_ros_client_is_cut_off_at_once(port: Port) -> None:
    doors, visitor = Rejections(), Visitor(port=port)
    doors.reject(visitor, FULL, START)
    assert visitor.done == [f"cut off: {FULL.text}"]


def test_no_more_than_so_many_wait_for_their_answer() -> None:
    doors = Rejections()
    visitors = [Visitor(session=number) for number in range(MOST_TURNED_AWAY + 1)]
    for visitor in visitors:
        doors.reject(visitor, FULL, START)
    assert [number for number, each in enumerate(visitors) if each.done] == [MOST_TURNED_AWAY]
    doors.hang_up()
    assert all(len(each.done) == 1 for each in visitors)
