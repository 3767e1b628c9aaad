"""Whose a request is, by its socket's address and its headers, and whose page may ask."""

import pytest

from openpendant.tools.pendants.web.admission import Asked, Browser, NotAdmitted, PageAdmission
from openpendant.tools.pendants.web.settings import settings_of

SERVERS = [{"name": "cell", "address": "127.0.0.1:11010"}]
GATEWAY = {"secret_file": "not read here"}
LAN = "192.0.2.7"
OTHER = "198.51.100.5"


def admission(**settings: object) -> PageAdmission:
    given = {"servers": SERVERS, "gateway": GATEWAY, **settings}
    return PageAdmission(settings_of(given, "test"), ("school",))


def asked(peer: str, *headers: tuple[str, str], is_encrypted: bool = False) -> Asked:
    return Asked(peer, is_encrypted, headers)


PROXIES = [("Forwarded", f"for={LAN}"), ("X-Forwarded-For", LAN), ("X-Real-IP", LAN), ("Via", "1")]


@pytest.mark.parametrize("header", PROXIES, ids=[name for name, _ in PROXIES])
@pytest.mark.parametrize("peer", ["127.0.0.1", "::1", LAN])
def test_what_came_through_a_proxy_that_nobody_named_is_refused(
    peer: str, header: tuple[str, str]
) -> None:
    with pytest.raises(NotAdmitted, match="name it in its file, proxies"):
        admission().browser(asked(peer, header))


@pytest.mark.parametrize(
    ("peer", "stated"),
    [(LAN, LAN), ("::1", "::1"), ("::ffff:192.0.2.7", LAN), ("fe80::1%eth0", "fe80::1")],
)
def test_without_a_proxy_the_address_of_the_socket_counts(peer: str, stated: str) -> None:
    assert admission().browser(asked(peer)) == Browser(stated, is_encrypted=False)


def test_a_browser_that_came_by_tls_is_said_to_have() -> None:
    assert admission().browser(asked(LAN, is_encrypted=True)).is_encrypted


@pytest.mark.parametrize("peer", [LAN, "2001:db8::1", "::ffff:192.0.2.7"])
def test_a_gateway_that_no_server_knows_serves_its_own_machine_only(peer: str) -> None:
    local = admission(gateway=None)
    assert local.browser(asked("127.0.0.1")).address == "127.0.0.1"
    with pytest.raises(NotAdmitted, match="its own machine only"):
        local.browser(asked(peer))


STATED = {
    "x-forwarded-for": [("X-Forwarded-For", LAN)],
    "x-real-ip": [("X-Real-IP", LAN)],
    "forwarded": [("Forwarded", f"for={LAN};proto=http;by=10.0.0.1")],
    "forwarded with a port": [("Forwarded", f'by=x;for="{LAN}:4711"')],
    "what a stranger wrote stands before": [("X-Forwarded-For", f"{OTHER}, {LAN}")],
    "the same twice": [("X-Forwarded-For", f"{OTHER}, {LAN}"), ("X-Real-IP", LAN)],
    "a header twice": [("X-Forwarded-For", "127.0.0.1"), ("X-Forwarded-For", LAN)],
    "through two known proxies": [("X-Forwarded-For", f"{LAN}, 10.0.0.2")],
}


@pytest.mark.parametrize("headers", STATED.values(), ids=list(STATED))
def test_the_word_of_a_known_proxy_counts(headers: list[tuple[str, str]]) -> None:
    known = admission(proxies=["127.0.0.1", "10.0.0.2"])
    for peer in ("127.0.0.1", "::ffff:127.0.0.1"):
        assert known.browser(asked(peer, *headers)).address == LAN


def test_an_address_of_ipv6_is_taken_from_a_known_proxy() -> None:
    known = admission(proxies=["127.0.0.1"])
    header = ("Forwarded", 'for="[2001:db8::17]:4711"')
    assert known.browser(asked("127.0.0.1", header)).address == "2001:db8::17"


UNUSABLE = {
    "nothing": ([], "states no address"),
    "a mark without an address": ([("Via", "1.1 x")], "states no address"),
    "a name": ([("X-Forwarded-For", "localhost")], "no address"),
    "an unknown one": ([("Forwarded", "for=unknown")], "no address"),
    "a port": ([("X-Forwarded-For", f"{LAN}:80")], "no address"),
    "a network": ([("X-Real-IP", "192.0.2.0/24")], "no address"),
    "a zone": ([("X-Real-IP", "fe80::1%eth0")], "no address"),
    "no host's": ([("X-Real-IP", "0.0.0.0")], "no address"),
    "two": ([("X-Real-IP", OTHER), ("X-Forwarded-For", LAN)], "states two addresses"),
    "none at the end": ([("X-Forwarded-For", f"{LAN}, ")], "no address"),
}


@pytest.mark.parametrize(("headers", "why"), UNUSABLE.values(), ids=list(UNUSABLE))
def test_a_known_proxy_that_states_no_address_is_refused(
    headers: list[tuple[str, str]], why: str
) -> None:
    with pytest.raises(NotAdmitted, match=why):
        admission(proxies=["127.0.0.1"]).browser(asked("127.0.0.1", *headers))


def test_a_proxy_elsewhere_cannot_state_this_machine() -> None:
    known = admission(proxies=[OTHER])
    with pytest.raises(NotAdmitted, match="its own machine"):
        known.browser(asked(OTHER, ("X-Forwarded-For", "127.0.0.1")))


@pytest.mark.parametrize(
    "header", [("X-Forwarded-Proto", "https"), ("Forwarded", f"for={LAN};proto=https")]
)
def test_a_proxy_says_whether_the_browser_came_by_tls(header: tuple[str, str]) -> None:
    known = admission(proxies=["127.0.0.1"])
    stated = ("X-Forwarded-For", LAN)
    assert known.browser(asked("127.0.0.1", stated, header)).is_encrypted
    assert not known.browser(asked("127.0.0.1", stated, is_encrypted=True)).is_encrypted


def page(host: str, origin: str | None) -> Asked:
    headers = [("Host", host)] if host else []
    return asked(LAN, *headers, *([("Origin", origin)] if origin is not None else []))


OWN_PAGES = [
    ("127.0.0.1:8080", "http://127.0.0.1:8080"),
    ("127.0.0.1:8080", None),
    ("localhost:8080", "http://localhost:8080"),
    ("[::1]:8080", "http://[::1]:8080"),
    ("192.0.2.1", "http://192.0.2.1"),
    ("School:8080", "http://school:8080"),
    ("anything", "https://pendant.example"),
]
STRANGERS = [
    ("127.0.0.1:8080", "https://stranger.example"),
    ("127.0.0.1:8080", "http://127.0.0.1:8081"),
    ("127.0.0.1:8080", "null"),
    ("127.0.0.1:8080", ""),
    ("stranger.example:8080", "http://stranger.example:8080"),
    ("stranger.example", None),
    ("", "http://127.0.0.1:8080"),
    ("localhost.stranger.example", "http://localhost.stranger.example"),
    ("anything", "https://pendant.example.stranger.example"),
]


@pytest.mark.parametrize(("host", "origin"), OWN_PAGES)
def test_the_gateways_own_page_may_ask(host: str, origin: str | None) -> None:
    admission(origins=["https://pendant.example"]).check_page(page(host, origin))


@pytest.mark.parametrize(("host", "origin"), STRANGERS)
def test_no_page_of_a_stranger_may_ask(host: str, origin: str | None) -> None:
    with pytest.raises(NotAdmitted):
        admission(origins=["https://pendant.example"]).check_page(page(host, origin))


def test_a_page_has_one_origin() -> None:
    own = ("Origin", "http://127.0.0.1:8080")
    twice = asked(LAN, ("Host", "127.0.0.1:8080"), own, ("Origin", "https://stranger.example"))
    with pytest.raises(NotAdmitted, match="two origins"):
        admission().check_page(twice)
