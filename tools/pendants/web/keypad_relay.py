"""The keypad in a page: bytes between its WebSocket and a port of this machine for the bridge.

Owns that there is one page and one bridge at a time, and that a page which is gone is a pulled
cable: the bridge's connection is broken off with it. It keeps no byte, and looks at none but the
first one of a bridge: a stranger's page can have a browser speak HTTP to this port, which never
begins with the zero byte of a frame.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable

from aiohttp import WSCloseCode, WSMsgType, web

PATH = "/keypad"
"""Where a page opens the WebSocket of its keypad."""

HOST = "127.0.0.1"

TAKEN = 4010
"""Close code for a second page."""

SLOW = 4004
"""Close code for a page that leaves its bytes unread; as of a page's connection to a server."""

GOING_AWAY = int(WSCloseCode.GOING_AWAY)

MOST_WAITING = 8_192
"""Bytes for one side that it has not read; what is more ends it."""

_HEARTBEAT = 1.5
"""Time between two signs of life that a page is asked for [s]."""

_CLOSE_WITHIN = 1.0


class _Page:
    """The WebSocket of the page that has the keypad."""

    def __init__(self, socket: web.WebSocketResponse, to_bridge: Callable[[bytes], None]) -> None:
        self._socket = socket
        self._to_bridge = to_bridge
        self._waiting = bytearray()
        self._news = asyncio.Event()
        self._ended: asyncio.Future[int] = asyncio.get_running_loop().create_future()

    def end(self, code: int) -> None:
        """End it; the first reason counts."""
        if not self._ended.done():
            self._ended.set_result(code)

    async def until_ended(self) -> int:
        """Relay until it is over; return the close code."""
        tasks = [asyncio.ensure_future(each) for each in (self._read(), self._write())]
        for task in tasks:
            task.add_done_callback(lambda _: self.end(WSCloseCode.OK))
        try:
            return await self._ended
        finally:
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)

    async def close(self, code: int) -> None:
        """Close the WebSocket in order."""
        await self._socket.close(code=code)

    def send(self, data: bytes) -> bool:
        """Send bytes; return False where the page has too many unread."""
        self._waiting += data
        self._news.set()
        return len(self._waiting) <= MOST_WAITING

    async def _read(self) -> None:
        while (message := await self._socket.receive()).type is WSMsgType.BINARY:
            self._to_bridge(message.data)

    async def _write(self) -> None:
        while True:
            await self._news.wait()
            self._news.clear()
            data, self._waiting = bytes(self._waiting), bytearray()
            await self._socket.send_bytes(data)


class _Bridge(asyncio.Protocol):
    """One connection at the port; the relay says whether it is the bridge.

    Attributes:
        has_spoken: its first byte was that of a frame.
    """

    transport: asyncio.Transport

    def __init__(self, relay: KeypadRelay) -> None:
        self.has_spoken = False
        self._relay = relay

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        assert isinstance(transport, asyncio.Transport)
        self.transport = transport
        self._relay.bridge_came(self)

    def data_received(self, data: bytes) -> None:
        if not self.has_spoken and data[0] != 0:
            self.transport.abort()
            return
        self.has_spoken = True
        self._relay.bridge_said(self, data)

    def connection_lost(self, exc: Exception | None) -> None:
        self._relay.bridge_left(self)


class KeypadRelay:
    """The relay of one gateway."""

    def __init__(self) -> None:
        """Make a relay that does not listen yet."""
        self._server: asyncio.Server | None = None
        self._page: _Page | None = None
        self._bridge: _Bridge | None = None

    async def listen(self, port: int) -> str:
        """Listen for the bridge, and return what it takes as `--port`.

        Args:
            port: 0 for a free one.

        Raises:
            OSError: it cannot be listened at.
        """
        loop = asyncio.get_running_loop()
        self._server = await loop.create_server(lambda: _Bridge(self), HOST, port)
        return f"socket://{HOST}:{self._server.sockets[0].getsockname()[1]}"

    def close(self) -> None:
        """Listen no more, and end both sides."""
        if self._server is not None:
            self._server.close()
        self._end_bridge()
        if self._page is not None:
            self._page.end(GOING_AWAY)

    # The page.

    async def serve(self, request: web.Request) -> web.WebSocketResponse:
        """Be the keypad's line for a page until one of them ends it."""
        socket = web.WebSocketResponse(
            heartbeat=_HEARTBEAT, compress=False, max_msg_size=MOST_WAITING, timeout=_CLOSE_WITHIN
        )
        await socket.prepare(request)
        if self._page is not None:
            await socket.close(code=TAKEN, message=b"another page has the keypad")
            return socket
        page = self._page = _Page(socket, self._to_bridge)
        try:
            code = await page.until_ended()
        finally:
            # The robot's side first: what the keypad held ends with the bridge's line.
            self._page = None
            self._end_bridge()
        await page.close(code)
        return socket

    def _to_bridge(self, data: bytes) -> None:
        """Hand on bytes, which are lost without a bridge, as on a line that leads nowhere."""
        if self._bridge is None:
            return
        self._bridge.transport.write(data)
        if self._bridge.transport.get_write_buffer_size() > MOST_WAITING:
            self._end_bridge()

    # The bridge.

    def bridge_came(self, bridge: _Bridge) -> None:
        """Take a bridge, unless there is no keypad for it, or one that has spoken is there."""
        if self._page is None or (self._bridge is not None and self._bridge.has_spoken):
            bridge.transport.abort()
        else:
            self._end_bridge()
            self._bridge = bridge

    def bridge_said(self, bridge: _Bridge, data: bytes) -> None:
        """Hand bytes of the bridge on to the page."""
        page = self._page
        if bridge is not self._bridge or page is None or page.send(data):
            return
        self._end_bridge()
        page.end(SLOW)

    def bridge_left(self, bridge: _Bridge) -> None:
        """Take that a bridge has gone; the keypad notices it by the silence."""
        if bridge is self._bridge:
            self._bridge = None

    def _end_bridge(self) -> None:
        bridge, self._bridge = self._bridge, None
        if bridge is not None:
            bridge.transport.abort()
