import selectors
import socket
import struct
import threading
import time
from collections.abc import Iterator
from typing import Any
from unittest.mock import Mock

import pytest

from openpendant.server.watchdog.stop_connection import ControllerAddress, StopConnection
from openpendant.server.watchdog.watchdog_protocol import StopTarget

MS = 1_000_000
STOP = b"stop the robot"
ANSWER = struct.pack("<3i", 11, 3, 1)
REFUSAL = struct.pack("<3i", 11, 3, 2)
HOST = "127.0.0.1"
WAIT_S = 10.0


def frame(body: bytes) -> bytes:
    return struct.pack("<i", len(body)) + body


class Rig:
    def __init__(self, *, is_kept: bool = True, backlog: int = 8) -> None:
        self.listener = socket.create_server((HOST, 0), backlog=backlog)
        self.listener.settimeout(WAIT_S)
        self.selector = selectors.DefaultSelector()
        self.said: list[str] = []
        self.now = 1_000 * MS
        port = self.listener.getsockname()[1]
        target = StopTarget("cell", HOST, port, STOP.hex(), is_kept, ANSWER.hex(), "little")
        self.link = StopConnection(target, self.selector, self.said.append)
        self.accepted: list[socket.socket] = []

    @property
    def own(self) -> socket.socket:
        (key,) = self.selector.get_map().values()
        assert isinstance(key.fileobj, socket.socket)
        return key.fileobj

    def wait(self, milliseconds: int) -> None:
        self.now += milliseconds * MS
        self.link.keep_up(self.now)

    def take(self) -> None:
        events = self.selector.select(WAIT_S)
        assert events, "nothing came"
        for key, mask in events:
            key.data.ready(mask, self.now)

    def accept(self) -> socket.socket:
        connection, _ = self.listener.accept()
        connection.settimeout(WAIT_S)
        self.accepted.append(connection)
        return connection

    def connected(self) -> socket.socket:
        self.link.keep_up(self.now)
        return self.again()

    def stopped(self) -> socket.socket:
        connection = self.connected()
        self.link.stop(self.now)
        return connection

    def again(self) -> socket.socket:
        connection = self.accept()
        self.take()
        return connection

    def close(self) -> None:
        for each in [*self.accepted, self.listener]:
            each.close()
        for key in list(self.selector.get_map().values()):
            assert isinstance(key.fileobj, socket.socket)
            key.fileobj.close()
        self.selector.close()


@pytest.fixture
def rig(request: pytest.FixtureRequest) -> Iterator[Rig]:
    made = Rig(is_kept=getattr(request, "param", True))
    yield made
    made.close()


@pytest.fixture
def full() -> Iterator[Rig]:
    made = Rig(backlog=0)
    with socket.create_connection(made.listener.getsockname()):
        yield made
    made.close()


def test_an_answered_stop_is_owed_no_longer(rig: Rig) -> None:
    peer = rig.stopped()
    assert peer.recv(100) == STOP
    assert not rig.link.is_done
    peer.sendall(frame(ANSWER))
    rig.take()
    assert rig.link.is_done


@pytest.mark.parametrize("heard", [b"", frame(REFUSAL), frame(ANSWER)[:-1]])
def test_an_unanswered_stop_is_sent_again_on_a_new_connection(rig: Rig, heard: bytes) -> None:
    peer = rig.stopped()
    if heard:
        peer.sendall(heard)
        rig.take()
    rig.wait(99)
    first = rig.own
    rig.wait(1)
    assert rig.own is not first
    assert rig.again().recv(100) == STOP
    assert not rig.link.is_done


def test_each_time_the_controller_is_given_longer_to_answer(rig: Rig) -> None:
    rig.stopped()
    gaps = []
    for _ in range(6):
        used, gap = rig.own, 0
        while rig.own is used:
            rig.wait(10)
            gap += 10
        gaps.append(gap)
        rig.again()
    assert gaps == [100, 200, 400, 800, 1_000, 1_000]


def test_a_stop_into_a_reset_connection_is_sent_again_at_once(rig: Rig) -> None:
    peer = rig.stopped()
    peer.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
    peer.close()
    rig.take()
    rig.wait(0)
    assert rig.again().recv(100) == STOP


def test_a_stop_waits_for_no_attempt_that_hangs(full: Rig) -> None:
    full.link.keep_up(full.now)
    hanging = full.own.getsockname()
    full.wait(10)
    full.accept()
    full.link.stop(full.now)
    assert full.own.getsockname() != hanging
    assert full.again().recv(100) == STOP


def test_an_attempt_is_given_up_after_a_second(full: Rig) -> None:
    full.link.keep_up(full.now)
    hanging = full.own.getsockname()
    full.wait(999)
    assert full.own.getsockname() == hanging
    full.wait(1)
    assert full.own.getsockname() != hanging


def test_a_stop_that_nobody_answers_is_given_up_at_its_limit(rig: Rig) -> None:
    rig.stopped()
    rig.link.limit(rig.now + 50 * MS)
    done = []
    for milliseconds in (49, 1):
        rig.wait(milliseconds)
        done.append(rig.link.is_done)
    assert done == [False, True]
    assert "not answered" in rig.said[-1]


@pytest.mark.parametrize("rig", [False], indirect=True)
def test_a_controller_that_takes_one_connection_is_left_once_it_answered(rig: Rig) -> None:
    rig.link.keep_up(rig.now)
    rig.link.stop(rig.now)
    peer = rig.again()
    assert peer.recv(100) == STOP
    peer.sendall(frame(ANSWER))
    rig.take()
    assert peer.recv(100) == b""


@pytest.mark.parametrize(
    ("option", "value"),
    [("TCP_KEEPIDLE", 1), ("TCP_KEEPINTVL", 1), ("TCP_KEEPCNT", 2), ("TCP_USER_TIMEOUT", 2_500)],
)
def test_an_idle_connection_without_power_is_found_dead(rig: Rig, option: str, value: int) -> None:
    rig.connected()
    assert rig.own.getsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE)
    assert rig.own.getsockopt(socket.IPPROTO_TCP, getattr(socket, option)) == value


PATIENCE_S = 20.0


def found(*hosts: str) -> list[Any]:
    return [(socket.AF_INET, socket.SOCK_STREAM, 0, "", (host, 12000)) for host in hosts]


def known(address: ControllerAddress) -> tuple[int, Any]:
    until = time.monotonic() + PATIENCE_S
    while address.current is None:
        assert time.monotonic() < until, "no address came"
        time.sleep(0.005)
    return address.current


def test_an_address_in_digits_is_known_at_once_and_never_looked_up() -> None:
    address = ControllerAddress("127.0.0.1", 12000, Mock(side_effect=AssertionError))
    assert address.current == (socket.AF_INET, ("127.0.0.1", 12000))


def test_a_name_server_that_does_not_answer_holds_nothing_up() -> None:
    answers = threading.Event()

    def slow(*_: object, **__: object) -> list[Any]:
        answers.wait(PATIENCE_S)
        return found("192.0.2.1")

    address = ControllerAddress("arm.invalid", 12000, slow)
    assert address.current is None
    answers.set()
    assert known(address) == (socket.AF_INET, ("192.0.2.1", 12000))


def test_the_addresses_of_a_name_are_tried_in_turn() -> None:
    both = Mock(return_value=found("192.0.2.1", "192.0.2.2"))
    address = ControllerAddress("arm.invalid", 12000, both)
    tried = []
    for _ in range(3):
        tried.append(known(address)[1][0])
        address.failed()
    assert tried == ["192.0.2.1", "192.0.2.2", "192.0.2.1"]


def test_a_name_that_is_found_no_longer_keeps_its_last_good_address() -> None:
    asked, answers = threading.Event(), [found("192.0.2.1")]

    def once(*_: object, **__: object) -> list[Any]:
        if answers:
            return answers.pop()
        asked.set()
        raise socket.gaierror

    address = ControllerAddress("arm.invalid", 12000, once, renewal=0.0)
    known(address)
    while not asked.wait(0.005):
        address.failed()
    assert address.current == (socket.AF_INET, ("192.0.2.1", 12000))
