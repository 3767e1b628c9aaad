"""Stewart platform paths: the straight tool line, and curves through leg lengths.

Owns the line as exact functions of the path parameter (the legs follow by formula, so the tool is
on it everywhere), and the check of any path against the platform's limits before it is timed. Each
path implements `joint_curves.Path`, a joint vector being the six leg lengths [m], so timing,
certificate and trajectory are those of a serial arm. Base frame; a start is where the platform
stands, treated by `settle_start`. Knows no time.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ..errors import BadArgument, NoAssembly, NoMotion
from ..kinematics.stewart.legs import LegMotion, leg_motion
from ..kinematics.stewart.platform import StewartKinematics, assemble
from ..orientation import vector_of_quaternion
from ..pose import Array, Pose
from ..trajectory.joint_curves import (
    COINCIDENT,
    Indices,
    JointSpline,
    Path,
    sampled_extent,
    settle_start,
)

CHECK_STEP = 5e-4
"""Distance between the places of a path that are checked [m]."""

_LEAST_CHECKS, _MOST_CHECKS = 32, 2000
_SPAN = 5e-3  # m of path between knots, which timing takes for the smooth pieces
_LEAST_SPANS, _MOST_SPANS = 4, 64


class PlatformLine:
    """Leg lengths along the straight line of the platform between two poses, with an even rotation.

    The parameter s is the distance covered by the platform's origin, or by its rim in the rotation,
    whichever is longer [m]: p(s) = p₀ + s Δp / L, R(s) = exp(s ω) R₀ with ω the rotation vector
    over L.
    """

    def __init__(self, kinematics: StewartKinematics, start: Array, target: Pose) -> None:
        """Join the platform's pose at (6,) leg lengths inside the strokes [m] with another.

        Raises:
            PlatformLimit: the target breaks a limit; fraction 1.
            NoAssembly: no pose of the workspace has the leg lengths of the start.
            NoMotion: the platform is there already.
        """
        self._legs = kinematics.legs
        self.origin = kinematics.forward(start)
        self.target = target
        self._start = np.array(start, dtype=np.float64)
        self.goal: Array = kinematics.workspace.check(target, fraction=1.0)
        turn = vector_of_quaternion(target.compose(_turned_back(self.origin)).quaternion)
        distance = self.origin.position_distance(target)
        self.length = max(distance, math.sqrt(float(turn @ turn)) * kinematics.size)
        if self.length < COINCIDENT:
            raise NoMotion
        self._shift = (target.position - self.origin.position) / self.length
        self._turn = turn / self.length
        self._arms = self._legs.platform @ self.origin.rotation.T
        spans = min(max(math.ceil(self.length / _SPAN), _LEAST_SPANS), _MOST_SPANS)
        self.knots: Array = np.linspace(0.0, self.length, spans + 1)
        self.waypoint_knots: Indices = np.array([0, spans])

    @property
    def dof(self) -> int:
        """Number of legs."""
        return len(self._start)

    def pose(self, s: float) -> Pose:
        """Return the platform's pose at s."""
        return self.origin.interpolate(self.target, s / self.length)

    def evaluate(self, s: Array, order: int = 0) -> Array:
        """Return the (m, 6) leg lengths (order 0) or their derivative by s (1, 2) at s: (m,)."""
        if order not in (0, 1, 2):
            raise BadArgument("order", order, "0, 1 or 2")
        motion = self._motion(np.asarray(s, dtype=np.float64))
        values: Array = motion[order]
        if order == 0:
            # The ends are exact to the last digit, so that paths join and the robot stands still.
            values[s <= 0.0] = self._start
            values[s >= self.length] = self.goal
        return values

    def extent(self) -> tuple[Array, Array]:
        """Return the least and the greatest length of each leg on the path, each (6,)."""
        return sampled_extent(self, 0.0, self.length)

    def _motion(self, s: Array) -> LegMotion:
        """Return lengths and derivatives by s, each (m, 6)."""
        arms = self._turned(s)
        spin = np.cross(self._turn, arms)
        shift = self.origin.position + s[:, np.newaxis] * self._shift
        legs = shift[:, np.newaxis, :] + arms - self._legs.base
        return leg_motion(legs, self._shift + spin, np.cross(self._turn, spin))

    def _turned(self, s: Array) -> Array:
        """Return the (m, 6, 3) platform anchors, about the platform's origin, at s: (m,).

        Rodrigues' formula: exp(φ) a = a + sin|φ|/|φ| φ × a + (1 - cos|φ|)/|φ|² φ × (φ × a).
        """
        rate = math.sqrt(float(self._turn @ self._turn))
        angle = s * rate
        once = np.cross(self._turn, self._arms)
        twice = np.cross(self._turn, once)
        first = s * np.sinc(angle / np.pi)
        second = 0.5 * (s * np.sinc(angle / (2.0 * np.pi))) ** 2
        turned: Array = (
            self._arms
            + first[:, np.newaxis, np.newaxis] * once
            + second[:, np.newaxis, np.newaxis] * twice
        )
        return turned


def platform_line(
    kinematics: StewartKinematics,
    start: Sequence[float] | Array,
    target: Pose,
    *,
    frame: str = "base",
) -> PlatformLine:
    """Return the straight line of the platform from its present pose, checked along its length.

    Raises:
        PlatformLimit: a pose of the line breaks a limit; with its fraction of the path.
        OutOfRange: the start is outside a stroke.
        NoAssembly: no pose of the workspace has the leg lengths of the start.
        NoMotion: the platform is there already.
        WrongJointCount, NotFinite: the start is not one finite value per leg.
        FrameUnknown: there is no such frame.
    """
    stands = np.array(settle_start(start, kinematics.limits))
    line = PlatformLine(kinematics, stands, kinematics.to_base(target, frame))
    for fraction in _fractions(line)[1:].tolist():
        kinematics.workspace.check(line.pose(fraction * line.length), fraction)
    return line


def leg_curve(
    kinematics: StewartKinematics, waypoints: Sequence[Sequence[float] | Array] | Array
) -> JointSpline:
    """Return the smooth curve through leg lengths, checked along its length.

    Args:
        waypoints: (w, 6) leg lengths [m], the first where the robot stands; two give a line.

    Raises:
        PlatformLimit: the platform would leave its workspace, or a leg its cone, on the path.
        NoAssembly: no platform pose has the leg lengths of the start, or of a place on the path.
        MotionError: the curve is refused, as of `JointSpline`.
    """
    curve = JointSpline(waypoints, kinematics.limits)
    check_path(kinematics, curve)
    return curve


def check_path(kinematics: StewartKinematics, path: Path) -> None:
    """Check a path of leg lengths against cones and workspace, every 0.5 mm of it.

    The strokes are the joint limits of the path itself. The start is where the robot stands, and
    may be outside by the noise of its feedback.

    Raises:
        PlatformLimit: a place breaks a limit; with its fraction of the path.
        NoAssembly: no platform pose has the leg lengths of the start, or of a place on the path.
    """
    fractions = _fractions(path)
    places = path.evaluate(fractions * path.length)
    pose = kinematics.forward(places[0])
    for fraction, lengths in zip(fractions[1:].tolist(), places[1:], strict=True):
        # Searched from the pose 0.5 mm before, so that the pose found is the one that follows it.
        try:
            found = assemble(kinematics.legs, lengths, pose)
        except NoAssembly as error:
            error.reason = f"{error.reason}, at {fraction:.1%} of the path"
            raise
        pose = Pose.from_matrix(found.rotation, found.position)
        kinematics.workspace.check_posture(pose, fraction)


def _fractions(path: Path) -> Array:
    checks = min(max(math.ceil(path.length / CHECK_STEP), _LEAST_CHECKS), _MOST_CHECKS)
    return np.linspace(0.0, 1.0, checks + 1)


def _turned_back(pose: Pose) -> Pose:
    """Return the inverse of a pose's rotation alone."""
    return Pose(np.zeros(3), pose.quaternion).inverse()
