"""Geometric paths: the curves in joint space, and the straight line of the tool.

Owns the straight tool line: sampled, solved by inverse kinematics from one sample to the next, and
refused where the arm would have to change its branch. Joint-space curves come from `joint_curves`
and are named here too. Knows no timing. The server's event loop imports this module, so inverse
kinematics is imported only by the functions that search.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from .errors import BadArgument, BranchChange, NoMotion, Unreachable
from .joint_curves import (
    COINCIDENT,
    JointLine,
    JointSpline,
    Path,
    check_extent,
    settle_start,
)
from .pose import Pose
from .trajectory import Array

if TYPE_CHECKING:
    from .kinematics import Kinematics

__all__ = [
    "COINCIDENT",
    "JointLine",
    "JointSpline",
    "Path",
    "check_extent",
    "joint_path_through_poses",
    "linear_legs",
    "linear_path",
    "settle_start",
]

POSITION_STEP = 0.002
"""Distance of the samples of a tool line [m]."""
ROTATION_STEP = math.radians(1.0)
"""Turn between the samples of a tool line [rad]."""
POSITION_DEVIATION = 1e-4
"""How far the tool may stray from its line [m]."""
ROTATION_DEVIATION = 1e-3
"""How far the tool may tilt out of its turn [rad]."""

_MOST_STEPS = 2000
_MOST_HALVINGS = 6
_DENSER = 10
_GREATEST_JOINT_STEP = {False: 0.1, True: 0.02}  # rad; m for a prismatic joint


def linear_path(
    kinematics: Kinematics,
    start: Sequence[float] | Array,
    target: Pose,
    *,
    frame: str = "base",
) -> JointSpline:
    """Return the joint path that leads the tool along a straight line while it turns evenly.

    The line is sampled every 2 mm or 1° (at most 2,000 samples), each solved from the one before.
    Between samples the joints follow a smooth curve; where the tool, measured at ten times the
    density, strays from the line by more than 0.1 mm or 1 mrad, samples are added.

    Args:
        kinematics: the robot.
        start: (n,) where the robot stands; see `settle_start`.
        target: the tool pose at the end, in `frame`.
        frame: `base` or `root`.

    Returns:
        A path with two waypoints: its start and its end.

    Raises:
        Unreachable: a pose of the line; with its fraction of the way.
        BranchChange: a joint would have to jump; with the fraction, the joint and the jump.
        OutOfRange: the start, or the curve between samples, is outside a joint's range.
        NoMotion: the tool is there already.
        WrongJointCount: the start does not have one value per joint.
        NotFinite: the start holds an infinity or a NaN.
        FrameUnknown: there is no such frame.
    """
    line = _ToolLine(kinematics, settle_start(start, kinematics.limits), target, frame)
    fractions = np.linspace(0.0, 1.0, line.steps() + 1)
    joints = line.solve(fractions)
    for _ in range(_MOST_HALVINGS):
        rough = line.jumps(joints) > 1.0
        if not rough.any():
            rough = line.strays(joints)
        if not rough.any():
            return JointSpline(joints, kinematics.limits, taught=(0, len(joints) - 1))
        fractions, joints = line.halve(fractions, joints, rough)
    worst = int(np.argmax(line.jumps(joints)))
    change = np.abs(joints[worst + 1] - joints[worst])
    joint = int(np.argmax(change / line.greatest_step))
    limits = kinematics.limits
    raise BranchChange(
        float(fractions[worst]), limits.names[joint], float(change[joint]), limits.unit(joint)
    )


def linear_legs(
    kinematics: Kinematics,
    start: Sequence[float] | Array,
    poses: Sequence[Pose],
    *,
    frame: str = "base",
) -> list[JointSpline]:
    """Return one straight tool line after another, through several poses.

    The legs meet at corners, so each is to be timed from rest to rest. A pose where the tool stands
    already adds no leg.

    Raises:
        NoMotion: no pose adds a leg.
        BadArgument: there are no poses.
        MotionError: a leg is refused, as of `linear_path`.
    """
    if not poses:
        raise BadArgument("poses", 0, "at least one pose")
    legs: list[JointSpline] = []
    here = np.array(settle_start(start, kinematics.limits))
    for pose in poses:
        try:
            legs.append(linear_path(kinematics, here, pose, frame=frame))
        except NoMotion:
            continue
        here = legs[-1].goal
    if not legs:
        raise NoMotion
    return legs


def joint_path_through_poses(
    kinematics: Kinematics,
    start: Sequence[float] | Array,
    poses: Sequence[Pose],
    *,
    frame: str = "base",
) -> list[Array]:
    """Return joint waypoints that take the tool through poses, each near the one before.

    Args:
        kinematics: the robot.
        start: (n,) where the robot stands; see `settle_start`.
        poses: tool poses in `frame`.
        frame: `base` or `root`.

    Returns:
        The start, then one joint position for each pose, as `JointSpline` takes them.

    Raises:
        Unreachable: a pose; its fraction counts the poses.
        OutOfRange: the start is outside a joint's range.
        WrongJointCount: the start does not have one value per joint.
        NotFinite: the start holds an infinity or a NaN.
        FrameUnknown: there is no such frame.
    """
    from .ik import solve

    waypoints = [np.array(settle_start(start, kinematics.limits))]
    for number, pose in enumerate(poses, start=1):
        try:
            solution = solve(kinematics, pose, waypoints[-1], frame=frame)
        except Unreachable as error:
            error.fraction = number / len(poses)
            raise
        waypoints.append(solution.joint_position)
    return waypoints


class _ToolLine:
    """The straight line of the tool from where the robot stands to a target."""

    def __init__(
        self, kinematics: Kinematics, start: Sequence[float], target: Pose, frame: str
    ) -> None:
        self.kinematics = kinematics
        self.start = np.array(start)
        self.target = kinematics.to_base(target, frame)
        self.origin = kinematics.forward(start)
        self.distance = self.origin.position_distance(self.target)
        self.angle = self.origin.rotation_distance(self.target)
        self.greatest_step = np.array(
            [_GREATEST_JOINT_STEP[prismatic] for prismatic in kinematics.limits.prismatic]
        )

    def steps(self) -> int:
        wanted = max(self.distance / POSITION_STEP, self.angle / ROTATION_STEP)
        return min(max(math.ceil(wanted), 2), _MOST_STEPS)

    def solve(self, fractions: Array) -> Array:
        """Return the (m, n) joint positions at the fractions, the first being the start."""
        joints = [self.start]
        for fraction in fractions[1:].tolist():
            joints.append(self._solve(fraction, joints[-1]))
        return np.array(joints)

    def jumps(self, joints: Array) -> Array:
        """Return for each span the greatest joint step, relative to what is accepted."""
        steps: Array = (np.abs(np.diff(joints, axis=0)) / self.greatest_step).max(axis=1)
        return steps

    def strays(self, joints: Array) -> NDArray[np.bool_]:
        """Return for each span whether the curve through the samples leaves the line in it."""
        curve = JointSpline(joints)
        inside = np.arange(1, _DENSER) / _DENSER
        s = curve.knots[:-1, np.newaxis] + np.diff(curve.knots)[:, np.newaxis] * inside
        ratios = self._deviations(curve.evaluate(s.ravel()))
        off = (ratios.reshape(s.shape) > 1.0).any(axis=1)
        # Coinciding samples share a knot; the last of them is where its span begins.
        spans = np.zeros(len(joints) - 1, dtype=np.bool_)
        begins = np.searchsorted(curve.waypoint_knots, np.flatnonzero(off), side="right") - 1
        spans[begins] = True
        return spans

    def halve(
        self, fractions: Array, joints: Array, rough: NDArray[np.bool_]
    ) -> tuple[Array, Array]:
        """Return fractions and joints with a sample added in the middle of each rough span."""
        spans = np.flatnonzero(rough)
        middles = (fractions[spans] + fractions[spans + 1]) / 2.0
        added = [
            self._solve(fraction, joints[span])
            for fraction, span in zip(middles.tolist(), spans.tolist(), strict=True)
        ]
        return np.insert(fractions, spans + 1, middles), np.insert(joints, spans + 1, added, axis=0)

    def _solve(self, fraction: float, seed: Array) -> Array:
        from .ik import solve

        pose = self.origin.interpolate(self.target, fraction)
        try:
            return solve(self.kinematics, pose, seed, restarts=0, time_cap=None).joint_position
        except Unreachable as error:
            error.fraction = fraction
            raise

    def _deviations(self, joint_positions: Array) -> Array:
        """Return how far the tool is off the line at each (m, n), relative to what is accepted."""
        rotations = np.empty((len(joint_positions), 3, 3))
        offsets = np.empty((len(joint_positions), 3))
        for row, joint_position in enumerate(joint_positions):
            rotations[row], offsets[row] = self.kinematics.place(joint_position)
        offsets -= self.origin.position
        if self.distance > POSITION_DEVIATION:
            along = (self.target.position - self.origin.position) / self.distance
            offsets -= np.outer(offsets @ along, along)
        whole = self.origin.inverse().compose(self.target)
        turned = np.einsum("ji,mjk->mik", self.origin.rotation, rotations)
        if self.angle > ROTATION_DEVIATION:
            # An even turn about one axis leaves that axis where it was.
            axis = whole.quaternion[:3] / np.linalg.norm(whole.quaternion[:3])
            tilts = np.linalg.norm(turned @ axis - axis, axis=1)
        else:
            tilts = np.linalg.norm(turned - np.eye(3), axis=(1, 2)) / math.sqrt(2.0)
        distances = np.linalg.norm(offsets, axis=1)
        ratios: Array = np.maximum(distances / POSITION_DEVIATION, tilts / ROTATION_DEVIATION)
        return ratios
