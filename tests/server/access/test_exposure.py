"""What a server may be exposed to (promise 28)."""

from __future__ import annotations

import pytest
from rigs.cells.admission_desk import BOOK, account

from openpendant.server.access.accounts import AccountBook
from openpendant.server.access.exposure import (
    Exposure,
    ExposureRefused,
    check_exposure,
    clear_text_fault,
    is_loopback,
)
from openpendant.simplemsg.pendant.roles import Role
from openpendant.simplemsg.verdicts import VerdictCode as V

LAN = "192.0.2.5"


@pytest.mark.parametrize("host", ["127.0.0.1", "127.8.8.8", "::1", "localhost", "::ffff:127.0.0.1"])
def test_this_machines_own_addresses_are_told(host: str) -> None:
    assert is_loopback(host)


@pytest.mark.parametrize("host", ["0.0.0.0", "::", LAN, "", "localhost.example", "fe80::1%eth0"])
def test_other_addresses_are_not_this_machines_own(host: str) -> None:
    assert not is_loopback(host)


def test_loopback_needs_neither_accounts_nor_tls() -> None:
    assert check_exposure(Exposure("127.0.0.1", False, ["127.0.0.1"]), AccountBook()) == []


@pytest.mark.parametrize("host", ["0.0.0.0", "::", LAN, "robot.example"])
@pytest.mark.parametrize(
    "book",
    [
        AccountBook(),
        AccountBook([account("otto", Role.OPERATOR)]),
        AccountBook([account("gone", Role.ADMIN, disabled=True)]),
    ],
    ids=["empty", "no admin", "disabled admin"],
)
def test_an_address_that_others_reach_is_refused_while_nobody_could_log_in(
    host: str, book: AccountBook
) -> None:
    with pytest.raises(ExposureRefused, match="openpendant users add") as caught:
        check_exposure(Exposure(host, True, []), book)
    assert caught.value.key == "listen.host"


@pytest.mark.parametrize(("has_tls", "warnings"), [(True, 0), (False, 1)])
def test_passwords_in_clear_text_are_warned_of(has_tls: bool, warnings: int) -> None:
    assert len(check_exposure(Exposure(LAN, has_tls, []), BOOK)) == warnings


@pytest.mark.parametrize("address", ["0.0.0.0", "::", "*", "10.0.0.0/8", "", "224.0.0.1", "host"])
def test_a_list_for_the_clear_text_ports_that_names_no_host_is_refused(address: str) -> None:
    with pytest.raises(ExposureRefused) as caught:
        check_exposure(Exposure("127.0.0.1", False, ["127.0.0.1", address]), BOOK)
    assert caught.value.key == "ros_i.allow"


@pytest.mark.parametrize(
    ("host", "address", "is_taken"),
    [
        ("127.0.0.1", "127.0.0.1", True),
        (LAN, "192.0.2.7", True),
        (LAN, "::ffff:192.0.2.7", True),
        (LAN, "192.0.2.8", False),
        (LAN, "127.0.0.1", False),
        (LAN, "", False),
    ],
)
def test_clear_text_ports_serve_loopback_or_the_list(
    host: str, address: str, is_taken: bool
) -> None:
    fault = clear_text_fault(Exposure(host, False, ["192.0.2.7"]), address)
    assert (fault is None) is is_taken
    assert fault is None or fault.code is V.ADDRESS_NOT_ALLOWED
