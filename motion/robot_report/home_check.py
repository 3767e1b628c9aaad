"""Home check: can a tool be jogged any way from a joint position, above all from home?

Owns the first increments that a person at a pendant tries, and the verdict on a position: it is
inside the limits and free of self-collision, the mechanism is not singular there, and each single
increment that the arm can do is accepted: 10 mm along and 5° about the axes of the base, and of the
tool, both ways, 24 in all. Each is tried as the server would carry it out: by the line planner, the
check of self-collision on the path, the timing, and the limit certificate.

What an arm of fewer than six axes cannot do from anywhere is not held against a position: an axis
along or about which the tool would have to move, and which is not in the column space of the
Jacobian though that has its full rank. For four-axis arms these are A and B, the rotations about x
and y: they do 8 of the 12 increments of each frame. Findings are data; it prints nothing.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..description.robot import Robot
from ..errors import MotionError
from ..jog.jog_commands import shifted, turned
from ..kinematics.ik.singularity import SINGULAR, condition
from ..kinematics.serial import Kinematics
from ..paths.mechanism import Mechanism, PlatformMechanism, SerialMechanism, mechanism
from ..planning.path_check import check_path
from ..pose import Array, Pose
from ..scene.collision import CollisionModel, Proximity
from ..timing.parameterization import time_path
from ..trajectory.certificate import certify

SHIFT = 0.010
"""Increment along an axis [m]."""

TURN = math.radians(5.0)
"""Increment about an axis [rad]."""

AXES = ("x", "y", "z", "A", "B", "C")
"""Axes of an increment: along x, y, z, and about them."""

_BEYOND = 1e-6
"""Share of a unit twist outside the column space from which an arm cannot move so."""


class Increment(NamedTuple):
    """Single increment of the tool: a frame's axis and a way along or about it."""

    frame: str
    axis: int
    sign: int

    @property
    def label(self) -> str:
        """The increment as on a key of a pendant, such as `+x` or `-B`."""
        return f"{'+' if self.sign > 0 else '-'}{AXES[self.axis]}"

    def target(self, here: Pose) -> Pose:
        """Return the pose of the tool in base after the increment, from where it is."""
        axes = here if self.frame == "tool" else None
        vector = [0.0, 0.0, 0.0]
        if self.axis < 3:
            vector[self.axis] = self.sign * SHIFT
            return shifted(here, vector, axes)
        vector[self.axis - 3] = self.sign * TURN
        return turned(here, vector, axes)


FRAMES = ("base", "tool")
INCREMENTS = tuple(
    Increment(frame, axis, sign) for frame in FRAMES for axis in range(6) for sign in (1, -1)
)
"""The 24 first increments, those along and about the axes of the base first."""


class RefusedIncrement(NamedTuple):
    """Increment that is refused, and why."""

    increment: Increment
    error: MotionError


@dataclass(frozen=True, slots=True)
class HomeReport:
    """Verdict on a joint position from which a tool is to be jogged.

    Attributes:
        robot: name of the robot.
        position: (n,) controller side; of a platform the lengths of its legs [rad or m].
        pose: the tool there in base; None outside the limits.
        condition: greatest over least singular value of the Jacobian without units; infinite at a
            singularity.
        outside: the limit that the position breaks; None if it keeps all.
        contact: two links that touch there; None if none do.
        beyond: increments that the arm cannot do from anywhere.
        refused: the other increments that are refused, each with its reason.
    """

    robot: str
    position: tuple[float, ...]
    pose: Pose | None
    condition: float
    outside: MotionError | None
    contact: Proximity | None
    beyond: tuple[Increment, ...]
    refused: tuple[RefusedIncrement, ...]

    @property
    def is_good(self) -> bool:
        """True if the position is legal, touches nothing, and refuses nothing that it could do."""
        return self.outside is None and self.contact is None and not self.refused

    def possible(self, frame: str) -> int:
        """Return how many of the 12 increments of a frame the arm can do at all."""
        return len(INCREMENTS) // 2 - sum(each.frame == frame for each in self.beyond)

    def accepted(self, frame: str) -> int:
        """Return how many of the 12 increments of a frame are accepted."""
        if self.outside is not None:
            return 0
        refused = sum(each.increment.frame == frame for each in self.refused)
        return self.possible(frame) - refused


def check_home(robot: Robot) -> HomeReport:
    """Return the verdict on a robot's home."""
    arm = mechanism(robot)
    return check_position(robot.name, arm, arm.home_position)


def check_position(
    name: str,
    arm: Mechanism,
    position: Sequence[float],
    collision: CollisionModel | None = None,
    *,
    most_refused: int = len(INCREMENTS),
) -> HomeReport:
    """Return the verdict on any joint position of a robot.

    Args:
        name: of the robot, for the report.
        position: (n,) controller side [rad or m].
        collision: model of a serial arm that was built already; built here if None.
        most_refused: how many refusals are found before the check ends: a search for a good
            position needs one.
    """
    joints = tuple(float(value) for value in position)
    try:
        arm.limits.check_position(joints)
        pose = arm.forward(joints)
    except MotionError as error:
        return HomeReport(name, joints, None, math.inf, error, None, (), ())
    if isinstance(arm, SerialMechanism) and collision is None:
        collision = CollisionModel(arm.kinematics)
    contact = None if collision is None else touching_at(collision, joints)
    beyond = increments_beyond(arm, joints, pose)
    refused: list[RefusedIncrement] = []
    for increment in INCREMENTS:
        if contact is not None or len(refused) >= most_refused:
            break
        if increment not in beyond:
            refused.extend(_refusal(arm, joints, pose, increment, collision))
    measure = condition_at(arm, joints)
    return HomeReport(name, joints, pose, measure, None, contact, beyond, tuple(refused))


def touching_at(collision: CollisionModel, joints: Sequence[float]) -> Proximity | None:
    """Return two bodies that touch at a (n,) position; None if none do."""
    if not collision.pairs:
        return None
    nearest = collision.distance(joints)
    return nearest if nearest is not None and nearest.touching else None


def condition_at(arm: Mechanism, joints: Sequence[float]) -> float:
    """Return the condition number of the Jacobian without units; infinite from `SINGULAR` on."""
    if isinstance(arm, PlatformMechanism):
        kinematics = arm.kinematics
        found = kinematics.workspace.holding(kinematics.forward(joints)).condition
        return found if found < SINGULAR else math.inf
    assert isinstance(arm, SerialMechanism)
    return condition(arm.kinematics, joints)


def increments_beyond(arm: Mechanism, joints: Sequence[float], here: Pose) -> tuple[Increment, ...]:
    """Return the increments that an arm of fewer than six axes cannot do by its construction.

    None at a singularity: what is lost there is lost at that position only.
    """
    if not isinstance(arm, SerialMechanism) or arm.limits.dof >= len(AXES):
        return ()
    kinematics = arm.kinematics
    jacobian = _scaled(kinematics, joints)
    basis, gains, _ = np.linalg.svd(jacobian, full_matrices=False)
    if gains[-1] * SINGULAR < gains[0]:
        return ()
    beyond = []
    for increment in INCREMENTS:
        twist = _twist(increment, here)
        if np.linalg.norm(twist - basis @ (basis.T @ twist)) > _BEYOND:
            beyond.append(increment)
    return tuple(beyond)


def _scaled(kinematics: Kinematics, joints: Sequence[float]) -> Array:
    """Return the (6, n) Jacobian in base with lengths in arm's sizes."""
    jacobian = kinematics.jacobian(joints) * np.where(
        kinematics.limits.prismatic, kinematics.size, 1.0
    )
    jacobian[:3] /= kinematics.size
    return jacobian


def _twist(increment: Increment, here: Pose) -> Array:
    """Return the (6,) unit twist [v; ω] of an increment in base."""
    axis = np.eye(3)[increment.axis % 3]
    if increment.frame == "tool":
        axis = here.rotation @ axis
    twist = np.zeros(6)
    twist[slice(0, 3) if increment.axis < 3 else slice(3, 6)] = axis
    return twist


def _refusal(
    arm: Mechanism,
    joints: tuple[float, ...],
    here: Pose,
    increment: Increment,
    collision: CollisionModel | None,
) -> Iterator[RefusedIncrement]:
    """Yield why an increment is refused, if it is."""
    try:
        path = arm.line(joints, increment.target(here))
        trajectory = time_path(path, arm.limits)
        certify(trajectory, arm.limits, start=joints)
        if collision is not None:
            check_path(collision, trajectory.position)
    except MotionError as error:
        yield RefusedIncrement(increment, error)
