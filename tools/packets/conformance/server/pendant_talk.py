"""The tester as a pendant: hello, requests with ids, and the news that comes in between.

Owns the sorting of what the server sends into answers and news. Knows no verdict of a check.
"""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from typing import TypeVar

from openpendant.simplemsg import ByteOrder, CommType, Message
from openpendant.simplemsg.pendant import (
    PROTOCOL_VERSION,
    Authority,
    AuthorityAction,
    AuthorityBeat,
    Hello,
    HelloReply,
    State,
    Verdict,
)

from .news import News
from .target import Target
from .wire import CannotJudge, Frame, RuleBroken, Wire

ANSWER_WITHIN = 2.0
"""A verdict that takes longer is missing; a motion is planned before it comes [s]."""

_NEWS_KEPT = 2_048
_MOST_BYTES = 4 * 1024 * 1024
"""Bytes of news, and of answers, that are kept; a server that floods is not waited for."""

_BEAT_PERIOD = 0.5

_News = TypeVar("_News", bound=Message)


class Talker:
    """One pendant connection.

    Attributes:
        wire: the connection.
        hello: the server's welcome; None before it.
        news: topics that came, newest last, with their times.
        fault: what is wrong with the stream itself, empty while nothing is.
    """

    def __init__(self, wire: Wire) -> None:
        """Take a connection on which nothing was said yet."""
        self.wire = wire
        self.hello: HelloReply | None = None
        self.news: deque[tuple[float, Message]] = deque(maxlen=_NEWS_KEPT)
        self.fault = ""
        self._news_sizes: deque[int] = deque()
        self._news_bytes = 0
        self._answers: deque[Frame] = deque()
        self._answer_bytes = 0
        self._news = News()
        self._last_request = 100
        wire.listener = self._take

    def _take(self, frame: Frame) -> None:
        if self.fault:
            return
        if frame.comm_type == CommType.REPLY:
            self._answers.append(frame)
            self._answer_bytes += len(frame.data)
            if self._answer_bytes > _MOST_BYTES:
                self._end(f"more than {_MOST_BYTES} bytes of answers to nothing")
        else:
            try:
                self._keep(frame.time, frame.message(), len(frame.data))
            except RuleBroken as broken:
                self._end(str(broken))
        self._news.came()

    def _keep(self, time: float, message: Message, size: int) -> None:
        self.news.append((time, message))
        self._news_sizes.append(size)
        self._news_bytes += size
        while len(self._news_sizes) > len(self.news) or self._news_bytes > _MOST_BYTES:
            if len(self._news_sizes) == len(self.news):
                self.news.popleft()
            self._news_bytes -= self._news_sizes.popleft()

    def _end(self, fault: str) -> None:
        """Go on with nothing that comes after this."""
        self.fault = fault
        self.wire.reset()

    @property
    def has_answer(self) -> bool:
        """A reply came that nobody has taken yet."""
        return bool(self._answers)

    def next_id(self) -> int:
        """Return a request id that was not used on this connection."""
        self._last_request += 1
        return self._last_request

    async def until(self, condition: Callable[[], bool], within: float) -> bool:
        """Wait until a condition on what came holds; tell whether it does.

        Raises:
            RuleBroken: the stream itself is faulty.
        """

        def holds() -> bool:
            if condition():
                return True
            if self.fault:
                raise RuleBroken(self.fault)
            return False

        return await self._news.until(holds, within)

    async def answer(self, what: str, within: float = ANSWER_WITHIN) -> Frame:
        """Return the next reply.

        Raises:
            RuleBroken: none came.
        """
        await self.until(lambda: bool(self._answers), within)
        if not self._answers:
            end = "the link was closed" if self.wire.is_lost else f"none came within {within:g} s"
            raise RuleBroken(f"an answer to {what}: {end}")
        frame = self._answers.popleft()
        self._answer_bytes -= len(frame.data)
        return frame

    async def ask(
        self, message: Message | bytes, what: str, within: float = ANSWER_WITHIN
    ) -> Frame:
        """Send a request and return the frame that answers it."""
        self.wire.send(message)
        return await self.answer(what, within)

    async def verdict(self, message: Message, what: str) -> Verdict:
        """Send a request and return the verdict on it, which must quote its id.

        Raises:
            RuleBroken: none came, or it quotes another request.
        """
        reply = (await self.ask(message, what)).message()
        if not isinstance(reply, Verdict):
            raise RuleBroken(f"{what} was answered by {type(reply).__name__}, not by a verdict")
        asked = getattr(message, "request_id", 0)
        if reply.request_id != asked:
            raise RuleBroken(f"the verdict on request {asked} quotes {reply.request_id}")
        if (reply.reply_code == 1) != (reply.code == 0):
            raise RuleBroken(f"{what}: reply code {reply.reply_code} with verdict {reply.code}")
        return reply

    async def refused(self, message: Message, code: int, what: str) -> None:
        """Send a request that must be refused for a certain reason.

        Raises:
            RuleBroken: it is accepted, or refused for another one.
        """
        found = await self.verdict(message, what)
        if found.code != code:
            raise RuleBroken(f"{what}: verdict {found.code} ({found.text!r}), expected {code}")

    async def accepted(self, message: Message, what: str) -> None:
        """Send a request that must be accepted.

        Raises:
            RuleBroken: it is refused.
        """
        found = await self.verdict(message, what)
        if found.code:
            raise RuleBroken(f"{what} was refused: {found.code} {found.text!r}")

    async def take_authority(self) -> None:
        """Take the motion authority.

        Raises:
            CannotJudge: somebody else has it.
        """
        request = Authority(self.next_id(), AuthorityAction.REQUEST)
        found = await self.verdict(request, "the request for the authority")
        if found.code:
            raise CannotJudge(f"the motion authority is not to be had: {found.text}")

    @asynccontextmanager
    async def beating(self) -> AsyncIterator[None]:
        """Keep the motion authority, by a beat every half second, while the context lasts."""

        async def beat() -> None:
            while not self.wire.is_lost:
                self.wire.send(AuthorityBeat())
                await asyncio.sleep(_BEAT_PERIOD)

        beats = asyncio.create_task(beat())
        try:
            yield
        finally:
            beats.cancel()
            await asyncio.gather(beats, return_exceptions=True)

    def all(self, kind: type[_News]) -> list[_News]:
        """Return the news of one kind, oldest first."""
        return [message for _, message in self.news if isinstance(message, kind)]

    async def state(self, within: float = 1.5) -> State:
        """Return the newest state, waiting for one where none came yet.

        Raises:
            CannotJudge: none comes.
        """
        if not await self.until(lambda: bool(self.all(State)), within):
            raise CannotJudge("no state came")
        return self.all(State)[-1]


async def stranger(target: Target, order: ByteOrder = ByteOrder.LITTLE) -> Talker:
    """Connect to the pendant port and say nothing."""
    return Talker(await target.pendant(order))


async def welcomed(
    target: Target, *, rate: float = 0.0, order: ByteOrder = ByteOrder.LITTLE, name: str = "tester"
) -> Talker:
    """Connect to the pendant port and say hello.

    Raises:
        RuleBroken: the hello was refused.
    """
    talker = await stranger(target, order)
    reply = (await talker.ask(Hello(PROTOCOL_VERSION, rate, "", name), "hello")).message()
    if not isinstance(reply, HelloReply):
        raise RuleBroken(f"hello was answered by {reply}")
    talker.hello = reply
    return talker
