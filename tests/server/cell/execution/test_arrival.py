"""When a motion has arrived, and how far a robot has come: by reports written down.

The status that came with them says that the robot stands, so that only the joints decide.
"""

from __future__ import annotations

from collections.abc import Sequence

import pytest
from rigs.cells.server_rig import LIMITS

from openpendant.motion.trajectory.ptp import plan_joint_move
from openpendant.motion.trajectory.trajectory import Row
from openpendant.server.cell.execution.feedback import Feedback
from openpendant.server.cell.execution.point_stream import PointStream, StreamPhase
from openpendant.server.cell.execution.setpoint_sources import StoredRows
from openpendant.server.cell.execution.tracking import TrackingMonitor
from openpendant.server.refusal import Refusal
from openpendant.server.settings.cell_settings import ControllerLink
from openpendant.server.uplinks.generic import GenericUplink
from openpendant.simplemsg import (
    HeaderOnly,
    JointFeedback,
    MsgType,
    Status,
    ValidField,
    joint_array,
)

MS = 1_000_000
LINK = ControllerLink()
GOAL = (0.4, -0.2)
MOVE = plan_joint_move((0.0, 0.0), GOAL, LIMITS)
END = round(MOVE.duration * 1e9)
NOTHING = joint_array(())


def reported(feedback: Feedback, position: Sequence[float], speed: float, now: int) -> None:
    fields = ValidField.POSITION | ValidField.VELOCITY
    joints, speeds = joint_array(position), joint_array([speed] * len(position))
    feedback.take(JointFeedback(0, fields, 0.0, joints, speeds, NOTHING), now)
    feedback.take(Status(1, 0, 0, 0, 0, 2, 1), now)


class Sent:
    def __init__(self, taken: int = END) -> None:
        uplink = GenericUplink(LINK, LIMITS.velocity)
        self.execution = PointStream(StoredRows(MOVE, LIMITS), LIMITS, uplink, LINK, 0)
        self.feedback = Feedback(2, LINK)
        reported(self.feedback, (0.0, 0.0), 0.0, 0)
        while self.execution.next_point(END) is not None:
            uplink.answer(HeaderOnly(MsgType.JOINT_TRAJ_PT_FULL), 0)
        reported(self.feedback, GOAL, 0.0, taken - 1)
        assert self.advance(taken) is None
        assert not self.has_arrived

    def advance(self, now: int) -> Refusal | None:
        return self.execution.advance(self.feedback, now)

    @property
    def has_arrived(self) -> bool:
        return self.execution.phase is StreamPhase.ARRIVED

    def arrives(self, position: Sequence[float], speed: float, now: int) -> bool:
        reported(self.feedback, position, speed, now)
        assert self.advance(now) is None
        return self.has_arrived


@pytest.mark.parametrize(
    ("position", "arrives"),
    [
        (GOAL, True),
        ((0.4009, -0.2009), True),
        ((0.4011, -0.2), False),
        ((0.3989, -0.2), False),
        ((0.4, -0.1989), False),
        ((0.4, -0.2011), False),
        ((0.0, 0.0), False),
    ],
)
def test_a_motion_arrives_where_each_joint_is_at_its_goal(
    position: Sequence[float], arrives: bool
) -> None:
    assert Sent().arrives(position, 0.0, END) is arrives


@pytest.mark.parametrize(("speed", "arrives"), [(0.0009, True), (0.0011, False)])
def test_a_motion_arrives_where_the_robot_stands(speed: float, arrives: bool) -> None:
    assert Sent().arrives(GOAL, speed, END) is arrives


def test_no_report_from_before_the_end_of_a_motion_tells_of_it() -> None:
    sent = Sent(END - 50 * MS)
    assert not sent.arrives(GOAL, 0.0, END - 1)
    assert sent.arrives(GOAL, 0.0, END)


def following(started: int, count: int = 10) -> TrackingMonitor:
    """Return the progress on samples of 0.01 rad each, 10 ms apart."""
    made = TrackingMonitor(started)
    for index in range(count):
        made.sent(Row(0.01 * index, [0.01 * index], [1.0], [0.0]))
    return made


def seen(progress: TrackingMonitor, position: float, at: int) -> int:
    feedback = Feedback(1, LINK)
    reported(feedback, [position], 0.0, at * MS)
    progress.update(feedback)
    return progress.base // MS


@pytest.mark.parametrize(
    ("position", "at", "base"),
    [
        (0.05, 150, 100),  # on time
        (0.05, 170, 120),  # 20 ms late
        (0.05, 130, 100),  # ahead, which it never is
        (0.0, 400, 400),  # it stands
        (0.02, 99, 100),  # from before it began
        (0.09, 900, 100),  # at the end of what was sent, whenever that was
    ],
)
def test_a_robot_began_when_its_place_says(position: float, at: int, base: int) -> None:
    assert seen(following(100 * MS), position, at) == base


def test_a_report_from_before_the_start_moves_nothing_on() -> None:
    progress = following(100 * MS)
    assert seen(progress, 0.08, 99) == 100
    assert seen(progress, 0.03, 150) == 120


def test_a_robot_goes_never_back_on_its_way() -> None:
    progress = following(0)
    assert seen(progress, 0.06, 60) == 0
    assert seen(progress, 0.02, 70) == 10  # it stands at what it had reached


def test_at_the_last_sample_the_time_that_was_known_stays() -> None:
    progress = following(0)
    assert seen(progress, 0.07, 90) == 20
    assert seen(progress, 0.09, 500) == 20
