"""The client's side of one connection: requests out, verdicts and outcomes back to whoever waits.

Owns the matching of replies to requests and the end of everything that waits when the connection is
lost. What the requests mean is the business of `session` and of what is built on it.
"""

from __future__ import annotations

import asyncio
import socket
from collections.abc import Callable
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
    Role,
    Unasked,
)
from openpendant.simplemsg.pendant import (
    MAX_PENDANT_FRAME,
    HelloReply,
    Management,
    Outcome,
    PairingReply,
    Verdict,
)

from .failures import ConnectionLost, NotUnderstood, PendantError, WrongArgument
from .judging import judged
from .motions import MotionHandle

REPLY_TIMEOUT = 35.0
"""What is not planned is answered at once, or after a secret or the disk; so long is a fault [s].

What is planned has no bound of its own: others may be planned before it, for as long as that takes.
That the link is dead is found by its silence.
"""
HELLO = 0
"""Stands for the request id of hello, which has none. An outcome that has it ends no request: the
server sends us away."""

_T = TypeVar("_T")


class Conversation(asyncio.Protocol):
    """One connection to a pendant server.

    Attributes:
        error: why it is over; None while it goes on.
        closed: set when the connection has ended.
        heard: when the last bytes came, by the loop's clock [s].
    """

    def __init__(self, on_news: Callable[[Message], None]) -> None:
        """Make a conversation that has not begun.

        Args:
            on_news: called with every message that answers nothing: state and changes.
        """
        self.error: PendantError | None = None
        self.closed = asyncio.Event()
        self.heard = 0.0
        self._on_news = on_news
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
        """Send at once from now on."""
        self._transport = cast(asyncio.Transport, transport)  # uvloop's are none by class
        self.heard = asyncio.get_running_loop().time()
        transport.get_extra_info("socket").setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def data_received(self, data: bytes) -> None:
        """Decode what came and give each message to whoever waits for it."""
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
        """End everything that waits."""
        self._transport = None
        self._end(exc)
        self.closed.set()

    def close(self) -> None:
        """Close the connection; `closed` tells when it is."""
        self._is_leaving = True
        if self._transport is not None:
            self._transport.close()
        else:
            self.closed.set()

    def abort(self, why: PendantError | None = None) -> None:
        """Break the connection at once, and tell everything that waits why."""
        if why is not None:
            self._end(why)
        if self._transport is not None:
            self._transport.abort()

    def new_request(self) -> int:
        """Return a request id that was not used yet."""
        self._last_request += 1
        return self._last_request

    def write(self, message: Message) -> None:
        """Send a message.

        Raises:
            ConnectionLost: the connection is over.
            WrongArgument: the message cannot be written.
        """
        if self.error is not None:
            raise self.error
        if self._transport is None:
            raise ConnectionLost("not connected")
        try:
            frame = self._wire.send(message)
        except LocalProtocolError as error:
            raise WrongArgument(str(error)) from None
        self._transport.write(frame)

    def expect(self, kind: type[_T]) -> asyncio.Future[_T]:
        """Return a future that the caller completes, and that fails when the connection ends.

        Raises:
            ConnectionLost: the connection is over already.
        """
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
            request: the request.
            request_id: its number.
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

    def send(self, request: Message, request_id: int) -> asyncio.Future[Message]:
        """Send a request at once; return what its verdict completes, for `judged`.

        Raises:
            ConnectionLost: the connection is over.
            WrongArgument: the message cannot be written.
        """
        verdict = self._verdicts[request_id] = self.expect(Message)
        verdict.add_done_callback(lambda _: self._verdicts.pop(request_id, None))
        try:
            self.write(request)
        except PendantError:
            verdict.cancel()
            raise
        return verdict

    def expect_outcome(self, request_id: int) -> asyncio.Future[Outcome]:
        """Return what the outcome of a motion completes; whoever expects it no more cancels it.

        Raises:
            ConnectionLost: the connection is over already.
        """
        outcome = self._outcomes[request_id] = self.expect(Outcome)
        outcome.add_done_callback(lambda _: self._outcomes.pop(request_id, None))
        return outcome

    async def begin_motion(self, request: Message, request_id: int) -> tuple[Message, MotionHandle]:
        """Send a request that is planned; return what accepted it, and the motion, which has begun.

        The wait has no bound: a motion that nobody waits for any more would begin unseen.

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
                self._on_news(message)

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


def _complete(future: asyncio.Future[_T] | None, value: _T) -> None:
    if future is not None and not future.done():
        future.set_result(value)
