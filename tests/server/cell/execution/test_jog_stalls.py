"""A jog is held while server or emulator stalls again and again, exactly, on one clock."""

from random import Random
from typing import cast

import numpy as np
import pytest
from promises.promise_table import figure
from rigs.cells.lagging_robot import TICK, LaggingRobot, TrackedDrive
from rigs.cells.server_rig import MS
from rigs.cells.stalling_cell import StallingCell, Who
from rigs.motion.jog_pad import EmulatedPad
from rigs.motion.simple_jogger import SimpleJogger

from openpendant.motion.description.limits import JointLimits
from openpendant.motion.jog import JogCaps, Jogger, JointJog
from openpendant.server.cell.execution.setpoint_sources import JogRows, Press
from openpendant.server.cell.execution.tracking import EMULATED
from openpendant.server.cell.execution.trajectory_execution import ActiveMotion
from openpendant.server.control import MotionKind
from openpendant.server.events.cell_events import MotionRequest
from openpendant.server.settings.cell_settings import ControllerLink, JogSettings
from openpendant.simplemsg.pendant import Activity
from openpendant.simplemsg.verdicts import VerdictCode as V

BEAT = 50
"""Between two beats [ms]; each stall lasts a whole number of them."""

ROUND = 0.015
"""Between two looks of the server, and of the controller, the robot goes on [s]."""


class HeldJog(EmulatedPad):
    """A key of the first joint, held however either end stalls."""

    def __init__(self, lead: float) -> None:
        self.stalling = StallingCell(jog={"lead": lead})
        super().__init__(self.stalling)
        self.most_ahead = 0.0
        self.hold_key()

    def hold_key(self) -> None:
        self.let_go()
        self.squeeze()
        self.cell.wait(50)
        assert self.press(0.15, 0.0, 0.0, 0.0, 0.0, 0.0, deadline=0.25) is V.ACCEPTED

    def keep(self, milliseconds: int) -> None:
        for _ in range(0, milliseconds, BEAT):
            self.hold(BEAT)
            self.most_ahead = max(self.most_ahead, self.ahead)

    def stall(self, who: Who, milliseconds: int) -> None:
        self.stalling.stall(who, milliseconds, (BEAT, self.touch))
        self.most_ahead = max(self.most_ahead, self.ahead)

    def touch(self) -> None:
        self.squeeze()
        self.beat()

    @property
    def ahead(self) -> float:
        """Return how much the controller has in stock, by where the robot is [s]."""
        # Of a second: far more than is ever ahead.
        newest = self.sent[-100:]
        times, places = zip(*((each.time, each.positions[0]) for each in newest), strict=True)
        return float(times[-1] - np.interp(self.cell.position[0], places, times))

    @property
    def is_held(self) -> bool:
        return self.cell.core.cell.activity is Activity.JOGGING

    @property
    def ends(self) -> list[V]:
        return [code for _, code in self.pendant.outcomes()]


def stalls(jog: HeldJog, who: Who, lengths: list[int], between: int) -> None:
    jog.keep(300)
    for length in lengths:
        jog.stall(who, length)
        jog.keep(between)


@pytest.mark.parametrize("lead", [0.05, 0.1])
def test_twenty_stalls_of_an_emulator_end_no_jog(lead: float) -> None:
    chance = Random(55)
    jog = HeldJog(lead)
    stalls(jog, "emulator", [chance.choice((100, 150, 200)) for _ in range(20)], 300)
    assert (jog.is_held, jog.ends, jog.cell.controller.referee.events["stalls"]) == (True, [], 20)
    assert not jog.cell.controller.referee.events["under-runs"]


@pytest.mark.parametrize(("lead", "unseen"), [(0.05, 0.05), (0.1, 0.025)])
def test_and_the_controller_has_no_more_in_stock_than_the_lead(lead: float, unseen: float) -> None:
    """More only until it is seen that it stood still: 2.5 reports, or up to 100 ms in all."""
    jog = HeldJog(lead)
    stalls(jog, "emulator", [150] * 6, 300)
    assert jog.most_ahead <= lead + unseen + EMULATED["lag"] + ROUND
    assert lead - 0.02 <= jog.ahead <= lead + EMULATED["lag"] + ROUND


def test_twenty_stalls_of_the_server_within_the_lead_end_no_jog() -> None:
    jog = HeldJog(0.1)
    stalls(jog, "server", [50] * 20, 300)
    assert (jog.is_held, jog.ends) == (True, [])


@pytest.mark.parametrize(("lead", "away"), [(0.05, 100), (0.1, 150), (0.1, 200)])
def test_a_longer_one_ends_it_names_the_server_and_latches_nothing(lead: float, away: int) -> None:
    """A jog has no more under way than its lead, so that the robot runs out of points."""
    jog = HeldJog(lead)
    jog.keep(300)
    jog.stall("server", away)
    jog.keep(300)
    assert (jog.ends, jog.cell.core.cell.stop) == ([V.SERVER_LATE], None)
    jog.hold_key()
    jog.keep(300)
    assert jog.is_held


def test_a_robot_that_stands_more_than_half_of_the_time_does_not_follow() -> None:
    jog = HeldJog(0.05)
    stalls(jog, "emulator", [round(figure(55, "stall").ms)] * 6, 50)
    assert jog.ends == [V.NOT_FOLLOWING]
    assert jog.cell.now % (10 * MS) == 0


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
