import math
from collections.abc import Callable

import pytest
from rigs.cells.expectations import only
from rigs.cells.robot_cell_situations import in_control
from rigs.cells.server_rig import LIMITS, ServerRig, ready
from rigs.peers.scripted_controller import Fault
from rigs.peers.server_clients import NEAR, hello, joints, pose

from openpendant.motion.description.limits import float32_ceiling
from openpendant.server.planning.jobs import JointPathJob
from openpendant.server.refusal import Refusal
from openpendant.server.settings.cell_settings import ControllerPath
from openpendant.simplemsg import (
    PENDANT,
    ByteOrder,
    Codec,
    CommType,
    Connection,
    HeaderOnly,
    JointPosition,
    Malformed,
    Message,
    Opaque,
    ReplyCode,
    Role,
    joint_array,
)
from openpendant.simplemsg.errors import BodyFault
from openpendant.simplemsg.pendant import (
    Activity,
    Authority,
    AuthorityBeat,
    Hello,
    JogStep,
    JointMove,
    JointPath,
    JointWaypoint,
    Outcome,
    PosePath,
    PoseWaypoint,
    ResetStop,
    SoftwareStop,
    StopChanged,
    Subscribe,
    Verdict,
)
from openpendant.simplemsg.verdicts import VerdictCode as V


@pytest.mark.parametrize(
    ("message", "code"),
    [
        (joints(math.nan, 0.0), V.NOT_FINITE),
        (joints(0.0, math.inf), V.NOT_FINITE),
        (JointMove(9, 0.5, 2, joint_array((0.0, 0.0, 0.0, math.nan))), V.NOT_FINITE),
        (joints(0.0, 0.0, 0.1), V.WRONG_JOINT_COUNT),
        (joints(2.1, 0.0), V.OUT_OF_RANGE),
        (joints(0.0, 3e38), V.OUT_OF_RANGE),
        (joints(0.0, 0.0), V.NO_MOTION),
        (joints(0.1, 0.0, speed=math.nan), V.NOT_FINITE),
        (joints(0.1, 0.0, speed=math.inf), V.NOT_FINITE),
        (joints(0.1, 0.0, speed=0.0), V.BAD_ARGUMENT),
        (joints(0.1, 0.0, speed=1.01), V.BAD_ARGUMENT),
        (joints(0.1, 0.0, speed=-0.5), V.BAD_ARGUMENT),
        (pose(motion=0), V.BAD_ARGUMENT),
        (pose(motion=3), V.BAD_ARGUMENT),
        (pose(speed=2.0), V.BAD_ARGUMENT),
        (pose(position=(math.nan, 0, 0)), V.NOT_FINITE),
        (pose(position=(1e30, 0, 0)), V.BAD_ARGUMENT),
        (pose(orientation=(0, 0, math.inf, 1)), V.NOT_FINITE),
        (pose(orientation=(0, 0, 0, 0)), V.BAD_ARGUMENT),
        (pose(orientation=(3e38, 3e38, 3e38, 3e38)), V.BAD_ARGUMENT),
        (JointPath(9, 0.5, 2, (JointWaypoint(joint_array((0.0, 2.1))),)), V.OUT_OF_RANGE),
        (JointPath(9, 0.5, 2, (JointWaypoint(joint_array((0.0, math.nan))),)), V.NOT_FINITE),
        (JointPath(9, 0.5, 1, (JointWaypoint(joint_array((0.1,))),)), V.WRONG_JOINT_COUNT),
        (JointMove(9, 0.5, 1, joint_array((0.1,))), V.WRONG_JOINT_COUNT),
        (JointMove(9, 0.5, 3, joint_array((0.1, 0.1))), V.WRONG_JOINT_COUNT),
        (JointPath(9, 1.5, 2, (JointWaypoint(joint_array((0.0, 0.1))),)), V.BAD_ARGUMENT),
        (PosePath(9, 1, 0.5, "base", (PoseWaypoint(NEAR, (0, 0, 0, 2.0)),)), V.BAD_ARGUMENT),
        (Authority(9, 4), V.BAD_ARGUMENT),
        (Subscribe(9, math.nan), V.BAD_ARGUMENT),
        (Subscribe(9, math.inf), V.BAD_ARGUMENT),
    ],
)
def test_a_faulty_request_is_refused_by_one_verdict_that_can_be_encoded(
    message: Message, code: V
) -> None:
    rig, pendant = in_control()
    verdict = only(Verdict, pendant.send(message))
    assert (verdict.request_id, verdict.code, verdict.reply_code) == (9, code, ReplyCode.FAILURE)
    assert verdict.text
    assert Codec(PENDANT, ByteOrder.LITTLE, 4).encode(verdict)
    assert (rig.activity(), rig.jobs, rig.points) == (Activity.IDLE, [], [])


def test_waypoints_rounded_beyond_a_limit_are_taken_as_the_limit() -> None:
    rig = ready(plans_at_once=False)
    rig.holder().path((float32_ceiling(LIMITS.upper[0]), 0.0))
    job = only(JointPathJob, rig.jobs)
    assert job.waypoints == ((2.0, 0.0),)


def test_a_malformed_request_gets_a_verdict_and_a_malformed_topic_nothing() -> None:
    pendant = ready().pendant()
    verdict = only(Verdict, pendant.send(Malformed(65010, 2, BodyFault("short", 65010, 2, 0))))
    assert verdict.code == V.MALFORMED
    assert pendant.send(Malformed(65006, 1, BodyFault("long", 65006, 1, 0))) == []


_BIG = Codec(PENDANT, ByteOrder.BIG, 4)


def _short(whole: bytes) -> bytes:
    return (len(whole) - 8).to_bytes(4, "big") + whole[4:-4]


@pytest.mark.parametrize(
    "frame",
    [
        _short(_BIG.encode(JointMove(4711, 0.5, 2, joint_array((0.1,))))),
        _BIG.encode(JogStep(4711, 0.5, 2, "base", 6, joint_array(()))).replace(
            b"bas", b"\xff\xfe\xfd"
        ),
    ],
    ids=["cut short", "a frame whose name is no UTF-8"],
)
def test_the_refusal_of_a_malformed_request_names_its_id(frame: bytes) -> None:
    """A client that waits for the answer by its id gets it."""
    pendant = ready().pendant()
    malformed = only(Malformed, Connection(Role.SERVER, PENDANT, ByteOrder.BIG).receive(frame))
    verdict = only(Verdict, pendant.send(malformed))
    assert (verdict.request_id, verdict.code) == (4711, V.MALFORMED)


@pytest.mark.parametrize(
    "message",
    [
        Opaque(4711, b"x"),
        JointPosition(0, joint_array(()), comm_type=CommType.REQUEST),
        AuthorityBeat(comm_type=CommType.REQUEST),
    ],
)
def test_an_unknown_request_is_answered_failure_and_ten_of_them_close(message: Message) -> None:
    pendant = ready().pendant()
    for _ in range(10):
        assert pendant.closed_for == []
        reply = only(HeaderOnly, pendant.send(message))
        assert reply.reply_code == ReplyCode.FAILURE
    assert pendant.closed_for


@pytest.mark.parametrize(
    "message",
    [
        Opaque(4711, b"x", comm_type=CommType.TOPIC),
        JointMove(1, 0.5, 2, joint_array((0.1,)), comm_type=CommType.TOPIC),
        JointMove(1, 0.5, 2, joint_array((0.1,)), comm_type=CommType.REPLY),
        hello(),
    ],
)
def test_nothing_but_a_request_is_answered_or_moves(message: Message) -> None:
    rig, pendant = in_control()
    if isinstance(message, Hello):
        message.comm_type = CommType.TOPIC
    assert pendant.send(message) == []
    assert rig.points == []


def test_a_stop_sent_as_a_topic_stops_without_an_answer() -> None:
    rig = ready()
    rig.holder().move(1.0, 0.5)
    observer = rig.pendant()
    answers = observer.send(SoftwareStop(1, "x", comm_type=CommType.TOPIC))
    assert [type(message) for message in answers] == [StopChanged]
    assert rig.core.cell.stop is not None
    assert len(rig.stops) == 1


@pytest.mark.parametrize(
    "end",
    [
        lambda rig: rig.wait(2_000),
        lambda rig: rig.pendant().stop(),
        lambda rig: rig.path(ControllerPath.MOTION, False),
    ],
    ids=["arrive", "stop", "controller lost"],
)
@pytest.mark.parametrize("kind", ["joint move", "path", "path still planned"])
def test_each_request_has_one_verdict_and_one_outcome_if_it_began(
    kind: str, end: Callable[[ServerRig], object]
) -> None:
    rig, pendant = in_control(plans_at_once=kind != "path still planned")
    pendant.got.clear()
    if kind == "joint move":
        pendant.move(0.5, 0.5)
    else:
        pendant.path((0.1, 0.0), (0.5, 0.5))
    end(rig)
    if rig.jobs:
        rig.plan()
    rig.wait(2_500)
    verdicts, outcomes = pendant.verdicts(), pendant.outcomes()
    assert len(verdicts) == 1
    assert len(outcomes) == (1 if verdicts[0][1] is V.ACCEPTED else 0)


def test_promise_28_the_same_request_id_twice_is_refused_and_disturbs_nothing() -> None:
    rig, pendant = in_control()
    pendant.got.clear()
    assert pendant.code(joints(0.5, 0.5)) is V.ACCEPTED
    assert pendant.code(joints(0.1, 0.1)) is V.REQUEST_REPEATED
    rig.wait(2_000)
    assert pendant.outcomes() == [(9, V.ACCEPTED)]
    assert rig.controller.position == (0.5, 0.5)


def test_requests_in_one_chunk_are_judged_one_after_the_other() -> None:
    rig = ready()
    pendant = rig.pendant()
    pendant.got.clear()
    chunk: list[Message] = [
        Authority(1, 1),
        JointMove(2, 0.5, 2, joint_array((0.5, 0.5))),
        JointMove(3, 0.5, 2, joint_array((0.1, 0.1))),
        SoftwareStop(4, ""),
        ResetStop(5),
    ]
    for message in chunk:
        pendant.send(message)
    codes = [V.ACCEPTED, V.ACCEPTED, V.MOVING, V.ACCEPTED, V.MOVING]
    assert pendant.verdicts() == list(enumerate(codes, 1))
    assert pendant.outcomes() == [(2, V.STOPPED)]


def test_an_outcome_carries_times_code_and_numbers() -> None:
    rig, pendant = in_control()
    rig.controller.faults = {3: Fault.REFUSE}
    pendant.move(0.5, 0.5)
    rig.wait(100)
    (outcome,) = pendant.all(Outcome)
    assert outcome.code == V.CONTROLLER_REFUSED
    assert outcome.motion_time > 0
    assert "reply code 2" in outcome.text


def test_a_refusal_with_numbers_beyond_4_bytes_is_still_told() -> None:
    rig, pendant = in_control(plans_at_once=False)
    pendant.path((0.1, 0.1))
    pendant.got.clear()
    rig.plan(Refusal(V.NOT_TIMEABLE, "ü" * 200, 0, 1e300, math.nan))
    (verdict,) = pendant.all(Verdict)
    assert Codec(PENDANT, ByteOrder.LITTLE, 4).encode(verdict)
    assert verdict.text == "ü" * 80
