from collections.abc import Callable

import pytest
from promises.promise_table import figure
from rigs.cells.expectations import only
from rigs.cells.ros_situations import (
    PATH,
    TOPIC,
    collecting,
    down,
    e_stopped,
    idle,
    jobs,
    latched,
    manual,
    moving,
    planning,
    status_of,
    unknown_mode,
)
from rigs.cells.server_rig import FAILURE, MS, SUCCESS, ServerRig, ready

from openpendant.server.events.events import Port
from openpendant.server.refusal import Refusal
from openpendant.simplemsg import (
    CommType,
    GetVersion,
    GetVersionReply,
    HeaderOnly,
    JointPosition,
    JointTraj,
    JointTrajPt,
    Malformed,
    Message,
    Opaque,
    Ping,
    Received,
    ReplyCode,
    Status,
    TrajPoint,
    TriState,
    joint_array,
)
from openpendant.simplemsg.errors import BodyFault
from openpendant.simplemsg.pendant import Activity, AuthorityChanged, AuthorityReason
from openpendant.simplemsg.verdicts import STATUS_ERROR_OFFSET
from openpendant.simplemsg.verdicts import VerdictCode as V

FAULTS, WINDOW = figure(7, "faults").count, round(figure(7, "window").ms)


@pytest.mark.parametrize("port", [Port.ROS_MOTION, Port.ROS_STATE])
@pytest.mark.parametrize(
    ("request_", "kind", "code"),
    [
        (Ping(), Ping, SUCCESS),
        (GetVersion(), GetVersionReply, SUCCESS),
        (Status(0, 0, 0, 0, 0, 0, 0, comm_type=CommType.REQUEST), Status, SUCCESS),
        (JointPosition(0, joint_array(()), comm_type=CommType.REQUEST), HeaderOnly, FAILURE),
        (Opaque(4711, b"xx"), HeaderOnly, FAILURE),
    ],
)
def test_every_request_is_answered_once(
    port: Port, request_: Message, kind: type[Message], code: ReplyCode
) -> None:
    client = ready().ros(port=port)
    reply = only(kind, client.send(request_))
    assert (reply.comm_type, reply.reply_code) == (CommType.REPLY, code)


@pytest.mark.parametrize(
    "topic",
    [
        Opaque(4711, b"", comm_type=TOPIC),
        Status(0, 0, 0, 0, 0, 0, 0),
        Malformed(11, 1, BodyFault("short", 11, 1, 0)),
        JointTrajPt(0, joint_array(()), 0.0, 0.0, comm_type=TOPIC),
        JointTrajPt(9, joint_array(()), 0.0, 0.0, comm_type=TOPIC),
        JointTraj((TrajPoint(0, joint_array((9.0,)), 0.0, 0.0),), comm_type=TOPIC),
    ],
)
def test_no_topic_is_ever_answered(topic: Received) -> None:
    assert ready().ros().send(topic) == []


def test_a_malformed_request_is_answered_and_discards_the_points() -> None:
    rig, client = collecting()
    (reply,) = client.send(Malformed(11, 2, BodyFault("short", 11, 2, 0)))
    assert reply == HeaderOnly(11, reply_code=FAILURE)
    rig.wait(500)
    assert jobs(rig) == []


@pytest.mark.parametrize("port", [Port.ROS_MOTION, Port.ROS_STATE])
def test_status_may_be_asked_for_with_any_body(port: Port) -> None:
    rig = ready()
    error = BodyFault("too short", 13, CommType.REQUEST, 0)
    reply = only(Status, rig.ros(port=port).send(Malformed(13, CommType.REQUEST, error)))
    assert (reply.comm_type, reply.reply_code) == (CommType.REPLY, SUCCESS)


def test_promise_7_ten_unknown_requests_in_ten_seconds_close_the_link() -> None:
    _, client = idle()
    for _ in range(FAULTS - 1):
        client.send(Opaque(4711, b""))
    assert client.closed_for == []
    client.send(Opaque(4711, b""))
    assert client.closed_for


def test_promise_7_unknown_requests_that_come_slowly_are_put_up_with() -> None:
    rig, client = idle()
    for _ in range(30):
        client.send(Opaque(4711, b""))
        rig.wait(WINDOW // (FAULTS - 1) + 10)
    assert client.closed_for == []


def test_a_state_connection_is_told_at_once_and_then_at_its_rate() -> None:
    rig = ready(ros_i={"state_rate": 25})
    listener = rig.ros(port=Port.ROS_STATE)
    assert [type(message) for message in listener.got] == [JointPosition, Status]
    rig.wait(400)
    assert len(listener.all(Status)) == 11


def test_a_point_on_the_state_port_moves_nothing() -> None:
    rig = ready()
    assert rig.ros(port=Port.ROS_STATE).point(0, 0.0, 0.0) is FAILURE
    assert rig.core.cell.authority.holder is None


def test_positions_that_are_not_fresh_are_not_repeated() -> None:
    rig = ready()
    rig.controller.reports = False
    listener = rig.ros(port=Port.ROS_STATE)
    rig.wait(100)
    told = len(listener.all(JointPosition))
    rig.wait(200)
    assert len(listener.all(JointPosition)) == told
    assert listener.all(Status)[-1].error_code == STATUS_ERROR_OFFSET + V.FEEDBACK_STALE


@pytest.mark.parametrize(
    ("spoil", "told"),
    [
        (lambda rig: None, (0, 0, 1)),
        (manual, (0, 0, 1)),
        (latched, (1_000_020, 1, 0)),
        (down, (1_000_023, 1, 0)),
        (e_stopped, (1_000_025, 1, 0)),
        (lambda rig: rig.holder().move(0.5, 0.5), (0, 0, 1)),
    ],
)
def test_status_is_the_controllers_narrowed_by_our_own_obstacles(
    spoil: Callable[[ServerRig], None], told: tuple[int, int, int]
) -> None:
    rig = ready()
    spoil(rig)
    status = status_of(rig)
    assert (status.error_code, status.in_error, status.motion_possible) == told


def test_status_says_in_motion_as_long_as_the_motion_lasts() -> None:
    rig, _ = moving()
    assert status_of(rig).in_motion == TriState.TRUE
    rig.wait(3_000)
    assert status_of(rig).in_motion == TriState.FALSE


@pytest.mark.parametrize(
    ("code", "shown"),
    [(V.NOT_TIMEABLE, V.NOT_TIMEABLE), (V.NO_MOTION, None), (V.STOPPED, V.STOPPED)],
)
def test_status_shows_why_a_plan_was_refused_unless_that_is_no_error(
    code: V, shown: V | None
) -> None:
    rig, _ = planning()
    rig.plan(Refusal(code))
    assert rig.core.ros.refused is shown


def test_the_first_point_takes_the_authority_and_tells_everybody() -> None:
    rig = ready()
    pendant, client = rig.pendant(), rig.ros("127.0.0.1")
    client.point(0, 0.0, 0.0)
    (change,) = pendant.all(AuthorityChanged)
    assert (change.holder, change.client) == (client.session, "ROS-I 127.0.0.1")
    assert pendant.take() is V.HELD_BY_OTHER


def held(rig: ServerRig) -> None:
    rig.holder()


def stale(rig: ServerRig) -> None:
    rig.now += 101 * MS


def override_of_0(rig: ServerRig) -> None:
    pendant = rig.holder()
    assert pendant.speed(0.0) is V.ACCEPTED
    pendant.release()


@pytest.mark.parametrize(
    ("spoil", "code"),
    [
        (override_of_0, V.OVERRIDE_ZERO),
        (held, V.HELD_BY_OTHER),
        (manual, V.NOT_AUTOMATIC),
        (unknown_mode, V.NOT_AUTOMATIC),
        (latched, V.STOP_LATCHED),
        (down, V.CONTROLLER_DOWN),
        (stale, V.FEEDBACK_STALE),
        (e_stopped, V.CONTROLLER_NOT_READY),
    ],
)
def test_a_client_that_may_not_move_gets_failure_and_is_closed(
    spoil: Callable[[ServerRig], None], code: V
) -> None:
    rig = ready()
    spoil(rig)
    client = rig.ros()
    before = rig.core.cell.authority.holder
    assert client.point(0, 0.0, 0.0) is FAILURE
    assert client.point(1, 0.1, 0.0) is FAILURE
    assert len(client.closed_for) == 1
    assert (rig.core.ros.refused, rig.core.cell.authority.holder) == (code, before)


def test_an_address_that_is_not_allowed_may_not_move_but_may_stop() -> None:
    rig, _ = moving()
    stranger = rig.ros("10.0.0.9")
    assert stranger.point(0, 0.0, 0.0) is FAILURE
    assert stranger.closed_for
    assert rig.core.ros.refused is V.ADDRESS_NOT_ALLOWED
    assert stranger.stop() is SUCCESS
    assert len(rig.stops) == 1


def test_a_mode_that_changes_while_points_are_collected_ends_it() -> None:
    rig, client = idle()
    client.trajectory(*PATH)
    manual(rig)
    rig.wait(200)
    assert jobs(rig) == []
    assert client.closed_for
    assert rig.core.ros.refused is V.NOT_AUTOMATIC


def test_authority_without_use_is_given_back_after_3_s_at_rest() -> None:
    rig = ready()
    pendant, client = rig.pendant(), rig.ros()
    client.trajectory(*PATH)
    while rig.activity() is not Activity.IDLE or not rig.points:
        rig.wait(10)
    rested = rig.now
    while rig.core.cell.authority.holder is not None:
        rig.wait(10)
    assert rig.now == rested + 3_000 * MS
    assert pendant.all(AuthorityChanged)[-1].reason == AuthorityReason.RELEASED
    assert client.closed_for == []
    assert client.trajectory((0.0, 0.0)) == [SUCCESS]
