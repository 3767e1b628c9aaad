"""Kinematics of a Stewart platform, with the members that `Kinematics` has for a serial arm.

Owns the meaning of a joint vector for it: six leg lengths, in file order [m], so the limits are
those of prismatic joints. Inverse kinematics is a formula, forward kinematics a search, the reverse
of a serial arm; the caller sees no difference. Frames: `base` is the base plate's frame, which
`root` coincides with; the tool is the platform. Twists are (6,) [v; ω], accelerations (6,) [v̇; ω̇].
Knows no path.

Owns also that search for the pose at six leg lengths, and the proof that its answer is the right
one. Six lengths fit up to 40 poses (Raghavan 1993; Merlet, Parallel Robots, chapter 4); only one of
them is the machine's.

Proof that there is one inside the workspace: let y be the pose as fractions of the workspace
bounds, so that the workspace is the set S with sum |y_i| ≤ 1, which is convex; l(y) the leg
lengths, l' their Jacobian, and G its inverse at home. If |G l'(y) - 1| ≤ c < 1 throughout S, then
y ↦ y - G l(y) brings two poses of S closer together by the factor c (mean value theorem along the
chord, which lies in S), so no two of them have the same lengths. An answer that closes the legs and
lies in S is therefore the one connected with home, whatever the search did. `uniqueness` returns c.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...description.limits import JointLimits
from ...description.robot import ParallelRobot
from ...errors import BadArgument, FrameUnknown, NoAssembly, PlatformLimit
from ...orientation import rotation_of_vector
from ...pose import Array, Pose, PoseArray
from .legs import LegMotion, Legs
from .workspace import PlatformWorkspace

if TYPE_CHECKING:
    from ..ik.ik import Solution

CLOSURE = 1e-11
"""Greatest leg error of an answer [m]."""

_ITERATIONS = 40
_SETTLED = 1e-14  # m: a lesser leg error is rounding
_LONGEST_STEP = 0.5  # rad, or share of the size: the linearisation holds no farther


class Assembly(NamedTuple):
    """Platform placement that closes the legs.

    Attributes:
        rotation: (3, 3).
        position: (3,) [m].
        jacobian: (6, 6) leg Jacobian there, twist to leg rates.
        residual: greatest leg error [m].
    """

    rotation: Array
    position: Array
    jacobian: Array
    residual: float
    iterations: int


def assemble(legs: Legs, lengths: Array, start: Pose) -> Assembly:
    """Return a platform placement with given leg lengths, by Newton's method.

    Args:
        lengths: (6,) [m], finite.
        start: where the search starts.

    Raises:
        NoAssembly: the search met a singular placement, or did not close the legs.
    """
    rotation, position = start.rotation, start.position
    size = float(np.abs(legs.platform).max())
    before = math.inf
    for iteration in range(_ITERATIONS + 1):
        found, jacobian = legs.linearise(rotation, position)
        errors = lengths - found
        residual = float(np.abs(errors).max())
        # Once inside the tolerance, an error that no longer shrinks is rounding.
        if residual <= _SETTLED or (residual <= CLOSURE and residual >= before):
            return Assembly(rotation, position, jacobian, residual, iteration)
        before = residual
        try:
            step = np.asarray(np.linalg.solve(jacobian, errors), dtype=np.float64)
        except np.linalg.LinAlgError:
            raise _refused(lengths, residual, "the search met a singular placement") from None
        longest = max(
            math.sqrt(float(step[:3] @ step[:3])) / size, math.sqrt(float(step[3:] @ step[3:]))
        )
        if longest > _LONGEST_STEP:
            step *= _LONGEST_STEP / longest
        position = position + step[:3]
        rotation = rotation_of_vector(step[3:]) @ rotation
    reason = f"the nearest found in {_ITERATIONS} iterations leaves a leg {residual:.3g} m off"
    raise _refused(lengths, residual, reason)


def uniqueness(legs: Legs, bounds: Array, samples: int = 2000, random_seed: int = 0) -> float:
    """Return c of the module docstring over sampled poses; below 1 there is no second pose.

    Args:
        bounds: (6,) of x, y, z [m], roll, pitch, yaw [rad] about home.
        samples: poses, half of them on the workspace's border; its 12 corners are added.
        random_seed: the same number gives the same answer.
    """
    at_home = np.linalg.inv(legs.rpy_jacobian(legs.home) * bounds)
    random = np.random.default_rng(random_seed)
    shares = random.dirichlet(np.full(6, 0.5), samples) * random.choice((-1.0, 1.0), (samples, 6))
    shares[::2] *= random.uniform(0.0, 1.0, (len(shares[::2]), 1))
    worst = 0.0
    for share in np.concatenate((np.eye(6), -np.eye(6), shares)):
        x = share * bounds
        pose = Pose.from_rpy(legs.home.position + x[:3], x[3:])
        change = at_home @ (legs.rpy_jacobian(pose) * bounds) - np.eye(6)
        worst = max(worst, float(np.linalg.norm(change, 2)))
    return worst


def _refused(lengths: Array, residual: float, reason: str) -> NoAssembly:
    return NoAssembly(tuple(lengths.tolist()), residual, reason)


FRAMES = ("base", "root")

BORDER = 1e-3
"""Greatest excess over 1 of the workspace sum, as read from a robot at rest on the border."""

_LEGS = 6


class StewartKinematics:
    """Kinematics of one platform; it keeps no state, so the same question has one answer.

    Attributes:
        lower: (6,) least leg length [m], read-only.
        upper: (6,) greatest leg length [m], read-only.
        turning: (6,) False: no leg has revolutions.
        size: the radius of the platform's anchors [m], to weigh rotations against shifts.

    Raises, in every method:
        NoAssembly: no pose of the workspace has these leg lengths.
        PlatformLimit: the pose breaks a stroke, a cone or the workspace rule.
        WrongJointCount, NotFinite: not one finite value per leg.
        FrameUnknown: there is no such frame or link.
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
        """Leg lengths at home [m]."""
        return tuple(self.legs.lengths(self.legs.home).tolist())

    def inverse(self, pose: Pose, frame: str = "base") -> Array:
        """Return the (6,) leg lengths that hold the platform at a pose."""
        return self.workspace.check(self.to_base(pose, frame))

    def solve(
        self, target: Pose, seed: Sequence[float] | Array, *, frame: str = "base"
    ) -> Solution:
        """Return the answer as `ik.solve` does; there is one, and the seed is only checked."""
        from ..ik.ik import Solution

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
        """Return the platform's pose.

        Args:
            joint_position: (6,) leg lengths [m]; the strokes are not checked.
            link: the platform's link or the root's; the platform's if None.
            seed: where the search starts first; home if None. It saves time and changes nothing.
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
        """Return the derivative of the platform's motion by the legs: the inverse leg Jacobian.

        Returns:
            (6, 6): linear velocity of the platform's origin [m/s], then angular velocity [rad/s],
            per unit of leg rate [m/s].
        """
        self.to_base(self.legs.home, frame)
        return self.linearise(self._checked(joint_position))[2]

    def linearise(self, joint_position: Array) -> tuple[Array, Array, Array]:
        """Return the platform's (3, 3) rotation, (3,) position [m] and the (6, 6) Jacobian."""
        found = self._assembly(joint_position)
        jacobian = np.asarray(np.linalg.inv(found.jacobian), dtype=np.float64)
        return found.rotation, found.position, jacobian

    def place(self, joint_position: Array) -> tuple[Array, Array]:
        """Return the platform's (3, 3) rotation and (3,) position in the base."""
        found = self._assembly(joint_position)
        return found.rotation, found.position

    def places(self, joint_positions: Array) -> PoseArray:
        """Return the platform's poses at many (m, 6) leg lengths on one path, in the base."""
        rotation, position = np.empty((len(joint_positions), 3, 3)), []
        seed: Pose | None = None
        for row, lengths in enumerate(joint_positions):
            found = self._assembly(lengths, seed)
            seed = Pose.from_matrix(found.rotation, found.position)
            rotation[row] = found.rotation
            position.append(found.position)
        return PoseArray(rotation, np.array(position))

    def to_base(self, pose: Pose, frame: str) -> Pose:
        """Return a pose given in `base` or `root`, expressed in the base frame: they are one."""
        if frame not in FRAMES:
            raise FrameUnknown(frame, FRAMES)
        return pose

    def check_motion(self, pose: Pose, twist: Array, acceleration: Array) -> LegMotion:
        """Check the rates and accelerations of the legs in a platform motion, and return them.

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
        """Return the placement inside the workspace; there is at most one."""
        try:
            return self._assembly_from(self.legs.home if seed is None else seed, lengths)
        except NoAssembly:
            if seed is None:
                raise
        # A seed near another assembly may lead to that one; from home the search finds the right
        # one.
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
