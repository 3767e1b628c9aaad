"""The gateway: for each WebSocket one TCP connection, and whole frames between the two as bytes.

Owns the life of such a pair: which server a page may name, when it is ended and by what code, that
a silent browser is noticed, and that all end in order when the gateway does. It knows no robot and
no message but FORWARDED; what it gets in one message it writes in one piece.
"""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Awaitable, Callable, Sequence
from enum import IntEnum

from aiohttp import WSMessage, WSMsgType, web

from openpendant.simplemsg.framing import MAX_FRAME

from ..connection_errors import Unreachable
from .admission import Asked, Browser, NotAdmitted, PageAdmission
from .backlog import Backlog, TooSlow
from .keypad_relay import PATH as KEYPAD_PATH
from .keypad_relay import KeypadRelay
from .server_link import GatewayIdentity, NotForwarded, Server, ServerLink, dial
from .settings import is_loopback

PATH = "/servers/{server:.*}"
"""Where a page opens its WebSocket, by the name of a server; `/servers` lists the names.

Without a name it is the first one's: so a page that never had the list finds its only server.
"""

MOST_PAIRS = 256
"""WebSockets at once; a server takes no more connections either."""

MOST_IN_MESSAGE = 4 * MAX_FRAME
"""Largest message of a browser [bytes]."""

HEARTBEAT = 1.5
"""Silence of a browser after which it is asked for a sign of life [s]."""

SILENCE = 5.0
"""Silence after which a browser is given up [s]."""

_CLOSE_WITHIN = 1.0
"""Time for the closing handshake [s]."""

_OVER = {WSMsgType.CLOSE, WSMsgType.CLOSING, WSMsgType.CLOSED, WSMsgType.ERROR}
"""What a WebSocket tells once it is over."""

_LONGEST_REASON = 123
"""Bytes that fit a WebSocket's close frame beside its code."""


class Ending(IntEnum):
    """Close codes of a WebSocket; the reason beside it is a sentence."""

    GOING_AWAY = 1001
    """The gateway ends."""
    INTERNAL_ERROR = 1011
    SERVER_UNREACHABLE = 4000
    SERVER_ENDED = 4001
    """The server closed the connection, or it broke."""
    NOT_FORWARDED = 4002
    """The server does not believe this gateway."""
    NO_FRAMES = 4003
    """The browser sent what are no whole frames."""
    TOO_SLOW = 4004
    """The browser left too much unread."""
    BROWSER_SILENT = 4005
    BROWSER_LEFT = 4006
    """Told to nobody: the browser closed the WebSocket, or it broke."""


class BrowserPair:
    """One browser and its connection to a server."""

    def __init__(self, socket: web.WebSocketResponse, transport: asyncio.Transport | None) -> None:
        """Pair a WebSocket that is open with nothing yet."""
        loop = asyncio.get_running_loop()
        self._socket = socket
        self._transport = transport
        self._backlog = Backlog()
        self._news = asyncio.Event()
        self._heard = loop.time()
        self._ended: asyncio.Future[tuple[Ending, str]] = loop.create_future()
        self._lost: str | None = None
        self._early: deque[WSMessage] = deque()

    def end(self, ending: Ending, reason: str = "") -> None:
        """End the pair; the first reason counts."""
        if not self._ended.done():
            self._ended.set_result((ending, reason))

    async def run(self, server: Server, forwarded: bytes) -> None:
        """BrowserRelay until one side is over; both are closed afterwards.

        Args:
            forwarded: the first frame to the server, empty for none.
        """
        link = ServerLink(forwarded, lambda frames: self._take(link, frames), self._lose)
        work = asyncio.get_running_loop().create_task(self._relay(server, link))
        work.add_done_callback(self._end_with)
        try:
            ending, reason = await self._ended
        finally:
            # The robot's side first: its server stops at once what this browser held.
            link.close()
            work.cancel()
        await self._close(ending, reason)

    def _end_with(self, work: asyncio.Task[None]) -> None:
        """End the pair where the work on it failed, which is a fault of this program."""
        if not work.cancelled() and (error := work.exception()) is not None:
            self.end(Ending.INTERNAL_ERROR, "a fault of the gateway; its log says more")
            told = {"message": "a pair ended by a fault", "exception": error}
            work.get_loop().call_exception_handler(told)

    async def _relay(self, server: Server, link: ServerLink) -> None:
        hears = asyncio.get_running_loop().create_task(self._hear_early())
        try:
            await dial(server, link)
        except Unreachable as error:
            return self.end(Ending.SERVER_UNREACHABLE, str(error))
        except NotForwarded as error:
            return self.end(Ending.NOT_FORWARDED, str(error))
        finally:
            hears.cancel()
            await asyncio.wait([hears])
        self._heard = asyncio.get_running_loop().time()
        async with asyncio.TaskGroup() as tasks:
            for each in (self._up(link), self._down(), self._beat(link)):
                tasks.create_task(each)

    # From the browser to the server.

    async def _hear_early(self) -> None:
        """Keep what comes before the server was reached; notice a browser that leaves meanwhile."""
        size = 0
        while size < MOST_IN_MESSAGE:
            message = await self._socket.receive()
            if message.type in _OVER:
                return self.end(Ending.BROWSER_LEFT)
            self._early.append(message)
            size += len(message.data or b"")

    async def _next(self) -> WSMessage:
        return self._early.popleft() if self._early else await self._socket.receive()

    async def _up(self, link: ServerLink) -> None:
        loop = asyncio.get_running_loop()
        while True:
            message = await self._next()
            self._heard = loop.time()
            match message.type:
                case WSMsgType.BINARY:
                    if not link.relay(message.data):
                        return self.end(Ending.NO_FRAMES, "a message holds whole frames")
                    if link.is_full:
                        await link.until_room()
                case WSMsgType.PING:
                    await self._socket.pong(message.data)
                case WSMsgType.PONG:
                    continue
                case WSMsgType.TEXT:
                    return self.end(Ending.NO_FRAMES, "frames are bytes, not text")
                case _:
                    return self.end(Ending.BROWSER_LEFT)

    async def _beat(self, link: ServerLink) -> None:
        """Ask a silent browser for a sign of life, and give it up where none comes."""
        loop = asyncio.get_running_loop()
        while True:
            await asyncio.sleep(HEARTBEAT / 3)
            silent = loop.time() - self._heard
            if self._transport is None or self._transport.is_closing():
                return self.end(Ending.BROWSER_LEFT)
            if link.is_full:  # what it sends is not being read
                self._heard = loop.time()
            elif silent > SILENCE:
                return self.end(Ending.BROWSER_SILENT, f"nothing came for {SILENCE:g} s")
            elif silent > HEARTBEAT:
                await self._socket.ping()

    # From the server to the browser.

    def _take(self, link: ServerLink, frames: Sequence[bytes]) -> None:
        in_socket = 0 if self._transport is None else self._transport.get_write_buffer_size()
        try:
            for frame in frames:
                self._backlog.add(frame, link.order, in_socket)
        except TooSlow as error:
            return self.end(Ending.TOO_SLOW, str(error))
        self._news.set()

    def _lose(self, why: str) -> None:
        self._lost = why
        self._news.set()

    async def _down(self) -> None:
        while True:
            await self._news.wait()
            self._news.clear()
            try:
                while self._backlog:
                    await self._socket.send_bytes(self._backlog.take())
            except ConnectionError:
                return self.end(Ending.BROWSER_LEFT)
            if self._lost is not None:
                return self.end(Ending.SERVER_ENDED, self._lost)

    async def _close(self, ending: Ending, reason: str) -> None:
        """Close the WebSocket in order; break off a browser that takes no part in it."""
        told = reason.encode()[:_LONGEST_REASON].decode(errors="ignore").encode()
        try:
            async with asyncio.timeout(_CLOSE_WITHIN):
                await self._socket.close(code=ending, message=told)
        except TimeoutError:
            if self._transport is not None:
                self._transport.abort()


class BrowserRelay:
    """All pairs of a gateway."""

    def __init__(
        self,
        servers: Sequence[Server],
        admission: PageAdmission,
        identity: GatewayIdentity | None,
        keypad: KeypadRelay | None = None,
    ) -> None:
        """Make a gateway without pairs.

        Args:
            identity: what the servers believe it by; None for one of this machine's browsers alone.
            keypad: for the bridge of a keypad in a page; None for none.
        """
        self._servers = {each.name: each for each in servers}
        self._admission = admission
        self._identity = identity
        self._keypad = keypad
        self._pairs: dict[BrowserPair, asyncio.Task[None] | None] = {}

    def application(self) -> web.Application:
        """Return what serves the list of servers and the WebSockets."""
        application = web.Application(middlewares=[self._admitted])
        application.router.add_get("/servers", self._list)
        application.router.add_get(PATH, self._open)
        if self._keypad is not None:
            application.router.add_get(KEYPAD_PATH, self._open_keypad)
        application.on_shutdown.append(self._shut_down)
        return application

    @web.middleware
    async def _admitted(
        self, request: web.Request, handler: Callable[[web.Request], Awaitable[web.StreamResponse]]
    ) -> web.StreamResponse:
        """Refuse every request, that for the page too, of whom the address rule refuses."""
        try:
            self._browser(request)
        except NotAdmitted as error:
            raise web.HTTPForbidden(text=f"{error}\n") from None
        return await handler(request)

    def _browser(self, request: web.Request) -> Browser:
        asked = Asked(request.remote or "", request.secure, list(request.headers.items()))
        self._admission.check_page(asked)
        return self._admission.browser(asked)

    async def _list(self, request: web.Request) -> web.Response:
        names = [{"name": each.name, "address": str(each)} for each in self._servers.values()]
        told: dict[str, object] = {"servers": names}
        if self._keypad is not None and is_loopback(self._browser(request).address):
            told["keypad"] = True
        return web.json_response(told, headers={"Cache-Control": "no-store"})

    async def _open_keypad(self, request: web.Request) -> web.StreamResponse:
        """Be the line of the keypad in a page; its bridge has rights that the browser has not."""
        assert self._keypad is not None
        if not is_loopback(self._browser(request).address):
            raise web.HTTPForbidden(text="the keypad is for browsers of this machine only\n")
        return await self._keypad.serve(request)

    async def _open(self, request: web.Request) -> web.StreamResponse:
        """Pair a page's WebSocket with the server that it names, until one of the two is over."""
        name = request.match_info["server"] or next(iter(self._servers))
        server = self._servers.get(name)
        if server is None:
            raise web.HTTPNotFound(text="no server of this name; /servers lists them\n")
        if len(self._pairs) >= MOST_PAIRS:
            raise web.HTTPServiceUnavailable(text=f"{MOST_PAIRS} pages are open already\n")
        browser = self._browser(request)
        forwarded = b"" if self._identity is None else self._identity.forwarded(browser)
        socket = web.WebSocketResponse(
            autoping=False, compress=False, max_msg_size=MOST_IN_MESSAGE, timeout=_CLOSE_WITHIN
        )
        await socket.prepare(request)
        pair = BrowserPair(socket, request.transport)
        self._pairs[pair] = asyncio.current_task()
        try:
            await pair.run(server, forwarded)
        finally:
            del self._pairs[pair]
        return socket

    async def _shut_down(self, _: web.Application) -> None:
        """End all pairs in order; aiohttp would wait for their browsers."""
        running = [each for each in self._pairs.values() if each is not None]
        for pair in self._pairs:
            pair.end(Ending.GOING_AWAY, "the gateway ends")
        if self._keypad is not None:
            self._keypad.close()
        if running:
            await asyncio.wait(running, timeout=2 * _CLOSE_WITHIN)
