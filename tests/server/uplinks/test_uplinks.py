import pytest
from rigs.cells.emulated_cell import EmulatedCell
from rigs.cells.expectations import expect, refusal_from
from rigs.cells.server_rig import MS, ServerRig, ready

from openpendant.controller_emulator.error_codes import ErrorCode
from openpendant.motion.trajectory.trajectory import Row
from openpendant.server import uplinks
from openpendant.server.events.effects import SendStop, SendToController
from openpendant.server.settings.cell_settings import ControllerLink, ControllerPath
from openpendant.server.uplinks.generic import GenericUplink, generic_declaration
from openpendant.server.uplinks.uplink import WORDS, ControllerDialect, error_text
from openpendant.server.watchdog.watchdog_process import stop_target
from openpendant.simplemsg import (
    CommType,
    HeaderOnly,
    JointTrajPt,
    JointTrajPtFull,
    Message,
    MsgType,
    Received,
    ReplyCode,
    joint_array,
)
from openpendant.simplemsg.pendant import AuthorityBeat, Outcome
from openpendant.simplemsg.verdicts import VerdictCode as V

POINT = (3, Row(0.03, [0.5, -0.5], [1.0, -0.5], [4.0, 0.0]), 0.01)
REST = (0, Row(0.0, [0.5, -0.5], [0.0, 0.0], [4.0, 0.0]), 0.0)


def make(**link: object) -> GenericUplink:
    return GenericUplink(ControllerLink.model_validate(link), (2.0, 2.0))


def awaiting(**link: object) -> GenericUplink:
    """Return one that was sent a point."""
    uplink = make(**link)
    uplink.point(*POINT, 0)
    return uplink


def answer(msg_type: int, code: int = ReplyCode.SUCCESS) -> Message:
    return HeaderOnly(msg_type, reply_code=code)


FULL_DONE = answer(MsgType.JOINT_TRAJ_PT_FULL)


def test_a_full_point_carries_everything_and_the_time_from_the_start() -> None:
    message = expect(JointTrajPtFull, make().point(*POINT, 0))
    assert (message.sequence, message.valid_fields, message.time) == (3, 15, 0.03)
    assert message.positions == joint_array((0.5, -0.5))
    assert message.velocities == joint_array((1.0, -0.5))
    assert message.accelerations == joint_array((4.0, 0.0))


def test_a_simple_point_carries_the_speed_ratio_and_the_time_of_its_segment() -> None:
    message = expect(JointTrajPt, make(points="simple").point(*POINT, 0))
    assert (message.sequence, message.velocity, message.duration) == (3, 0.5, 0.01)
    assert message.comm_type == CommType.REQUEST


def test_a_simple_point_of_rest_names_a_speed_because_0_means_none_given() -> None:
    assert expect(JointTrajPt, make(points="simple").point(*REST, 0)).velocity == 0.1


def test_a_stop_is_sequence_minus_4_without_joints_and_ends_the_waiting() -> None:
    uplink = awaiting()
    message = expect(JointTrajPt, uplink.stop(0, is_sent=True))
    assert (message.sequence, message.joints) == (-4, joint_array(()))
    assert not uplink.awaiting


@pytest.mark.parametrize(
    ("points", "number"),
    [
        ("full", MsgType.JOINT_TRAJ_PT_FULL),
        ("simple", MsgType.JOINT_TRAJ_PT),
        ("simple", MsgType.JOINT_POSITION),
    ],
)
def test_a_point_is_answered_as_a_point_or_a_simple_one_as_a_position(
    points: str, number: int
) -> None:
    uplink = awaiting(points=points)
    assert uplink.awaiting
    assert uplink.answer(answer(number), 0) is None
    assert not uplink.awaiting


@pytest.mark.parametrize("code", [ReplyCode.FAILURE, ReplyCode.UNUSED, 77])
def test_any_code_but_success_is_a_refusal(code: int) -> None:
    uplink = awaiting()
    refusal = refusal_from(uplink.answer(answer(MsgType.JOINT_TRAJ_PT_FULL, code), 0))
    assert refusal.code is V.CONTROLLER_REFUSED
    assert str(int(code)) in refusal.text


@pytest.mark.parametrize("number", [MsgType.PING, MsgType.JOINT_TRAJ_PT, 9999])
def test_an_answer_of_another_type_is_a_mismatch(number: int) -> None:
    uplink = awaiting()
    assert refusal_from(uplink.answer(answer(number), 0)).code is V.CONTROLLER_MISMATCH


def test_answers_to_what_was_sent_before_are_not_taken_for_the_points() -> None:
    uplink = awaiting()
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
    uplink = awaiting(points_in_flight=3)
    uplink.point(*POINT, 0)
    failure = answer(MsgType.JOINT_TRAJ_PT_FULL, ReplyCode.FAILURE)
    assert uplink.answer(failure, 2) is None
    assert refusal_from(uplink.answer(failure, 1)).code is V.CONTROLLER_REFUSED


@pytest.mark.parametrize(("is_answered", "overdue"), [(False, 500), (True, 900)])
def test_of_several_points_each_waits_by_itself(is_answered: bool, overdue: int) -> None:
    uplink = awaiting(points_in_flight=2, reply_deadline=0.5)
    uplink.point(*POINT, 400 * MS)
    if is_answered:
        assert uplink.answer(FULL_DONE, 1) is None
    assert uplink.overdue(overdue * MS - 1) is None
    assert uplink.overdue(overdue * MS) is not None


def test_an_answer_after_a_stop_is_nobodys_business() -> None:
    uplink = awaiting()
    uplink.stop(0, is_sent=True)
    assert uplink.answer(answer(MsgType.PING, ReplyCode.FAILURE), 0) is None


@pytest.mark.parametrize("deadline", [0.5, 0.05])
def test_a_point_is_overdue_exactly_at_the_deadline_and_once(deadline: float) -> None:
    uplink = make(reply_deadline=deadline)
    uplink.point(*POINT, 10)
    due = 10 + round(deadline * 1e9)
    assert uplink.overdue(due - 1) is None
    assert refusal_from(uplink.overdue(due)).code is V.CONTROLLER_SILENT
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
    uplink = awaiting()
    uplink.stop(0, is_sent=True)
    uplink.point(*POINT, 0)
    uplink.lost()
    assert not uplink.stop_overdue(10**12)
    assert not uplink.awaiting
    assert uplink.overdue(10**12) is None


TOY_STOP = JointTrajPtFull(7, -4, 0, 0.0, *((0.0,) * 10,) * 3)
GOAL = (0.5, 0.5)


class ToyUplink(GenericUplink):
    """Numbers its points from 1,000 for robot 7, and stops it by a message of its own."""

    def point(self, number: int, row: Row, step: float, now: int) -> Message:
        point = expect(JointTrajPtFull, super().point(number, row, step, now))
        point.robot_id = 7
        point.sequence += 1_000
        return point

    def stop(self, now: int, *, is_sent: bool) -> Message:
        super().stop(now, is_sent=is_sent)
        return TOY_STOP


TOY = ControllerDialect(
    ToyUplink,
    stop=TOY_STOP,
    stopped=HeaderOnly(MsgType.PING, reply_code=ReplyCode.SUCCESS),
    declared=generic_declaration,
)


@pytest.fixture
def rig(monkeypatch: pytest.MonkeyPatch) -> ServerRig:
    monkeypatch.setitem(uplinks.DIALECTS, "generic", TOY)
    return ready(plans_at_once=False)


def test_points_and_stops_of_a_cell_are_the_dialects(rig: ServerRig) -> None:
    pendant = rig.holder()
    pendant.path((0.1, 0.1), GOAL)
    rig.plan()
    rig.wait(20)
    points = [item.message for _, item in rig.log if isinstance(item, SendToController)]
    assert points
    assert all(isinstance(each, JointTrajPtFull) and each.robot_id == 7 for each in points)
    pendant.stop()
    (stop,) = [item.message for _, item in rig.log if isinstance(item, SendStop)]
    assert stop is TOY_STOP


def test_the_last_stop_of_a_cell_that_failed_is_the_dialects(rig: ServerRig) -> None:
    assert expect(SendStop, rig.core.fail("ValueError: boom", rig.now)[0]).message is TOY_STOP


def test_the_watchdog_stops_with_the_bytes_of_the_dialect(rig: ServerRig) -> None:
    target = stop_target(rig.settings)
    msg_type = int(MsgType.JOINT_TRAJ_PT_FULL).to_bytes(4, "little")
    assert bytes.fromhex(target.stop)[4:8] == msg_type
    assert bytes.fromhex(target.answer)[:4] == int(MsgType.PING).to_bytes(4, "little")


def test_the_words_are_there_for_every_error_of_the_emulated_controller() -> None:
    assert set(WORDS) == {int(code) for code in ErrorCode if code is not ErrorCode.NONE}


@pytest.mark.parametrize(
    ("number", "words"), [(109, ("109", "under-run", "too late")), (4711, ("4711",))]
)
def test_a_number_is_always_told(number: int, words: tuple[str, ...]) -> None:
    assert all(word in error_text(number) for word in words)


class SlowLine(EmulatedCell):
    def __init__(self) -> None:
        self.late: list[tuple[ControllerPath, Received]] = []
        self.slow: tuple[ControllerPath, ...] = ()
        super().__init__(controller={"lead": 0.09})  # so that it runs dry before reports are lost

    def _hear(self, path: ControllerPath, received: Received) -> None:
        if path in self.slow:
            self.late.append((path, received))
        else:
            super()._hear(path, received)

    def catch_up(self) -> None:
        self.slow, late = (), self.late
        for path, received in late:
            super()._hear(path, received)


@pytest.mark.parametrize(
    ("slow", "code"),
    [
        ((ControllerPath.MOTION,), V.CONTROLLER_STOPPED),
        ((ControllerPath.MOTION, ControllerPath.STATE), V.CONTROLLER_REFUSED),
    ],
)
def test_a_motion_that_ran_dry_is_told_as_an_under_run_whichever_is_heard_first(
    slow: tuple[ControllerPath, ...], code: V
) -> None:
    """The controller's own status names the error; its answer to the next point does not."""
    cell = SlowLine()
    cell.wait(300)
    pendant = cell.holder()
    assert pendant.move(*(at + 0.8 for at in cell.position), speed=0.5) is V.ACCEPTED
    cell.wait(300)
    pendant.send(AuthorityBeat())
    cell.slow = slow
    cell.wait(200)
    cell.catch_up()
    cell.wait(50)
    (outcome,) = pendant.all(Outcome)
    assert outcome.code == code
    assert "under-run" in outcome.text
    assert "late" in outcome.text
