"""Which host names are one machine: so that two cells do not drive one robot by two names.

Owns what is the same address. Asks the name service, so that it may block; a name that is not known
there, or not yet, is compared as it is written. Must not know what a cell is.
"""

from __future__ import annotations

import socket
from ipaddress import IPv6Address, ip_address
from typing import Any

_THIS_MACHINE = "127.0.0.1"
"""Stands for every loopback address: a controller on this machine may listen on all of them."""


def addresses_of(host: str) -> frozenset[str]:
    """Return all addresses of a host, each in one form only; its name where it has none.

    Args:
        host: address or name.
    """
    name = host.lower().removesuffix(".")
    try:
        found = socket.getaddrinfo(name, None, type=socket.SOCK_STREAM)
    except OSError:
        return frozenset([name])
    return frozenset(_in_one_form(address) for *_, address in found)


def _in_one_form(address: tuple[Any, ...]) -> str:
    ip = ip_address(address[0])
    if isinstance(ip, IPv6Address) and ip.ipv4_mapped is not None:
        ip = ip.ipv4_mapped
    # To connect to "any address" is to connect to this machine.
    if ip.is_loopback or ip.is_unspecified:
        return _THIS_MACHINE
    # A link-local address is another machine at each network interface, whose number comes last.
    interface = address[3] if isinstance(ip, IPv6Address) else 0
    return f"{ip}%{interface}" if interface else str(ip)
