"""The state port: STATUS true to state in all seven fields, joint reports, inputs and outputs."""

import pytest
from rigs.cells.controller_rig import FAILURE, LIMITS, MS, SUCCESS, ControllerRig, full_point

from openpendant.controller_emulator.core.admission import Admission, Tolerances
from openpendant.controller_emulator.core.controller import EmulatedController
from openpendant.controller_emulator.core.signals import DigitalSignals
from openpendant.controller_emulator.interpolation.servo import StartRule
from openpendant.controller_emulator.profiles import GENERIC, PROFILES, ControllerProfile
from openpendant.simplemsg import (
    CommType,
    JointFeedback,
    JointPosition,
    Malformed,
    MsgType,
    Received,
    ReplyCode,
    Status,
    Unasked,
    joint_array,
)
from openpendant.simplemsg.errors import BodyFault, HeaderFault
from openpendant.simplemsg.pendant import (
    OperatorAction,
    OperatorEvent,
    ReadSignals,
    ReadSignalsReply,
    SetInputs,
    WriteOutputs,
)

MOVE = (full_point(0, 0.0, (0.0, 0.0)), full_point(1, 1.0, (0.5, -0.5)))


def controller_of(profile: ControllerProfile) -> EmulatedController:
    admission, rule = Admission(LIMITS, Tolerances()), StartRule(1, 0, 0, 0)
    return EmulatedController(admission, (0.0, 0.0), profile, start_rule=rule)


def test_a_controller_that_was_just_switched_on_is_ready() -> None:
    ready = {"drives_powered": 1, "mode": 2, "motion_possible": 1}
    resting = {"e_stopped": 0, "error_code": 0, "in_error": 0, "in_motion": 0}
    assert ControllerRig().status == Status(**ready, **resting)


def test_in_motion_holds_exactly_from_the_start_to_the_last_point(rig: ControllerRig) -> None:
    rig.stream(*MOVE)
    assert rig.status.in_motion == 1
    rig.now += 1000 * MS - 1
    rig.wait(0)
    assert rig.status.in_motion == 1
    rig.now += 1
    rig.wait(0)
    assert rig.status.in_motion == 0


def test_a_round_reports_position_then_position_velocity_and_acceleration() -> None:
    rig = ControllerRig()
    rig.stream(*MOVE)
    rig.wait(250)
    joints, feedback, status = rig.controller.state_messages(rig.now)
    assert isinstance(joints, JointPosition)
    assert isinstance(feedback, JointFeedback)
    assert isinstance(status, Status)
    position, velocity, acceleration = rig.state
    assert joints == JointPosition(0, joint_array(position))
    assert feedback.positions == joint_array(position)
    assert feedback.velocities == joint_array(velocity)
    assert feedback.accelerations == joint_array(acceleration)
    assert feedback.valid_fields == 15
    assert feedback.time == 0.25


def test_status_comes_with_every_tenth_round(rig: ControllerRig) -> None:
    rounds = []
    for _ in range(30):
        rig.wait(10)
        messages = rig.controller.state_messages(rig.now)
        rounds.append(any(isinstance(message, Status) for message in messages))
    assert [n for n, has_status in enumerate(rounds) if has_status] == [0, 10, 20]


def test_a_change_of_status_is_told_once_and_at_once(rig: ControllerRig) -> None:
    rig.controller.state_messages(rig.now)
    assert rig.controller.status_change(rig.now) is None
    rig.operate(OperatorAction.EMERGENCY_STOP)
    change = rig.controller.status_change(rig.now)
    assert change is not None
    assert change.e_stopped == 1
    assert rig.controller.status_change(rig.now) is None


def test_a_status_request_is_answered_whatever_its_body(rig: ControllerRig) -> None:
    fault = BodyFault("empty", MsgType.STATUS, CommType.REQUEST, 0)
    reply = rig.controller.answer(Malformed(MsgType.STATUS, CommType.REQUEST, fault), rig.now)
    assert isinstance(reply, Status)
    assert (reply.comm_type, reply.reply_code) == (CommType.REPLY, ReplyCode.SUCCESS)


@pytest.mark.parametrize("comm_type", [CommType.TOPIC, CommType.REPLY, 4, -1])
def test_nothing_but_a_request_is_answered(comm_type: int, rig: ControllerRig) -> None:
    status = rig.status
    status.comm_type = comm_type
    assert rig.controller.answer(status, rig.now) is None
    assert rig.controller.answer(Unasked(status), rig.now) is None


def test_a_point_that_is_neither_request_nor_topic_is_ignored(rig: ControllerRig) -> None:
    point = full_point(0, 0.0, (0.0, 0.0))
    point.comm_type = 4
    assert rig.send(point) == []
    assert not rig.violations
    assert rig.controller.referee.events["points-accepted"] == 0


def test_a_message_that_the_profile_does_not_take_is_refused() -> None:
    few = GENERIC._replace(accepts=frozenset({MsgType.JOINT_TRAJ_PT}))
    ((_, reply),) = controller_of(few).handle(1, MOVE[0], 0)
    assert reply.reply_code == ReplyCode.FAILURE


def test_the_operator_message_as_a_topic_is_obeyed_and_not_answered(rig: ControllerRig) -> None:
    assert rig.send(OperatorEvent(OperatorAction.EMERGENCY_STOP, comm_type=CommType.TOPIC)) == []
    assert rig.status.e_stopped == 1


TYPE_0 = HeaderFault("type 0", 0, CommType.REQUEST, 0)


@pytest.mark.parametrize(
    "message",
    [
        Unasked(ControllerRig().status),
        Malformed(0, CommType.REQUEST, TYPE_0),
        OperatorEvent(OperatorAction.IDENTIFY, comm_type=CommType.TOPIC),
    ],
    ids=["a reply nobody asked for", "a malformed request of type 0", "a question as a topic"],
)
def test_what_cannot_be_answered_is_not(message: Received, rig: ControllerRig) -> None:
    assert rig.send(message) == []


@pytest.mark.parametrize("operator_events", [True, False])
def test_it_says_that_it_is_emulated_on_both_ports_and_does_nothing(operator_events: bool) -> None:
    rig = ControllerRig(operator_events=operator_events)
    rig.stream(*MOVE)
    before = rig.status
    question = OperatorEvent(OperatorAction.IDENTIFY)
    assert rig.code(question) == ReplyCode.SUCCESS
    reply = rig.controller.answer(question, rig.now)
    assert reply is not None
    assert reply.reply_code == ReplyCode.SUCCESS
    assert rig.status == before
    assert not rig.violations


@pytest.mark.parametrize("profile", PROFILES.values(), ids=PROFILES)
def test_every_profile_says_that_it_is_emulated(profile: ControllerProfile) -> None:
    reply = controller_of(profile).answer(OperatorEvent(OperatorAction.IDENTIFY), 0)
    assert reply is not None
    assert reply.reply_code == ReplyCode.SUCCESS


@pytest.fixture
def signals() -> ControllerRig:
    return ControllerRig(signals=DigitalSignals(20, 16))


def _read(signals: ControllerRig, first: int = 0) -> ReadSignalsReply:
    reply = signals.controller.answer(ReadSignals(first), signals.now)
    assert isinstance(reply, ReadSignalsReply)
    return reply


def test_only_masked_outputs_are_set(signals: ControllerRig) -> None:
    signals.code(WriteOutputs(0, 0b1111, 0b0101))
    assert signals.code(WriteOutputs(0, 0b0011, 0b0010)) == SUCCESS
    assert _read(signals).outputs == 0b0110


def test_inputs_are_set_by_the_operator_and_not_by_writing(signals: ControllerRig) -> None:
    assert signals.code(SetInputs(16, 0b1000, 0b1000)) == SUCCESS
    assert signals.code(WriteOutputs(0, 0b1, 0b1)) == SUCCESS
    assert (_read(signals, 16).inputs, _read(signals).inputs) == (0b1000, 0)


def test_a_reply_says_how_many_there_are(signals: ControllerRig) -> None:
    assert (_read(signals).input_count, _read(signals).output_count) == (20, 16)


@pytest.mark.parametrize(
    "message",
    [
        WriteOutputs(16, 1, 1),
        WriteOutputs(1, 1, 1),
        WriteOutputs(-16, 1, 1),
        SetInputs(16, 0b10000, 0),
        ReadSignals(32),
        ReadSignals(7),
    ],
    ids=repr,
)
def test_signals_that_are_not_there_are_refused(
    signals: ControllerRig, message: WriteOutputs | SetInputs | ReadSignals
) -> None:
    assert signals.code(message) == FAILURE


def test_a_write_beyond_the_end_sets_none(signals: ControllerRig) -> None:
    signals.code(SetInputs(16, 0b11111, 0b11111))
    assert _read(signals, 16).inputs == 0


def test_without_operator_events_nobody_sets_inputs() -> None:
    signals = ControllerRig(signals=DigitalSignals(16, 16), operator_events=False)
    assert signals.code(SetInputs(0, 1, 1)) == FAILURE
    assert signals.code(WriteOutputs(0, 1, 1)) == SUCCESS


def test_an_emergency_stop_leaves_the_outputs_alone(signals: ControllerRig) -> None:
    signals.code(WriteOutputs(0, 1, 1))
    signals.operate(OperatorAction.EMERGENCY_STOP)
    assert _read(signals).outputs == 1


def test_a_topic_is_obeyed_without_an_answer(signals: ControllerRig) -> None:
    assert signals.send(WriteOutputs(0, 1, 1, comm_type=CommType.TOPIC)) == []
    assert _read(signals).outputs == 1
