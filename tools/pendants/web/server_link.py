"""The link to a pendant server: one TCP connection, cut into whole frames.

Owns FORWARDED, the one message of the gateway's own: it is the first frame, and nothing of a
browser is sent before the server has believed it.
"""

from __future__ import annotations

import asyncio
import ssl
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from openpendant.simplemsg import PENDANT, ByteOrder, ReplyCode, codec_for
from openpendant.simplemsg.framing import Frame, Mode, Splitter
from openpendant.simplemsg.pendant import Encrypted, Forwarded

from ..connection_errors import Unreachable, server_address, unreachable
from ..credentials import tls_context
from .admission import Browser
from .settings import KnownServer

DIAL_WITHIN = 5.0
"""Time for a connection to a server, and for its word on FORWARDED [s]."""

_CLOSE_WITHIN = 1.0
"""Time for what is still to be written when a link is closed [s]."""


class NotForwarded(Exception):
    """The server does not believe this gateway; the text is for its person."""


@dataclass(frozen=True, slots=True)
class GatewayIdentity:
    """What the servers believe this gateway by."""

    name: str
    secret: str

    def forwarded(self, browser: Browser) -> bytes:
        """Return the frame that says whose a connection is, little-endian as the page's are."""
        encrypted = Encrypted.YES if browser.is_encrypted else Encrypted.NO
        said = Forwarded(self.name, self.secret, browser.address, encrypted)
        return codec_for(PENDANT, ByteOrder.LITTLE).encode(said)


@dataclass(frozen=True, slots=True)
class Server:
    """A server that may be dialled.

    Attributes:
        own_address: where its connections come from; empty for the usual one.
    """

    name: str
    host: str
    port: int
    tls: ssl.SSLContext | None
    own_address: str = ""

    @classmethod
    def of(cls, settings: KnownServer, own_address: str) -> Server:
        """Return the server of a configuration.

        Raises:
            WrongArgument: its certificate cannot be read.
        """
        host, port = server_address(settings.address) or ("", 0)
        ca = Path(settings.ca) if settings.ca else None
        return cls(settings.name, host, port, tls_context(ca), own_address)

    def __str__(self) -> str:
        return f"[{self.host}]:{self.port}" if ":" in self.host else f"{self.host}:{self.port}"


class ServerLink(asyncio.Protocol):
    """One connection.

    Attributes:
        order: byte order of the conversation; None before the first frame, where no FORWARDED
            settled it.
    """

    def __init__(
        self,
        forwarded: bytes,
        take: Callable[[list[bytes]], None],
        ended: Callable[[str], None],
    ) -> None:
        """Make a link that is not connected.

        Args:
            forwarded: the first frame, empty for none.
            take: called with whole frames of the server.
            ended: called once when the link is over, with why.
        """
        order = ByteOrder.LITTLE if forwarded else None
        self._forwarded = forwarded
        self._take = take
        self._ended = ended
        self._down = Splitter(Mode.STRICT, order)
        self._up = Splitter(Mode.STRICT, order)
        self._believed: asyncio.Future[None] = asyncio.get_running_loop().create_future()
        self._may_write = asyncio.Event()
        self._may_write.set()
        self._transport: asyncio.Transport | None = None

    @property
    def order(self) -> ByteOrder:
        """Byte order of the server's frames, little until one came."""
        return self._down.byte_order or ByteOrder.LITTLE

    @property
    def is_full(self) -> bool:
        """True while the server takes no more."""
        return not self._may_write.is_set()

    async def until_believed(self) -> None:
        """Wait until the server has believed FORWARDED; at once without one.

        Raises:
            NotForwarded: it does not.
        """
        try:
            async with asyncio.timeout(DIAL_WITHIN):
                await self._believed
        except TimeoutError:
            raise NotForwarded(f"no answer within {DIAL_WITHIN:g} s") from None

    def relay(self, data: bytes) -> bool:
        """Write the whole frames of a message in one piece.

        Returns:
            False if it held anything else, too, which is not sent; then the link must be closed.
        """
        cuts = self._up.feed(data)
        whole = [cut.data for cut in cuts if cut.is_frame]
        is_whole = len(whole) == len(cuts) and not self._up.pending
        if self._transport is not None and whole:
            self._transport.write(data if is_whole else b"".join(whole))
        return is_whole and bool(whole)

    async def until_room(self) -> None:
        """Wait until the server takes more."""
        await self._may_write.wait()

    def close(self) -> None:
        """Write what is left and close in order; break off where that takes long."""
        transport = self._transport
        if transport is not None and not transport.is_closing():
            transport.close()
            asyncio.get_running_loop().call_later(_CLOSE_WITHIN, transport.abort)

    # What asyncio calls.

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Say whose the connection is, before anything else."""
        assert isinstance(transport, asyncio.Transport)
        self._transport = transport
        if self._forwarded:
            transport.write(self._forwarded)
        else:
            self._believed.set_result(None)

    def data_received(self, data: bytes) -> None:
        """Hand on the frames that came."""
        cuts = self._down.feed(data)
        frames = [cut.data for cut in cuts if cut.is_frame]
        if frames and not self._believed.done():
            self._judge(Frame(frames.pop(0), self.order))
        if frames and not self._believed.exception():
            self._take(frames)
        if not self._down.in_step:
            self._over("the server sent what is no frame")

    def _judge(self, answer: Frame) -> None:
        is_taken = answer.reply_code == ReplyCode.SUCCESS
        if answer.msg_type == Forwarded.PLACE.msg_type and is_taken:
            self._believed.set_result(None)
        else:
            self._doubt("the server does not know this gateway by this name, address and secret")

    def _doubt(self, why: str) -> None:
        self._believed.set_exception(NotForwarded(why))
        self._believed.exception()  # nobody may be waiting any more

    def pause_writing(self) -> None:
        """Note that the server takes no more for now."""
        self._may_write.clear()

    def resume_writing(self) -> None:
        """Note that it takes more."""
        self._may_write.set()

    def connection_lost(self, error: Exception | None) -> None:
        """Tell that the link is over."""
        self._over("the server closed the connection" if error is None else "the link broke")

    def _over(self, why: str) -> None:
        if not self._believed.done():
            self._doubt(f"{why} before it knew whose it is")
        self._may_write.set()
        if self._transport is not None:
            self._transport.close()
        ended, self._ended = self._ended, lambda _: None
        ended(why)


async def dial(server: Server, link: ServerLink) -> None:
    """Connect a link to a server, and wait until it has believed FORWARDED.

    Raises:
        Unreachable: nobody listens there, or it does not speak TLS.
        NotForwarded: the server does not believe this gateway.
    """
    try:
        async with asyncio.timeout(DIAL_WITHIN):
            await asyncio.get_running_loop().create_connection(
                lambda: link,
                server.host,
                server.port,
                ssl=server.tls,
                server_hostname=None if server.tls is None else server.host,
                local_addr=(server.own_address, 0) if server.own_address else None,
            )
    except TimeoutError:
        raise Unreachable(None, f"{server} does not answer within {DIAL_WITHIN:g} s") from None
    except OSError as error:
        raise unreachable(error, server.host, server.port, tls=server.tls is not None) from None
    except ValueError as error:
        raise Unreachable(None, f"{server.host!r} is no host: {error}") from None
    await link.until_believed()
