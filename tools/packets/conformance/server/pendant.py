"""Section P, first part: the conversation on the pendant port; hello, requests, state.

Only with a pendant port. The protocol is our own: docs/architecture.md, "The public protocol". Owns
the tester's end as well: requests with ids, and the sorting of messages into replies and topics.
"""

from __future__ import annotations

import asyncio
import itertools
import json
import math
from collections import deque
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from functools import partial
from typing import TypeVar

from openpendant.simplemsg import ByteOrder, CommType, Message, MsgType, Ping, ReplyCode
from openpendant.simplemsg.framing import HEADER_SIZE
from openpendant.simplemsg.pendant import (
    MAX_PENDANT_FRAME,
    PROTOCOL_VERSION,
    Activity,
    Authority,
    AuthorityAction,
    AuthorityBeat,
    Hello,
    HelloReply,
    JointMove,
    Management,
    State,
    StateField,
    Subscribe,
    Verdict,
)
from openpendant.simplemsg.verdicts import VerdictCode

from ..check import CannotJudge, CheckFinding, Profile, RuleBroken, passed
from .checks import check, check_on
from .monitor import distance, rate
from .target import Target
from .wire import Arrivals, ReceivedFrame, Wire, raw_frame

ANSWER_WITHIN = 2.0
"""A verdict that takes longer is missing; a motion is planned before it comes [s]."""

_TOPICS_KEPT = 2_048
_MOST_BYTES = 4 * 1024 * 1024
"""Bytes of topics, and of replies, that are kept; a server that floods is not waited for."""

_BEAT_PERIOD = 0.5

_News = TypeVar("_News", bound=Message)


class PendantConversation:
    """One pendant connection.

    Attributes:
        topics: topics that came, newest last, with their times.
        fault: what is wrong with the stream itself, empty while nothing is.
    """

    hello: HelloReply
    """The server's welcome, set by `welcomed`."""

    def __init__(self, wire: Wire) -> None:
        self.wire = wire
        self.topics: deque[tuple[float, Message]] = deque(maxlen=_TOPICS_KEPT)
        self.fault = ""
        self._topic_sizes: deque[int] = deque()
        self._topic_bytes = 0
        self._answers: deque[ReceivedFrame] = deque()
        self._answer_bytes = 0
        self._news = Arrivals()
        self._last_request = 100
        wire.listener = self._take

    def _take(self, frame: ReceivedFrame) -> None:
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
        self.topics.append((time, message))
        self._topic_sizes.append(size)
        self._topic_bytes += size
        while len(self._topic_sizes) > len(self.topics) or self._topic_bytes > _MOST_BYTES:
            if len(self._topic_sizes) == len(self.topics):
                self.topics.popleft()
            self._topic_bytes -= self._topic_sizes.popleft()

    def _end(self, fault: str) -> None:
        """Reset the connection because of a fault in what it sent."""
        self.fault = fault
        self.wire.reset()

    @property
    def has_answer(self) -> bool:
        """True while a reply waits to be taken."""
        return bool(self._answers)

    def next_id(self) -> int:
        """Return a request id that was not used on this connection."""
        self._last_request += 1
        return self._last_request

    async def until(self, condition: Callable[[], bool], within: float) -> bool:
        """Wait for a condition; return True if it holds in time. RuleBroken for a faulty stream."""

        def holds() -> bool:
            if condition():
                return True
            if self.fault:
                raise RuleBroken(self.fault)
            return False

        return await self._news.until(holds, within)

    async def answer(self, what: str, within: float = ANSWER_WITHIN) -> ReceivedFrame:
        """Return the next reply; raise RuleBroken where none came."""
        await self.until(lambda: bool(self._answers), within)
        if not self._answers:
            end = "the link was closed" if self.wire.is_lost else f"none came within {within:g} s"
            raise RuleBroken(f"an answer to {what}: {end}")
        frame = self._answers.popleft()
        self._answer_bytes -= len(frame.data)
        return frame

    async def ask(
        self, message: Message | bytes, what: str, within: float = ANSWER_WITHIN
    ) -> ReceivedFrame:
        """Send a request and return the frame that answers it."""
        self.wire.send(message)
        return await self.answer(what, within)

    async def verdict(self, message: Message, what: str) -> Verdict:
        """Return the verdict on a request; RuleBroken where none came, or on another request."""
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
        """Send a request; raise RuleBroken unless it is refused, and for this reason."""
        found = await self.verdict(message, what)
        if found.code != code:
            raise RuleBroken(f"{what}: verdict {found.code} ({found.text!r}), expected {code}")

    async def accepted(self, message: Message, what: str) -> None:
        """Send a request; raise RuleBroken where it is refused."""
        found = await self.verdict(message, what)
        if found.code:
            raise RuleBroken(f"{what} was refused: {found.code} {found.text!r}")

    async def take_authority(self) -> None:
        """Take the motion authority; raise CannotJudge where somebody else has it."""
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
        """Return the topics of one kind, oldest first."""
        return [message for _, message in self.topics if isinstance(message, kind)]

    async def state(self, within: float = 1.5) -> State:
        """Return the newest state, waiting for the first; raise CannotJudge where none comes."""
        if not await self.until(lambda: bool(self.all(State)), within):
            raise CannotJudge("no state came")
        return self.all(State)[-1]


async def stranger(target: Target, order: ByteOrder = ByteOrder.LITTLE) -> PendantConversation:
    """Connect to the pendant port and say nothing."""
    return PendantConversation(await target.pendant(order))


async def welcomed(
    target: Target, *, rate: float = 0.0, order: ByteOrder = ByteOrder.LITTLE, name: str = "tester"
) -> PendantConversation:
    """Connect to the pendant port and say hello; RuleBroken where that is refused."""
    pendant = await stranger(target, order)
    reply = (await pendant.ask(Hello(PROTOCOL_VERSION, rate, "", name), "hello")).message()
    if not isinstance(reply, HelloReply):
        raise RuleBroken(f"hello was answered by {reply}")
    pendant.hello = reply
    return pendant


OURS = frozenset({Profile.GENERIC, Profile.PENDANT})

_UNKNOWN = 65_099
_RATE = 20.0
_SAME = 1e-3
_RESTING = 0.01


def _move(pendant: PendantConversation, count: int = 6) -> JointMove:
    return JointMove(pendant.next_id(), 0.1, count, (0.0,) * 10)


@check("PS01", profiles=OURS)
async def _hello(target: Target) -> CheckFinding:
    hello = (await welcomed(target)).hello
    if hello.protocol_version != PROTOCOL_VERSION or hello.session == 0:
        raise RuleBroken(f"version {hello.protocol_version}, session {hello.session}")
    if not 1 <= hello.dof <= 10 or not 1023 <= hello.max_frame <= MAX_PENDANT_FRAME:
        raise RuleBroken(f"dof {hello.dof}, max_frame {hello.max_frame}")
    if not (hello.max_state_rate >= 1 and hello.authority_timeout > 0 and hello.robot):
        raise RuleBroken(f"rate {hello.max_state_rate}, timeout {hello.authority_timeout}")
    return passed(f"{hello.server}, cell {hello.cell}, robot {hello.robot}")


@check("PS02", profiles=OURS)
async def _sessions(target: Target) -> None:
    numbers = []
    for _ in range(3):
        numbers.append((await welcomed(target)).hello.session)
    if len(set(numbers)) != 3:
        raise RuleBroken(f"three connections have sessions {numbers}")


@check_on(stranger, "PS03", profiles=OURS)
async def _before_hello(pendant: PendantConversation) -> None:
    await pendant.refused(_move(pendant), VerdictCode.HELLO_FIRST, "a motion before hello")


async def _unwelcome(target: Target, hello: Hello, code: VerdictCode, what: str) -> None:
    pendant = await stranger(target)
    await pendant.refused(hello, code, what)
    if not await pendant.wire.is_closed_within(2.0):
        raise RuleBroken(f"after {what} the link is still open")


check("PS04", profiles=OURS)(
    partial(
        _unwelcome,
        hello=Hello(PROTOCOL_VERSION + 1, 0.0, "", "tester"),
        code=VerdictCode.VERSION,
        what="a hello of another version",
    )
)
check("PS05", profiles=OURS)(
    partial(
        _unwelcome,
        hello=Hello(PROTOCOL_VERSION, 0.0, "no such cell", "tester"),
        code=VerdictCode.UNKNOWN_CELL,
        what="a hello to another cell",
    )
)


@check_on(welcomed, "PS06", profiles=OURS)
async def _second_hello(pendant: PendantConversation) -> None:
    hello = Hello(PROTOCOL_VERSION, 0.0, "", "tester")
    await pendant.refused(hello, VerdictCode.BAD_ARGUMENT, "a second hello")
    await pendant.ask(Ping(), "a PING after a second hello")


@check_on(stranger, "PS07", profiles=OURS)
async def _no_hello(pendant: PendantConversation) -> None:
    if not await pendant.wire.is_closed_within(8.0):
        raise RuleBroken("8 s without hello, and the link is still open")


@check_on(welcomed, "PS08", profiles=OURS)
async def _unknown_request(pendant: PendantConversation) -> None:
    frame = raw_frame(pendant.wire.codec, _UNKNOWN, CommType.REQUEST, body=bytes(300))
    reply = await pendant.ask(frame, "an unknown request")
    if (reply.msg_type, reply.reply_code) != (_UNKNOWN, ReplyCode.FAILURE):
        raise RuleBroken(f"an unknown request was answered by {reply}")
    await pendant.ask(Ping(), "a PING after an unknown request")


@check_on(welcomed, "PS09", profiles=OURS)
async def _unknown_topic(pendant: PendantConversation) -> None:
    topic = raw_frame(pendant.wire.codec, _UNKNOWN, CommType.TOPIC, body=bytes(5000))
    pendant.wire.send(topic, Ping())
    reply = await pendant.answer("a PING behind an unknown topic")
    if reply.msg_type != MsgType.PING:
        raise RuleBroken(f"an unknown topic was answered by {reply}")


@check("PS10", profiles=OURS)
async def _ping(target: Target) -> None:
    for pendant in (await stranger(target), await welcomed(target)):
        reply = await pendant.ask(Ping(), "a PING")
        if (reply.msg_type, reply.reply_code) != (MsgType.PING, ReplyCode.SUCCESS):
            raise RuleBroken(f"a PING was answered by {reply}")


@check_on(welcomed, "PS11", profiles=OURS)
async def _malformed(pendant: PendantConversation) -> None:
    frame = raw_frame(pendant.wire.codec, Subscribe.PLACE.msg_type, CommType.REQUEST, body=bytes(6))
    reply = (await pendant.ask(frame, "a request that is too short")).message()
    if not isinstance(reply, Verdict) or reply.code != VerdictCode.MALFORMED:
        raise RuleBroken(f"a request that is too short was answered by {reply}")
    await pendant.ask(Ping(), "a PING after a malformed request")


@check_on(stranger, "PS12", profiles=OURS)
async def _split(pendant: PendantConversation) -> None:
    hello = pendant.wire.encode(Hello(PROTOCOL_VERSION, 0.0, "", "tester"))
    await pendant.wire.send_in_pieces(hello)
    await pendant.answer("a hello that came byte by byte")


@check("PS13", profiles=OURS)
async def _big_endian(target: Target) -> None:
    await welcomed(target, order=ByteOrder.BIG)


@check_on(welcomed, "PS14", profiles=OURS)
async def _too_large(pendant: PendantConversation) -> None:
    wire = pendant.wire
    wire.send(raw_frame(wire.codec, _UNKNOWN, CommType.TOPIC, length=MAX_PENDANT_FRAME + 1))
    if not await wire.is_closed_within(3.0):
        raise RuleBroken("a length beyond max_frame left the link open for 3 s")


@check_on(welcomed, "PS15", profiles=OURS)
async def _nonsense(pendant: PendantConversation) -> None:
    frame = raw_frame(pendant.wire.codec, _UNKNOWN, CommType.REQUEST)
    for _ in range(30):
        pendant.wire.send(frame)
        await asyncio.sleep(0.01)
    if not await pendant.wire.is_closed_within(2.0):
        raise RuleBroken("thirty unknown requests in a row, and the link is still open")


@check("PS16", profiles=OURS)
async def _state_rate(target: Target) -> CheckFinding:
    hello = (await welcomed(target)).hello
    found = []
    for asked in (min(_RATE, hello.max_state_rate), hello.max_state_rate):
        pendant = await welcomed(target, rate=asked)
        await asyncio.sleep(2.0)
        got = rate([time for time, message in pendant.topics if isinstance(message, State)])
        if not 0.8 * asked <= got <= 1.2 * asked:
            raise RuleBroken(f"asked for {asked:g} Hz, got {got:.3g}")
        found.append(f"{got:.3g} Hz")
    return passed(", ".join(found))


@check("PS17", profiles=OURS)
async def _state_order(target: Target) -> None:
    pendant = await welcomed(target, rate=50.0)
    await pendant.until(lambda: len(pendant.all(State)) >= 10, 2.0)
    states = pendant.all(State)
    if len(states) < 10:
        raise RuleBroken(f"{len(states)} states in 2 s at 50 Hz")
    for earlier, later in itertools.pairwise(states):
        if later.sequence <= earlier.sequence:
            raise RuleBroken(f"sequence {later.sequence} after {earlier.sequence}")
        if (later.time_s, later.time_ns) <= (earlier.time_s, earlier.time_ns):
            raise RuleBroken("the server's time does not advance")
    if not all(-1 <= state.age < 10 and math.isfinite(state.age) for state in states):
        raise RuleBroken(f"age {states[-1].age}")
    if not any(state.age for state in states):
        raise RuleBroken("the age is always 0 s: no report comes in the moment of its state")


@check("PS22", profiles=OURS)
async def _same_joints(target: Target) -> None:
    watch = await target.state()
    await watch.begin()
    pendant = await welcomed(target, rate=50.0)
    state = await pendant.state()
    gap = distance(state.positions, watch.position)
    if gap > _SAME:
        raise RuleBroken(f"the pendant port and the state port differ by {gap:.4g} rad or m")


@check("PS23", profiles=OURS)
async def _at_rest(target: Target) -> None:
    pendant = await welcomed(target, rate=50.0)
    await pendant.until(lambda: len(pendant.all(State)) >= 10, 2.0)
    first, *_, last = [await pendant.state(), *pendant.all(State)]
    if last.activity != Activity.IDLE or distance(first.positions, last.positions) > _SAME:
        raise CannotJudge("the robot moves")
    if last.request_id or last.holder:
        raise RuleBroken(f"request {last.request_id}, holder {last.holder}, where there are none")
    if not last.valid_fields & StateField.VELOCITY:
        return
    fastest = max(map(abs, last.velocities))
    if not fastest <= _RESTING:
        raise RuleBroken(f"the joints stand, and are said to move with {fastest:g} rad/s or m/s")


@check("PS18", profiles=OURS)
async def _unsubscribe(target: Target) -> None:
    pendant = await welcomed(target, rate=_RATE)
    await pendant.state()
    await pendant.accepted(Subscribe(pendant.next_id(), 0.0), "a subscription of 0 Hz")
    count = len(pendant.all(State))
    await asyncio.sleep(0.6)
    if len(pendant.all(State)) > count:
        raise RuleBroken(f"{len(pendant.all(State)) - count} states after a subscription of 0 Hz")


@check_on(welcomed, "PS19", profiles=OURS)
async def _bad_rate(pendant: PendantConversation) -> None:
    for asked in (-5.0, 0.1, 1e6, math.nan, math.inf):
        found = await pendant.verdict(Subscribe(pendant.next_id(), asked), f"{asked} Hz")
        if found.code not in (VerdictCode.BAD_ARGUMENT, VerdictCode.NOT_FINITE):
            raise RuleBroken(f"a state rate of {asked} Hz: verdict {found.code}")


@check_on(welcomed, "PS20", profiles=OURS)
async def _once(pendant: PendantConversation) -> None:
    await pendant.accepted(Subscribe(pendant.next_id(), 0.0), "a subscription")
    if await pendant.until(lambda: pendant.has_answer, 0.4):
        raise RuleBroken("a subscription was answered twice")


@check_on(welcomed, "PS21", profiles=OURS)
async def _management(pendant: PendantConversation) -> None:
    for body in (b"{", b"[]", b'{"no such": "question"}', b"\xff\xfe", b""):
        request = Management(pendant.next_id(), body)
        frame = await pendant.ask(request, f"management {body!r}")
        reply = frame.message()
        if not isinstance(reply, Management) or reply.request_id != request.request_id:
            raise RuleBroken(f"management {body!r} was answered by {reply}")
        if frame.reply_code != ReplyCode.FAILURE:
            raise RuleBroken(f"management {body!r} was answered with success")
        _parsed(frame.data[HEADER_SIZE + 4 :])


@check_on(welcomed, "PS24", profiles=OURS)
async def _snapshot(pendant: PendantConversation) -> None:
    hello = pendant.hello
    request = Management(pendant.next_id(), b'{"op": "snapshot"}')
    frame = await pendant.ask(request, "a snapshot")
    reply = frame.message()
    if not isinstance(reply, Management) or reply.request_id != request.request_id:
        raise RuleBroken(f"a snapshot was answered by {reply}")
    if frame.reply_code != ReplyCode.SUCCESS:
        raise RuleBroken(f"a snapshot was answered with reply code {frame.reply_code}")
    shown = _parsed(frame.data[HEADER_SIZE + 4 :])
    joints = shown.get("joints")
    count = len(joints) if isinstance(joints, list) else 0
    if (shown.get("cell"), count) != (hello.cell, hello.dof):
        raise RuleBroken(
            f"the snapshot shows cell {shown.get('cell')!r} with {count} joints, hello"
            f" {hello.cell!r} with {hello.dof}"
        )


def _parsed(body: bytes) -> dict[str, object]:
    try:
        value = json.loads(body)
    except ValueError:
        raise RuleBroken(f"the answer is no JSON: {body[:60]!r}") from None
    if not isinstance(value, dict):
        raise RuleBroken(f"the answer is no JSON object: {body[:60]!r}")
    return value
