from __future__ import annotations

import socket
import threading
import time
from typing import Any

from openpendant.server.watchdog.stop_connection import ControllerAddress

WAIT_S = 20.0


def found(*hosts: str) -> list[Any]:
    kind = socket.SOCK_STREAM
    return [(socket.AF_INET, kind, 0, "", (host, 12000)) for host in hosts]


def known(address: ControllerAddress) -> tuple[int, Any]:
    until = time.monotonic() + WAIT_S
    while address.current is None:
        assert time.monotonic() < until, "no address came"
        time.sleep(0.005)
    return address.current


def test_an_address_in_digits_is_known_at_once_and_never_looked_up() -> None:
    def never(*_: object, **__: object) -> list[Any]:
        raise AssertionError

    address = ControllerAddress("127.0.0.1", 12000, never)
    assert address.current == (socket.AF_INET, ("127.0.0.1", 12000))


def test_a_name_server_that_does_not_answer_holds_nothing_up() -> None:
    answers = threading.Event()

    def slow(*_: object, **__: object) -> list[Any]:
        answers.wait(WAIT_S)
        return found("192.0.2.1")

    address = ControllerAddress("arm.invalid", 12000, slow)
    assert address.current is None
    answers.set()
    assert known(address) == (socket.AF_INET, ("192.0.2.1", 12000))


def test_the_addresses_of_a_name_are_tried_in_turn() -> None:
    address = ControllerAddress(
        "arm.invalid", 12000, lambda *_, **__: found("192.0.2.1", "192.0.2.2")
    )
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
