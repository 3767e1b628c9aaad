"""The pendant face: hello, verdicts and outcomes, who may do what, state."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import pytest
from server_rig import LIMITS, MS, Fault, Pendant, ServerRig, hello, ready

from openpendant.motion.limits import float32_ceiling
from openpendant.server.jobs import JointPathJob
from openpendant.server.outgoing import ForwardStop, Spread
from openpendant.server.refusal import Refusal
from openpendant.server.robot_cell import ControllerPath
from openpendant.simplemsg import (
    PENDANT,
    ByteOrder,
    Codec,
    CommType,
    HeaderOnly,
    JointPosition,
    Malformed,
    Message,
    Opaque,
    Ping,
    ReplyCode,
    joint_array,
)
from openpendant.simplemsg.errors import BodyFault
from openpendant.simplemsg.pendant import (
    Activity,
    Authority,
    AuthorityBeat,
    AuthorityChanged,
    AuthorityReason,
    Hello,
    HelloReply,
    JointMove,
    JointPath,
    JointWaypoint,
    LinkState,
    Outcome,
    PoseMove,
    PosePath,
    PoseWaypoint,
    ResetStop,
    SoftwareStop,
    State,
    StopChanged,
    Subscribe,
    Verdict,
)
from openpendant.simplemsg.verdicts import VerdictCode as V

UPRIGHT = (0.0, 0.0, 0.0, 1.0)
NEAR = (0.3, 0.0, 0.3)


def pose(
    motion: int = 1,
    speed: float = 0.5,
    position: Sequence[float] = NEAR,
    orientation: Sequence[float] = UPRIGHT,
) -> PoseMove:
    return PoseMove(9, motion, speed, "base", tuple(position), tuple(orientation))


def joints(*values: float, speed: float = 0.5) -> JointMove:
    return JointMove(9, speed, joint_array(values))


# Hello.


def test_hello_is_answered_with_who_and_what_is_here() -> None:
    pendant = ready().stranger()
    (reply,) = pendant.hello()
    assert isinstance(reply, HelloReply)
    assert (reply.cell, reply.robot, reply.dof, reply.session) == (
        "cell",
        "two-joints",
        2,
        pendant.session,
    )
    assert (reply.tick_rate, reply.max_state_rate, reply.authority_timeout) == (100.0, 100.0, 3.0)


@pytest.mark.parametrize(
    ("message", "code"),
    [
        (Hello(2, 0.0, "", "x"), V.VERSION),
        (hello(cell="elsewhere"), V.UNKNOWN_CELL),
        (hello(state_rate=math.nan), V.BAD_ARGUMENT),
        (hello(state_rate=-1.0), V.BAD_ARGUMENT),
        (hello(state_rate=0.5), V.BAD_ARGUMENT),
        (hello(state_rate=126.0), V.BAD_ARGUMENT),
    ],
)
def test_a_refused_hello_ends_the_conversation_for_good(message: Hello, code: V) -> None:
    pendant = ready().stranger()
    assert pendant.code(message) is code
    assert len(pendant.closed_for) == 1
    assert pendant.send(hello()) == []
    assert pendant.stop() is None


def test_ping_is_answered_before_hello() -> None:
    (reply,) = ready().stranger().send(Ping())
    assert (reply.comm_type, reply.reply_code) == (CommType.REPLY, ReplyCode.SUCCESS)


@pytest.mark.parametrize(
    "message",
    [
        joints(0.1, 0.1),
        pose(),
        Authority(9, 1),
        SoftwareStop(9, ""),
        ResetStop(9),
        Subscribe(9, 10.0),
    ],
)
def test_before_hello_every_other_request_is_refused(message: Message) -> None:
    rig = ready()
    assert rig.stranger().code(message) is V.HELLO_FIRST
    assert rig.stops == []
    assert rig.points == []


def test_a_second_hello_is_refused_and_changes_nothing() -> None:
    rig = ready()
    pendant = rig.pendant("first")
    pendant.take()
    assert pendant.code(hello("second", 50.0)) is V.BAD_ARGUMENT
    assert pendant.closed_for == []
    rig.wait(100)
    assert pendant.all(State) == []


@pytest.mark.parametrize(("silence", "closed"), [(2_000, 0), (2_010, 1)])
def test_who_says_no_hello_in_2_s_is_closed(silence: int, closed: int) -> None:
    rig = ready()
    pendant = rig.stranger()
    rig.wait(silence)
    assert len(pendant.closed_for) == closed


def test_who_is_silent_for_30_s_is_closed_and_a_ping_is_enough_to_stay() -> None:
    rig = ready()
    silent, alive = rig.pendant(), rig.pendant()
    for _ in range(31):
        rig.wait(1_000)
        alive.send(Ping())
    assert silent.closed_for
    assert alive.closed_for == []


def test_names_and_reasons_are_shown_without_control_characters_and_cut() -> None:
    rig = ready()
    observer, pendant = rig.pendant(), rig.pendant("a\nb\x1b" + "ü" * 40)
    pendant.take()
    pendant.stop("\x00line\r\nbreak" + "x" * 100)
    (owner,) = observer.all(AuthorityChanged)
    (stop,) = observer.all(StopChanged)
    assert owner.client == "a?b?" + "ü" * 14
    assert stop.reason == "?line??break" + "x" * 52
    assert rig.core.cell.stop is not None
    assert rig.core.cell.stop.reason.isprintable()


# Verdicts.


@pytest.mark.parametrize(
    ("message", "code"),
    [
        (joints(math.nan, 0.0), V.NOT_FINITE),
        (joints(0.0, math.inf), V.NOT_FINITE),
        (joints(0.0, 0.0, 0.0, math.nan), V.NOT_FINITE),
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
        (JointPath(9, 0.5, (JointWaypoint(joint_array((0.0, 2.1))),)), V.OUT_OF_RANGE),
        (JointPath(9, 0.5, (JointWaypoint(joint_array((0.0, math.nan))),)), V.NOT_FINITE),
        (JointPath(9, 1.5, (JointWaypoint(joint_array((0.0, 0.1))),)), V.BAD_ARGUMENT),
        (PosePath(9, 1, 0.5, "base", (PoseWaypoint(NEAR, (0, 0, 0, 2.0)),)), V.BAD_ARGUMENT),
        (Authority(9, 3), V.BAD_ARGUMENT),
        (Subscribe(9, math.nan), V.BAD_ARGUMENT),
        (Subscribe(9, math.inf), V.BAD_ARGUMENT),
    ],
)
def test_a_faulty_request_is_refused_by_one_verdict_that_can_be_encoded(
    message: Message, code: V
) -> None:
    rig = ready()
    pendant = rig.holder()
    (verdict,) = pendant.send(message)
    assert isinstance(verdict, Verdict)
    assert (verdict.request_id, verdict.code, verdict.reply_code) == (9, code, ReplyCode.FAILURE)
    assert verdict.text
    assert Codec(PENDANT, ByteOrder.LITTLE, 4).encode(verdict)
    assert rig.activity() is Activity.IDLE
    assert rig.jobs == []
    assert rig.points == []


def test_waypoints_rounded_beyond_a_limit_are_taken_as_the_limit() -> None:
    rig = ready(plans_at_once=False)
    rig.holder().path((float32_ceiling(LIMITS.upper[0]), 0.0))
    (job,) = rig.jobs
    assert isinstance(job, JointPathJob)
    assert job.waypoints == ((2.0, 0.0),)


def test_a_malformed_request_gets_a_verdict_and_a_malformed_topic_nothing() -> None:
    pendant = ready().pendant()
    (verdict,) = pendant.send(Malformed(65010, 2, BodyFault("short", 65010, 2, 0)))
    assert isinstance(verdict, Verdict)
    assert verdict.code == V.MALFORMED
    assert pendant.send(Malformed(65006, 1, BodyFault("long", 65006, 1, 0))) == []


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
        (reply,) = pendant.send(message)
        assert isinstance(reply, HeaderOnly)
        assert reply.reply_code == ReplyCode.FAILURE
    assert pendant.closed_for


@pytest.mark.parametrize(
    "message",
    [
        Opaque(4711, b"x", comm_type=CommType.TOPIC),
        JointMove(1, 0.5, joint_array((0.1,)), comm_type=CommType.TOPIC),
        JointMove(1, 0.5, joint_array((0.1,)), comm_type=CommType.REPLY),
        hello(),
    ],
)
def test_nothing_but_a_request_is_answered_or_moves(message: Message) -> None:
    rig = ready()
    pendant = rig.holder()
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


# Exactly three outcomes.


def _arrive(rig: ServerRig, pendant: Pendant) -> None:
    rig.wait(2_000)


def _stop(rig: ServerRig, pendant: Pendant) -> None:
    rig.pendant().stop()


def _lose_controller(rig: ServerRig, pendant: Pendant) -> None:
    rig.path(ControllerPath.MOTION, False)


@pytest.mark.parametrize(
    "end", [_arrive, _stop, _lose_controller], ids=["arrive", "stop", "controller lost"]
)
@pytest.mark.parametrize("kind", ["joint move", "path", "path still planned"])
def test_each_request_has_one_verdict_and_one_outcome_if_it_began(
    kind: str, end: Callable[[ServerRig, Pendant], None]
) -> None:
    rig = ready(plans_at_once=kind != "path still planned")
    pendant = rig.holder()
    pendant.got.clear()
    if kind == "joint move":
        pendant.move(0.5, 0.5)
    else:
        pendant.path((0.1, 0.0), (0.5, 0.5))
    end(rig, pendant)
    if rig.jobs:
        rig.plan()
    rig.wait(2_500)
    verdicts, outcomes = pendant.verdicts(), pendant.outcomes()
    assert len(verdicts) == 1
    assert len(outcomes) == (1 if verdicts[0][1] is V.ACCEPTED else 0)


def test_the_same_request_id_twice_still_gets_one_verdict_each() -> None:
    rig = ready()
    pendant = rig.holder()
    pendant.got.clear()
    assert pendant.code(joints(0.5, 0.5)) is V.ACCEPTED
    assert pendant.code(joints(0.1, 0.1)) is V.MOVING
    rig.wait(2_000)
    assert pendant.outcomes() == [(9, V.ACCEPTED)]
    assert rig.controller.position == (0.5, 0.5)


def test_requests_in_one_chunk_are_judged_one_after_the_other() -> None:
    rig = ready()
    pendant = rig.pendant()
    pendant.got.clear()
    chunk: list[Message] = [
        Authority(1, 1),
        JointMove(2, 0.5, joint_array((0.5, 0.5))),
        JointMove(3, 0.5, joint_array((0.1, 0.1))),
        SoftwareStop(4, ""),
        ResetStop(5),
    ]
    for message in chunk:
        pendant.send(message)
    assert pendant.verdicts() == [
        (1, V.ACCEPTED),
        (2, V.ACCEPTED),
        (3, V.MOVING),
        (4, V.ACCEPTED),
        (5, V.MOVING),
    ]
    assert pendant.outcomes() == [(2, V.STOPPED)]


def test_an_outcome_carries_times_code_and_numbers() -> None:
    rig = ready()
    pendant = rig.holder()
    rig.controller.faults = {3: Fault.REFUSE}
    pendant.move(0.5, 0.5)
    rig.wait(100)
    (outcome,) = pendant.all(Outcome)
    assert outcome.code == V.CONTROLLER_REFUSED
    assert outcome.motion_time > 0
    assert "reply code 2" in outcome.text


# Authority and stop.


def test_two_pendants_one_authority() -> None:
    rig = ready()
    anna, bert = rig.pendant("anna"), rig.pendant("bert")
    assert anna.take() is V.ACCEPTED
    assert anna.take() is V.ACCEPTED
    assert bert.take() is V.HELD_BY_OTHER
    assert "anna" in bert.all(Verdict)[-1].text
    assert bert.release() is V.NOT_IN_CONTROL
    assert bert.move(0.1, 0.1) is V.HELD_BY_OTHER
    assert anna.release() is V.ACCEPTED
    assert bert.take() is V.ACCEPTED
    reasons = [change.reason for change in anna.all(AuthorityChanged)]
    assert reasons == [AuthorityReason.GRANTED, AuthorityReason.RELEASED, AuthorityReason.GRANTED]


def test_beats_keep_the_authority_and_their_absence_ends_it_after_3_s() -> None:
    rig = ready()
    pendant = rig.holder()
    for _ in range(10):
        rig.wait(1_000)
        pendant.send(AuthorityBeat())
    last = rig.now
    rig.wait(2_990)
    assert rig.core.cell.authority.is_held_by(pendant.session)
    rig.wait(10)
    assert rig.core.cell.authority.holder is None
    assert rig.now == last + 3_000 * MS
    assert pendant.all(AuthorityChanged)[-1].reason == AuthorityReason.EXPIRED


def test_a_motion_request_is_a_sign_of_life() -> None:
    rig = ready()
    pendant = rig.holder()
    rig.wait(2_000)
    pendant.move(0.1, 0.1)
    rig.wait(2_990)
    assert rig.core.cell.authority.holder is not None


def test_a_refused_request_is_no_sign_of_life() -> None:
    rig = ready()
    pendant = rig.holder()
    rig.wait(2_000)
    pendant.move(9.0, 9.0)
    rig.wait(1_000)
    assert rig.core.cell.authority.holder is None


def test_an_observer_may_stop_but_not_reset() -> None:
    rig = ready()
    holder, observer = rig.holder(), rig.pendant("observer")
    holder.move(1.0, 0.5)
    rig.wait(200)
    out = rig.core.receive(observer.session, SoftwareStop(7, "hey"), rig.now)
    assert isinstance(out[0], ForwardStop)
    rig.perform(out)
    rig.wait(50)
    assert observer.reset() is V.HELD_BY_OTHER
    assert holder.reset() is V.ACCEPTED
    (latched, reset) = observer.all(StopChanged)
    assert (latched.stop, latched.client, latched.reason) == (1, "observer", "hey")
    assert (reset.stop, reset.client) == (0, "holder")


def test_nobody_resets_without_the_authority() -> None:
    rig = ready()
    pendant = rig.pendant()
    pendant.stop()
    assert pendant.reset() is V.NOT_IN_CONTROL


def test_a_stop_outlives_who_pressed_it() -> None:
    rig = ready()
    observer = rig.pendant()
    observer.stop()
    observer.close()
    assert rig.holder().move(0.5, 0.5) is V.STOP_LATCHED


# State.


@pytest.mark.parametrize(("rate", "count"), [(0.0, 0), (1.0, 1), (25.0, 25), (100.0, 100)])
def test_state_comes_at_the_rate_that_was_asked_for(rate: float, count: int) -> None:
    rig = ready()
    pendant = rig.pendant(state_rate=rate)
    rig.wait(10)
    pendant.got.clear()
    rig.wait(1_000)
    assert len(pendant.all(State)) == count


def test_a_rate_above_the_tick_is_the_ticks() -> None:
    rig = ready(tick_rate=100)
    pendant = rig.pendant(state_rate=125.0)
    rig.wait(1_000)
    assert len(pendant.all(State)) == 100


def test_the_rate_can_be_changed() -> None:
    rig = ready()
    pendant = rig.pendant(state_rate=100.0)
    assert pendant.code(Subscribe(5, 0.0)) is V.ACCEPTED
    rig.wait(100)
    assert pendant.all(State) == []


def test_state_carries_where_the_robot_is_what_it_does_and_how_old_that_is() -> None:
    rig = ready()
    holder = rig.holder()
    pendant = rig.pendant(state_rate=100.0)
    holder.move(1.0, 0.5)
    rig.wait(500)
    rig.controller.reports = False
    rig.wait(120)
    state = pendant.all(State)[-1]
    assert state.positions[:2] == rig.core.cell.feedback.position
    assert (state.activity, state.request_id, state.holder) == (
        Activity.MOVING,
        holder.last_request,
        holder.session,
    )
    assert state.age == pytest.approx(0.12)
    assert state.link == LinkState.STALE
    assert (state.time_s * 10**9 + state.time_ns) == rig.now


def test_before_the_first_report_the_age_is_minus_1_and_no_field_valid() -> None:
    rig = ServerRig()
    pendant = rig.pendant(state_rate=100.0)
    rig.wait(10)
    (state,) = pendant.all(State)
    assert (state.age, state.valid_fields, state.link) == (-1.0, 0, LinkState.DOWN)


def test_state_is_encoded_once_for_all_and_who_was_too_slow_is_told_how_often() -> None:
    rig = ready()
    pendants = [rig.pendant(state_rate=100.0) for _ in range(3)]
    out = rig.wait(10)
    assert [item.sessions for item in out if isinstance(item, Spread)] == [
        tuple(pendant.session for pendant in pendants)
    ]
    rig.core.skipped(pendants[1].session)
    rig.core.skipped(pendants[1].session)
    rig.wait(10)
    assert [pendant.all(State)[-1].dropped for pendant in pendants] == [0, 2, 0]
    assert len({pendant.all(State)[-1].sequence for pendant in pendants}) == 1


def test_a_refusal_with_numbers_beyond_4_bytes_is_still_told() -> None:
    rig = ready(plans_at_once=False)
    pendant = rig.holder()
    pendant.path((0.1, 0.1))
    pendant.got.clear()
    rig.plan(Refusal(V.NOT_TIMEABLE, "ü" * 200, 0, 1e300, math.nan))
    (verdict,) = pendant.all(Verdict)
    assert Codec(PENDANT, ByteOrder.LITTLE, 4).encode(verdict)
    assert verdict.text == "ü" * 80
