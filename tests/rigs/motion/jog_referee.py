"""Judges the set-points of a jog with arithmetic of its own, tick by tick.

Nothing here is shared with `motion.jog`: limits from the robot file, velocities by comparing
positions with forward kinematics of other modules, pose errors against the exact line.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from promises.promise_table import figure
from rigs.motion.jogged_robots import REDUCED, UR5_BENT, model, robot

from openpendant.motion.description.limits import JointLimits
from openpendant.motion.jog import JogCaps, JogCause, Jogger, JogSetpoint, JogTarget
from openpendant.motion.kinematics.serial import Kinematics
from openpendant.motion.paths.mechanism import Mechanism, SerialMechanism
from openpendant.motion.pose import Array
from openpendant.motion.scene.collision import CollisionModel
from openpendant.motion.trajectory.point_speed import elbow_link

POINT_LIMIT = figure(12, "speed").bound / 1e3 * (1.0 + figure(12, "excess").bound)
CLEAR = figure(16, "clear").bound / 1e3
NOISE = 5e-5


@dataclass
class Referee:
    """Watches one jogger; the first fault is raised as a sentence.

    Attributes:
        dt: length of a tick [s].
        reduced: whether tool and elbow are held to 250 mm/s.
        collision: bodies that must not come nearer than 5 mm; None not to look.
        beyond: joints that stand beyond their limit at the start.
    """

    robot: Mechanism
    jogger: Jogger
    dt: float = 0.01
    reduced: bool = True
    collision: CollisionModel | None = None
    steps: list[JogSetpoint] = field(default_factory=list)
    fastest_point: float = 0.0
    _floor: Array | None = None

    def __post_init__(self) -> None:
        self.position = self.jogger.position
        self.velocity = [0.0] * len(self.position)
        self.elbow: str | None = None
        if isinstance(self.robot, SerialMechanism):
            self.elbow = elbow_link(self.robot.kinematics)

    @property
    def limits(self) -> JointLimits:
        return self.robot.limits

    def run(self, target: JogTarget | None, ticks: int) -> JogSetpoint:
        """Jog for some ticks and judge each."""
        self.jogger.aim(target)
        for _ in range(ticks):
            self.tick()
        return self.steps[-1]

    def rest(self, target: JogTarget | None, most: int = 1500) -> JogSetpoint:
        """Jog until the robot stands, and judge each tick."""
        self.jogger.aim(target)
        for _ in range(most):
            step = self.tick()
            if step.at_rest and (target is None or step.cause is not None):
                return step
        raise AssertionError(f"still moving after {most} ticks")

    def tick(self) -> JogSetpoint:
        step = self.jogger.step(self.dt)
        self._judge(step)
        self.steps.append(step)
        self.position, self.velocity = step.position, step.velocity
        return step

    def _judge(self, step: JogSetpoint) -> None:
        limits, dt = self.limits, self.dt
        for joint, name in enumerate(limits.names):
            q, v = step.position[joint], step.velocity[joint]
            q0, v0 = self.position[joint], self.velocity[joint]
            lower, upper = limits.lower[joint], limits.upper[joint]
            top, gain = limits.velocity[joint], limits.acceleration[joint] * 1.001
            if not (math.isfinite(q) and math.isfinite(v)):
                raise AssertionError(f"{name} is not finite")
            outside = max(lower - q, q - upper, 0.0)
            # From beyond a limit the way may lead back only.
            if outside > max(lower - q0, q0 - upper, 0.0):
                raise AssertionError(f"{name} at {q} beyond [{lower}, {upper}]")
            if abs(v) > top * (1.0 + 1e-6):
                raise AssertionError(f"{name} at {v} faster than {top}")
            if abs(v - v0) > gain * dt:
                raise AssertionError(f"{name} changes by {v - v0} in a tick, {gain * dt} allowed")
            jump = q - q0 - 0.5 * (v + v0) * dt
            if abs(jump) > 0.25 * gain * dt * dt + 1e-9:
                raise AssertionError(f"{name} jumps by {jump}")
            if abs(q - q0) > top * dt * (1.0 + 1e-6) + 1e-12:
                raise AssertionError(f"{name} moves {q - q0} in a tick")
        if self.reduced:
            self._judge_points(step)
        if self.collision is not None:
            self._judge_clearance(step)

    def _judge_points(self, step: JogSetpoint) -> None:
        before, after = np.array(self.position), np.array(step.position)
        if np.array_equal(before, after):
            return
        for name, speed in self._point_speeds(before, after, np.array(step.velocity)):
            self.fastest_point = max(self.fastest_point, speed)
            if speed > POINT_LIMIT:
                raise AssertionError(f"the {name} is at {speed} m/s")

    def _point_speeds(
        self, before: Array, after: Array, velocity: Array
    ) -> list[tuple[str, float]]:
        speeds = []
        for name, link in (("tool", None), ("elbow", self.elbow)):
            if name == "elbow" and link is None:
                continue
            way = math.dist(self._point(before, link), self._point(after, link)) / self.dt
            # The speed at the set-point itself, by differences along its velocity.
            ahead = self._point(after + 1e-6 * velocity, link)
            behind = self._point(after - 1e-6 * velocity, link)
            speeds += [(name, way), (name, math.dist(ahead, behind) / 2e-6)]
        return speeds

    def _point(self, position: Array, link: str | None) -> list[float]:
        if isinstance(self.robot, SerialMechanism):
            kinematics: Kinematics = self.robot.kinematics
            place: list[float] = kinematics.forward(position, link=link).position.tolist()
            return place
        found: list[float] = self.robot.forward(position).position.tolist()
        return found

    def _judge_clearance(self, step: JogSetpoint) -> None:
        assert self.collision is not None
        now = self.collision.clearances(np.array(step.position))
        if self._floor is None:
            self._floor = self.collision.clearances(np.array(self.position))
        # What was nearer than 5 mm may only part: it never comes nearer than it was, but for the
        # curvature between two looks.
        floor = np.minimum(self._floor, CLEAR)
        for pair in np.flatnonzero(now < floor - NOISE).tolist():
            names = self.collision.pairs[pair]
            raise AssertionError(f"{names} are {now[pair]} m apart, {floor[pair]} before")
        self._floor = np.maximum(self._floor, now)


def referee(
    name: str = "ur5",
    start: Sequence[float] = UR5_BENT,
    caps: JogCaps = REDUCED,
    dt: float = 0.01,
) -> Referee:
    """Watch a jog of a robot of the project."""
    return Referee(robot(name), Jogger(model(name), start, caps), dt, caps.reduced)


def cause_of(step: JogSetpoint) -> JogCause:
    """Return what slows or holds the robot, which must be told."""
    assert step.cause is not None
    return step.cause


def joints_out(step: JogSetpoint) -> tuple[float, ...]:
    """Return the keys of joints that are suggested, which must be told."""
    assert step.retreat is not None
    assert step.retreat.joints is not None
    return step.retreat.joints


def line_error(
    robot: Mechanism, start: Sequence[float], direction: Array, step: JogSetpoint
) -> tuple[float, float]:
    """Return how far the tool is off the straight line it began [m], and how much turned [rad]."""
    began, now = robot.forward(start), robot.forward(step.position)
    way = now.position - began.position
    off = way - (way @ direction) * direction
    return float(np.linalg.norm(off)), began.rotation_distance(now)
