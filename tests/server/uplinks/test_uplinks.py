from __future__ import annotations

import pytest

from openpendant.motion.trajectory.trajectory import Row
from openpendant.server.settings.cell_settings import ControllerLink
from openpendant.server.uplinks.generic import GenericUplink
from openpendant.simplemsg import (
    CommType,
    HeaderOnly,
    JointTrajPt,
    JointTrajPtFull,
    Message,
    MsgType,
    ReplyCode,
    joint_array,
)
from openpendant.simplemsg.verdicts import VerdictCode as V

MS = 1_000_000
POINT = (3, Row(0.03, [0.5, -0.5], [1.0, -0.5], [4.0, 0.0]), 0.01)
REST = (0, Row(0.0, [0.5, -0.5], [0.0, 0.0], [4.0, 0.0]), 0.0)


def make(**link: object) -> GenericUplink:
    return GenericUplink(ControllerLink.model_validate(link), (2.0, 2.0))


def answer(msg_type: int, code: int = ReplyCode.SUCCESS) -> Message:
    return HeaderOnly(msg_type, reply_code=code)


FULL_DONE = answer(MsgType.JOINT_TRAJ_PT_FULL)


def test_a_full_point_carries_everything_and_the_time_from_the_start() -> None:
    message = make().point(*POINT, 0)
    assert isinstance(message, JointTrajPtFull)
    assert (message.sequence, message.valid_fields, message.time) == (3, 15, 0.03)
    assert message.positions == joint_array((0.5, -0.5))
    assert message.velocities == joint_array((1.0, -0.5))
    assert message.accelerations == joint_array((4.0, 0.0))


def test_a_simple_point_carries_the_speed_ratio_and_the_time_of_its_segment() -> None:
    message = make(points="simple").point(*POINT, 0)
    assert isinstance(message, JointTrajPt)
    assert (message.sequence, message.velocity, message.duration) == (3, 0.5, 0.01)
    assert message.comm_type == CommType.REQUEST


def test_a_simple_point_of_rest_names_a_speed_because_0_means_none_given() -> None:
    message = make(points="simple").point(*REST, 0)
    assert isinstance(message, JointTrajPt)
    assert message.velocity == 0.1


def test_a_stop_is_sequence_minus_4_without_joints_and_ends_the_waiting() -> None:
    uplink = make()
    uplink.point(*POINT, 0)
    message = uplink.stop(0, is_sent=True)
    assert isinstance(message, JointTrajPt)
    assert (message.sequence, message.joints) == (-4, joint_array(()))
    assert not uplink.awaiting


def test_success_is_success() -> None:
    uplink = make()
    uplink.point(*POINT, 0)
    assert uplink.awaiting
    assert uplink.answer(FULL_DONE, 0) is None
    assert not uplink.awaiting


@pytest.mark.parametrize("number", [MsgType.JOINT_TRAJ_PT, MsgType.JOINT_POSITION])
def test_a_simple_point_may_be_answered_as_a_point_or_as_a_position(number: int) -> None:
    uplink = make(points="simple")
    uplink.point(*POINT, 0)
    assert uplink.answer(answer(number), 0) is None


@pytest.mark.parametrize("code", [ReplyCode.FAILURE, ReplyCode.UNUSED, 77])
def test_any_code_but_success_is_a_refusal(code: int) -> None:
    uplink = make()
    uplink.point(*POINT, 0)
    refusal = uplink.answer(answer(MsgType.JOINT_TRAJ_PT_FULL, code), 0)
    assert refusal is not None
    assert refusal.code is V.CONTROLLER_REFUSED
    assert str(int(code)) in refusal.text


@pytest.mark.parametrize("number", [MsgType.PING, MsgType.JOINT_TRAJ_PT, 9999])
def test_an_answer_of_another_type_is_a_mismatch(number: int) -> None:
    uplink = make()
    uplink.point(*POINT, 0)
    refusal = uplink.answer(answer(number), 0)
    assert refusal is not None
    assert refusal.code is V.CONTROLLER_MISMATCH


def test_answers_to_what_was_sent_before_are_not_taken_for_the_points() -> None:
    uplink = make()
    uplink.point(*POINT, 0)
    assert uplink.answer(answer(MsgType.JOINT_TRAJ_PT, ReplyCode.FAILURE), 1) is None
    assert uplink.awaiting
    assert uplink.answer(FULL_DONE, 0) is None
    assert not uplink.awaiting


def test_as_many_points_as_allowed_wait_for_their_answers_at_once() -> None:
    uplink = make(points_in_flight=3)
    full = []
    for _ in range(3):
        uplink.point(*POINT, 0)
        full.append(uplink.is_full)
    assert full == [False, False, True]
    for pending in (2, 1, 0):
        assert uplink.awaiting
        assert uplink.answer(FULL_DONE, pending) is None
        assert not uplink.is_full
    assert not uplink.awaiting


def test_of_several_points_each_answer_counts_and_none_from_before_them() -> None:
    uplink = make(points_in_flight=3)
    uplink.point(*POINT, 0)
    uplink.point(*POINT, 0)
    failure = answer(MsgType.JOINT_TRAJ_PT_FULL, ReplyCode.FAILURE)
    assert uplink.answer(failure, 2) is None
    refusal = uplink.answer(failure, 1)
    assert refusal is not None
    assert refusal.code is V.CONTROLLER_REFUSED


def test_of_several_points_the_oldest_is_overdue_first() -> None:
    uplink = make(points_in_flight=2, reply_deadline=0.5)
    uplink.point(*POINT, 0)
    uplink.point(*POINT, 400 * MS)
    assert uplink.answer(FULL_DONE, 1) is None
    assert uplink.overdue(899 * MS) is None
    assert uplink.overdue(900 * MS) is not None


def test_of_several_points_each_waits_by_itself() -> None:
    uplink = make(points_in_flight=2, reply_deadline=0.5)
    uplink.point(*POINT, 0)
    uplink.point(*POINT, 400 * MS)
    assert uplink.overdue(499 * MS) is None
    assert uplink.overdue(500 * MS) is not None


def test_an_answer_after_a_stop_is_nobodys_business() -> None:
    uplink = make()
    uplink.point(*POINT, 0)
    uplink.stop(0, is_sent=True)
    assert uplink.answer(answer(MsgType.PING, ReplyCode.FAILURE), 0) is None


@pytest.mark.parametrize("deadline", [0.5, 0.05])
def test_a_point_is_overdue_exactly_at_the_deadline_and_once(deadline: float) -> None:
    uplink = make(reply_deadline=deadline)
    uplink.point(*POINT, 10)
    due = 10 + round(deadline * 1e9)
    assert uplink.overdue(due - 1) is None
    refusal = uplink.overdue(due)
    assert refusal is not None
    assert refusal.code is V.CONTROLLER_SILENT
    assert uplink.overdue(due) is None


def test_an_unanswered_stop_is_overdue_after_two_seconds_and_once() -> None:
    uplink = make()
    uplink.stop(0, is_sent=True)
    uplink.stop(1_900_000_000, is_sent=True)
    assert not uplink.stop_overdue(1_999_999_999)
    assert uplink.stop_overdue(2_000_000_000)
    assert not uplink.stop_overdue(2_000_000_000)


@pytest.mark.parametrize("pending", [0, 1])
def test_a_stop_is_answered_when_nothing_is_owed_any_more(pending: int) -> None:
    uplink = make()
    uplink.stop(0, is_sent=True)
    uplink.answer(answer(MsgType.JOINT_TRAJ_PT, ReplyCode.SUCCESS), pending)
    assert uplink.stop_overdue(10**12) is bool(pending)


def test_a_stop_that_is_answered_while_points_are_in_flight_is_not_overdue() -> None:
    uplink = make(points_in_flight=2)
    uplink.stop(0, is_sent=True)
    uplink.point(*POINT, 0)
    uplink.point(*POINT, 0)
    assert uplink.answer(answer(MsgType.JOINT_TRAJ_PT), 2) is None
    assert not uplink.stop_overdue(10**12)
    assert uplink.awaiting


def test_a_stop_that_went_nowhere_awaits_no_answer() -> None:
    uplink = make()
    uplink.stop(0, is_sent=False)
    assert not uplink.stop_overdue(10**12)


def test_a_lost_link_owes_nothing() -> None:
    uplink = make()
    uplink.point(*POINT, 0)
    uplink.stop(0, is_sent=True)
    uplink.point(*POINT, 0)
    uplink.lost()
    assert not uplink.stop_overdue(10**12)
    assert not uplink.awaiting
    assert uplink.overdue(10**12) is None
