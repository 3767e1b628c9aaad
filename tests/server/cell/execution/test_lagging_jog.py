from __future__ import annotations

from random import Random
from typing import cast

import pytest
from rigs.cells.lagging_robot import TICK, LaggingRobot, TrackedDrive
from rigs.motion.simple_jogger import SimpleJogger

from openpendant.motion.description.limits import JointLimits
from openpendant.motion.jog import JogCaps, Jogger, JointJog
from openpendant.server.cell.execution.setpoint_sources import JogRows, Press
from openpendant.server.cell.execution.trajectory_execution import ActiveMotion
from openpendant.server.control import MotionKind
from openpendant.server.events.cell_events import MotionRequest
from openpendant.server.settings.cell_settings import ControllerLink, JogSettings
from openpendant.simplemsg.verdicts import VerdictCode as V

LIMITS = JointLimits(
    names=("first", "second"),
    lower=(-6.0, -6.0),
    upper=(6.0, 6.0),
    velocity=(1.0, 1.0),
    acceleration=(5.0, 5.0),
    prismatic=(False, False),
)
LINK = ControllerLink()
LEAD = JogSettings().lead
HOLD_NS = 60_000_000_000


class StandingRobot(LaggingRobot):
    stands_from: int | None = None

    def advance(self, now: int) -> None:
        super().advance(now if self.stands_from is None else min(now, self.stands_from))


def held_jog(lag: float) -> tuple[TrackedDrive, StandingRobot]:
    start = (0.0, 0.0)
    robot = StandingRobot(LIMITS, start, [lag, lag / 2], 0)
    drive = TrackedDrive(LIMITS, LINK, robot, chance=Random(1), is_prompt=True)
    caps = JogCaps(1.0, 1.0, 10.0, 1.0, False)
    press = Press(1, 1, HOLD_NS, drive.now)
    jogger = SimpleJogger(LIMITS, start, caps)
    jogger.aim(JointJog((0.5, 0.3)))
    rows = JogRows(cast(Jogger, jogger), start, JointJog((0.5, 0.3)), press)
    drive.perform(
        drive.driving.drive(
            ActiveMotion(MotionRequest(1, 1), MotionKind.JOG, 1), rows, LEAD, drive.now
        )
    )
    return drive, robot


@pytest.mark.parametrize("lag", [0.0, 0.03, 0.05, LINK.lag])
def test_a_robot_that_lags_as_declared_is_jogged_at_the_usual_lead(lag: float) -> None:
    drive, robot = held_jog(lag)
    drive.run(3_000)
    assert drive.driving.is_driving
    assert robot.stock(drive.now) <= round(LEAD * 1e9) + TICK
    assert drive.ended == drive.alarms == []
    assert robot.waited == 0


def test_one_that_stands_does_not_follow_after_half_a_second() -> None:
    drive, robot = held_jog(0.0)
    drive.run(1_000)
    robot.stands_from = drive.now
    drive.run(490)
    assert drive.ended == []
    drive.run(30)
    (refusal,) = drive.ended
    assert refusal is not None
    assert refusal.code is V.NOT_FOLLOWING
    assert robot.stock(drive.now) <= round((LEAD + LINK.lag) * 1e9) + TICK
