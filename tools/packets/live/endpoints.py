"""Addresses as people type them: `[HOST:]PORT`, IPv6 in brackets."""

from __future__ import annotations

import argparse
import ipaddress
import os
from typing import NamedTuple

LOOPBACK = "127.0.0.1"


class Endpoint(NamedTuple):
    """A TCP address.

    Attributes:
        host: name or address, IPv6 without brackets.
        port: TCP port, 0 for any free one.
    """

    host: str
    port: int

    def __str__(self) -> str:
        return f"[{self.host}]:{self.port}" if ":" in self.host else f"{self.host}:{self.port}"


def listen_endpoint(text: str) -> Endpoint:
    """Read `[HOST:]PORT`; without a host it is loopback.

    Raises:
        argparse.ArgumentTypeError: it is none; the text says what is expected.
    """
    host, _, port = text.rpartition(":")
    return Endpoint(host.strip("[]") or LOOPBACK, _port(port, text, least=0))


def target_endpoint(text: str) -> Endpoint:
    """Read `[HOST:]PORT` of a peer to connect to.

    Raises:
        argparse.ArgumentTypeError: it is none; the text says what is expected.
    """
    host, _, port = text.rpartition(":")
    return Endpoint(host.strip("[]") or LOOPBACK, _port(port, text, least=1))


def _port(digits: str, text: str, least: int) -> int:
    if digits.isascii() and digits.isdigit() and least <= int(digits[:6]) <= 65_535:
        return int(digits[:6])
    raise argparse.ArgumentTypeError(f"{text[:80]!r} is no [HOST:]PORT; a port is {least} to 65535")


def is_loopback(host: str) -> bool:
    """Return True if only this machine can reach an address."""
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"


def in_short(error: OSError | UnicodeError) -> str:
    """Return why an address cannot be used, in the system's own words: asyncio's are long."""
    number = error.errno if isinstance(error, OSError) else None
    return os.strerror(number) if number is not None and number > 0 else str(error)
