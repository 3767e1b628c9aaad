"""TCP addresses as people type them, `[HOST:]PORT` with IPv6 in brackets, and links to peers."""

from __future__ import annotations

import argparse
import asyncio
import ipaddress
import os
from collections import deque
from collections.abc import Callable
from typing import NamedTuple

from openpendant.simplemsg.framing import Cut, Mode, Splitter

from ..console import PeerError

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
    """Read `[HOST:]PORT`, without a host loopback; ArgumentTypeError says what is expected."""
    host, _, port = text.rpartition(":")
    return Endpoint(host.strip("[]") or LOOPBACK, _port(port, text, least=0))


def target_endpoint(text: str) -> Endpoint:
    """Read `[HOST:]PORT` of a peer to connect to; ArgumentTypeError says what is expected."""
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


_READ = 64 * 1024


class PeerSilentError(PeerError):
    """The peer is connected and says nothing."""


class Peer:
    """A connection that is open.

    Attributes:
        splitter: knows the byte order that the peer speaks.
    """

    def __init__(
        self, name: str, reader: asyncio.StreamReader, writer: asyncio.StreamWriter
    ) -> None:
        self.name = name
        self.splitter = Splitter(Mode.ONLOOKER)
        self._reader = reader
        self._writer = writer
        self._pieces: deque[Cut] = deque()

    @classmethod
    async def connect(cls, endpoint: Endpoint, within: float) -> Peer:
        """Connect to a peer within a time [s]; raise PeerError where it cannot be reached."""
        try:
            async with asyncio.timeout(within):
                streams = await asyncio.open_connection(endpoint.host, endpoint.port)
        except TimeoutError:
            reason = f"no answer within {within:g} s"
            raise PeerError(f"cannot connect to {endpoint}: {reason}") from None
        except (OSError, UnicodeError) as error:
            raise PeerError(f"cannot connect to {endpoint}: {in_short(error)}") from None
        return cls(str(endpoint), *streams)

    @property
    def is_here(self) -> bool:
        """True if its address is one of this machine's."""
        own, peer = (self._writer.get_extra_info(end) for end in ("sockname", "peername"))
        return bool(own and peer) and (peer[0] == own[0] or is_loopback(peer[0]))

    async def send(self, data: bytes, within: float) -> None:
        """Write bytes in one piece.

        Raises:
            PeerError: the connection is broken, or the peer takes no bytes for `within` seconds.
        """
        try:
            self._writer.write(data)
            async with asyncio.timeout(within):
                await self._writer.drain()
        except TimeoutError:
            raise PeerSilentError(f"{self.name} takes no bytes for {within:g} s") from None
        except OSError as error:
            raise PeerError(f"{self.name} broke off: {in_short(error)}") from None

    async def next_piece(
        self, within: float, wanted: Callable[[Cut], bool] = lambda piece: True
    ) -> Cut:
        """Return the next frame or stray bytes; what is not wanted is dropped.

        Raises:
            PeerSilentError: nothing complete came within `within` seconds.
            PeerError: the peer closed or broke the connection.
        """
        try:
            async with asyncio.timeout(within):
                while True:
                    while not self._pieces:
                        await self._read()
                    piece = self._pieces.popleft()
                    if wanted(piece):
                        return piece
        except TimeoutError:
            rest = len(self.splitter.pending)
            begun = f", but {rest} bytes of a frame that does not end" if rest else ""
            raise PeerSilentError(
                f"no answer from {self.name} within {within:g} s{begun}"
            ) from None
        except OSError as error:
            raise PeerError(f"{self.name} broke off: {in_short(error)}") from None

    async def _read(self) -> None:
        data = await self._reader.read(_READ)
        if not data and not self._pieces:
            self._pieces += self.splitter.finish()
            if not self._pieces:
                raise PeerError(f"{self.name} closed the connection")
        self._pieces += self.splitter.feed(data)

    async def close(self) -> None:
        """Close in order."""
        self._writer.close()
        try:
            async with asyncio.timeout(1.0):
                await self._writer.wait_closed()
        except OSError:  # broken already, or it takes nothing any more: nothing is left to say
            self._writer.transport.abort()
