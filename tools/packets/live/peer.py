"""One TCP connection of a tool to the peer that it talks to: frames out, frames in, deadlines.

Owns what can go wrong with a socket, and turns it into a `PeerError` of one line.
"""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Callable

from openpendant.simplemsg.framing import Cut, Mode, Splitter

from ..console import PeerError
from .endpoints import Endpoint, in_short

_READ = 64 * 1024


class PeerSilentError(PeerError):
    """The peer is connected and says nothing."""


class Peer:
    """A connection that is open.

    Attributes:
        name: the peer, for messages.
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
        """Connect to a peer.

        Args:
            endpoint: its address.
            within: time for the connection [s].

        Raises:
            PeerError: it cannot be reached.
        """
        try:
            async with asyncio.timeout(within):
                streams = await asyncio.open_connection(endpoint.host, endpoint.port)
        except TimeoutError:
            reason = f"no answer within {within:g} s"
            raise PeerError(f"cannot connect to {endpoint}: {reason}") from None
        except (OSError, UnicodeError) as error:
            raise PeerError(f"cannot connect to {endpoint}: {in_short(error)}") from None
        return cls(str(endpoint), *streams)

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
