"""Settings of the gateway: a TOML file, the arguments that go before it, and its secret.

Owns the keys, their bounds and the words for what cannot be used.
"""

from __future__ import annotations

import os
import re
import stat
from ipaddress import IPv4Address, IPv6Address, ip_address
from pathlib import Path
from typing import Annotated, Any
from urllib.parse import urlsplit

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, ValidationError

from ..connection_errors import server_address
from ..settings_file import ServerAddress, SettingsRefused, beginning_of

LOOPBACK = "127.0.0.1"
DEFAULT_PORT = 8080

_MOST_SECRET = 128
_SECRET = re.compile(rb"\s*[0-9a-fA-F]{64}\s*")

IP = IPv4Address | IPv6Address


def ip_of(text: str) -> IP | None:
    """Return an address as a number, one of IPv4 within IPv6 as that of IPv4.

    Returns:
        None for a name, a network, and an address with a zone or a port.
    """
    try:
        ip = ip_address(text)
    except ValueError:
        return None
    if isinstance(ip, IPv6Address):
        return None if ip.scope_id is not None else ip.ipv4_mapped or ip
    return ip


def is_loopback(host: str) -> bool:
    """Return True if an address or host name is this machine's own."""
    ip = ip_of(host)
    return host == "localhost" or (ip is not None and ip.is_loopback)


def _check_name(name: str) -> str:
    if not (name.isprintable() and 1 <= len(name.encode("utf-8", "replace")) <= 32):
        raise ValueError("a name is 1 to 32 bytes of printable characters")
    return name


def _check_own_address(text: str) -> str:
    if text and ip_of(text) is None:
        raise ValueError("accepted: an address of this machine, or nothing")
    return text


def _check_proxy(text: str) -> str:
    if ip_of(text) is None:
        raise ValueError("accepted: the address of one host, not a network, a name, zone or port")
    return text


def _check_origin(text: str) -> str:
    parts = urlsplit(text)
    if parts.scheme not in ("http", "https") or text != f"{parts.scheme}://{parts.netloc}":
        raise ValueError("accepted: an origin such as https://pendant.example, without a path")
    return text


class _Table(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class KnownServer(_Table):
    """A pendant server that pages may be connected to."""

    name: Annotated[str, AfterValidator(_check_name)]
    """What pages call it."""
    address: ServerAddress
    """HOST or HOST:PORT."""
    ca: str = ""
    """Certificate of the server; the connection to it is encrypted. Empty for clear text."""


class IdentitySettings(_Table):
    """What the servers know this gateway by: `[[gateways]]` of their own configuration."""

    name: Annotated[str, AfterValidator(_check_name)] = "web"
    """Its name there."""
    address: Annotated[str, AfterValidator(_check_own_address)] = ""
    """Where its connections come from, an address of this machine; empty for the usual one."""
    secret_file: Annotated[str, Field(min_length=1)]
    """The file that they read, too: 32 random bytes in hexadecimal, for its owner's eyes only."""


class OwnCertificate(_Table):
    """The gateway's own certificate, for browsers that come by https."""

    certificate: Annotated[str, Field(min_length=1)]
    """File with it, and with those that sign it."""
    key: Annotated[str, Field(min_length=1)]
    """File with its key."""


def _check_servers(servers: tuple[KnownServer, ...]) -> tuple[KnownServer, ...]:
    if len({each.name for each in servers}) < len(servers):
        raise ValueError("each server needs a name of its own")
    return servers


class WebSettings(_Table):
    """All that the gateway's file may say."""

    host: Annotated[str, Field(min_length=1)] = LOOPBACK
    """Address to listen at; others than this machine's only where the servers demand logins."""
    port: Annotated[int, Field(ge=0, le=65_535)] = DEFAULT_PORT
    """Port to listen at, 0 for a free one."""
    keypad: Annotated[int, Field(ge=0, le=65_535)] | None = None
    """Port of this machine where the bridge of a keypad in a page comes, 0 for a free one."""
    servers: Annotated[
        tuple[KnownServer, ...],
        Field(min_length=1, max_length=64),
        AfterValidator(_check_servers),
    ]
    """The servers that pages may choose from; no other is ever dialled."""
    gateway: IdentitySettings | None = None
    """Without it browsers of this machine alone are served."""
    proxies: Annotated[
        tuple[Annotated[str, AfterValidator(_check_proxy)], ...], Field(max_length=16)
    ] = ()
    """Addresses of the proxies before this gateway, whose word is believed whose a request is."""
    origins: Annotated[
        tuple[Annotated[str, AfterValidator(_check_origin)], ...], Field(max_length=16)
    ] = ()
    """Origins that a page may have beside the address it was asked for at: behind a proxy, and
    under a name of this machine in a network."""
    tls: OwnCertificate | None = None
    """Without it the page comes by plain http."""

    @property
    def is_local(self) -> bool:
        """True if only this machine's browsers can come."""
        return is_loopback(self.host) and not self.proxies


def settings_of(data: dict[str, Any], source: str) -> WebSettings:
    """Check plain data.

    Args:
        source: the file, or "arguments".

    Raises:
        SettingsRefused: the first key that is unknown or out of bounds, or that goes with no other.
    """
    try:
        settings = WebSettings.model_validate(data)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        key = ".".join(str(part)[:80] for part in first["loc"])
        problem = {"extra_forbidden": "unknown key", "missing": "must be given"}.get(
            first["type"], first["msg"]
        )
        raise SettingsRefused(f"{source}: {key}: {problem}") from None
    _check_identity(settings, source)
    return settings


def _check_identity(settings: WebSettings, source: str) -> None:
    """Refuse to serve other machines as one that the servers do not know.

    Raises:
        SettingsRefused: a browser elsewhere would count as this machine, or the secret would
            cross the network in clear text.
    """
    if settings.gateway is None:
        if not settings.is_local:
            which = "proxies" if is_loopback(settings.host) else f"host {settings.host!r}"
            raise SettingsRefused(
                f"{source}: {which}: to the servers every browser would count as this machine; name"
                " this gateway to them ([[gateways]]) and give its secret: --secret-file, or"
                " [gateway] of the file"
            )
        return
    for server in settings.servers:
        host, _ = server_address(server.address) or ("", 0)
        if not is_loopback(host) and not server.ca:
            problem = "is another machine's, so the secret needs TLS; give its certificate as ca"
            raise SettingsRefused(f"{source}: address of server {server.name!r}: {host} {problem}")


def read_secret(identity: IdentitySettings) -> str:
    """Return the gateway's secret.

    Raises:
        SettingsRefused: its file cannot be used, or others may read it.
    """
    path = Path(identity.secret_file)
    content = beginning_of(path, _MOST_SECRET)
    if os.name == "posix" and (mode := stat.S_IMODE(path.stat().st_mode)) & 0o077:
        problem = f"is open to other users of this machine (mode {mode:03o}); chmod 600"
        raise SettingsRefused(f"{path}: {problem}")
    if not _SECRET.fullmatch(content):
        problem = "does not hold 32 bytes in hexadecimal; write it with: openssl rand -hex 32"
        raise SettingsRefused(f"{path}: {problem}")
    return content.decode().strip()
