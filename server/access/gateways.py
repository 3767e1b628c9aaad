"""Gateways: programs that open connections for browsers, and whose word on each is believed.

Owns when a FORWARDED is believed (promise 41): the socket comes from the address of a gateway that
the configuration names, under that gateway's name, with its secret, and the address that it states
is one of a host. Everything else about the connection then goes by the address that it states, as
if its person had come from there without a gateway.

Owns what becomes of the others: they are counted, and noted once a minute for each address of a
socket. They lock nobody out: the gateway shares its address with others, and nobody guesses 32
random bytes.

Pure: `now` is an argument. No journal holds a secret, so that a rerun is told whether it was right.
"""

from __future__ import annotations

import hmac
import ipaddress
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from openpendant.simplemsg.pendant import Encrypted, Forwarded
from openpendant.simplemsg.verdicts import VerdictCode

from ..refusal import Refusal
from ..settings.cell_settings import GatewaySettings
from .audit import AuditEntry, AuditEvent, Detail
from .lockout import SECOND_NS, ip_of, source_of
from .passwords import Secret

_NOTED_EVERY_NS = 60 * SECOND_NS

_MOST_NOTED = 1_024
"""Addresses of which is remembered when they were noted; of more the oldest is forgotten."""

_SHARED = {ip_of("127.0.0.1"), ip_of("::1")}
"""Addresses that every program of this machine connects from."""

_IP = ipaddress.IPv4Address | ipaddress.IPv6Address


@dataclass(frozen=True, slots=True)
class Gateway:
    """One gateway.

    Attributes:
        address: where its connections come from.
        secret: None where it is not known, and nothing from there is believed.
    """

    name: str
    address: _IP | None
    secret: Secret | None

    @classmethod
    def of(cls, settings: GatewaySettings, secret: Secret | None) -> Gateway:
        """Return the gateway of a configuration."""
        return cls(settings.name, ip_of(settings.address), secret)


@dataclass(frozen=True, slots=True)
class Forwarder:
    """A gateway that a connection came through.

    Attributes:
        gateway: its name.
        peer: address of the socket.
        is_encrypted: the browser came to it by TLS.
    """

    gateway: str
    peer: str
    is_encrypted: bool


@dataclass(frozen=True, slots=True)
class Origin:
    """Where a connection comes from, as a gateway that is believed states it."""

    address: str
    forwarder: Forwarder


def stated_ip(text: str) -> _IP | None:
    """Return the address of a host as a number, one of IPv4 within IPv6 as that of IPv4.

    Returns:
        None for a name, a network, an address with a zone or a port, and for one of no host.
    """
    # `ip_of` forgives a zone, which the system writes behind addresses of its own sockets.
    ip = None if "%" in text else ip_of(text)
    if ip is None or ip.is_unspecified or ip.is_multicast or ip in _BROADCAST:
        return None
    return ip


_BROADCAST = {ip_of("255.255.255.255")}

NOT_FIRST = "only the first frame of a gateway's connection says whose that is"
"""Why a FORWARDED is refused that comes from elsewhere, or later."""

TWICE = "whose a connection is is said once"
"""Why a second FORWARDED is refused."""

Noted = Callable[[int, bool], bool]
"""Takes the place of a gateway in the configuration, and whether the secret was that gateway's;
returns whether it counts as right, which a rerun has from the journal."""


def _as_it_is(_gateway: int, is_right: bool) -> bool:
    return is_right


class Gateways:
    """The gateways of a server.

    Attributes:
        refused: how many connections stated wrongly where they come from.
    """

    def __init__(
        self,
        gateways: Sequence[Gateway],
        record: Callable[[AuditEntry], None],
        noted: Noted = _as_it_is,
    ) -> None:
        """Know the gateways of a configuration."""
        self.refused = 0
        self._gateways = tuple(gateways)
        self._record = record
        self._noted_secret = noted
        # When each address was noted last [ns], in that order, and how many were refused since.
        self._noted: dict[str, tuple[int, int]] = {}

    def has(self, address: str) -> bool:
        """Return True if a socket of this address may be a gateway's."""
        return bool(self._gateways) and ip_of(address) in {each.address for each in self._gateways}

    def has_source(self, source: str) -> bool:
        """Return True if a gateway's connections are charged to what this address is charged to."""
        found = (each.address for each in self._gateways)
        return source in {source_of(str(address)) for address in found if address is not None}

    def is_alone_at(self, address: str) -> bool:
        """Return True if nobody but a gateway comes from its address."""
        return self.has(address) and ip_of(address) not in _SHARED

    def origin(self, peer: str, stated: Forwarded, now: int) -> Origin | Refusal:
        """Return where a connection comes from; or why its first frame is not believed.

        Args:
            peer: address of its socket.
        """
        why = self._fault(peer, stated)
        if why is not None:
            return self.refuse(peer, why, now)
        forwarder = Forwarder(stated.gateway, peer, stated.is_encrypted == Encrypted.YES)
        return Origin(str(stated_ip(stated.address)), forwarder)

    def _fault(self, peer: str, stated: Forwarded) -> str | None:
        """Return what of a FORWARDED is wrong; None where it is believed.

        Nothing that it says is repeated: it may be a secret in the wrong field.
        """
        known = {each.name: number for number, each in enumerate(self._gateways)}
        number = known.get(stated.gateway)
        if number is None:
            return "no gateway of this name is configured"
        gateway = self._gateways[number]
        if ip_of(peer) != gateway.address:
            return f"gateway {gateway.name!r} has another address"
        if not self._noted_secret(number, _is_secret(gateway, stated.secret)):
            return f"the secret is not that of gateway {gateway.name!r}"
        if stated_ip(stated.address) is None:
            return f"gateway {gateway.name!r} states no address of a host"
        if stated.is_encrypted not in list(Encrypted):
            return f"gateway {gateway.name!r} says neither that TLS is used nor that it is not"
        return None

    def refuse(self, peer: str, why: str, now: int) -> Refusal:
        """Count a FORWARDED that is not believed, note it where that is due, and return why.

        Args:
            peer: address of its socket.
        """
        self.refused += 1
        source = source_of(peer)
        noted_at, since = self._noted.get(source, (now - _NOTED_EVERY_NS, 0))
        since += 1
        if now - noted_at >= _NOTED_EVERY_NS:
            detail: dict[str, Detail] = {"why": why, "refused": since}
            self._record(AuditEntry(AuditEvent.FORWARD_REFUSED, now, source=peer, detail=detail))
            noted_at, since = now, 0
            self._noted.pop(source, None)
            if len(self._noted) >= _MOST_NOTED:
                del self._noted[next(iter(self._noted))]
        self._noted[source] = noted_at, since
        return Refusal(VerdictCode.FORWARD_REFUSED, why)


def _is_secret(gateway: Gateway, secret: str) -> bool:
    """Compare in a time that tells nothing of where two secrets differ."""
    if gateway.secret is None:
        return False
    kept = gateway.secret.reveal()
    return hmac.compare_digest(secret.lower().encode(), kept.lower().encode())
