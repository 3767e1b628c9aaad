import asyncio
import json
import struct
from collections import Counter
from collections.abc import Callable
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from promises.promise_table import figure
from rigs.cells.admission_desk import BOOK, Desk
from rigs.cells.byte_rig import READ, ByteClient, ByteRig
from rigs.data.example_counts import examples
from rigs.peers.server_clients import hello

from openpendant.server.events.effects import Ask, Effect, SendStop, SendToController
from openpendant.server.events.events import Port
from openpendant.server.shell.client_connection import REQUESTS_PER_TURN
from openpendant.simplemsg import (
    ByteOrder,
    CommType,
    HeaderOnly,
    JointTraj,
    JointTrajPt,
    JointTrajPtFull,
    Message,
    MsgType,
    Ping,
    ReplyCode,
    TrajPoint,
    joint_array,
)
from openpendant.simplemsg.pendant import (
    Authority,
    AuthorityAction,
    AuthorityBeat,
    HelloReply,
    Home,
    JogRelease,
    JogSpace,
    JogStart,
    JointMove,
    Management,
    MotionControl,
    MotionControlAction,
    OperatingMode,
    ResetStop,
    SetMode,
    SetSpeed,
    SoftwareStop,
    Subscribe,
    Verdict,
)
from openpendant.simplemsg.verdicts import VerdictCode as V

REQUEST, TOPIC = CommType.REQUEST, CommType.TOPIC
NOTHING = joint_array([])
LAST = 1_000_000
"""Request id of the STOP."""

RATES = joint_array((1.0, 0.0))
JOINTS = joint_array((0.5, 0.5))


def told(number: int, **body: object) -> Management:
    return Management(number, json.dumps(body).encode())


FLOODS: dict[str, Callable[[int], Message]] = {
    "pings": lambda number: Ping(comm_type=REQUEST),
    "beats": lambda number: AuthorityBeat(),
    "moves": lambda number: JointMove(number, 0.5, 2, JOINTS),
    "questions": lambda number: told(number, op="why", key="x" * 40),
}


def welcomed(rig: ByteRig, *, in_control: bool = False) -> ByteClient:
    client = rig.client()
    client.tell(hello())
    if in_control:
        client.tell(Authority(1, AuthorityAction.REQUEST))
    client.heard()
    return client


def talking(*, in_control: bool = False) -> tuple[ByteRig, ByteClient]:
    rig = ByteRig()
    return rig, welcomed(rig, in_control=in_control)


async def handled(rig: ByteRig, client: ByteClient) -> list[Effect]:
    """Let all be handled that was said; return what followed."""
    before = len(rig.log)
    await client.until_handled()
    return [item for _, item in rig.log[before:]]


def is_stopped(rig: ByteRig) -> bool:
    return rig.core.cell.stop is not None


def is_read(client: ByteClient) -> bool:
    return client.transport.reads


def answers(got: list[Any]) -> Counter[int]:
    verdicts = Counter(each.request_id for each in got if isinstance(each, Verdict))
    return verdicts + Counter(each.request_id for each in got if isinstance(each, Management))


def codes(got: list[Any]) -> dict[int, V]:
    return {each.request_id: V(each.code) for each in got if isinstance(each, Verdict)}


@pytest.mark.parametrize("flood", FLOODS)
@pytest.mark.parametrize("count", [0, 100, figure(19, "own").count])
async def test_promise_19_it_acts_in_the_turn_that_reads_its_last_byte(
    flood: str, count: int
) -> None:
    rig, client = talking(in_control=True)
    frames = [client.frames(FLOODS[flood](number)) for number in range(2, count + 2)]
    assert max(map(len, frames), default=0) <= 88
    stream = b"".join([*frames, client.frames(SoftwareStop(LAST, "now"))])
    client.say(stream[:-1])
    assert not is_stopped(rig)
    client.say(stream[-1:])
    assert is_stopped(rig)
    since = await handled(rig, client)
    assert not any(isinstance(item, SendToController | Ask | SendStop) for item in since)
    assert answers(client.heard())[LAST] == 1


async def test_a_stranger_is_read_ahead_700_frames_and_may_stop() -> None:
    rig = ByteRig(Desk(BOOK).login)
    client = welcomed(rig)
    client.say(client.frames(Ping(comm_type=REQUEST)) * 17)
    assert client.shell.wire.more
    client.tell(*(FLOODS["moves"](number) for number in range(700)))
    client.tell(SoftwareStop(LAST, "now"))
    assert is_stopped(rig)
    await client.until_handled()
    got = codes(client.heard())
    assert got.pop(LAST) is V.ACCEPTED
    assert set(got.values()) == {V.LOGIN_NEEDED}


@pytest.mark.parametrize(
    ("desk", "bound"),
    [(None, figure(8, "ahead").bytes), (Desk(BOOK), figure(8, "strangers").bytes)],
)
async def test_promise_8_reading_ahead_ends_at_the_bound_and_goes_on_below_it(
    desk: Desk | None, bound: int
) -> None:
    rig = ByteRig(None if desk is None else desk.login)
    client = welcomed(rig)
    ping = client.frames(Ping(comm_type=REQUEST))
    while is_read(client):
        client.say(ping * 64)
    assert bound <= client.shell.wire.waiting < bound + 64 * len(ping)
    turns = 0
    while not client.transport.reads:
        await asyncio.sleep(0)
        turns += 1
        assert turns < 10
    client.tell(SoftwareStop(LAST, "now"))
    assert is_stopped(rig)


async def test_reset_move_and_stop_in_one_read_move_nothing() -> None:
    rig, client = talking(in_control=True)
    client.tell(SoftwareStop(2, "first"))
    client.heard()
    client.tell(ResetStop(3), JointMove(4, 0.5, 2, JOINTS), SoftwareStop(5, "no, stop"))
    verdicts = [(5, V.ACCEPTED), (3, V.OVERTAKEN_BY_STOP), (4, V.OVERTAKEN_BY_STOP)]
    assert list(codes(client.heard()).items()) == verdicts
    rig.wait(500)
    assert is_stopped(rig)
    assert not any(isinstance(item, Ask) for _, item in rig.log)
    client.tell(ResetStop(6))
    assert codes(client.heard())[6] is V.ACCEPTED


async def test_a_request_that_was_overtaken_is_not_taken_when_it_comes_again() -> None:
    _, client = talking(in_control=True)
    move = client.frames(JointMove(4, 0.5, 2, JOINTS))
    client.say(move + client.frames(SoftwareStop(5, "")))
    client.heard()
    client.say(move)
    assert codes(client.heard()) == {4: V.REQUEST_REPEATED}


async def test_what_moves_nothing_is_taken_in_its_order_and_answered() -> None:
    rig, client = talking(in_control=True)
    client.tell(
        Subscribe(2, 10.0),
        Ping(comm_type=REQUEST),
        Authority(3, AuthorityAction.RELEASE),
        told(4, op="why"),
        MotionControl(5, MotionControlAction.PAUSE),
        SoftwareStop(6, ""),
    )
    got = client.heard()
    assert answers(got) == Counter([2, 3, 4, 5, 6])
    assert V.OVERTAKEN_BY_STOP not in codes(got).values()
    assert rig.core.cell.authority.holder is None


async def test_several_stops_at_once_stop_once_and_each_is_answered() -> None:
    rig, client = talking()
    before = len(rig.stops)
    client.tell(*(SoftwareStop(number, "") for number in range(1, 101)))
    assert len(rig.stops) == before + 1
    await client.until_handled()
    assert answers(client.heard()) == Counter(range(1, 101))
    assert len(rig.stops) == before + 1


async def test_a_stop_that_was_handled_late_does_not_stop_what_was_reset_meanwhile() -> None:
    rig = ByteRig()
    holder, client = welcomed(rig, in_control=True), welcomed(rig)
    client.tell(*(SoftwareStop(number, "") for number in range(1, 101)))
    holder.tell(ResetStop(2))
    assert codes(holder.heard())[2] is V.ACCEPTED
    await client.until_handled()
    assert not is_stopped(rig)


async def test_what_comes_behind_the_stop_is_handled_behind_it() -> None:
    rig, client = talking(in_control=True)
    client.tell(ResetStop(2), SoftwareStop(3, ""), ResetStop(4))
    got = codes(client.heard())
    assert got == {3: V.ACCEPTED, 2: V.OVERTAKEN_BY_STOP, 4: V.ACCEPTED}
    assert not is_stopped(rig)


async def test_hello_and_stop_in_one_read_are_a_hello_and_a_stop() -> None:
    rig = ByteRig()
    client = rig.client()
    client.tell(hello(), Authority(1, AuthorityAction.REQUEST), SoftwareStop(2, "now"))
    assert is_stopped(rig)
    got = client.heard()
    assert isinstance(got[0], HelloReply)
    assert list(codes(got).items()) == [(2, V.ACCEPTED), (1, V.OVERTAKEN_BY_STOP)]


async def test_without_a_hello_a_stop_is_refused_like_anything_else() -> None:
    rig = ByteRig()
    client = rig.client()
    client.tell(ResetStop(1), SoftwareStop(2, "now"), SoftwareStop(3, ""))
    assert not is_stopped(rig)
    assert codes(client.heard()) == dict.fromkeys((1, 2, 3), V.HELLO_FIRST)


@pytest.mark.parametrize("order", ByteOrder)
@pytest.mark.parametrize("body", [b"", b"\1\0\0\0", b"\1\0\0\0\xff", b"\1\0\0\0" + b"\xff" * 64])
async def test_a_pendants_stop_that_is_too_short_or_whose_reason_is_no_text_stops(
    order: ByteOrder, body: bytes
) -> None:
    rig = ByteRig()
    client = rig.client(order=order)
    client.tell(hello())
    client.heard()
    header = (12 + len(body), SoftwareStop.PLACE.msg_type, REQUEST, 0)
    client.say(struct.pack(f"{order.value}4i", *header) + body)
    assert is_stopped(rig)
    assert list(codes(client.heard()).values()) == [V.ACCEPTED]


# Whatever becomes of the connection.


def ten_unknown(client: ByteClient) -> bytes:
    return struct.pack("<4i", 12, 64_000, REQUEST, 0) * 10


def no_frame(client: ByteClient) -> bytes:
    return bytes(4)


@pytest.mark.parametrize("cut", [ten_unknown, no_frame])
async def test_a_stop_acts_where_the_read_that_brings_it_ends_the_connection(
    cut: Callable[[ByteClient], bytes],
) -> None:
    rig, client = talking()
    stop = client.frames(SoftwareStop(2, "now"))
    client.say(cut(client) + stop if cut is ten_unknown else stop + cut(client))
    assert client.transport.is_over
    assert is_stopped(rig)


async def test_behind_bytes_that_are_no_frame_there_is_no_stop() -> None:
    rig, client = talking()
    client.say(
        client.frames(Ping(comm_type=REQUEST))
        + no_frame(client)
        + client.frames(SoftwareStop(2, ""))
    )
    assert client.transport.is_over
    assert not is_stopped(rig)


async def test_a_stop_that_is_read_after_the_end_was_decided_acts() -> None:
    rig, client = talking()
    client.shell.close("for a test")
    frames = client.frames(ResetStop(2), SoftwareStop(3, "now"))
    client.shell.data_received(frames[:-1])
    assert not is_stopped(rig)
    client.shell.data_received(frames[-1:])
    assert is_stopped(rig)


async def test_nothing_else_that_is_read_then_is_handled() -> None:
    rig, client = talking()
    client.shell.close("for a test")
    client.shell.data_received(client.frames(Authority(2, AuthorityAction.REQUEST)))
    assert rig.core.cell.authority.holder is None


async def test_others_are_handled_between_the_parts_of_a_backlog() -> None:
    rig = ByteRig()
    client, other = welcomed(rig), welcomed(rig)
    client.tell(*(told(number, op="why") for number in range(1, 101)))
    handled = []
    while client.shell.wire.more:
        other.tell(Ping(comm_type=REQUEST))
        assert isinstance(other.heard()[0], Ping)
        handled.append(len(client.heard()))
        await asyncio.sleep(0)
    assert max(handled) <= REQUESTS_PER_TURN


# ROS-Industrial.


def point(sequence: int, comm_type: int = REQUEST) -> JointTrajPt:
    return JointTrajPt(sequence, JOINTS, 0.1, 0.5, comm_type=comm_type)


ROS_STOPS: dict[str, Callable[[], Message]] = {
    "point": lambda: point(-4),
    "full point": lambda: JointTrajPtFull(
        0, -4, 0, 0.0, NOTHING, NOTHING, NOTHING, comm_type=REQUEST
    ),
    "trajectory": lambda: JointTraj((TrajPoint(-4, NOTHING, 0.0, 0.0),), comm_type=REQUEST),
}


async def acts_at_once_and_in_its_place(
    kind: str, port: Port, order: ByteOrder, count: int
) -> None:
    rig = ByteRig(ros_i={"byte_order": order.name.lower()})
    client = rig.client(port, order)
    client.heard()
    stops = len(rig.stops)
    stream = client.frames(
        *(point(number) for number in range(count)),
        Ping(comm_type=REQUEST),
        ROS_STOPS[kind](),
        Ping(comm_type=REQUEST),
    )
    client.say(stream)
    assert len(rig.stops) == stops + 1
    assert rig.stops[-1] == rig.now
    await client.until_handled()
    replies = [each for each in client.heard() if isinstance(each, HeaderOnly | Ping)]
    # Of what comes in two reads, the first is handled in part before the second brings the STOP.
    handled = 64 if len(stream) > READ else 0
    points = [(MsgType.JOINT_TRAJ_PT, ReplyCode.SUCCESS)] * handled
    points += [(MsgType.JOINT_TRAJ_PT, ReplyCode.FAILURE)] * (count - handled)
    ping, taken = (MsgType.PING, ReplyCode.SUCCESS), ReplyCode.SUCCESS
    stop = ROS_STOPS[kind]().PLACE.msg_type
    assert [
        (each.msg_type if isinstance(each, HeaderOnly) else MsgType.PING, each.reply_code)
        for each in replies
    ] == [*points, ping, (stop, taken), ping]
    rig.wait(500)
    assert not any(isinstance(item, Ask | SendToController) for _, item in rig.log)
    if count:
        assert rig.core.ros.refused is V.OVERTAKEN_BY_STOP


@pytest.mark.parametrize("order", ByteOrder)
@pytest.mark.parametrize("kind", ROS_STOPS)
@pytest.mark.parametrize(
    ("port", "count"),
    [(Port.ROS_MOTION, 0), (Port.ROS_MOTION, 1_000), (Port.ROS_STATE, 0), (Port.ROS_STATE, 100)],
)
async def test_a_ros_stop_acts_at_once_and_is_answered_in_its_place(
    kind: str, port: Port, order: ByteOrder, count: int
) -> None:
    await acts_at_once_and_in_its_place(kind, port, order, count)


async def test_a_ros_stop_acts_at_once_behind_as_many_points_as_are_read_ahead() -> None:
    count = figure(19, "own").count
    await acts_at_once_and_in_its_place("point", Port.ROS_MOTION, ByteOrder.LITTLE, count)


@pytest.mark.parametrize("order", ByteOrder)
@pytest.mark.parametrize(
    "numbers", [(MsgType.JOINT_TRAJ_PT, -4), (MsgType.JOINT_TRAJ_PT_FULL, 0, -4)]
)
async def test_a_ros_stop_that_ends_behind_its_sequence_stops_and_is_refused_as_a_frame(
    order: ByteOrder, numbers: tuple[int, ...]
) -> None:
    rig = ByteRig()
    client = rig.client(Port.ROS_MOTION, order)
    msg_type, *body = numbers
    header = (12 + 4 * len(body), msg_type, REQUEST, 0)
    before = len(rig.stops)
    client.say(struct.pack(f"{order.value}{4 + len(body)}i", *header, *body))
    assert len(rig.stops) == before + 1
    assert client.heard() == [HeaderOnly(msg_type, reply_code=ReplyCode.FAILURE)]


async def test_points_behind_a_ros_stop_begin_a_fresh_trajectory() -> None:
    rig = ByteRig()
    client = rig.client(Port.ROS_MOTION)
    client.tell(point(0), point(-4), point(0), point(1), point(-3))
    replies = [each.reply_code for each in client.heard()]
    assert replies == [ReplyCode.FAILURE, *[ReplyCode.SUCCESS] * 4]
    assert any(isinstance(item, Ask) for _, item in rig.log)


async def test_topics_in_front_of_a_ros_stop_are_dropped_and_not_answered() -> None:
    rig = ByteRig()
    client = rig.client(Port.ROS_MOTION)
    client.tell(point(0, TOPIC), point(-4, TOPIC))
    assert client.heard() == []
    rig.wait(500)
    assert not any(isinstance(item, Ask) for _, item in rig.log)


# All together: any requests, in any portions.

_CHOICES: tuple[Callable[[int], Message], ...] = (
    lambda number: ResetStop(number),
    lambda number: JointMove(number, 0.5, 2, JOINTS),
    lambda number: Authority(number, AuthorityAction.REQUEST),
    lambda number: Authority(number, AuthorityAction.RELEASE),
    lambda number: JogStart(number, number, 1, 0.15, JogSpace.JOINTS, "", 2, RATES),
    lambda number: JogRelease(number, number),
    lambda number: SetSpeed(number, 0.5, 0.0),
    lambda number: SetMode(number, OperatingMode.AUTOMATIC),
    lambda number: Home(number, 0.5, "home"),
    lambda number: MotionControl(number, MotionControlAction.RESUME),
    lambda number: Subscribe(number, 0.0),
    lambda number: told(number, op="why"),
    lambda number: told(number, op="signals.set", name="out", value=True),
    lambda number: told(number, op="tools.select", name="flange"),
    lambda number: SoftwareStop(number, ""),
)


@settings(max_examples=examples(20, in_soak=5_000))
@given(
    st.lists(st.sampled_from(_CHOICES), max_size=60),
    st.integers(0, 60),
    st.lists(st.integers(1, 2_000), min_size=1, max_size=10),
    st.sampled_from(ByteOrder),
)
async def test_promise_19_each_request_is_answered_once_and_none_moves_after_the_stop(
    chosen: list[Callable[[int], Message]], behind: int, sizes: list[int], order: ByteOrder
) -> None:
    rig = ByteRig()
    client = rig.client(order=order)
    client.tell(hello(), Authority(1, AuthorityAction.REQUEST))
    client.heard()
    wanted = [*chosen[:behind], _CHOICES[-1]]
    stream = client.frames(*(make(number) for number, make in enumerate(wanted, 2)))
    at = turn = 0
    while at < len(stream):
        size = sizes[turn % len(sizes)]
        client.say(stream[at : at + size])
        at, turn = at + size, turn + 1
        if size % 2:
            await asyncio.sleep(0)
    assert is_stopped(rig)
    since = await handled(rig, client)
    assert not any(isinstance(item, SendToController | Ask) for item in since)
    assert is_stopped(rig)
    assert answers(client.heard()) == Counter(range(2, len(wanted) + 2))
