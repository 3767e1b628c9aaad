"""Tool paths: the joint path that leads the tool along a curve.

Owns the density of the samples on a tool curve, their solution by inverse kinematics from one to
the next, the measure of the tool's deviation between samples, and the refusal where the arm would
have to change its branch. Samples are (m,) values of s, joint positions (m, n), and the start is
(n,), see `settle_start`. Knows no shape of a curve and no timing. The server's event loop imports
this module, so inverse kinematics is imported only by the function that searches.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import suppress

import numpy as np
from numpy.typing import NDArray

from ..errors import BranchChange, OutOfRange, PlatformLimit, PoseUnreachable
from ..pose import Array, Pose, PoseArray
from ..trajectory.joint_curves import ROUNDING, JointSpline, settle_start
from .tool_curves import ToolCurve
from .tool_kinematics import ToolKinematics, check_workspace, next_joints, singularity_near

POSITION_STEP = 0.002
"""Distance of the samples of a tool curve [m]."""
ROTATION_STEP = math.radians(1.0)
"""Rotation between the samples of a tool curve [rad]."""
POSITION_DEVIATION = 5e-5
"""Greatest deviation of the planned tool from its curve [m]; the other half of 0.1 mm is left to
the controller that runs the samples."""
ROTATION_DEVIATION = math.radians(0.025)
"""Greatest angle of the planned tool from its orientation on the curve, half of 0.05° [rad]."""

_LEAST_STEPS = 8  # steps on each piece of a curve
_MOST_STEPS = 2000
_MOST_HALVINGS = 10  # to 2 µm, where a nearly aligned wrist rotates by π
_DENSER = 10
_GREATEST_JOINT_STEP = {False: 0.1, True: 0.02}  # by prismatic: rad or m
_STRIDE = 5  # samples from one that is solved to the next, where a refusal is looked for
_REFUSALS = (OutOfRange, PlatformLimit, PoseUnreachable)
_ARM = POSITION_DEVIATION / ROTATION_DEVIATION  # m; weighs rotations against shifts
_PROJECTIONS = 2


def follow_tool_curve(
    kinematics: ToolKinematics, start: Sequence[float] | Array, curve: ToolCurve
) -> JointSpline:
    """Return the joint path, with the curve's waypoints, that leads the tool along a curve.

    The curve is sampled every 2 mm or 1° (at most 2,000 samples a piece), each solved from the one
    before. Between samples the joints follow a smooth curve. Where the tool, measured at ten times
    the density, deviates by more than 0.05 mm or 0.025°, or a joint leaves its range, samples are
    added: the samples themselves are inside.

    Args:
        curve: begins at the tool's present pose, in the base frame.

    Raises:
        PoseUnreachable: a pose of the curve; with its fraction of the path.
        PlatformLimit: a pose of the curve breaks a limit of a platform, with its fraction.
        BranchChange: a joint would have to jump; with the fraction, the joint and the jump.
        OutOfRange: a pose of the curve is reached only outside a joint's range, with its fraction;
            or the start is, or the path between samples.
        NoMotion: no joint moves.
        WrongJointCount, NotFinite: the start is not one finite value per joint.
    """
    settled = np.array(settle_start(start, kinematics.limits))
    follower = _Follower(kinematics, curve)
    s = _samples(curve)
    joints = follower.solve(s, settled)
    for halvings in range(_MOST_HALVINGS + 1):
        rough = follower.jumps(joints) > 1.0
        if not rough.any():
            rough = follower.strays(s, joints)
        if not rough.any():
            taught = np.searchsorted(s, curve.waypoints - curve.length * 1e-9)
            path = JointSpline(joints, kinematics.limits, taught=taught.tolist())
            check_workspace(kinematics, path)
            return path
        if halvings < _MOST_HALVINGS:
            s, joints = follower.halve(s, joints, rough)
            follower.rejoin(s, joints)
    raise follower.refusal(s, joints)


class _Follower:
    """Solver of the joint positions along a tool curve.

    Places on the curve are its parameter s, for most curves a length [m]; joint positions are
    controller-side [rad or m].

    Attributes:
        curve: in the base frame.
        greatest_step: (n,) greatest motion of a joint between samples [rad or m].
    """

    def __init__(self, kinematics: ToolKinematics, curve: ToolCurve) -> None:
        self.kinematics = kinematics
        self.curve = curve
        self.greatest_step = np.array(
            [_GREATEST_JOINT_STEP[prismatic] for prismatic in kinematics.limits.prismatic]
        )

    def solve(self, s: Array, start: Array) -> Array:
        """Return the (m, n) joint positions [rad or m] at s: (m,), the first being the start."""
        self._refuse_end_out_of_reach(s, start)
        joints = [start]
        self._extend(joints, s)
        return np.array(joints)

    def _refuse_end_out_of_reach(self, s: Array, start: Array) -> None:
        """Raise the refusal of a curve that ends out of reach, without solving all samples to it.

        Every fifth sample is solved up to the first that is refused, then those just before it.
        Where it is only the wide steps that fail, nothing is raised.
        """
        try:
            self._extend([start], s[[0, -1]])
        except _REFUSALS:
            joints = [start]
            with suppress(*_REFUSALS):
                self._extend(joints, s[::_STRIDE])
            refused = (len(joints) - 1) * _STRIDE
            self._extend(joints[-1:], s[refused : refused + _STRIDE + 1])

    def _extend(self, joints: list[Array], s: Array) -> None:
        """Append joint positions at s: (m,), whose first is solved already and is the last."""
        for place, pose in zip(s[1:].tolist(), self._poses(s[1:]), strict=True):
            joints.append(self._solve(place, pose, joints[-1]))

    def jumps(self, joints: Array) -> Array:
        """Return for each of m - 1 spans the greatest joint step, relative to what is accepted."""
        steps: Array = (np.abs(np.diff(joints, axis=0)) / self.greatest_step).max(axis=1)
        return steps

    def strays(self, s: Array, joints: Array) -> NDArray[np.bool_]:
        """Return for each of m - 1 spans if the path leaves the curve, or a joint its range."""
        path = JointSpline(joints)
        inside = np.arange(1, _DENSER) / _DENSER
        knots = path.knots[:-1, np.newaxis] + np.diff(path.knots)[:, np.newaxis] * inside
        # Coinciding samples share a knot; its span begins at the last of them.
        begins = np.searchsorted(path.waypoint_knots, np.arange(len(knots)), side="right") - 1
        guesses = s[begins, np.newaxis] + np.diff(s)[begins, np.newaxis] * inside
        between = path.evaluate(knots.ravel())
        limits = self.kinematics.limits
        beyond = np.maximum(between - limits.upper, limits.lower - between).max(axis=1)
        off = (self._deviations(between, guesses.ravel()) > 1.0) | (beyond > ROUNDING)
        spans = np.zeros(len(joints) - 1, dtype=np.bool_)
        spans[begins] = off.reshape(knots.shape).any(axis=1)
        return spans

    def halve(self, s: Array, joints: Array, rough: NDArray[np.bool_]) -> tuple[Array, Array]:
        """Return samples and joints with one added in the middle of each rough span."""
        spans = np.flatnonzero(rough)
        middles = (s[spans] + s[spans + 1]) / 2.0
        added = [
            self._solve(middle, pose, joints[span])
            for middle, pose, span in zip(
                middles.tolist(), self._poses(middles), spans.tolist(), strict=True
            )
        ]
        return np.insert(s, spans + 1, middles), np.insert(joints, spans + 1, added, axis=0)

    def rejoin(self, s: Array, joints: Array) -> None:
        """Solve again, in place, every sample after a jump.

        A long step past a singularity may end on another branch, and all samples after it stay
        there. From the samples that `halve` added before it, the step is shorter and stays on the
        branch; so do the following samples, one after the other.
        """
        for index in range(1, len(s)):
            step = np.abs(joints[index] - joints[index - 1]) / self.greatest_step
            if step.max() > 1.0:
                pose = next(self._poses(s[index : index + 1]))
                joints[index] = self._solve(float(s[index]), pose, joints[index - 1])

    def refusal(self, s: Array, joints: Array) -> BranchChange:
        """Return the refusal for the greatest jump."""
        worst = int(np.argmax(self.jumps(joints)))
        change = np.abs(joints[worst + 1] - joints[worst])
        joint = int(np.argmax(change / self.greatest_step))
        limits = self.kinematics.limits
        fraction = float(s[worst]) / self.curve.length
        return BranchChange(
            fraction,
            limits.names[joint],
            float(change[joint]),
            limits.unit(joint),
            singularity_near(self.kinematics, joints[worst]),
        )

    def _poses(self, s: Array) -> Iterator[Pose]:
        """Yield the poses at s, each when it is wanted: a refused path wants the first few only."""
        return (Pose.from_matrix(*place) for place in zip(*self.curve.place(s), strict=True))

    def _solve(self, s: float, pose: Pose, seed: Array) -> Array:
        try:
            return next_joints(self.kinematics, pose, seed)
        except _REFUSALS as error:
            error.fraction = s / self.curve.length
            raise

    def _deviations(self, joint_positions: Array, guesses: Array) -> Array:
        """Return how far the tool is off the curve near (m,) guesses, relative to the accepted."""
        places = self.kinematics.places(joint_positions)
        offset, tilt = deviation(self.curve, places, guesses)
        ratios: Array = np.maximum(offset / POSITION_DEVIATION, tilt / ROTATION_DEVIATION)
        return ratios


def deviation(curve: ToolCurve, places: PoseArray, guesses: Array) -> tuple[Array, Array]:
    """Return the (m,) distances [m] and angles [rad] of tool places from the nearest of a curve.

    Nearest means in position and orientation together, found by Gauss-Newton steps along the curve:
    s grows by (e · c') / (c' · c') with the error e to the place c(s), where rotations are weighed
    by a length. That is the path accuracy of ISO 9283: a tool that is merely early or late is not
    off.

    Args:
        curve: where the tool should be.
        places: where it is, m places.
        guesses: (m,) estimates of the places on the curve.
    """
    s = guesses
    for _ in range(_PROJECTIONS):
        error, motion = _errors(curve, places, s), curve.motion(s)
        motion[:, 3:] *= _ARM
        error[:, 3:] *= _ARM
        along = np.einsum("ij,ij->i", error, motion) / np.einsum("ij,ij->i", motion, motion)
        s = np.clip(s + along, 0.0, curve.length)
    error = _errors(curve, places, s)
    return np.linalg.norm(error[:, :3], axis=1), np.linalg.norm(error[:, 3:], axis=1)


def _errors(curve: ToolCurve, places: PoseArray, s: Array) -> Array:
    """Return the (m, 6) shift [m] and small rotation [rad] from the curve at s to the places.

    For a rotation R by a small angle it is the axial vector of its skew part, (R - Rᵀ) / 2: its
    length is the sine of the angle.
    """
    wanted = curve.place(s)
    turn = places.rotation @ wanted.rotation.transpose(0, 2, 1)
    skew = turn - turn.transpose(0, 2, 1)
    vector = np.stack((skew[:, 2, 1], skew[:, 0, 2], skew[:, 1, 0]), axis=1) / 2.0
    return np.hstack((places.position - wanted.position, vector))


def _samples(curve: ToolCurve) -> Array:
    """Return the places of a curve where the joints are solved, with every join among them."""
    samples = [np.zeros(1)]
    for begin, end in zip(curve.joins[:-1], curve.joins[1:], strict=True):
        rate = np.abs(curve.motion(np.linspace(begin, end, _LEAST_STEPS + 1)))
        shift = float(np.linalg.norm(rate[:, :3], axis=1).max())
        turn = float(np.linalg.norm(rate[:, 3:], axis=1).max())
        wanted = (end - begin) * max(shift / POSITION_STEP, turn / ROTATION_STEP)
        steps = min(max(math.ceil(wanted), _LEAST_STEPS), _MOST_STEPS)
        samples.append(np.linspace(begin, end, steps + 1)[1:])
    return np.concatenate(samples)
