"""The tester's end of one TCP connection: raw bytes as well as messages, and when each came.

A tester must be able to send what no honest codec would, and to look at what no codec would accept.
So frames are cut out of the stream by their length field alone, kept as bytes, and decoded only
when asked. Owns no opinion: what a frame should have been is the checks' business. All time is the
running loop's.
"""

from __future__ import annotations

import asyncio
import socket
import struct
from collections import deque
from collections.abc import Callable

from openpendant.simplemsg import Codec, Message, MessageFault
from openpendant.simplemsg.framing import HEADER_SIZE, LEAST_LENGTH, Frame, Mode, Splitter

from ..check import RuleBroken


class Arrivals:
    """Notification of arrivals on one connection."""

    def __init__(self) -> None:
        self._came = asyncio.Event()

    def came(self) -> None:
        """Wake the waiting check: something came, or the connection ended."""
        self._came.set()

    async def until(self, condition: Callable[[], bool], within: float) -> bool:
        """Wait for a condition on the arrivals; return True if it holds within a time [s]."""
        try:
            async with asyncio.timeout(within):
                while not condition():
                    self._came.clear()
                    await self._came.wait()
        except TimeoutError:
            return False
        return True


REPLY_WITHIN = 1.0
"""A reply that takes longer is missing, unless a check says otherwise [s]."""

CONNECT_WITHIN = 3.0
"""A connection that takes longer is refused [s]."""

_MOST_WAITING = 4096
_MOST_WAITING_BYTES = 1 << 20
_LOG_LENGTH = 12


class TargetUnreachable(Exception):
    """The target takes no connection on a port."""


class ReceivedFrame(Frame):
    """One frame as it was received.

    Attributes:
        time: when its last byte came [s, the loop's].
    """

    __slots__ = ("codec", "time")

    def __init__(self, time: float, data: bytes, codec: Codec) -> None:
        super().__init__(data, codec.byte_order)
        self.time = time
        self.codec = codec

    def integers(self, count: int) -> tuple[int, ...]:
        """Return the first integers of the body; raise RuleBroken where it is shorter."""
        if len(self.body) < 4 * count:
            raise RuleBroken(f"{self}: the body is shorter than {4 * count} bytes")
        return struct.unpack_from(f"{self.codec.byte_order.value}{count}i", self.body)

    def message(self) -> Message:
        """Return the message in it; raise RuleBroken where there is none."""
        try:
            return self.codec.decode(self.data)
        except MessageFault as fault:
            raise RuleBroken(f"{self}: {fault}") from None

    def __str__(self) -> str:
        return (
            f"type {self.msg_type}, comm {self.comm_type}, code {self.reply_code},"
            f" {len(self.data)} bytes"
        )


def raw_frame(
    codec: Codec,
    msg_type: int,
    comm_type: int,
    reply_code: int = 0,
    body: bytes = b"",
    length: int | None = None,
) -> bytes:
    """Return a frame with any header, right or wrong."""
    true_length = LEAST_LENGTH + len(body)
    fields = (true_length if length is None else length, msg_type, comm_type, reply_code)
    return struct.pack(f"{codec.byte_order.value}4i", *fields) + body


class Wire(asyncio.Protocol):
    """One connection to the target.

    Attributes:
        stray: bytes in which no frame can be found any more; empty while the stream is sound.
        listener: takes each frame in place of the queue, where set.
    """

    def __init__(self, name: str, codec: Codec) -> None:
        """Make an end that is not connected yet; `open_wire` does both."""
        self.name = name
        self.codec = codec
        self.log: deque[str] = deque(maxlen=_LOG_LENGTH)
        self.stray = b""
        self.listener: Callable[[ReceivedFrame], None] | None = None
        self._loop = asyncio.get_running_loop()
        self._opened = self._loop.time()
        self._waiting: deque[ReceivedFrame] = deque()
        self._waiting_bytes = 0
        self._splitter = Splitter(Mode.STRICT, codec.byte_order)
        self._news = Arrivals()
        self._transport: asyncio.Transport | None = None
        self._is_lost = False
        self._is_held = False

    # What the loop calls.

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Send at once from now on."""
        assert isinstance(transport, asyncio.Transport)
        self._transport = transport
        sock = transport.get_extra_info("socket")
        sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def data_received(self, data: bytes) -> None:
        """Cut frames out of the stream."""
        if self.stray:
            # No frame can be found any more; a few bytes are enough to show.
            self.stray = (self.stray + data)[:64]
            return
        for cut in self._splitter.feed(data):
            if cut.is_frame:
                self._take(ReceivedFrame(self._loop.time(), cut.data, self.codec))
            else:
                self.stray = cut.data[:64]
                self._note(f"← bytes that are no frame: {self.stray[:16].hex(' ')}")
        self._news.came()

    def connection_lost(self, exc: Exception | None) -> None:
        """Note the end."""
        self._is_lost = True
        self._note("closed by the target" if exc is None else f"lost: {exc}")
        self._news.came()

    def _take(self, frame: ReceivedFrame) -> None:
        if self.listener is not None:
            self.listener(frame)
            return
        self._note(f"← {frame}")
        self._waiting.append(frame)
        self._waiting_bytes += len(frame.data)
        is_full = len(self._waiting) >= _MOST_WAITING or self._waiting_bytes >= _MOST_WAITING_BYTES
        if is_full and self._transport and not self._is_held:
            # An endless stream is left to the kernel until somebody asks for it.
            self._is_held = True
            self._transport.pause_reading()

    def _note(self, text: str) -> None:
        self.log.append(f"{self._loop.time() - self._opened:.3f} s {self.name} {text}")

    # What checks call.

    @property
    def is_lost(self) -> bool:
        """True once the connection has ended, from either side."""
        return self._is_lost

    @property
    def age(self) -> float:
        """Time since it was opened [s]."""
        return self._loop.time() - self._opened

    @property
    def unread(self) -> bytes:
        """Received bytes that are no whole frame: the beginning of one, or none at all."""
        return self.stray or self._splitter.pending

    @property
    def is_amid_frame(self) -> bool:
        """True while a frame of the target is incomplete."""
        return bool(self._splitter.pending)

    def encode(self, message: Message | bytes) -> bytes:
        """Return a message as bytes; bytes are left alone."""
        return message if isinstance(message, bytes) else self.codec.encode(message)

    def send(self, *parts: Message | bytes) -> None:
        """Send messages and bytes in one piece."""
        data = b"".join(map(self.encode, parts))
        self._note(f"→ {len(data)} bytes {data[:HEADER_SIZE].hex(' ', 4)}")
        if self._transport is not None and not self._transport.is_closing():
            self._transport.write(data)

    async def send_in_pieces(self, data: bytes, size: int = 1, pause: float = 0.002) -> None:
        """Send bytes in pieces, each in a segment of its own."""
        for start in range(0, len(data), size):
            self.send(data[start : start + size])
            await asyncio.sleep(pause)

    async def poll(self, within: float) -> ReceivedFrame | None:
        """Return the next frame; None where none comes in time, or none can come any more."""
        await self._news.until(
            lambda: bool(self._waiting) or self._is_lost or bool(self.stray), within
        )
        if not self._waiting:
            return None
        frame = self._waiting.popleft()
        self._waiting_bytes -= len(frame.data)
        is_low = len(self._waiting) < _MOST_WAITING // 2
        if self._is_held and self._transport and is_low:
            self._is_held = self._waiting_bytes >= _MOST_WAITING_BYTES
            if not self._is_held:
                self._transport.resume_reading()
        return frame

    async def expect(self, what: str, within: float = REPLY_WITHIN) -> ReceivedFrame:
        """Return the next frame.

        Args:
            what: what it should be, for the report.
            within: how long to wait [s].

        Raises:
            RuleBroken: none came.
        """
        frame = await self.poll(within)
        if frame is not None:
            return frame
        if self.stray:
            raise RuleBroken(f"instead of {what} came bytes that are no frame: {self.stray.hex()}")
        if self._is_lost:
            raise RuleBroken(f"the link was closed instead of {what}")
        raise RuleBroken(f"{what} did not come within {within:g} s")

    async def ask(
        self, message: Message | bytes, what: str, within: float = REPLY_WITHIN
    ) -> ReceivedFrame:
        """Send a request and return the frame that answers it; see `expect`."""
        self.send(message)
        return await self.expect(f"an answer to {what}", within)

    async def expect_silence(self, seconds: float, after: str) -> None:
        """Raise RuleBroken where the target says something or closes the link."""
        frame = await self.poll(seconds)
        if frame is not None:
            raise RuleBroken(f"after {after} came {frame}, though nothing is due")
        if self.stray or self._is_lost:
            end = "bytes that are no frame" if self.stray else "the end of the link"
            raise RuleBroken(f"after {after} came {end}")

    async def is_closed_within(self, seconds: float) -> bool:
        """Wait for the end of the connection; return True if it came."""
        await self._news.until(lambda: self._is_lost, seconds)
        return self._is_lost

    def half_close(self) -> None:
        """Close our direction (FIN), and keep receiving."""
        if self._transport is not None and not self._transport.is_closing():
            self._note("→ end of stream")
            self._transport.write_eof()

    def reset(self) -> None:
        """End the connection with a TCP reset."""
        if self._transport is None or self._transport.is_closing():
            return
        self._note("→ reset")
        sock = self._transport.get_extra_info("socket")
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
        self._transport.abort()

    def hold(self) -> None:
        """Stop reading, as a client that hangs does."""
        if self._transport is not None:
            self._transport.pause_reading()

    def close(self) -> None:
        """End the connection."""
        if self._transport is not None:
            self._transport.close()


async def open_wire(name: str, host: str, port: int, codec: Codec) -> Wire:
    """Connect; raise TargetUnreachable where there is nobody, or nobody answers in time."""
    loop = asyncio.get_running_loop()
    try:
        async with asyncio.timeout(CONNECT_WITHIN):
            _, wire = await loop.create_connection(lambda: Wire(name, codec), host, port)
    except (OSError, TimeoutError) as error:
        reason = (error.strerror if isinstance(error, OSError) else "") or "no answer"
        raise TargetUnreachable(f"{name} port {host}:{port} cannot be reached: {reason}") from None
    return wire
