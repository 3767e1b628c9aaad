"""Section P, first part: the conversation on the pendant port; hello, requests, state.

Only with a pendant port. The protocol is our own: docs/architecture.md, "The public protocol".
"""

from __future__ import annotations

import asyncio
import itertools
import json
import math

from openpendant.simplemsg import ByteOrder, CommType, MsgType, Ping, ReplyCode
from openpendant.simplemsg.pendant import (
    MAX_PENDANT_FRAME,
    PROTOCOL_VERSION,
    Activity,
    Hello,
    JointMove,
    Management,
    State,
    StateField,
    Subscribe,
    Verdict,
)
from openpendant.simplemsg.verdicts import VerdictCode

from ..findings import PASSED, Finding, Section
from ..findings import Verdict as Judged
from .checks import Profile, check
from .pendant_talk import Talker, stranger, welcomed
from .target import Target
from .watch import distance, rate
from .wire import HEADER, CannotJudge, RuleBroken, raw_frame

OURS = frozenset({Profile.GENERIC, Profile.PENDANT})

_PROTOCOL = "docs/simplemsg.md, dialect pendant"
_HELLO = _PROTOCOL + ": hello first, with version, capabilities and limits"
_OUTCOMES = "docs/architecture.md: every request is accepted or refused, once, with its id"
_STATE = "docs/architecture.md: listeners choose their rate; state carries sequence, time and age"
_SKIP = "docs/architecture.md: unknown messages are skipped by length, unknown requests refused"
_UNKNOWN = 65_099
_RATE = 20.0
_SAME = 1e-3
_RESTING = 0.01


def _move(talker: Talker, count: int = 6) -> JointMove:
    return JointMove(talker.next_id(), 0.1, count, (0.0,) * 10)


@check(
    "PS01",
    "hello is answered with version, limits and names",
    _HELLO,
    Section.PENDANT,
    profiles=OURS,
)
async def _hello(target: Target) -> Finding:
    hello = (await welcomed(target)).hello
    assert hello is not None
    if hello.protocol_version != PROTOCOL_VERSION or hello.session == 0:
        raise RuleBroken(f"version {hello.protocol_version}, session {hello.session}")
    if not 1 <= hello.dof <= 10 or not 1023 <= hello.max_frame <= MAX_PENDANT_FRAME:
        raise RuleBroken(f"dof {hello.dof}, max_frame {hello.max_frame}")
    if not (hello.max_state_rate >= 1 and hello.authority_timeout > 0 and hello.robot):
        raise RuleBroken(f"rate {hello.max_state_rate}, timeout {hello.authority_timeout}")
    return Finding(Judged.PASSED, f"{hello.server}, cell {hello.cell}, robot {hello.robot}")


@check("PS02", "sessions have numbers of their own", _HELLO, Section.PENDANT, profiles=OURS)
async def _sessions(target: Target) -> Finding:
    numbers = []
    for _ in range(3):
        hello = (await welcomed(target)).hello
        assert hello is not None
        numbers.append(hello.session)
    if len(set(numbers)) != 3:
        raise RuleBroken(f"three connections have sessions {numbers}")
    return PASSED


@check("PS03", "a request before hello is refused", _HELLO, Section.PENDANT, profiles=OURS)
async def _before_hello(target: Target) -> Finding:
    talker = await stranger(target)
    await talker.refused(_move(talker), VerdictCode.HELLO_FIRST, "a motion before hello")
    return PASSED


async def _unwelcome(target: Target, hello: Hello, code: VerdictCode, what: str) -> Finding:
    talker = await stranger(target)
    await talker.refused(hello, code, what)
    if not await talker.wire.is_closed_within(2.0):
        raise RuleBroken(f"after {what} the link is still open")
    return PASSED


@check(
    "PS04", "another version is refused and the link closed", _HELLO, Section.PENDANT, profiles=OURS
)
async def _version(target: Target) -> Finding:
    hello = Hello(PROTOCOL_VERSION + 1, 0.0, "", "tester")
    return await _unwelcome(target, hello, VerdictCode.VERSION, "a hello of another version")


@check(
    "PS05", "an unknown cell is refused and the link closed", _HELLO, Section.PENDANT, profiles=OURS
)
async def _cell(target: Target) -> Finding:
    hello = Hello(PROTOCOL_VERSION, 0.0, "no such cell", "tester")
    return await _unwelcome(target, hello, VerdictCode.UNKNOWN_CELL, "a hello to another cell")


@check(
    "PS06", "a second hello is refused and the link kept", _HELLO, Section.PENDANT, profiles=OURS
)
async def _second_hello(target: Target) -> Finding:
    talker = await welcomed(target)
    hello = Hello(PROTOCOL_VERSION, 0.0, "", "tester")
    await talker.refused(hello, VerdictCode.BAD_ARGUMENT, "a second hello")
    await talker.ask(Ping(), "a PING after a second hello")
    return PASSED


@check(
    "PS07",
    "who says no hello is left",
    "docs/configuration.md: hello_deadline",
    Section.PENDANT,
    profiles=OURS,
)
async def _no_hello(target: Target) -> Finding:
    talker = await stranger(target)
    if not await talker.wire.is_closed_within(8.0):
        raise RuleBroken("8 s without hello, and the link is still open")
    return PASSED


@check(
    "PS08", "an unknown request is refused with its own type", _SKIP, Section.PENDANT, profiles=OURS
)
async def _unknown_request(target: Target) -> Finding:
    talker = await welcomed(target)
    frame = raw_frame(talker.wire.codec, _UNKNOWN, CommType.REQUEST, body=bytes(300))
    reply = await talker.ask(frame, "an unknown request")
    if (reply.msg_type, reply.reply_code) != (_UNKNOWN, ReplyCode.FAILURE):
        raise RuleBroken(f"an unknown request was answered by {reply}")
    await talker.ask(Ping(), "a PING after an unknown request")
    return PASSED


@check("PS09", "an unknown topic is skipped by its length", _SKIP, Section.PENDANT, profiles=OURS)
async def _unknown_topic(target: Target) -> Finding:
    talker = await welcomed(target)
    topic = raw_frame(talker.wire.codec, _UNKNOWN, CommType.TOPIC, body=bytes(5000))
    talker.wire.send(topic, Ping())
    reply = await talker.answer("a PING behind an unknown topic")
    if reply.msg_type != MsgType.PING:
        raise RuleBroken(f"an unknown topic was answered by {reply}")
    return PASSED


@check(
    "PS10",
    "a PING is answered before hello and after it",
    _PROTOCOL,
    Section.PENDANT,
    profiles=OURS,
)
async def _ping(target: Target) -> Finding:
    for talker in (await stranger(target), await welcomed(target)):
        reply = await talker.ask(Ping(), "a PING")
        if (reply.msg_type, reply.reply_code) != (MsgType.PING, ReplyCode.SUCCESS):
            raise RuleBroken(f"a PING was answered by {reply}")
    return PASSED


@check(
    "PS11",
    "a malformed request is refused and the link kept",
    _OUTCOMES,
    Section.PENDANT,
    profiles=OURS,
)
async def _malformed(target: Target) -> Finding:
    talker = await welcomed(target)
    frame = raw_frame(talker.wire.codec, Subscribe.PLACE.msg_type, CommType.REQUEST, body=bytes(6))
    reply = (await talker.ask(frame, "a request that is too short")).message()
    if not isinstance(reply, Verdict) or reply.code != VerdictCode.MALFORMED:
        raise RuleBroken(f"a request that is too short was answered by {reply}")
    await talker.ask(Ping(), "a PING after a malformed request")
    return PASSED


@check(
    "PS12",
    "requests that come byte by byte are understood",
    "RFC 9293 3.8: TCP is a stream",
    Section.PENDANT,
    profiles=OURS,
)
async def _split(target: Target) -> Finding:
    talker = await stranger(target)
    hello = talker.wire.encode(Hello(PROTOCOL_VERSION, 0.0, "", "tester"))
    await talker.wire.send_in_pieces(hello)
    await talker.answer("a hello that came byte by byte")
    return PASSED


@check(
    "PS13",
    "a big-endian pendant is understood",
    "docs/simplemsg.md, byte order",
    Section.PENDANT,
    profiles=OURS,
)
async def _big_endian(target: Target) -> Finding:
    await welcomed(target, order=ByteOrder.BIG)
    return PASSED


@check(
    "PS14",
    "a frame beyond the announced size ends the link",
    _HELLO,
    Section.PENDANT,
    profiles=OURS,
)
async def _too_large(target: Target) -> Finding:
    talker = await welcomed(target)
    wire = talker.wire
    wire.send(raw_frame(wire.codec, _UNKNOWN, CommType.TOPIC, length=MAX_PENDANT_FRAME + 1))
    if not await wire.is_closed_within(3.0):
        raise RuleBroken("a length beyond max_frame left the link open for 3 s")
    return PASSED


@check(
    "PS15",
    "a client that only sends nonsense is cut off",
    "docs/ros-i.md: ten within ten seconds close the link",
    Section.PENDANT,
    profiles=OURS,
)
async def _nonsense(target: Target) -> Finding:
    talker = await welcomed(target)
    frame = raw_frame(talker.wire.codec, _UNKNOWN, CommType.REQUEST)
    for _ in range(30):
        talker.wire.send(frame)
        await asyncio.sleep(0.01)
    if not await talker.wire.is_closed_within(2.0):
        raise RuleBroken("thirty unknown requests in a row, and the link is still open")
    return PASSED


@check("PS16", "state comes at the rate that was asked for", _STATE, Section.PENDANT, profiles=OURS)
async def _state_rate(target: Target) -> Finding:
    hello = (await welcomed(target)).hello
    assert hello is not None
    found = []
    for asked in (min(_RATE, hello.max_state_rate), hello.max_state_rate):
        talker = await welcomed(target, rate=asked)
        await asyncio.sleep(2.0)
        got = rate([time for time, message in talker.news if isinstance(message, State)])
        if not 0.8 * asked <= got <= 1.2 * asked:
            raise RuleBroken(f"asked for {asked:g} Hz, got {got:.3g}")
        found.append(f"{got:.3g} Hz")
    return Finding(Judged.PASSED, ", ".join(found))


@check(
    "PS17",
    "state carries rising sequence and time, and its age",
    _STATE,
    Section.PENDANT,
    profiles=OURS,
)
async def _state_order(target: Target) -> Finding:
    talker = await welcomed(target, rate=50.0)
    await talker.until(lambda: len(talker.all(State)) >= 10, 2.0)
    states = talker.all(State)
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
    return PASSED


@check(
    "PS22",
    "state shows the joints as the ROS-Industrial port does",
    "docs/architecture.md: one cell behind both faces",
    Section.PENDANT,
    profiles=OURS,
)
async def _same_joints(target: Target) -> Finding:
    watch = await target.state()
    await watch.begin()
    talker = await welcomed(target, rate=50.0)
    state = await talker.state()
    gap = distance(state.positions, watch.position)
    if gap > _SAME:
        raise RuleBroken(f"the pendant port and the state port differ by {gap:.4g} rad or m")
    return PASSED


@check(
    "PS23",
    "the state of a robot at rest shows rest",
    _STATE,
    Section.PENDANT,
    profiles=OURS,
)
async def _at_rest(target: Target) -> Finding:
    talker = await welcomed(target, rate=50.0)
    await talker.until(lambda: len(talker.all(State)) >= 10, 2.0)
    first, *_, last = [await talker.state(), *talker.all(State)]
    if last.activity != Activity.IDLE or distance(first.positions, last.positions) > _SAME:
        raise CannotJudge("the robot moves")
    if last.request_id or last.holder:
        raise RuleBroken(f"request {last.request_id}, holder {last.holder}, where there are none")
    if not last.valid_fields & StateField.VELOCITY:
        return PASSED
    fastest = max(map(abs, last.velocities))
    if not fastest <= _RESTING:
        raise RuleBroken(f"the joints stand, and are said to move with {fastest:g} rad/s or m/s")
    return PASSED


@check("PS18", "state ends when it is no longer asked for", _STATE, Section.PENDANT, profiles=OURS)
async def _unsubscribe(target: Target) -> Finding:
    talker = await welcomed(target, rate=_RATE)
    await talker.state()
    await talker.accepted(Subscribe(talker.next_id(), 0.0), "a subscription of 0 Hz")
    count = len(talker.all(State))
    await asyncio.sleep(0.6)
    if len(talker.all(State)) > count:
        raise RuleBroken(f"{len(talker.all(State)) - count} states after a subscription of 0 Hz")
    return PASSED


@check("PS19", "a rate that cannot be is refused", _STATE, Section.PENDANT, profiles=OURS)
async def _bad_rate(target: Target) -> Finding:
    talker = await welcomed(target)
    for asked in (-5.0, 0.1, 1e6, math.nan, math.inf):
        found = await talker.verdict(Subscribe(talker.next_id(), asked), f"{asked} Hz")
        if found.code not in (VerdictCode.BAD_ARGUMENT, VerdictCode.NOT_FINITE):
            raise RuleBroken(f"a state rate of {asked} Hz: verdict {found.code}")
    return PASSED


@check("PS20", "a request is answered once", _OUTCOMES, Section.PENDANT, profiles=OURS)
async def _once(target: Target) -> Finding:
    talker = await welcomed(target)
    await talker.accepted(Subscribe(talker.next_id(), 0.0), "a subscription")
    if await talker.until(lambda: talker.has_answer, 0.4):
        raise RuleBroken("a subscription was answered twice")
    return PASSED


@check(
    "PS21",
    "management answers JSON with JSON, and nonsense with failure",
    _PROTOCOL,
    Section.PENDANT,
    profiles=OURS,
)
async def _management(target: Target) -> Finding:
    talker = await welcomed(target)
    for body in (b"{", b"[]", b'{"no such": "question"}', b"\xff\xfe", b""):
        request = Management(talker.next_id(), body)
        frame = await talker.ask(request, f"management {body!r}")
        reply = frame.message()
        if not isinstance(reply, Management) or reply.request_id != request.request_id:
            raise RuleBroken(f"management {body!r} was answered by {reply}")
        if frame.reply_code != ReplyCode.FAILURE:
            raise RuleBroken(f"management {body!r} was answered with success")
        _parsed(frame.data[HEADER + 4 :])
    return PASSED


@check(
    "PS24",
    "a snapshot is given, and is the cell that hello named",
    "server/pendant/management.py: snapshot, everything a pendant needs to know once",
    Section.PENDANT,
    profiles=OURS,
)
async def _snapshot(target: Target) -> Finding:
    talker = await welcomed(target)
    hello = talker.hello
    assert hello is not None
    request = Management(talker.next_id(), b'{"op": "snapshot"}')
    frame = await talker.ask(request, "a snapshot")
    reply = frame.message()
    if not isinstance(reply, Management) or reply.request_id != request.request_id:
        raise RuleBroken(f"a snapshot was answered by {reply}")
    if frame.reply_code != ReplyCode.SUCCESS:
        raise RuleBroken(f"a snapshot was answered with reply code {frame.reply_code}")
    shown = _parsed(frame.data[HEADER + 4 :])
    joints = shown.get("joints")
    count = len(joints) if isinstance(joints, list) else 0
    if (shown.get("cell"), count) != (hello.cell, hello.dof):
        raise RuleBroken(
            f"the snapshot shows cell {shown.get('cell')!r} with {count} joints, hello"
            f" {hello.cell!r} with {hello.dof}"
        )
    return PASSED


def _parsed(body: bytes) -> dict[str, object]:
    try:
        value = json.loads(body)
    except ValueError:
        raise RuleBroken(f"the answer is no JSON: {body[:60]!r}") from None
    if not isinstance(value, dict):
        raise RuleBroken(f"the answer is no JSON object: {body[:60]!r}")
    return value
