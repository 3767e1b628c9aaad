"""STOP first: which bytes are a STOP, where the walk ends, and what it leaves to those in front."""

import gc
import struct
from itertools import accumulate, pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from openpendant.simplemsg import (
    PENDANT,
    PENDANT_STOPS,
    ROS_STOPS,
    STANDARD,
    Arrival,
    ByteOrder,
    CommType,
    Connection,
    Dialect,
    JointTraj,
    JointTrajPt,
    JointTrajPtFull,
    LengthOutOfBounds,
    Message,
    MsgType,
    Opaque,
    Overtaken,
    Ping,
    Role,
    StopRule,
    TrajPoint,
    WaitingStop,
    accepted,
    codec_for,
    joint_array,
)
from openpendant.simplemsg.pendant import (
    PROTOCOL_VERSION,
    AuthorityBeat,
    Hello,
    ResetStop,
    SoftwareStop,
    Verdict,
)
from openpendant.simplemsg.stop_walk import MOST_FOUND, MOST_WALKED

REQUEST, TOPIC, REPLY = CommType.REQUEST, CommType.TOPIC, CommType.REPLY
NOTHING = joint_array([])
STOP_TYPE = SoftwareStop.PLACE.msg_type
ORDERS = tuple(ByteOrder)
PING_ASKED = Ping(comm_type=REQUEST)


def served(
    dialect: Dialect, rule: StopRule, frames_per_call: int = 64, max_frame: int = 65_532
) -> Connection:
    return Connection(
        Role.SERVER, dialect, max_frame=max_frame, frames_per_call=frames_per_call, stop_rule=rule
    )


def point(sequence: int, comm_type: int = REQUEST) -> JointTrajPt:
    return JointTrajPt(sequence, joint_array([0.5]), 0.125, 0.5, comm_type=comm_type)


def full_point(sequence: int) -> JointTrajPtFull:
    return JointTrajPtFull(0, sequence, 7, 0.5, NOTHING, NOTHING, NOTHING, comm_type=REQUEST)


def bare(order: ByteOrder, msg_type: int, body: bytes, comm: int = REQUEST, code: int = 0) -> bytes:
    return struct.pack(f"{order.value}4i", 12 + len(body), msg_type, comm, code) + body


def numbers(order: ByteOrder, *values: int) -> bytes:
    return struct.pack(f"{order.value}{len(values)}i", *values)


PING = {order: codec_for(STANDARD, order).encode(Ping(comm_type=REQUEST)) for order in ORDERS}


def found(wire: Connection, data: bytes) -> list[Message]:
    wire.read_ahead(data)
    return [stop.message for stop in wire.stops]


def marked(wire: Connection, *messages: Message) -> list[Arrival]:
    """Return what comes of messages that arrive at a pendant's port together."""
    return wire.marked(wire.receive(b"".join(map(codec_for(PENDANT).encode, messages))))


def ros(order: ByteOrder, message: Message) -> bytes:
    return codec_for(STANDARD, order).encode(message)


def trajectory(*sequences: int) -> JointTraj:
    points = tuple(TrajPoint(each, NOTHING, 0.1, 0.0) for each in sequences)
    return JointTraj(points, comm_type=REQUEST)


POINT, FULL_POINT = MsgType.JOINT_TRAJ_PT, MsgType.JOINT_TRAJ_PT_FULL


ROS_FRAMES = {
    "a point": lambda o: ros(o, point(-4)),
    "a point as topic": lambda o: ros(o, point(-4, TOPIC)),
    "a full point": lambda o: ros(o, full_point(-4)),
    "a trajectory with it": lambda o: ros(o, trajectory(0, -4)),
    "a point that ends behind its sequence": lambda o: bare(o, POINT, numbers(o, -4)),
    "a full point that ends there": lambda o: bare(o, FULL_POINT, numbers(o, 0, -4)),
    "a point of eight-byte reals": lambda o: bare(o, POINT, numbers(o, -4) + bytes(96)),
    "a point with a reply code": lambda o: bare(o, POINT, numbers(o, -4) + bytes(48), code=1),
}

NO_ROS_STOPS = {
    "another sequence": lambda o: ros(o, point(-3)),
    "a reply": lambda o: bare(o, POINT, numbers(o, -4), REPLY, 1),
    "no kind of exchange": lambda o: bare(o, POINT, numbers(o, -4), 0),
    "a point without a sequence": lambda o: bare(o, POINT, b"\xfc\xff\xff"),
    "a full point without one": lambda o: bare(o, FULL_POINT, numbers(o, -4)),
    "a trajectory without it": lambda o: ros(o, trajectory(-3)),
    "a trajectory of a broken length": lambda o: bare(o, MsgType.JOINT_TRAJ, numbers(o, -4) * 2),
    "a STOP inside another frame": lambda o: bare(o, 999, bytes(8) + ros(o, point(-4))),
    "a STOP that is all of another frame's body": lambda o: bare(o, 999, ros(o, point(-4))),
    "a status that holds the number": lambda o: bare(o, MsgType.STATUS, numbers(o, -4)),
}

PENDANT_FRAMES = {
    "whole": lambda o: codec_for(PENDANT, o).encode(SoftwareStop(7, "enough")),
    "without a reason": lambda o: bare(o, STOP_TYPE, numbers(o, 7)),
    "with some of a reason": lambda o: bare(o, STOP_TYPE, numbers(o, 7) + b"eno"),
    "without a number": lambda o: bare(o, STOP_TYPE, b""),
    "with a reason that is no text": lambda o: bare(o, STOP_TYPE, numbers(o, 7) + b"\xff" * 64),
    "too long": lambda o: bare(o, STOP_TYPE, numbers(o, 7) + b"x" * 80),
    "as a topic": lambda o: bare(o, STOP_TYPE, numbers(o, 7), TOPIC),
}


@pytest.mark.parametrize("order", ORDERS)
@pytest.mark.parametrize("name", ROS_FRAMES)
def test_a_whole_frame_with_the_sequence_of_stop_is_one(name: str, order: ByteOrder) -> None:
    frame = ROS_FRAMES[name](order)
    (stop,) = found(served(STANDARD, ROS_STOPS), PING[order] + frame)
    assert stop.comm_type == struct.unpack_from(f"{order.value}i", frame, 8)[0]


@pytest.mark.parametrize("order", ORDERS)
@pytest.mark.parametrize("name", NO_ROS_STOPS)
def test_nothing_else_is_one(name: str, order: ByteOrder) -> None:
    assert found(served(STANDARD, ROS_STOPS), PING[order] + NO_ROS_STOPS[name](order) * 2) == []


@pytest.mark.parametrize("order", ORDERS)
@pytest.mark.parametrize("name", PENDANT_FRAMES)
def test_a_pendants_stop_is_known_by_its_type_alone(name: str, order: ByteOrder) -> None:
    (stop,) = found(served(PENDANT, PENDANT_STOPS), PING[order] + PENDANT_FRAMES[name](order))
    assert isinstance(stop, SoftwareStop)
    assert stop.request_id == (0 if name == "without a number" else 7)
    assert len(stop.reason) <= 64


def test_a_sequence_ends_with_its_frame() -> None:
    order = ByteOrder.LITTLE
    short = bare(order, POINT, b"\xfc\xff\xff")
    behind = bare(order, 999, bytes(243))  # its length begins with the byte that makes it a STOP
    assert (short + behind)[16:20] == numbers(order, -4)
    assert found(served(STANDARD, ROS_STOPS), PING[order] + short + behind) == []


@pytest.mark.parametrize("at", range(1, 24))
def test_a_frame_that_was_begun_is_none_until_its_last_byte(at: int) -> None:
    frame = bare(ByteOrder.LITTLE, POINT, numbers(ByteOrder.LITTLE, -4, 0))
    wire = served(STANDARD, ROS_STOPS)
    assert found(wire, PING[ByteOrder.LITTLE] + frame[:at]) == []
    for byte in frame[at:-1]:
        assert found(wire, bytes((byte,))) == []
    assert len(found(wire, frame[-1:])) == 1


@pytest.mark.parametrize("length", [0, 11, 1_020, -1])
def test_behind_a_length_that_cannot_be_one_nothing_is_looked_for(length: int) -> None:
    stop = codec_for().encode(point(-4))
    wire = served(STANDARD, ROS_STOPS, max_frame=1_023)
    behind = struct.pack("<4i", length, 999, 2, 0) + bytes(max(length - 12, 0))
    assert len(found(wire, stop + behind + stop)) == 1
    assert len(found(wire, stop)) == 1


def test_a_stop_in_front_of_a_fault_is_found_and_stands_in_its_place() -> None:
    wire = served(STANDARD, ROS_STOPS)
    received = wire.receive(codec_for().encode(point(0)) + codec_for().encode(point(-4)) + bytes(4))
    assert isinstance(wire.fault, LengthOutOfBounds)
    first, second = wire.marked(received)
    assert first == Overtaken(point(0))
    assert second == wire.stops[0]


def test_what_stands_in_front_of_a_stop_is_overtaken_and_nothing_behind_it() -> None:
    wire = served(PENDANT, PENDANT_STOPS)
    arrived = marked(wire, ResetStop(1), SoftwareStop(2, ""), AuthorityBeat(), ResetStop(3))
    assert arrived == [Overtaken(ResetStop(1)), wire.stops[0], AuthorityBeat(), ResetStop(3)]
    assert not wire.overtaking


def test_what_stands_between_two_stops_is_overtaken_by_the_second() -> None:
    wire = served(PENDANT, PENDANT_STOPS)
    arrived = marked(wire, SoftwareStop(1, ""), ResetStop(2), SoftwareStop(3, ""))
    assert arrived == [wire.stops[0], Overtaken(ResetStop(2)), wire.stops[1]]


def test_a_stop_stands_in_its_place_where_a_part_of_a_backlog_ends_in_front_of_it() -> None:
    wire = served(PENDANT, PENDANT_STOPS, frames_per_call=1)
    assert marked(wire, ResetStop(1), SoftwareStop(2, "")) == [Overtaken(ResetStop(1))]
    received = wire.receive(b"")
    assert wire.overtaking
    assert wire.marked(received) == [wire.stops[0]]


def test_a_hello_is_not_overtaken() -> None:
    wire, hello = served(PENDANT, PENDANT_STOPS), Hello(PROTOCOL_VERSION, 0.0, "", "x")
    arrived = marked(wire, hello, ResetStop(1), SoftwareStop(2, ""))
    assert arrived == [hello, Overtaken(ResetStop(1)), wire.stops[0]]


def test_a_stop_that_comes_alone_is_a_message_like_any_other() -> None:
    wire = served(PENDANT, PENDANT_STOPS)
    wire.settle_byte_order(ByteOrder.LITTLE)
    stop = SoftwareStop(2, "a")
    for _ in range(3):
        assert wire.receive(codec_for(PENDANT).encode(stop)) == [stop]
    assert not wire.stops
    assert not wire.overtaking


def test_a_whole_trajectory_that_is_a_stop_is_found_also_where_it_comes_alone() -> None:
    order = ByteOrder.LITTLE
    wire = served(STANDARD, ROS_STOPS)
    assert len(wire.receive(PING[order])) == 1
    wire.receive(ROS_FRAMES["a trajectory with it"](order))
    (stop,) = wire.stops
    assert isinstance(stop.message, JointTraj)


def test_a_stop_may_be_answered_before_its_turn_and_only_once() -> None:
    codec = codec_for(PENDANT)
    wire = served(PENDANT, PENDANT_STOPS, frames_per_call=1)
    assert wire.receive(codec.encode(AuthorityBeat()) * 3) == [AuthorityBeat()]
    wire.read_ahead(codec.encode(SoftwareStop(2, "")))
    assert wire.unanswered == 1
    wire.send(Verdict(2, 0, -1, 0.0, 0.0, ""))
    while wire.more:
        wire.receive(b"")
    assert wire.unanswered == 0


def test_a_backlog_is_taken_in_parts_at_the_same_cost_each() -> None:
    """A part copies no more of the backlog than it may need, however much waits."""
    wire = served(PENDANT, PENDANT_STOPS, frames_per_call=16)
    frame = codec_for(PENDANT).encode(SoftwareStop(2, "again"))
    # The first call only looks for STOPs, as far as one goes; then it goes on from call to call.
    count = len(wire.receive(frame * 6_000))
    copied = 0
    while wire.more:
        before = wire.waiting
        taken = len(wire.receive(b""))
        assert before - wire.waiting == taken * len(frame)
        count += taken
        copied += taken > 0
    assert (count, copied) == (6_000, 375)
    assert len(wire.stops) == 6_000


_MESSAGES: tuple[Message, ...] = (
    Ping(comm_type=REQUEST),
    point(3),
    point(-4),
    point(-4, TOPIC),
    full_point(-4),
    trajectory(-4),
    Opaque(999, b"\xfc\xff\xff\xff" * 5, comm_type=TOPIC),
    Opaque(MsgType.JOINT_TRAJ_PT, struct.pack("<i", -4), comm_type=REQUEST),
)


def _is_stop(message: Message) -> bool:
    match message:
        case JointTrajPt(sequence=-4) | JointTrajPtFull(sequence=-4) | JointTraj():
            return True
        case Opaque(msg_type=MsgType.JOINT_TRAJ_PT):
            return True
    return False


@given(
    st.lists(st.sampled_from(range(len(_MESSAGES))), max_size=30),
    st.sampled_from(ORDERS),
    st.lists(st.tuples(st.integers(0, 3_000), st.booleans()), max_size=12),
    st.integers(1, 20),
)
def test_however_bytes_come_each_stop_is_found_with_its_last_byte_and_marks_all_before_it(
    chosen: list[int], order: ByteOrder, cuts: list[tuple[int, bool]], frames_per_call: int
) -> None:
    codec = codec_for(STANDARD, order)
    messages = [_MESSAGES[number] for number in chosen]
    frames = [
        bare(order, POINT, numbers(order, -4)) if each is _MESSAGES[-1] else codec.encode(each)
        for each in messages
    ]
    stream = b"".join(frames)
    ends = list(zip(accumulate(map(len, frames)), map(_is_stop, messages), strict=True))
    wire = served(STANDARD, ROS_STOPS, frames_per_call)
    edges = sorted({0, len(stream), *(cut % (len(stream) + 1) for cut, _ in cuts)})
    handles = [handle for _, handle in cuts] or [True]
    arrivals: list[Arrival] = []

    def handle(data: bytes) -> None:
        received = wire.receive(data)
        arrivals.extend(wire.marked(received) if wire.overtaking else received)

    for number, (begin, end) in enumerate(pairwise(edges)):
        if wire.more:
            wire.read_ahead(stream[begin:end])
            if handles[number % len(handles)]:
                handle(b"")
        else:
            handle(stream[begin:end])
        # A usual frame that comes whole and alone is handled at once, and needs no walk.
        alone = sum(isinstance(each, Message) and _is_stop(each) for each in arrivals)
        assert len(wire.stops) + alone == sum(stop for at, stop in ends if at <= end)
    while wire.more:
        handle(b"")
    assert len(arrivals) == len(messages)
    assert wire.unanswered == sum(each.comm_type == REQUEST for each in messages)
    for place, (arrival, message) in enumerate(zip(arrivals, messages, strict=True)):
        if isinstance(arrival, WaitingStop):
            assert _is_stop(message)
        elif isinstance(arrival, Overtaken):
            assert any(map(_is_stop, messages[place + 1 :]))
    for _ in range(wire.unanswered):
        wire.send(accepted(Ping()))


# Which have acted, and what is kept of them.


def waiting(*messages: Message, in_front: Message = PING_ASKED) -> Connection:
    """Return a pendant's conversation of which a message was handled, and others wait."""
    wire = served(PENDANT, PENDANT_STOPS, frames_per_call=1)
    codec = codec_for(PENDANT)
    assert wire.receive(codec.encode(in_front) * 2) == [in_front]
    wire.read_ahead(b"".join(map(codec.encode, messages)))
    return wire


def handed_on(wire: Connection, count: int = 100) -> list[WaitingStop]:
    """Return the STOPs among so many messages that come next."""
    stops: list[WaitingStop] = []
    while count and wire.more:
        count -= 1
        received = wire.receive(b"")
        got = wire.marked(received) if wire.overtaking else received
        stops += [each for each in got if isinstance(each, WaitingStop)]
    return stops


def test_the_first_that_has_not_acted_is_to_act_until_all_have() -> None:
    wire = waiting(SoftwareStop(1, "one"), ResetStop(2), SoftwareStop(3, "three"))
    assert wire.stop_to_act() == SoftwareStop(1, "one")
    wire.stops_have_acted(is_answered=True)
    assert wire.stop_to_act() is None
    assert [(stop.acted, stop.answered) for stop in handed_on(wire)] == [
        (True, True),
        (True, False),
    ]


def test_one_that_comes_later_acts_for_itself() -> None:
    wire = waiting(SoftwareStop(1, "one"), SoftwareStop(2, "two"))
    wire.stops_have_acted(is_answered=True)
    wire.read_ahead(codec_for(PENDANT).encode(SoftwareStop(3, "three")))
    assert wire.stop_to_act() == SoftwareStop(3, "three")
    (first, *_) = handed_on(wire, 2)
    assert first == WaitingStop(SoftwareStop(1, "one"), 2)
    assert wire.stop_to_act() == SoftwareStop(3, "three")
    wire.stops_have_acted(is_answered=True)
    stops = handed_on(wire)
    assert [stop.message for stop in stops] == [SoftwareStop(2, "two"), SoftwareStop(3, "three")]
    assert [(stop.acted, stop.answered) for stop in stops] == [(True, False), (True, True)]


def test_one_whose_place_came_before_it_could_act_acts_no_more_and_the_next_does() -> None:
    wire = waiting(SoftwareStop(1, "one"), SoftwareStop(2, "two"))
    (first,) = handed_on(wire, 2)
    assert (first.message, first.acted, first.answered) == (SoftwareStop(1, "one"), False, False)
    assert wire.stop_to_act() == SoftwareStop(2, "two")
    wire.stops_have_acted(is_answered=False)
    (second,) = handed_on(wire)
    assert (second.message, second.acted, second.answered) == (SoftwareStop(2, "two"), True, False)


def test_one_that_is_found_as_it_is_decoded_acts_before_it_is_handed_on() -> None:
    wire = served(PENDANT, PENDANT_STOPS, frames_per_call=1)
    frame = codec_for(PENDANT).encode(SoftwareStop(1, "one"))
    received = wire.receive(frame + frame[:-1])
    assert wire.stop_to_act() == SoftwareStop(1, "one")
    wire.stops_have_acted(is_answered=True)
    (stop,) = wire.marked(received)
    assert isinstance(stop, WaitingStop)
    assert (stop.acted, stop.answered) == (True, True)


@pytest.mark.parametrize("name", PENDANT_FRAMES)
def test_what_a_stop_says_is_known_in_its_place_as_when_it_was_found(name: str) -> None:
    order = ByteOrder.LITTLE
    wire = waiting(Opaque(999, bytes(77), comm_type=TOPIC))
    wire.read_ahead(PENDANT_FRAMES[name](order) * 2)
    found = [stop.message for stop in wire.stops]
    stops = handed_on(wire)
    assert [stop.message for stop in stops] == found
    assert {stop.is_sound for stop in stops} == {name == "whole"}


def test_thousands_that_wait_are_no_objects() -> None:
    """The garbage collector walks over every object again and again."""
    wire = waiting(in_front=AuthorityBeat())
    for number in range(4_000):
        wire.read_ahead(bare(ByteOrder.LITTLE, STOP_TYPE, numbers(ByteOrder.LITTLE, number)))
        wire.stops.clear()
        wire.stops_have_acted(is_answered=bool(number % 2))
    gc.collect()
    kept = [each for each in gc.get_objects() if isinstance(each, WaitingStop | SoftwareStop)]
    assert len(kept) < 50
    stops = handed_on(wire, 4_001)
    assert [stop.message for stop in stops] == [SoftwareStop(at, "") for at in range(4_000)]
    assert [stop.answered for stop in stops] == [False, True] * 2_000


def test_a_broken_frame_leaves_nothing_to_the_garbage_collector() -> None:
    wire = waiting()
    wire.read_ahead(bare(ByteOrder.LITTLE, STOP_TYPE, b"") * 9)
    gc.collect()
    gc.disable()
    try:
        assert len(handed_on(wire)) == 9
        assert gc.collect() == 0
    finally:
        gc.enable()


def headers(count: int) -> bytes:
    """Return requests that are nothing but a header."""
    return bare(ByteOrder.LITTLE, 99, b"") * count


def test_a_call_walks_over_so_many_frames_and_decodes_none_before_all_were_walked_over() -> None:
    wire = served(PENDANT, PENDANT_STOPS, frames_per_call=1)
    stop = codec_for(PENDANT, ByteOrder.LITTLE).encode(SoftwareStop(2, "now"))
    assert wire.receive(headers(MOST_WALKED) + stop) == []
    assert (wire.stops, wire.more, wire.is_searching) == ([], True, True)
    (first,) = wire.receive(b"")
    assert [each.message for each in wire.stops] == [SoftwareStop(2, "now")]
    assert not wire.is_searching
    assert isinstance(wire.marked([first])[0], Overtaken)


def test_a_call_finds_so_many_stops_and_the_next_goes_on() -> None:
    wire = served(PENDANT, PENDANT_STOPS, frames_per_call=1)
    stop = codec_for(PENDANT, ByteOrder.LITTLE).encode(SoftwareStop(2, "now"))
    assert wire.receive(stop * (MOST_FOUND + 1)) == []
    assert (len(wire.stops), wire.is_searching) == (MOST_FOUND, True)
    assert len(wire.receive(b"")) == 1
    assert (len(wire.stops), wire.is_searching) == (MOST_FOUND + 1, False)


def test_frames_one_by_one_are_those_of_one_call() -> None:
    frames = headers(20) + codec_for(PENDANT, ByteOrder.LITTLE).encode(SoftwareStop(2, "now"))
    cut = frames + headers(1)[:-1]
    at_once, one_by_one = (served(PENDANT, PENDANT_STOPS, count) for count in (64, 1))
    expected = at_once.marked(at_once.receive(cut))
    got = one_by_one.marked(one_by_one.receive(cut))
    while one_by_one.more and (received := one_by_one.receive_next()):
        got += one_by_one.marked(received)
    assert [type(each) for each in got] == [type(each) for each in expected]
    assert (one_by_one.more, one_by_one.partial) == (at_once.more, at_once.partial)
    assert one_by_one.waiting == at_once.waiting == 15


def test_what_one_call_looked_at_ends_before_what_it_did_not() -> None:
    wire = served(PENDANT, PENDANT_STOPS, frames_per_call=1)
    wire.receive(headers(1))
    wire.read_ahead(headers(2_000))
    taken = len(wire.receive(b""))
    while received := wire.receive_next():
        taken += len(received)
    assert taken == 1_024
    assert wire.more
