"""Promise 52: a robot within its tolerances is never stopped for having left its path.

Over the whole catalogue: joints that lag each by itself, up to the lag that is declared, noise as
declared, and reports that are up to 200 ms late in every way that one connection allows.
"""

from collections import Counter
from collections.abc import Sequence
from functools import cache
from random import Random

import numpy as np
import pytest
from promises.promise_table import figure
from rigs.cells.lagging_robot import MS, LaggingRobot, TrackedDrive

from openpendant.motion.description.robot import robot_names, serial_robot
from openpendant.motion.errors import MotionError
from openpendant.motion.jog import JogCaps, Jogger, JogModel, JogTarget, JointJog, ToolJog
from openpendant.motion.jog.line_speed_bounds import lever_arms
from openpendant.motion.kinematics.serial import Kinematics
from openpendant.motion.timing.parameterization import time_path
from openpendant.motion.trajectory.certificate import certify, certify_straight_move
from openpendant.motion.trajectory.joint_curves import JointSpline
from openpendant.motion.trajectory.point_speed import elbow_link, reduced_speed
from openpendant.motion.trajectory.ptp import straight_move
from openpendant.server.cell.execution.setpoint_sources import JogRows, Press
from openpendant.server.cell.execution.trajectory_execution import ActiveMotion
from openpendant.server.control import REDUCED_SPEED, MotionKind
from openpendant.server.events.cell_events import MotionRequest
from openpendant.server.planning.jobs import CertifiedTrajectory
from openpendant.server.refusal import Refusal
from openpendant.server.settings.cell_settings import ControllerLink
from openpendant.simplemsg.pendant import JogEnd
from openpendant.simplemsg.verdicts import VerdictCode as V

SERIAL = [name for name in robot_names() if name != "stewart_classroom"]
ALARMS = {V.LEFT_THE_PATH, V.OVER_SPEED, V.OVER_RANGE}
REAL = {"path_tolerance": 0.02, "lag": 0.08, "noise": 0.001}
EMULATED = {"path_tolerance": 0.01, "lag": 0.01, "noise": 0.0}
HOLD_NS = 10_000_000_000


class Arm:
    """A robot with the points whose speed T1 caps."""

    def __init__(self, name: str) -> None:
        self.kinematics = kinematics = Kinematics(serial_robot(name))
        self.limits = kinematics.limits
        self.jogs = JogModel(kinematics)
        links = [kinematics.robot.tool_link, elbow_link(kinematics)]
        self._points = [kinematics.link_point(link) for link in links if link is not None]
        self.lever_arms = [lever_arms(kinematics, link) for link in links if link is not None]

    def speed_points(self, position: Sequence[float]) -> tuple[tuple[float, ...], ...]:
        return self.kinematics.point_places(position, self._points)

    def somewhere(self, chance: Random, margin: float = 0.1) -> tuple[float, ...]:
        ends = zip(self.limits.lower, self.limits.upper, strict=True)
        return tuple(low + (up - low) * chance.uniform(margin, 1.0 - margin) for low, up in ends)

    def near(self, place: tuple[float, ...], chance: Random, way: float) -> tuple[float, ...]:
        """Return a place to which a move at full speed takes about so long [s]."""
        joints = zip(place, self.limits.lower, self.limits.upper, self.limits.velocity, strict=True)
        return tuple(
            min(max(at + chance.uniform(-way, way) * speed, low), up)
            for at, low, up, speed in joints
        )


@cache
def arm(name: str) -> Arm:
    return Arm(name)


class Trial:
    def __init__(self, seed: int) -> None:
        self.chance = chance = Random(seed)
        self.arm = arm(SERIAL[seed % len(SERIAL)])
        declared = chance.choice((REAL, EMULATED))
        link = ControllerLink(**declared)
        self.link = link.model_copy(update={"lead": chance.choice((0.09, 0.25))})
        self.start = self.arm.somewhere(chance)
        lags = [chance.choice((0.0, 1.0, chance.random())) for _ in self.start]
        robot = LaggingRobot(
            self.arm.limits,
            self.start,
            [lag * declared["lag"] for lag in lags],
            chance.choice((0, 0, chance.randint(0, 100 * MS))),
        )
        self.kind = chance.choice(("move", "move", "move", "jog", "jog", "reduced"))
        self.cap = None if self.kind == "move" else REDUCED_SPEED
        self.drive = TrackedDrive(
            self.arm.limits, self.link, robot, self.arm, self.cap, chance=chance
        )

    def run(self) -> None:
        drive, chance, driving = self.drive, self.chance, self.drive.driving
        work = ActiveMotion(
            MotionRequest(1, 1), MotionKind.JOG if self.kind == "jog" else MotionKind.MOVE, 1
        )
        if self.kind == "jog":
            press = Press(1, 1, HOLD_NS, drive.now)
            caps = JogCaps(1.0, chance.uniform(0.1, 1.0), REDUCED_SPEED, 0.8, False)
            rows = JogRows(Jogger(self.arm.jogs, self.start, caps), self.start, self.key(), press)
            drive.perform(driving.drive(work, rows, 0.1, drive.now))
            drive.run(chance.randint(10, 80) * 10)
            if driving.is_driving and chance.random() < 0.5:
                rows.aim(self.key(), press)
                drive.run(chance.randint(1, 30) * 10)
            rows.release(JogEnd.RELEASED, drive.now)
        else:
            drive.perform(driving.play(work, self.certified(), 1.0, drive.now))
            drive.run(chance.randint(1, 60) * 10)
        if chance.random() < 0.5:
            drive.perform(driving.end(Refusal(V.PROGRAM_STOPPED), drive.now))
        elif self.kind != "jog" and work.stored is not None and chance.random() < 0.3:
            work.stored.scale(chance.uniform(0.3, 1.0))
        for _ in range(60):
            if not driving.is_busy:
                break
            drive.run(50)
        drive.run(100)

    def key(self) -> JogTarget:
        shares = [self.chance.choice((-1.0, 0.0, 0.5, 1.0)) for _ in range(6)]
        if self.chance.random() < 0.5:
            return ToolJog(tuple(shares[:3]), tuple(shares[3:]))
        return JointJog(tuple((shares * 2)[: self.arm.limits.dof]))

    def certified(self) -> CertifiedTrajectory:
        arm, limits, chance = self.arm, self.arm.limits, self.chance
        if self.kind == "move":
            goal = arm.near(self.start, chance, chance.choice((0.05, 0.4, 0.8)))
            move = straight_move(self.start, goal, limits, speed=chance.choice((0.2, 1.0)))
            return CertifiedTrajectory(move, certify_straight_move(move, limits, start=self.start))
        places = [self.start]
        for _ in range(2):
            places.append(arm.near(places[-1], chance, 0.2))
        caps = reduced_speed(arm.kinematics, REDUCED_SPEED)
        trajectory = time_path(JointSpline(np.array(places), limits), limits, tool_speed=caps)
        return CertifiedTrajectory(
            trajectory, certify(trajectory, limits, start=self.start, tool_speed=caps)
        )


def alarms(seeds: range) -> dict[int, str]:
    wrong: dict[int, str] = {}
    kinds: Counter[str] = Counter()
    for seed in seeds:
        trial = Trial(seed)
        try:
            trial.run()
        except MotionError:
            continue
        kinds[trial.kind] += 1
        if trial.drive.alarms:
            wrong[seed] = f"{trial.kind}: {trial.drive.alarms[0]}"
    assert sum(kinds.values()) > 0.9 * len(seeds)
    assert set(kinds) == {"move", "jog", "reduced"}
    return wrong


def test_promise_52_nothing_is_stopped_that_keeps_within_its_tolerances() -> None:
    assert alarms(range(2 * len(SERIAL))) == {}


@pytest.mark.soak
def test_promise_52_nothing_is_stopped_in_ten_thousand_motions() -> None:
    assert alarms(range(1_000, 1_000 + figure(52, "motions").count)) == {}
