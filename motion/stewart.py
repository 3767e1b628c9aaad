"""Kinematics of a Stewart platform, with the members that `Kinematics` has for a serial arm.

Owns what a joint vector means for it: six leg lengths, in file order [m], so the limits are those
of prismatic joints. Inverse kinematics is a formula, forward kinematics a search, the reverse of a
serial arm; whoever calls does not see it. Frames: `base` is the base plate's frame, which `root`
coincides with; the tool is the platform. Knows no path.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from .errors import BadArgument, FrameUnknown, NoAssembly, PlatformLimit
from .limits import JointLimits
from .pose import Array, Pose
from .robot import ParallelRobot
from .stewart_assembly import Assembly, assemble
from .stewart_legs import LegMotion, Legs
from .stewart_workspace import PlatformWorkspace
from .tool_curves import Places

if TYPE_CHECKING:
    from .ik import Solution

FRAMES = ("base", "root")

BORDER = 1e-3
"""How far over 1 the workspace sum of a robot that stands on the border may be read."""

_LEGS = 6


class StewartKinematics:
    """The kinematics of one platform; it keeps no state, so the same question has one answer.

    Attributes:
        robot: the robot's facts.
        legs: the geometry of its legs.
        limits: stroke, rate and acceleration of the legs.
        workspace: the limits that belong to a pose.
        dof: 6.
        lower: (6,) least leg length [m], read-only.
        upper: (6,) greatest leg length [m], read-only.
        turning: (6,) False: no leg has turns.
        size: the radius of the platform's anchors [m], to weigh turns against shifts.
    """

    def __init__(self, robot: ParallelRobot) -> None:
        if robot.dof != _LEGS:
            raise BadArgument("dof", robot.dof, f"{_LEGS} legs")
        leg = robot.leg
        self.robot = robot
        self.dof = _LEGS
        self.limits = JointLimits(
            names=robot.joint_names,
            lower=(leg.min_length,) * _LEGS,
            upper=(leg.max_length,) * _LEGS,
            velocity=(leg.velocity,) * _LEGS,
            acceleration=(leg.acceleration or leg.velocity / robot.acceleration_ramp_s,) * _LEGS,
            prismatic=(True,) * _LEGS,
        )
        self.lower, self.upper = (
            _read_only(np.array(bounds)) for bounds in (self.limits.lower, self.limits.upper)
        )
        self.turning: NDArray[np.bool_] = np.zeros(_LEGS, dtype=np.bool_)
        self.turning.flags.writeable = False
        self.size = robot.platform_radius
        self.legs = Legs.of_robot(robot)
        self.workspace = PlatformWorkspace(robot, self.legs, self.limits)

    @property
    def home_position(self) -> tuple[float, ...]:
        """The leg lengths at home [m]."""
        return tuple(self.legs.lengths(self.legs.home).tolist())

    def inverse(self, pose: Pose, frame: str = "base") -> Array:
        """Return the (6,) leg lengths that hold the platform at a pose.

        Args:
            pose: of the platform, in `frame`.
            frame: `base` or `root`.

        Raises:
            PlatformLimit: the pose breaks a stroke, a cone or the workspace rule.
            FrameUnknown: there is no such frame.
        """
        return self.workspace.check(self.to_base(pose, frame))

    def solve(
        self, target: Pose, seed: Sequence[float] | Array, *, frame: str = "base"
    ) -> Solution:
        """Answer as `ik.solve` does for a serial arm; there is one answer, whatever the seed.

        Args:
            target: of the platform, in `frame`.
            seed: (6,) leg lengths, checked and otherwise not used.
            frame: `base` or `root`.

        Raises:
            PlatformLimit: the pose breaks a stroke, a cone or the workspace rule.
            WrongJointCount: the seed does not have one value per leg.
            NotFinite: a value of the seed is infinite or not a number.
            FrameUnknown: there is no such frame.
        """
        from .ik import Solution

        self._checked(seed)
        pose = self.to_base(target, frame)
        lengths = self.workspace.check(pose)
        found = self.forward(lengths, seed=pose)
        return Solution(
            joint_position=lengths,
            restarts=0,
            iterations=0,
            position_error=found.position_distance(pose),
            rotation_error=found.rotation_distance(pose),
        )

    def forward(
        self,
        joint_position: Sequence[float] | Array,
        frame: str = "base",
        link: str | None = None,
        seed: Pose | None = None,
    ) -> Pose:
        """Compute where the platform is.

        Args:
            joint_position: (6,) leg lengths [m]; the strokes are not checked.
            frame: `base` or `root`, which are one.
            link: the platform's link or the root's; the platform's if None.
            seed: where the search starts first; home if None. It saves time and changes nothing.

        Raises:
            NoAssembly: no pose of the workspace has these leg lengths.
            WrongJointCount: not one value per leg.
            NotFinite: a value is infinite or not a number.
            FrameUnknown: there is no such frame or link.
        """
        lengths = self._checked(joint_position)
        self.to_base(self.legs.home, frame)
        if link not in (None, self.robot.tool_link, self.robot.root_link):
            raise FrameUnknown(link or "", (self.robot.root_link, self.robot.tool_link))
        if link == self.robot.root_link != self.robot.tool_link:
            return Pose.identity()
        found = self._assembly(lengths, seed)
        return Pose.from_matrix(found.rotation, found.position)

    def jacobian(self, joint_position: Sequence[float] | Array, frame: str = "base") -> Array:
        """Compute how the platform moves with the legs: the inverse of the leg Jacobian.

        Returns:
            (6, 6): linear velocity of the platform's origin [m/s], then angular velocity [rad/s],
            per unit of leg rate [m/s].

        Raises:
            NoAssembly: no pose of the workspace has these leg lengths.
            WrongJointCount: not one value per leg.
            NotFinite: a value is infinite or not a number.
            FrameUnknown: there is no such frame.
        """
        self.to_base(self.legs.home, frame)
        return self.linearise(self._checked(joint_position))[2]

    def linearise(self, joint_position: Array) -> tuple[Array, Array, Array]:
        """Compute the platform's (3, 3) rotation, (3,) position [m] and the (6, 6) Jacobian.

        Raises:
            NoAssembly: no pose of the workspace has these leg lengths.
        """
        found = self._assembly(joint_position)
        jacobian = np.asarray(np.linalg.inv(found.jacobian), dtype=np.float64)
        return found.rotation, found.position, jacobian

    def place(self, joint_position: Array) -> tuple[Array, Array]:
        """Compute the platform's (3, 3) rotation and (3,) position in the base.

        Raises:
            NoAssembly: no pose of the workspace has these leg lengths.
        """
        found = self._assembly(joint_position)
        return found.rotation, found.position

    def places(self, joint_positions: Array) -> Places:
        """Compute where the platform is at many (m, 6) leg lengths on one way, in the base.

        Raises:
            NoAssembly: no pose of the workspace has these leg lengths.
        """
        rotation, position = np.empty((len(joint_positions), 3, 3)), []
        seed: Pose | None = None
        for row, lengths in enumerate(joint_positions):
            found = self._assembly(lengths, seed)
            seed = Pose.from_matrix(found.rotation, found.position)
            rotation[row] = found.rotation
            position.append(found.position)
        return Places(rotation, np.array(position))

    def to_base(self, pose: Pose, frame: str) -> Pose:
        """Express a pose given in `base` or `root` in the base frame: they are one.

        Raises:
            FrameUnknown: there is no such frame.
        """
        if frame not in FRAMES:
            raise FrameUnknown(frame, FRAMES)
        return pose

    def check_motion(self, pose: Pose, twist: Array, acceleration: Array) -> LegMotion:
        """Check what a platform motion asks of the legs, and return it.

        Args:
            pose: of the platform, in the base.
            twist: (6,) [v; ω], m/s and rad/s.
            acceleration: (6,) [v̇; ω̇].

        Raises:
            TooFast: a leg would be faster than its limit.
            TooSharp: a leg would accelerate more than its limit.
            NotFinite: a leg's rate or acceleration is infinite or not a number.
        """
        motion = self.legs.motion(pose, twist, acceleration)
        self.limits.check_velocity(motion.rate.tolist())
        self.limits.check_acceleration(motion.acceleration.tolist())
        return motion

    def _assembly(self, lengths: Array, seed: Pose | None = None) -> Assembly:
        """Find the placement inside the workspace, of which there is one at most."""
        try:
            return self._assembly_from(self.legs.home if seed is None else seed, lengths)
        except NoAssembly:
            if seed is None:
                raise
        # A seed near another assembly leads there; home decides.
        return self._assembly_from(self.legs.home, lengths)

    def _assembly_from(self, start: Pose, lengths: Array) -> Assembly:
        found = assemble(self.legs, lengths, start)
        pose = Pose.from_matrix(found.rotation, found.position)
        try:
            self.workspace.check_usage(pose, BORDER)
        except PlatformLimit as error:
            reason = f"outside the workspace: {error}"
            raise NoAssembly(tuple(lengths.tolist()), found.residual, reason) from None
        return found

    def _checked(self, joint_position: Sequence[float] | Array) -> Array:
        lengths = np.asarray(joint_position, dtype=np.float64)
        self.limits.check_finite(lengths.tolist(), "the leg lengths")
        return lengths


def _read_only(array: Array) -> Array:
    array.flags.writeable = False
    return array
