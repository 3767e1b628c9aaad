"""Client's side of one connection: sends requests, matches verdicts and outcomes to their waiters.

Owns the matching of replies to requests and fails every waiter when the connection is lost. Detects
a dead link by the server's silence; nothing else would, since the wait for a planned request has no
bound. `session` and the modules built on it own the meaning of the requests.
"""

from __future__ import annotations

import asyncio
import contextlib
import ipaddress
import socket
import ssl
from collections.abc import Callable, Sequence
from typing import TypeVar, cast

from openpendant.simplemsg import (
    PENDANT,
    ByteOrder,
    CommType,
    Connection,
    FramingFault,
    HeaderOnly,
    LocalProtocolError,
    Malformed,
    Message,
    Ping,
    Role,
    Unasked,
)
from openpendant.simplemsg.pendant import (
    MAX_PENDANT_FRAME,
    HelloReply,
    LobbyReply,
    Management,
    Outcome,
    PairingReply,
    Verdict,
)

from .connection_errors import ConnectionLost, NotUnderstood, PendantError, WrongArgument, judged
from .motions import MotionHandle

REPLY_TIMEOUT = 35.0
"""Time for the answer to a request that is not planned [s]; the slowest check a secret or the disk.

A planned request has no bound, because it waits for those planned before it. A dead link is found
by its silence.
"""
HELLO = 0
"""Request id of hello, which carries none. An outcome with this id ends no request: it means that
the server ends the connection."""

_T = TypeVar("_T")


class Conversation(asyncio.Protocol):
    """One connection to a pendant server.

    Whatever sends or waits raises `ConnectionLost` once the connection is over.

    Attributes:
        error: why it ended; None while it is open.
        heard: when the last bytes arrived, by the loop's clock [s].
    """

    def __init__(self, on_notification: Callable[[Message], None]) -> None:
        """Make a conversation that has not started."""
        self.error: PendantError | None = None
        self.closed = asyncio.Event()
        self.heard = 0.0
        self._on_notification = on_notification
        self._wire = Connection(Role.CLIENT, PENDANT, ByteOrder.LITTLE, max_frame=MAX_PENDANT_FRAME)
        self._transport: asyncio.Transport | None = None
        # Verdicts come in the order of decisions, not of requests: a planned motion is answered
        # late. So each is found by its request id.
        self._verdicts: dict[int, asyncio.Future[Message]] = {}
        self._outcomes: dict[int, asyncio.Future[Outcome]] = {}
        self._waiting: set[Callable[[PendantError], None]] = set()
        self._is_leaving = False
        self._last_request = HELLO

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Take the transport and disable Nagle's delay."""
        self._transport = cast(asyncio.Transport, transport)  # uvloop's are none by class
        self.heard = asyncio.get_running_loop().time()
        transport.get_extra_info("socket").setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def data_received(self, data: bytes) -> None:
        """Decode the received bytes and give each message to its waiter."""
        self.heard = asyncio.get_running_loop().time()
        while True:
            for received in self._wire.receive(data):
                if not isinstance(received, Malformed | Unasked):
                    self._take(received)
            if not self._wire.more:
                break
            data = b""
        if self._wire.fault is not None:
            self._end(self._wire.fault)

    def connection_lost(self, exc: Exception | None) -> None:
        """Fail every waiter."""
        self._transport = None
        self._end(exc)
        self.closed.set()

    @property
    def unprotected(self) -> str:
        """How others could read what is sent; empty with TLS, or within this machine."""
        transport = self._transport
        if transport is None:
            return ""
        here, there = (transport.get_extra_info(name) for name in ("sockname", "peername"))
        # A connection that is broken already has no addresses any more.
        if here and there and is_own_address(there[0], here[0]):
            return ""
        at = f"for {there[0]}" if there else "for an unknown address"
        encrypted = transport.get_extra_info("ssl_object")
        if encrypted is None:
            return f"in clear text {at}"
        if encrypted.context.verify_mode != ssl.CERT_REQUIRED:
            return f"{at} behind a certificate that nobody verified"
        return ""

    def close(self) -> None:
        """Close the connection; `closed` tells when it is."""
        self._is_leaving = True
        if self._transport is not None:
            self._transport.close()
        else:
            self.closed.set()

    def abort(self, why: PendantError | None = None) -> None:
        """Break the connection at once, and fail every waiter with the reason."""
        if why is not None:
            self._end(why)
        if self._transport is not None:
            self._transport.abort()

    def new_request(self) -> int:
        """Return an unused request id."""
        self._last_request += 1
        return self._last_request

    def write(self, *messages: Message) -> None:
        """Send messages in one write, so that they arrive together or not at all.

        Raises:
            WrongArgument: one of them cannot be written.
        """
        if self.error is not None:
            raise self.error
        if self._transport is None:
            raise ConnectionLost("not connected")
        try:
            frames = b"".join([self._wire.send(message) for message in messages])
        except LocalProtocolError as error:
            raise WrongArgument(str(error)) from None
        self._transport.write(frames)

    def expect(self, kind: type[_T]) -> asyncio.Future[_T]:
        """Return a future that the caller completes, and that fails when the connection ends."""
        if self.error is not None:
            raise self.error
        future: asyncio.Future[_T] = asyncio.get_running_loop().create_future()

        def fail(error: PendantError) -> None:
            if future.done():  # cancelled in this very turn of the loop
                return
            future.set_exception(error)
            # Nobody may be waiting for it any more; that is no fault of its own.
            future.exception()

        self._waiting.add(fail)
        future.add_done_callback(lambda _: self._waiting.discard(fail))
        return future

    async def ask(
        self, request: Message, request_id: int, *, within: float | None = REPLY_TIMEOUT
    ) -> Message:
        """Send a request and wait for its verdict.

        Args:
            within: wait at most so long [s]; None, for what is planned, as long as the link lives.

        Raises:
            Refused: the verdict is a failure, or the answer to a management request is one.
            Unanswered: no verdict came in time.
            ConnectionLost: the connection ended.
        """
        verdict = self.send(request, request_id)
        try:
            await asyncio.wait({verdict}, timeout=within)
            return judged(verdict, within)
        finally:
            verdict.cancel()

    def send(
        self, request: Message, request_id: int, *, ahead: Sequence[Message] = ()
    ) -> asyncio.Future[Message]:
        """Send a request at once; return the future of its verdict, for `judged`.

        Args:
            ahead: what goes in front of it, in the same write.

        Raises:
            WrongArgument: the message cannot be written.
        """
        verdict = self._verdicts[request_id] = self.expect(Message)
        verdict.add_done_callback(lambda _: self._verdicts.pop(request_id, None))
        try:
            self.write(*ahead, request)
        except PendantError:
            verdict.cancel()
            raise
        return verdict

    def expect_outcome(self, request_id: int) -> asyncio.Future[Outcome]:
        """Return the future of a motion's outcome; who waits no longer cancels it."""
        outcome = self._outcomes[request_id] = self.expect(Outcome)
        outcome.add_done_callback(lambda _: self._outcomes.pop(request_id, None))
        return outcome

    async def begin_motion(self, request: Message, request_id: int) -> tuple[Message, MotionHandle]:
        """Send a request that is planned; return its acceptance and the started motion.

        The wait has no bound: after a time-out the motion would start without a handle.

        Raises:
            Refused: the verdict is a failure.
            ConnectionLost: the connection ended.
        """
        outcome = self.expect_outcome(request_id)
        try:
            reply = await self.ask(request, request_id, within=None)
        except BaseException:
            outcome.cancel()
            raise
        return reply, MotionHandle(request_id, outcome)

    def _take(self, message: Message) -> None:
        match message:
            case (
                Verdict(request_id=request_id)
                | Management(request_id=request_id)
                | LobbyReply(request_id=request_id)
                | PairingReply(request_id=request_id)
            ):
                _complete(self._verdicts.get(request_id), message)
            case HelloReply():
                _complete(self._verdicts.get(HELLO), message)
            case Outcome(request_id=request_id) if request_id != HELLO:
                _complete(self._outcomes.get(request_id), message)
            case HeaderOnly(comm_type=CommType.REPLY):
                self._end(NotUnderstood(f"the server does not know type {message.msg_type}"))
            case _:
                self._on_notification(message)

    def _end(self, cause: Exception | None) -> None:
        if self.error is None:
            reason = "the server closed the connection"
            if self._is_leaving:
                reason = "the client is closed"
            if cause is not None:
                reason = str(cause) or f"the connection broke: {type(cause).__name__}"
            self.error = cause if isinstance(cause, PendantError) else ConnectionLost(reason)
        for fail in list(self._waiting):
            fail(self.error)
        self._waiting.clear()
        if isinstance(cause, FramingFault):
            self.abort()


def is_own_address(peer: str, own: str) -> bool:
    """Return True if the address of a peer is one of this machine's.

    Args:
        peer: address of the other end of a connection.
        own: of this end; what speaks to an address of its own machine uses that same address.
    """
    return peer == own or _is_loopback(peer)


def _is_loopback(address: str) -> bool:
    parsed = ipaddress.ip_address(address.partition("%")[0])
    mapped = parsed.ipv4_mapped if isinstance(parsed, ipaddress.IPv6Address) else None
    return (mapped or parsed).is_loopback


def _complete(future: asyncio.Future[_T] | None, value: _T) -> None:
    if future is not None and not future.done():
        future.set_result(value)


_LOOK_PERIOD = 1.0
_PING_PERIOD = 5.0

_SILENCE = 15.0
"""A server that says nothing for so long, not even to a ping, is gone [s]."""


async def keep_alive(
    conversation: Conversation, misses_states: Callable[[float, float], bool]
) -> None:
    """Send pings to the server, and end the connection once it is silent.

    Args:
        misses_states: called with the time and the time of the last bytes, both by the loop's
            clock [s]; returns True to send a ping at once.
    """
    loop = asyncio.get_running_loop()
    asked = loop.time()
    with contextlib.suppress(ConnectionLost):
        while True:
            await asyncio.sleep(_LOOK_PERIOD)
            now, heard = loop.time(), conversation.heard
            if now - heard > _SILENCE:
                text = f"the server said nothing for {_SILENCE:g} s"
                conversation.abort(ConnectionLost(text))
            if misses_states(now, heard) or now - asked >= _PING_PERIOD:
                asked = now
                conversation.write(Ping())
