"""PageAdmission of a browser: whose a request is, and whether its page may talk to the gateway.

Owns the address rule of a gateway: a request that came through another proxy is not this machine's
own, whatever its socket says. It is refused unless the configuration names that proxy; then the
address that the proxy states counts. Owns also that no page of a stranger talks through somebody's
browser: by the origin of the page, and by the name under which it reached the gateway, since a
stranger's name may lead here (DNS rebinding).

Pure: a request is its socket's address and its headers.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from urllib.parse import urlsplit

from .settings import IP, WebSettings, ip_of

MARKS_OF_A_PROXY = ("forwarded", "x-forwarded-for", "x-real-ip", "via")
"""Headers that only a proxy writes."""


class NotAdmitted(Exception):
    """A request that is refused; the text is for its person."""


@dataclass(frozen=True, slots=True)
class Asked:
    """What a request shows of where it comes from.

    Attributes:
        peer: address of its socket.
        is_encrypted: it came by TLS to this gateway.
        headers: names and values as they came.
    """

    peer: str
    is_encrypted: bool
    headers: Sequence[tuple[str, str]]

    def all_of(self, name: str) -> list[str]:
        """Return the values of a header, each part of a list on its own."""
        values = [value for key, value in self.headers if key.lower() == name]
        return [part.strip() for value in values for part in value.split(",")]

    def only(self, name: str) -> str | None:
        """Return the value of a header; None where it is missing or stands twice."""
        values = [value for key, value in self.headers if key.lower() == name]
        return values[0].strip() if len(values) == 1 else None


@dataclass(frozen=True, slots=True)
class Browser:
    """Where a browser is.

    Attributes:
        address: IPv4 or IPv6, without zone or port.
        is_encrypted: it came by TLS, to this gateway or to its proxy.
    """

    address: str
    is_encrypted: bool


class PageAdmission:
    """The rules of one gateway."""

    def __init__(self, settings: WebSettings, own_names: Sequence[str] = ()) -> None:
        """Know the proxies and the names of this gateway.

        Args:
            own_names: of this machine in its network.
        """
        self._proxies = {ip for each in settings.proxies if (ip := ip_of(each)) is not None}
        self._serves_others = settings.gateway is not None
        self._origins = {each.lower() for each in settings.origins}
        names = {"localhost", settings.host, *own_names}
        self._names = {each.lower() for each in names}

    def browser(self, asked: Asked) -> Browser:
        """Return whose a request is.

        Raises:
            NotAdmitted: it came through a proxy that nobody named, or is another machine's where
                this gateway could not say so to the servers.
        """
        peer = ip_of(asked.peer.partition("%")[0])
        if peer is None:
            raise NotAdmitted("the address of this browser is not known")
        is_encrypted = asked.is_encrypted
        if peer in self._proxies:
            ip, is_encrypted = self._stated(asked, peer)
        elif marks := [each for each in MARKS_OF_A_PROXY if asked.all_of(each)]:
            raise NotAdmitted(
                f"this request came through a proxy ({marks[0]}) at {peer}, which this gateway does"
                " not know: name it in its file, proxies"
            )
        else:
            ip = peer
        if not (self._serves_others or ip.is_loopback):
            raise NotAdmitted("this gateway serves browsers of its own machine only")
        return Browser(str(ip), is_encrypted)

    def _stated(self, asked: Asked, proxy: IP) -> tuple[IP, bool]:
        """Return what a known proxy says of a browser: its address, and whether it uses TLS.

        Raises:
            NotAdmitted: it says nothing, no address, or two things.
        """
        found = {self._first_stranger(way) for way in _ways(asked)}
        if len(found) != 1:
            how = "two addresses" if found else "no address"
            raise NotAdmitted(f"the proxy at {proxy} states {how} of this browser")
        ip = found.pop()
        if ip.is_loopback and not proxy.is_loopback:
            raise NotAdmitted(f"the proxy at {proxy} states an address of its own machine")
        return ip, "https" in {*asked.all_of("x-forwarded-proto")[-1:], *_protos(asked)[-1:]}

    def _first_stranger(self, way: Sequence[str]) -> IP:
        """Return the nearest address on the way here that is no proxy's of ours, else the first.

        What stands before it is the word of a stranger.
        """
        stated = [_stated_ip(text) for text in reversed(way)]
        return next((ip for ip in stated if ip not in self._proxies), stated[-1])

    def check_page(self, asked: Asked) -> None:
        """Check that the page which asks is this gateway's own.

        Raises:
            NotAdmitted: it is a stranger's, or came here under a stranger's name.
        """
        origin, host = asked.only("origin"), asked.only("host")
        if len([key for key, _ in asked.headers if key.lower() == "origin"]) > 1:
            raise NotAdmitted("two origins")
        if origin is not None and origin.lower() in self._origins:
            return
        if host is None or not self._is_own(host):
            raise NotAdmitted(
                f"this gateway is not called {(host or '')[:80]!r}: ask for it by its address, or"
                " name the origin in its file, origins"
            )
        # Who sends none is no browser, and nobody's browser is led by a stranger's page.
        if origin is not None and urlsplit(origin).netloc.lower() != host.lower():
            raise NotAdmitted(f"a page of {origin[:80]!r} may not use this gateway")

    def _is_own(self, host: str) -> bool:
        name = _host_of(host)
        return ip_of(name) is not None or name.lower() in self._names


def _stated_ip(text: str) -> IP:
    ip = ip_of(text)
    if ip is None or ip.is_unspecified or ip.is_multicast:
        raise NotAdmitted(f"a proxy states {text[:64]!r}, which is no address")
    return ip


def _host_of(host: str) -> str:
    """Return a Host header without its port, an address without its brackets."""
    if host.startswith("["):
        return host[1:].partition("]")[0]
    return host.rpartition(":")[0] if ":" in host else host


def _ways(asked: Asked) -> Iterator[list[str]]:
    """Return, for each header that has one, the addresses that a request came by, in order."""
    stated = [
        [_node(part) for part in asked.all_of("forwarded")],
        asked.all_of("x-forwarded-for"),
        asked.all_of("x-real-ip"),
    ]
    yield from (way for way in stated if way)


_FOR = re.compile(r'(?:^|;)\s*for\s*=\s*"?([^";]*)"?', re.IGNORECASE)
_PROTO = re.compile(r'(?:^|;)\s*proto\s*=\s*"?([^";]*)"?', re.IGNORECASE)
_PORT = re.compile(r":\d+$")


def _node(part: str) -> str:
    """Return the address in an element of `Forwarded`; empty for none."""
    found = _FOR.search(part)
    text = found[1].strip() if found else ""
    if text.startswith("["):
        return text[1:].partition("]")[0]
    return _PORT.sub("", text)


def _protos(asked: Asked) -> list[str]:
    found = (_PROTO.search(part) for part in asked.all_of("forwarded"))
    return [each[1].strip().lower() for each in found if each]
