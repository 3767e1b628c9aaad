import struct

import pytest
from promises.promise_table import figure
from rigs.data.message_samples import SAMPLES

from openpendant.simplemsg import (
    STANDARD,
    BodyFault,
    ByteOrder,
    CommType,
    Connection,
    GetVersion,
    HeaderFault,
    HeaderOnly,
    JointPosition,
    JointTrajPt,
    LengthOutOfBounds,
    LocalProtocolError,
    Malformed,
    NotEncodable,
    Opaque,
    OrderUndetectable,
    Ping,
    ReplyCode,
    Role,
    Unasked,
    accepted,
    codec_for,
    joint_array,
    refused,
)

PING = codec_for().encode(Ping())
PONG = Ping(comm_type=CommType.REPLY, reply_code=ReplyCode.SUCCESS)
POSITION = SAMPLES[JointPosition]
POSITION_FRAME = codec_for().encode(POSITION)


def _server(max_frame: int = 1023) -> Connection:
    return Connection(Role.SERVER, STANDARD, ByteOrder.LITTLE, max_frame=max_frame)


@pytest.fixture
def connection() -> Connection:
    return _server()


def _client() -> Connection:
    return Connection(Role.CLIENT, STANDARD, ByteOrder.LITTLE)


def _frame(length: int, msg_type: int = 999) -> bytes:
    return struct.pack("<4i", length, msg_type, 1, 0) + bytes(length - 12)


def test_a_client_must_know_the_byte_order() -> None:
    with pytest.raises(ValueError, match="a client must know the byte order"):
        Connection(Role.CLIENT)


@pytest.mark.parametrize("max_frame", [15, 65_540])
def test_a_bound_without_room_or_beyond_detection_is_refused(max_frame: int) -> None:
    with pytest.raises(ValueError, match=f"16 to 65539, not {max_frame}"):
        Connection(Role.SERVER, max_frame=max_frame)


@pytest.mark.parametrize("byte_order", ByteOrder)
def test_a_server_learns_the_byte_order_from_the_first_frame(byte_order: ByteOrder) -> None:
    connection = Connection(Role.SERVER)
    assert connection.receive(codec_for(byte_order=byte_order).encode(Ping())) == [Ping()]
    assert connection.byte_order is byte_order
    reply = connection.send(accepted(Ping()))
    assert codec_for(byte_order=byte_order).decode(reply) == PONG


@pytest.mark.parametrize("length", [12, 13, 255, 256, 3_072, 65_535])
@pytest.mark.parametrize("byte_order", ByteOrder)
def test_every_length_of_two_bytes_tells_the_byte_order(byte_order: ByteOrder, length: int) -> None:
    connection = Connection(Role.SERVER, max_frame=65_539)
    connection.receive(struct.pack(f"{byte_order.value}i", length))
    assert connection.byte_order is byte_order
    assert connection.fault is None


@pytest.mark.parametrize(
    "prefix", [bytes(4), b"\xff\xff\xff\xff", b"\x05\0\0\0", b"\0\0\0\x0b", b"\0\1\1\0", b"GET "]
)
def test_a_first_prefix_that_is_no_length_either_way_is_a_fault(prefix: bytes) -> None:
    connection = Connection(Role.SERVER)
    assert connection.receive(prefix) == []
    assert isinstance(connection.fault, OrderUndetectable)
    assert connection.fault.prefix == prefix


def test_a_server_that_knows_no_byte_order_yet_cannot_speak() -> None:
    connection = Connection(Role.SERVER)
    assert connection.byte_order is None
    with pytest.raises(LocalProtocolError, match="byte order is not known"):
        connection.send(POSITION)


def test_a_server_may_be_told_the_byte_order_of_the_peers_other_link() -> None:
    connection = Connection(Role.SERVER)
    connection.settle_byte_order(ByteOrder.BIG)
    assert connection.send(POSITION) == codec_for(byte_order=ByteOrder.BIG).encode(POSITION)


@pytest.mark.parametrize("length", [-(2**31), -1, 0, 11, 1020, 65_536, 2**31 - 1])
def test_a_length_out_of_bounds_is_a_fault_with_the_bounds(length: int) -> None:
    connection = _server()
    connection.receive(struct.pack("<i", length))
    fault = connection.fault
    assert isinstance(fault, LengthOutOfBounds)
    assert (fault.length, fault.lower, fault.upper) == (length, 12, 1019)


@pytest.mark.parametrize("length", [12, 1019])
def test_a_length_at_the_bounds_is_taken(length: int) -> None:
    (message,) = _server().receive(_frame(length))
    assert message == Opaque(999, bytes(length - 12), comm_type=CommType.TOPIC)


def test_a_fault_is_final_and_keeps_what_was_complete_before_it(connection: Connection) -> None:
    assert connection.receive(PING + bytes(4) + PING) == [Ping()]
    fault = connection.fault
    assert fault is not None
    assert connection.receive(PING) == []
    assert connection.fault is fault
    assert not connection.partial
    assert not connection.more


def test_partial_is_true_only_while_a_frame_is_begun(connection: Connection) -> None:
    assert not connection.partial
    for at in range(15):
        assert connection.receive(PING[at : at + 1]) == []
        assert connection.partial
    assert connection.receive(PING[15:]) == [Ping()]
    assert not connection.partial


def test_promise_9_one_call_decodes_64_frames_and_says_that_there_are_more() -> None:
    connection = _server()
    counts = [len(connection.receive(POSITION_FRAME * 150 + POSITION_FRAME[:9]))]
    while connection.more:
        assert not connection.partial
        counts.append(len(connection.receive(b"")))
    most = figure(9, "frames").count
    assert counts == [most, most, 150 - 2 * most]
    assert connection.partial


@pytest.mark.parametrize(
    ("frames", "per_call", "counts"), [(64, 64, [64]), (65, 64, [64, 1]), (40, 16, [16, 16, 8])]
)
def test_all_frames_come_call_after_call(frames: int, per_call: int, counts: list[int]) -> None:
    connection = Connection(Role.SERVER, frames_per_call=per_call)
    taken = [len(connection.receive(PING * frames))]
    while connection.more:
        taken.append(len(connection.receive(b"")))
    assert taken == counts
    assert not connection.partial


def test_bytes_that_come_while_there_are_more_are_kept_in_order(connection: Connection) -> None:
    frames = [codec_for().encode(JointPosition(i, joint_array([]))) for i in range(200)]
    received = connection.receive(b"".join(frames[:150]))
    received += connection.receive(b"".join(frames[150:]))
    while connection.more:
        received += connection.receive(b"")
    assert received == [JointPosition(i, joint_array([])) for i in range(200)]


@pytest.mark.parametrize("kind", [bytes, bytearray, memoryview])
def test_any_bytes_like_object_is_received(kind: type, connection: Connection) -> None:
    assert connection.receive(kind(POSITION_FRAME[:20])) == []
    assert connection.receive(kind(POSITION_FRAME[20:] + PING)) == [POSITION, Ping()]


def test_a_buffer_that_the_caller_reuses_does_not_change_what_was_received() -> None:
    connection, buffer = _server(), bytearray(_frame(20))
    (message,) = connection.receive(buffer)
    buffer[:] = bytes(len(buffer))
    assert message == Opaque(999, bytes(8), comm_type=CommType.TOPIC)


def test_a_request_may_be_answered_once(connection: Connection) -> None:
    connection.receive(PING)
    assert connection.unanswered == 1
    connection.send(accepted(Ping()))
    assert connection.unanswered == 0
    with pytest.raises(LocalProtocolError, match="type 1 answers no request"):
        connection.send(refused(Ping()))


def test_a_topic_is_never_answered(connection: Connection) -> None:
    connection.receive(POSITION_FRAME)
    with pytest.raises(LocalProtocolError, match="type 10 answers no request"):
        connection.send(accepted(POSITION))


def test_a_reply_that_cannot_be_encoded_leaves_the_request_open(connection: Connection) -> None:
    connection.receive(PING)
    with pytest.raises(LocalProtocolError):
        connection.send(HeaderOnly(1, reply_code=ReplyCode.UNUSED))
    assert connection.unanswered == 1


def test_a_reply_to_our_request_is_taken_and_a_second_one_is_unasked() -> None:
    client = _client()
    client.send(Ping())
    assert client.awaited == 1
    assert client.receive(codec_for().encode(PONG) * 2) == [PONG, Unasked(PONG)]
    assert client.awaited == 0


def test_a_malformed_reply_settles_its_request() -> None:
    client = _client()
    client.send(Ping())
    (malformed,) = client.receive(struct.pack("<4i", 12, 1, 3, 0))
    assert isinstance(malformed, Malformed)
    assert client.awaited == 0
    assert client.receive(codec_for().encode(PONG)) == [Unasked(PONG)]


def test_a_malformed_request_keeps_the_link_and_may_be_answered(connection: Connection) -> None:
    received = connection.receive(struct.pack("<5i", 16, 11, 2, 0, 7) + PING)
    (malformed, ping) = received
    assert isinstance(malformed, Malformed)
    assert (malformed.msg_type, malformed.comm_type) == (11, CommType.REQUEST)
    assert isinstance(malformed.error, BodyFault)
    assert str(malformed.error) == "joint_traj_pt: the body has 4 bytes, not 52"
    assert ping == Ping()
    assert connection.unanswered == 2
    reply = HeaderOnly(malformed.msg_type, reply_code=ReplyCode.FAILURE)
    assert connection.send(reply) == struct.pack("<4i", 12, 11, 3, 2)
    assert connection.fault is None


@pytest.mark.parametrize("header", [(0, 1, 0), (10, 0, 0), (10, 1, 1), (10, 3, 0), (10, 4, 2)])
def test_a_header_that_breaks_a_rule_is_malformed_with_its_numbers(
    header: tuple[int, ...],
) -> None:
    (malformed,) = _server().receive(struct.pack("<4i", 12, *header))
    assert isinstance(malformed, Malformed)
    error = malformed.error
    assert isinstance(error, HeaderFault)
    assert (error.msg_type, error.comm_type, error.reply_code) == header


def test_a_frame_beyond_the_bound_of_the_conversation_is_not_sent() -> None:
    connection = _server(max_frame=100)
    message = Opaque(999, bytes(85), comm_type=CommType.TOPIC)
    with pytest.raises(LocalProtocolError, match="101 bytes exceeds the 100"):
        connection.send(message)
    message.body = bytes(84)
    assert len(connection.send(message)) == 100


def test_a_topic_and_a_request_that_was_not_sent_await_no_reply() -> None:
    client = _client()
    client.send(POSITION)
    with pytest.raises(NotEncodable):
        client.send(JointTrajPt(2**31, joint_array([]), 0.0, 0.0))
    with pytest.raises(LocalProtocolError):
        client.send(Opaque(999, bytes(1100)))
    assert client.awaited == 0


def test_a_version_request_is_answered_by_its_own_layout() -> None:
    client, server = _client(), _server()
    (request,) = server.receive(client.send(GetVersion()))
    assert isinstance(request, GetVersion)
    assert client.receive(server.send(accepted(request))) == [accepted(request)]
