"""Whose word on where a connection comes from is believed (promise 41), and what is noted."""

import hmac
from dataclasses import replace

import pytest
from rigs.cells.gateway_rig import ALONE, GATEWAYS, SECRET, SHARED, forwarded

from openpendant.server.access import gateways
from openpendant.server.access.audit import AuditEntry, AuditEvent
from openpendant.server.access.gateways import Gateway, Gateways, Origin
from openpendant.server.access.lockout import ip_of
from openpendant.server.refusal import Refusal
from openpendant.simplemsg.pendant import Forwarded
from openpendant.simplemsg.verdicts import VerdictCode as V

SECOND = 1_000_000_000
NOW = 1_000 * SECOND
LAN = "192.0.2.7"


class Known:
    """Gateways, and what they noted."""

    def __init__(self, *known: Gateway) -> None:
        self.log: list[AuditEntry] = []
        self.gateways = Gateways(known or GATEWAYS, self.log.append)

    def origin(self, stated: Forwarded, peer: str = SHARED, now: int = NOW) -> Origin | Refusal:
        return self.gateways.origin(peer, stated, now)


def believed(stated: Forwarded, peer: str = SHARED) -> Origin:
    found = Known().origin(stated, peer)
    assert isinstance(found, Origin), found
    return found


def test_a_gateway_is_believed_by_name_address_and_secret() -> None:
    origin = believed(forwarded(LAN))
    assert origin.address == LAN
    assert (origin.forwarder.gateway, origin.forwarder.peer) == ("web", SHARED)
    assert origin.forwarder.is_encrypted
    assert not believed(forwarded(LAN, is_encrypted=0)).forwarder.is_encrypted


WRONG: dict[str, tuple[Forwarded, str, str]] = {
    "no name": (replace(forwarded(LAN), gateway=""), SHARED, "no gateway of this name"),
    "another name": (replace(forwarded(LAN), gateway="wep"), SHARED, "no gateway of this name"),
    "another's name": (replace(forwarded(LAN), gateway="own"), SHARED, "has another address"),
    "another address": (forwarded(LAN), LAN, "has another address"),
    "another's address": (forwarded(LAN), ALONE, "has another address"),
    "no secret": (replace(forwarded(LAN), secret=""), SHARED, "the secret is not that"),
    "half a secret": (replace(forwarded(LAN), secret=SECRET[:32]), SHARED, "the secret is not"),
    "another secret": (
        *(replace(forwarded(LAN), secret=SECRET[:-1] + "0"), SHARED),
        "the secret is not that",
    ),
    "another's secret": (
        *(replace(forwarded(LAN), secret=SECRET[::-1]), SHARED),
        "the secret is not that",
    ),
    "neither encrypted nor not": (forwarded(LAN, is_encrypted=2), SHARED, "says neither"),
}


@pytest.mark.parametrize("case", WRONG)
def test_where_anything_is_wrong_nothing_is_believed(case: str) -> None:
    stated, peer, why = WRONG[case]
    known = Known()
    refusal = known.origin(stated, peer)
    assert isinstance(refusal, Refusal)
    assert refusal.code == V.FORWARD_REFUSED
    assert why in refusal.sentence
    assert known.gateways.refused == 1


@pytest.mark.parametrize(
    "address",
    [
        "",
        "localhost",
        "pendant.school",
        "192.0.2.0/24",
        "192.0.2.7:11010",
        "[2001:db8::1]:11010",
        "[2001:db8::1]",
        "fe80::1%eth0",
        "192.0.2.7%1",
        "0192.0.2.7",
        "192.0.2",
        " 192.0.2.7",
        "0.0.0.0",
        "::",
        "255.255.255.255",
        "224.0.0.1",
        "ff02::1",
        "::ffff:0.0.0.0",
        "١٩٢.0.2.7",
    ],
)
def test_an_address_that_is_none_of_a_host_is_refused(address: str) -> None:
    refusal = Known().origin(forwarded(address))
    assert isinstance(refusal, Refusal)
    assert refusal.sentence == "gateway 'web' states no address of a host"


@pytest.mark.parametrize(
    ("stated", "address"),
    [
        ("::ffff:192.0.2.7", "192.0.2.7"),
        ("::FFFF:C000:0207", "192.0.2.7"),
        ("2001:DB8:0:0::1", "2001:db8::1"),
        ("::ffff:127.0.0.1", "127.0.0.1"),
        ("0:0:0:0:0:0:0:1", "::1"),
    ],
)
def test_an_address_is_a_number_however_it_is_written(stated: str, address: str) -> None:
    assert believed(forwarded(stated)).address == address


@pytest.mark.parametrize("peer", ["127.0.0.1", "::ffff:127.0.0.1", "::ffff:7f00:1"])
def test_the_socket_s_address_is_one_too(peer: str) -> None:
    assert believed(forwarded(LAN), peer).forwarder.peer == peer
    assert Known().gateways.has(peer)
    assert not Known().gateways.is_alone_at(peer)


@pytest.mark.parametrize(
    ("address", "is_alone"),
    [
        ("127.0.0.1", False),
        ("::1", False),
        ("::ffff:127.0.0.1", False),
        ("127.0.0.2", True),
        (LAN, True),
    ],
)
def test_a_gateway_is_alone_where_no_other_program_of_this_machine_comes_from(
    address: str, is_alone: bool
) -> None:
    known = Known(Gateway("web", ip_of(address), None)).gateways
    assert (known.has(address), known.is_alone_at(address)) == (True, is_alone)
    assert not known.has("198.51.100.1")


def test_the_case_of_a_hexadecimal_secret_does_not_matter() -> None:
    believed(replace(forwarded(LAN), secret=SECRET.upper()))


def test_a_gateway_whose_secret_is_not_known_is_not_believed() -> None:
    known = Known(replace(GATEWAYS[0], secret=None))
    assert isinstance(known.origin(replace(forwarded(LAN), secret="")), Refusal)


def test_secrets_are_compared_in_a_time_that_tells_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    compared: list[tuple[bytes, bytes]] = []

    def compare(left: bytes, right: bytes) -> bool:
        compared.append((left, right))
        return left == right

    monkeypatch.setattr(hmac, "compare_digest", compare)
    for secret in (SECRET, "", "x" * 64):
        Known().origin(replace(forwarded(LAN), secret=secret))
    assert compared == [(each.encode(), SECRET.encode()) for each in (SECRET, "", "x" * 64)]


def test_what_is_wrong_is_noted_and_counted_once_a_minute_for_each_socket_address() -> None:
    known, forged = Known(), replace(forwarded(LAN), secret="guess")
    for second in range(130):
        known.origin(forged, SHARED, NOW + second * SECOND)
        if second % 2:
            known.origin(forged, LAN, NOW + second * SECOND)
    noted = [(each.source, (each.at - NOW) // SECOND, each.detail) for each in known.log]
    here = "the secret is not that of gateway 'web'"
    there = "gateway 'web' has another address"
    assert noted == [
        (SHARED, 0, {"why": here, "refused": 1}),
        (LAN, 1, {"why": there, "refused": 1}),
        (SHARED, 60, {"why": here, "refused": 60}),
        (LAN, 61, {"why": there, "refused": 30}),
        (SHARED, 120, {"why": here, "refused": 60}),
        (LAN, 121, {"why": there, "refused": 30}),
    ]
    assert {each.event for each in known.log} == {AuditEvent.FORWARD_REFUSED}
    assert known.gateways.refused == 195


def test_nothing_that_was_stated_is_noted() -> None:
    """A secret may stand in the wrong field."""
    known = Known()
    for stated in (
        replace(forwarded(LAN), gateway="canary"),
        replace(forwarded(LAN), secret="canary"),
        replace(forwarded("canary")),
    ):
        refusal = known.origin(stated)
        assert isinstance(refusal, Refusal)
        assert "canary" not in refusal.sentence
    assert "canary" not in repr(known.log)


def test_of_ever_new_addresses_no_more_is_remembered_than_may_be() -> None:
    known = Known()
    for number in range(3_000):
        known.origin(forwarded(LAN), f"10.{number >> 8}.{number & 255}.1")
    assert len(known.gateways._noted) == gateways._MOST_NOTED
    assert len(known.log) == 3_000
