"""When a motion has arrived, and how far a robot has come: by reports written down.

The status that came with them says that the robot stands, so that only the joints decide.
"""

from collections.abc import Sequence

import pytest
from rigs.cells.controller_reports import joint_report, status
from rigs.cells.expectations import only, refusal_from
from rigs.cells.server_rig import LIMITS, MS

from openpendant.motion.trajectory.ptp import plan_joint_move
from openpendant.server.cell.execution.feedback import Feedback, Shown, interruption
from openpendant.server.cell.execution.point_stream import PointStream, StreamPhase, start_mismatch
from openpendant.server.cell.execution.setpoint_sources import StoredRows
from openpendant.server.cell.execution.trajectory_execution import TrajectoryExecution
from openpendant.server.events.effects import ReconnectController, SendStop
from openpendant.server.refusal import Refusal
from openpendant.server.settings.cell_settings import ControllerLink, ControllerPath
from openpendant.server.uplinks.generic import GenericUplink
from openpendant.simplemsg import ControllerMode, HeaderOnly, JointTrajPtFull, MsgType, Status
from openpendant.simplemsg.verdicts import VerdictCode as V

LINK = ControllerLink()
LEAD = round(LINK.lead * 1e9)
TRAJECTORY = plan_joint_move((0.0, 0.0), (0.4, -0.2), LIMITS)
GOAL = (0.4, -0.2)
END = round(TRAJECTORY.duration * 1e9)
DONE = HeaderOnly(MsgType.JOINT_TRAJ_PT_FULL)


class Player:
    def __init__(self) -> None:
        self.uplink = GenericUplink(LINK, LIMITS.velocity)
        self.execution = PointStream(StoredRows(TRAJECTORY, LIMITS), LIMITS, self.uplink, LINK, 0)
        self.feedback = Feedback(2, LINK)
        self.report((0.0, 0.0), 0)
        self.tell_status(0)

    def report(
        self, position: Sequence[float], now: int, velocity: Sequence[float] = (0.0, 0.0)
    ) -> None:
        self.feedback.take(joint_report(position, velocity), now)

    def tell_status(self, now: int, moving: int = 0) -> None:
        self.feedback.take(status(moving=moving), now)

    def arrives(self, position: Sequence[float], speed: float, now: int) -> bool:
        """Have it report its joints and that it stands."""
        self.report(position, now, (speed, speed))
        self.tell_status(now)
        assert self.advance(now) is None
        return self.phase() is StreamPhase.ARRIVED

    def next(self, now: int) -> JointTrajPtFull | None:
        point = self.execution.next_point(now)
        assert point is None or isinstance(point, JointTrajPtFull)
        return point

    def answer(self) -> None:
        self.uplink.answer(DONE, 0)

    def advance(self, now: int) -> Refusal | None:
        return self.execution.advance(self.feedback, now)

    def phase(self) -> StreamPhase:
        return self.execution.phase

    def send_all(self, now: int = END) -> int:
        count = 0
        while self.next(now) is not None:
            self.answer()
            count += 1
        return count


@pytest.fixture
def player() -> Player:
    return Player()


def test_each_sample_leaves_once_and_in_order_and_never_ahead_of_the_lead(player: Player) -> None:
    sent: list[JointTrajPtFull] = []
    for now in range(0, END + 1, 5 * MS):
        while (point := player.next(now)) is not None:
            assert round(point.time * 1e9) <= now + LEAD
            sent.append(point)
            player.answer()
    assert [point.sequence for point in sent] == list(range(len(TRAJECTORY.times)))
    assert [point.time for point in sent] == TRAJECTORY.times.tolist()
    assert [point.positions[:2] for point in sent] == list(map(tuple, TRAJECTORY.position.tolist()))
    assert [point.velocities[:2] for point in sent] == list(
        map(tuple, TRAJECTORY.velocity.tolist())
    )


def test_the_sample_of_a_tick_is_due_exactly_when_the_lead_reaches_it(player: Player) -> None:
    player.send_all(0)
    for at, is_due in ((0, True), (10 * MS - 1, False), (10 * MS, True)):
        assert player.advance(at) is None
        assert (player.next(at) is not None) is is_due
        player.answer()


def test_a_second_sample_in_a_tick_must_be_due_by_half_a_tick(player: Player) -> None:
    player.send_all(0)
    for at, count in ((15 * MS - 1, 1), (35 * MS - 1, 2), (45 * MS, 2)):
        assert player.advance(at) is None
        assert player.send_all(at) == count


def test_one_request_is_under_way_at_a_time(player: Player) -> None:
    assert player.next(END) is not None
    assert player.next(END) is None
    player.answer()
    assert player.next(END) is not None


def test_a_report_from_before_a_late_last_point_was_taken_ends_no_motion(player: Player) -> None:
    player.send_all()
    late = END + 60 * MS
    player.report(GOAL, late - MS)
    player.tell_status(late - MS)
    assert player.advance(late) is None
    assert player.phase() is StreamPhase.SETTLING
    assert player.arrives(GOAL, 0.0, late + MS)


def test_a_status_from_before_the_end_ends_no_motion(player: Player) -> None:
    player.send_all()
    player.report(GOAL, END)
    assert player.advance(END) is None
    assert player.phase() is StreamPhase.SETTLING
    player.tell_status(END, moving=1)
    assert player.advance(END) is None
    assert player.phase() is StreamPhase.SETTLING
    player.tell_status(END + MS)
    assert player.advance(END + MS) is None
    assert player.phase() is StreamPhase.ARRIVED


def test_a_status_that_comes_only_when_it_changes_counts_100_ms_after_the_end(
    player: Player,
) -> None:
    player.send_all()
    player.report(GOAL, END)
    assert player.advance(END) is None
    for after, phase in ((99, StreamPhase.SETTLING), (100, StreamPhase.ARRIVED)):
        player.report(GOAL, END + after * MS)
        assert player.advance(END + after * MS) is None
        assert player.phase() is phase


def test_not_arriving_within_2_s_is_told_with_the_worst_joint(player: Player) -> None:
    player.send_all()
    late = END + 2_000 * MS
    player.report((0.39, -0.1), late - 1)
    assert player.advance(late - 1) is None
    refusal = refusal_from(player.advance(late))
    assert (refusal.code, refusal.joint) == (V.NOT_ARRIVED, 1)
    assert (refusal.value, refusal.limit) == pytest.approx((-0.1, -0.2))


def test_stale_feedback_ends_it_just_after_250_ms(player: Player) -> None:
    assert player.advance(250 * MS) is None
    assert refusal_from(player.advance(250 * MS + 1)).code is V.FEEDBACK_STALE


def test_a_report_that_is_no_position_ends_it(player: Player) -> None:
    player.report((float("nan"), 0.0), MS)
    assert refusal_from(player.advance(MS)).code is V.NOT_FINITE


def test_an_unanswered_point_ends_it_at_the_deadline(player: Player) -> None:
    player.next(0)
    player.report((0.0, 0.0), 499 * MS)
    assert player.advance(500 * MS - 1) is None
    assert refusal_from(player.advance(500 * MS)).code is V.CONTROLLER_SILENT


@pytest.mark.parametrize(
    ("away_ms", "error", "told_after_ms", "is_ours"),
    [
        (330, 109, 0, True),  # an under-run, by the emulator's number
        (330, -1, 0, True),  # an error without a number
        (330, 109, 1_000, True),
        (330, 109, 1_001, False),
        (330, 103, 0, False),
        (29, 109, 0, False),  # nobody was away
        (60, 109, 0, False),  # what had left lasted for long after that
    ],
)
def test_an_under_run_is_the_servers_where_it_was_away_and_left_the_robot_dry(
    player: Player, away_ms: int, error: int, told_after_ms: int, is_ours: bool
) -> None:
    now = 0
    for now in range(0, 101 * MS, 10 * MS):
        player.send_all(now)
    now += away_ms * MS
    own = Refusal(V.CONTROLLER_STOPPED, "error")
    player.execution.blamed(own, player.feedback, now)
    later = now + told_after_ms * MS
    player.feedback.take(Status(1, 0, max(error, 0), 1, 1, 2, 1), later)
    for at in range(now, later, 10 * MS):
        player.execution.blamed(own, player.feedback, at)  # nobody is away any more
    told = player.execution.blamed(own, player.feedback, later)
    assert (told.code is V.SERVER_LATE) is is_ours
    assert (told is own) is not is_ours


def test_it_starts_only_where_the_robot_stands(player: Player) -> None:
    assert start_mismatch(TRAJECTORY, player.feedback) is None
    player.report((0.0, 0.0101), 1)
    refusal = refusal_from(start_mismatch(TRAJECTORY, player.feedback))
    assert (refusal.code, refusal.joint) == (V.NOT_STANDING, 1)
    player.report((0.0, 0.0), 2, (0.01, 0.0))
    assert refusal_from(start_mismatch(TRAJECTORY, player.feedback)).code is V.NOT_STANDING


def ended(taken: int = END) -> Player:
    """Return a motion all of which was sent, and the last point of which was taken at a time."""
    made = Player()
    made.send_all()
    made.report(GOAL, taken - 1)
    made.tell_status(taken - 1)
    assert made.advance(taken) is None
    assert made.phase() is not StreamPhase.ARRIVED
    return made


@pytest.mark.parametrize(
    ("position", "speed", "arrives"),
    [
        (GOAL, 0.0, True),
        (GOAL, 0.0009, True),
        (GOAL, 0.0011, False),
        ((0.4009, -0.2009), 0.0, True),
        ((0.4011, -0.2), 0.0, False),
        ((0.3989, -0.2), 0.0, False),
        ((0.4, -0.1989), 0.0, False),
        ((0.4, -0.2011), 0.0, False),
        ((0.0, 0.0), 0.0, False),
    ],
)
def test_a_motion_arrives_where_the_robot_stands_with_each_joint_at_its_goal(
    position: Sequence[float], speed: float, arrives: bool
) -> None:
    assert ended().arrives(position, speed, END) is arrives


def test_no_report_from_before_the_end_of_a_motion_tells_of_it() -> None:
    sent = ended(END - 50 * MS)
    assert not sent.arrives(GOAL, 0.0, END - 1)
    assert sent.arrives(GOAL, 0.0, END)


AUTO, MANUAL = ControllerMode.AUTO, ControllerMode.MANUAL
SOUND = Shown(AUTO, "", 0)


@pytest.mark.parametrize(
    ("before", "after", "said"),
    [
        (SOUND, Shown(AUTO, "the emergency stop", 0), "the emergency stop"),
        (Shown(AUTO, "no power", 0), Shown(AUTO, "the emergency stop", 0), "the emergency stop"),
        (SOUND, Shown(MANUAL, "", 0), "from auto to manual"),
        (Shown(MANUAL, "", 0), SOUND, "from manual to auto"),
        (SOUND, Shown(ControllerMode.UNKNOWN, "", 0), "from auto to unknown"),
        (SOUND, Shown(AUTO, "", 7), "error 7"),
        (Shown(AUTO, "", 6), Shown(AUTO, "", 7), "error 7"),
        (SOUND, Shown(AUTO, "", -1), "error -1"),
    ],
)
def test_what_is_new_ends_what_is_under_way(before: Shown, after: Shown, said: str) -> None:
    refusal = refusal_from(interruption(before, after))
    assert refusal.code is V.CONTROLLER_STOPPED
    assert said in refusal.text


@pytest.mark.parametrize(
    ("before", "after"),
    [
        (SOUND, SOUND),
        (Shown(AUTO, "", 7), Shown(AUTO, "", 7)),
        (Shown(AUTO, "", 7), SOUND),
        (Shown(AUTO, "no power", 0), Shown(AUTO, "no power", 0)),
        (Shown(AUTO, "no power", 0), SOUND),
    ],
)
def test_what_was_shown_before_ends_nothing(before: Shown, after: Shown) -> None:
    assert interruption(before, after) is None


SECOND = 1_000_000_000
WHY = Refusal(V.STOPPED, "why")


@pytest.fixture
def feedback() -> Feedback:
    return Feedback(2, LINK)


@pytest.fixture
def driving(feedback: Feedback) -> TrajectoryExecution:
    return TrajectoryExecution(LINK, LIMITS, feedback, lambda *_: [], lambda *_: [], lambda _: [])


@pytest.mark.parametrize(
    ("up", "linked"),
    [
        ((), False),
        ((ControllerPath.MOTION,), False),
        ((ControllerPath.STATE,), False),
        ((ControllerPath.MOTION, ControllerPath.STATE), True),
    ],
)
def test_a_motion_needs_both_links(
    driving: TrajectoryExecution, up: tuple[ControllerPath, ...], linked: bool
) -> None:
    for path in up:
        driving.path_changed(path, True)
    assert driving.is_linked is linked


@pytest.mark.parametrize(("is_up", "is_dropped"), [(True, True), (False, False)])
def test_a_stop_is_waited_for_only_where_it_went(
    driving: TrajectoryExecution, is_up: bool, is_dropped: bool
) -> None:
    driving.path_changed(ControllerPath.MOTION, is_up)
    only(SendStop, driving.halt(WHY, 0))
    dropped = any(isinstance(item, ReconnectController) for item in driving.settle(2 * SECOND))
    assert dropped is is_dropped


def test_a_stop_on_a_link_that_was_lost_since_is_waited_for_no_more(
    driving: TrajectoryExecution,
) -> None:
    driving.path_changed(ControllerPath.MOTION, True)
    driving.halt(WHY, 0)
    driving.path_changed(ControllerPath.MOTION, False)
    assert driving.settle(2 * SECOND) == []


@pytest.mark.parametrize(
    ("path", "is_known"), [(ControllerPath.STATE, False), (ControllerPath.MOTION, True)]
)
def test_nothing_of_a_state_link_that_was_lost_is_believed(
    driving: TrajectoryExecution, feedback: Feedback, path: ControllerPath, is_known: bool
) -> None:
    feedback.take(joint_report(()), 0)
    driving.path_changed(path, False)
    assert (feedback.position is not None) is is_known
