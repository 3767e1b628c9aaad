"""Mechanism: kinematics and paths of a robot, be it a serial arm or a platform.

Owns the calls that both have, and the choice between them: a serial arm through `serial`, `ik` and
`paths`, a Stewart platform through `platform` and `stewart_path`. A joint vector has the limits'
meaning, (n,) angles and shifts of a serial arm or lengths of legs [rad or m]. The paths returned
are timed by `parameterization.time_path` and certified as any other.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import TYPE_CHECKING

from ..description.limits import JointLimits
from ..description.robot import ParallelRobot, Robot, SerialRobot
from ..pose import Array, Pose
from ..trajectory.joint_curves import JointSpline, Path
from .segments import Segment

if TYPE_CHECKING:
    from ..kinematics.ik.ik import Solution
    from ..kinematics.serial import Kinematics
    from ..kinematics.stewart.platform import StewartKinematics


class Mechanism(ABC):
    """Kinematics and paths of a robot; poses are of the tool, `frame` is `base` or `root`.

    Every method refuses by a `MotionError`: a malformed joint position, a pose out of reach, a
    place of a path with its fraction, a segment with its number.

    Attributes:
        home_position: (n,) the joint position at home [rad or m].
    """

    def __init__(
        self, kinematics: Kinematics | StewartKinematics, home_position: tuple[float, ...]
    ) -> None:
        self._kinematics = kinematics
        self.limits: JointLimits = kinematics.limits
        self.home_position = home_position

    @abstractmethod
    def solve(
        self, target: Pose, seed: Sequence[float] | Array, *, frame: str = "base"
    ) -> Solution:
        """Return a joint position inside the limits that puts the tool at a pose."""

    @abstractmethod
    def line(self, start: Sequence[float] | Array, target: Pose, *, frame: str = "base") -> Path:
        """Return the path of the tool along a straight line with an even rotation."""

    @abstractmethod
    def curve(self, waypoints: Sequence[Sequence[float] | Array]) -> Path:
        """Return the smooth path through joint positions; through two, the straight one."""

    def forward(self, joint_position: Sequence[float] | Array, frame: str = "base") -> Pose:
        """Return the tool's pose."""
        return self._kinematics.forward(joint_position, frame)

    def jacobian(self, joint_position: Sequence[float] | Array, frame: str = "base") -> Array:
        """Return the (6, n) twist [v; ω] of the tool's origin per unit of joint velocity.

        Linear velocity comes first [m/s], then angular [rad/s], both along the axes of `frame`.
        """
        return self._kinematics.jacobian(joint_position, frame)

    def segments(self, start: Sequence[float] | Array, segments: Sequence[Segment]) -> list[Path]:
        """Return the paths of PTP, LIN, CIRC and spline segments in sequence; see `plan_path`."""
        from .paths import plan_path

        return plan_path(self._kinematics, start, segments)


class SerialMechanism(Mechanism):
    """Serial arm."""

    def __init__(self, robot: SerialRobot) -> None:
        from ..kinematics.serial import Kinematics

        self.kinematics = Kinematics(robot)
        super().__init__(self.kinematics, robot.home_position)

    def solve(
        self, target: Pose, seed: Sequence[float] | Array, *, frame: str = "base"
    ) -> Solution:
        """Return a joint position that puts the tool at a pose, near the seed if possible."""
        from ..kinematics.ik.ik import solve

        return solve(self.kinematics, target, seed, frame=frame)

    def line(self, start: Sequence[float] | Array, target: Pose, *, frame: str = "base") -> Path:
        """Return the straight tool line."""
        from .paths import linear_path

        return linear_path(self.kinematics, start, target, frame=frame)

    def curve(self, waypoints: Sequence[Sequence[float] | Array]) -> Path:
        """Return the smooth path through joint positions."""
        return JointSpline(waypoints, self.limits)


class PlatformMechanism(Mechanism):
    """Stewart platform; its joint vector is six leg lengths [m]."""

    def __init__(self, robot: ParallelRobot) -> None:
        from ..kinematics.stewart.platform import StewartKinematics

        self.kinematics = StewartKinematics(robot)
        super().__init__(self.kinematics, self.kinematics.home_position)

    def solve(
        self, target: Pose, seed: Sequence[float] | Array, *, frame: str = "base"
    ) -> Solution:
        """Return the leg lengths of a pose; there is one answer, whatever the seed."""
        return self.kinematics.solve(target, seed, frame=frame)

    def line(self, start: Sequence[float] | Array, target: Pose, *, frame: str = "base") -> Path:
        """Return the straight line of the platform."""
        from .stewart_path import platform_line

        return platform_line(self.kinematics, start, target, frame=frame)

    def curve(self, waypoints: Sequence[Sequence[float] | Array]) -> Path:
        """Return the smooth path through leg lengths."""
        from .stewart_path import leg_curve

        return leg_curve(self.kinematics, waypoints)


def mechanism(robot: Robot) -> Mechanism:
    """Return the mechanism of a robot of any kind."""
    match robot:
        case SerialRobot():
            return SerialMechanism(robot)
        case ParallelRobot():
            return PlatformMechanism(robot)
