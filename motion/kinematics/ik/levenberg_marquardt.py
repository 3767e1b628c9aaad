"""Levenberg–Marquardt search for a joint position that puts the tool at a pose.

Owns the iteration

    (JᵀJ + λI) Δ = Jᵀe,   e = [Δp / size; log(R_target Rᵀ)],   λ = 0.1 |e|² + 1e-12,

with the (6, n) Jacobian J of tool shift and rotation per joint, the linear rows and the prismatic
joints in units of the arm's size, so that e and Δ have no unit. The damping scaled by the error is
from Sugihara: Solvability-Unconcerned Inverse Kinematics by the Levenberg-Marquardt Method, 2011.
Owns also the use of a seed: freely, then along the limits. It works at singular positions too.
Knows no pinocchio and no clock: it uses `Kinematics`, and the caller sets the number of attempts.

These small symmetric systems are solved many thousand times, so this module uses Eigen's Cholesky
decomposition by eigenpy, which pinocchio's collision library depends on. With seven equations,
`numpy.linalg.solve` spends most of its time around LAPACK; Eigen takes a third to a half of it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import eigenpy
import numpy as np

from ...pose import Array
from ..revolutions import JointRanges
from ..serial import Kinematics, rotation_vector


def solve_positive_definite(matrix: Array, right: Array) -> Array:
    """Return x with A x = b for a symmetric positive definite matrix, by A = L Lᵀ.

    Positive definiteness is not checked, and no error is raised. A damped normal matrix JᵀJ + λI
    has it as long as λ stays above the rounding noise of its trace: with λ = 1e-12 of a matrix of
    seven columns up to a trace of some thousands.

    Args:
        matrix: (n, n) A, of which only the lower triangle is read.
        right: (n,) b.

    Returns:
        The (n,) x.
    """
    solution: Array = eigenpy.LLT(matrix).solve(right)
    return solution


# Errors are scaled by the arm's size, so these have no unit. The damping is that fraction of the
# squared error: large steps far away, Newton's steps near the target.
_DAMPING = 0.1
_LEAST_DAMPING = 1e-12
_POLISHED = 1e-20  # squared error
_TRUST = 10.0  # the damping's factor from one polishing step to the next
_NEAR_MISS = 1e-2  # in units of the arm's size: a lesser error is worth polishing
_STALL_RATIO = 0.98  # ratio of successive squared errors: above it the search stalls
_STALL_ITERATIONS = 3
_GREATEST_PULL = 1.0  # share of the distance to the middle of the range, in one iteration
_FREE_ITERATIONS = 5  # iterations at the start in which the error may rise


class Found(NamedTuple):
    """Joint position inside the limits, with its errors.

    Attributes:
        joint_position: (n,) controller-side [rad or m].
        position_error: distance from the asked position [m], by forward kinematics.
        rotation_error: angle from the asked orientation [rad], by forward kinematics.
    """

    joint_position: Array
    position_error: float
    rotation_error: float


class DampedSearch:
    """Search for one pose: the target, the tolerances, and the results so far.

    Attributes:
        restarts: random starts used.
        spent: iterations of all attempts together.
        best: the nearest position inside the limits that was found; None before the first.
    """

    def __init__(
        self,
        kinematics: Kinematics,
        ranges: JointRanges,
        target: tuple[Array, Array],
        seed: Sequence[float],
        iterations: int,
        tolerances: tuple[float, float],
    ) -> None:
        """Start a search.

        Args:
            kinematics: the robot.
            ranges: its limits and revolutions.
            target: (3, 3) rotation and (3,) position [m] in the base frame.
            seed: (n,) joint position inside the limits.
            iterations: iterations of each attempt.
            tolerances: greatest accepted distance [m] and angle [rad].
        """
        self.kinematics, self.ranges = kinematics, ranges
        self.rotation, self.position = target
        self.seed = seed
        self.iterations = iterations
        self.tolerances = tolerances
        self.lower, self.upper = kinematics.lower, kinematics.upper
        self.size = kinematics.size
        self.middle, self.joint_unit = ranges.middle, ranges.unit
        # Linear rows in units of the arm's size, columns in those of the joints.
        self.jacobian_unit = np.empty((6, kinematics.dof))
        self.jacobian_unit[:3] = ranges.unit / self.size
        self.jacobian_unit[3:] = ranges.unit
        self.identity = np.eye(kinematics.dof)
        self.redundant = kinematics.dof > 6
        self.centring = False
        self.restarts = 0
        self.spent = 0
        self.best: Found | None = None

    def from_seed(self, *, near: bool) -> Found | None:
        """Search freely from the seed, then along the limits.

        Where a free search ends outside the limits, a spare joint may bring it back, and a near
        target may be reached with a joint on its bound. Otherwise it was on its way to a branch
        that does not fit, so the second search starts in the middle of the ranges.

        Args:
            near: True if the target is near, so that a spare joint moves no more than it must.
        """
        start = np.array(self.seed)
        self.centring = self.redundant and not near
        free = self._fitted(self._descend(start, bounded=False))
        if free is not None and (found := self.accepted(free)):
            return found
        if not near and not self.redundant:
            start = self.middle
        return self.accepted(self._descend(start, bounded=True))

    def from_random(self, random: np.random.Generator) -> Found | None:
        """Search from a random position inside the limits."""
        self.restarts += 1
        # Some answers exist only far from the middle, so every other pair of restarts has no pull.
        self.centring = self.redundant and self.restarts % 4 < 2
        start = random.uniform(self.lower, self.upper)
        # A spare joint can move an answer back inside the limits, so searching there pays.
        bounded = self.redundant and self.restarts % 2 == 0
        reached = self._descend(start, bounded=bounded)
        fitted = self._fitted(reached)
        if fitted is None:
            fitted = np.clip(reached, self.lower, self.upper)
        found = self.measured(fitted)
        if self.suffices(found):
            return found
        return self.polished(fitted) if self.score(found) < _NEAR_MISS else None

    def polished(self, start: Sequence[float] | Array) -> Found | None:
        """Search along the limits from a position that nearly reaches the pose.

        Never steps to a greater error, as Marquardt (1963): near a straight elbow the free search
        oscillates about the answer.
        """
        position = np.array(start)
        error, jacobian = self._linearised(position)
        squared = float(error @ error)
        damping = _DAMPING * squared + _LEAST_DAMPING
        for _ in range(self.iterations):
            if squared < _POLISHED:
                break
            self.spent += 1
            trial = self._stepped(position, error, jacobian, damping, bounded=True)
            error_there, jacobian_there = self._linearised(trial)
            squared_there = float(error_there @ error_there)
            if squared_there < squared:
                position, error, jacobian = trial, error_there, jacobian_there
                squared, damping = squared_there, damping / _TRUST
            else:
                damping *= _TRUST
        return self.accepted(position)

    def measured(self, joint_position: Array) -> Found:
        """Return a position inside the limits with its errors by forward kinematics."""
        rotation, translation = self.kinematics.place(joint_position)
        found = Found(
            joint_position,
            math.dist(self.position.tolist(), translation.tolist()),
            rotation_angle(self.rotation, rotation),
        )
        if self.best is None or self.score(found) < self.score(self.best):
            self.best = found
        return found

    def accepted(self, joint_position: Array) -> Found | None:
        """Return a position inside the limits as an answer, if it is within the tolerances."""
        found = self.measured(joint_position)
        return found if self.suffices(found) else None

    def suffices(self, found: Found) -> bool:
        """Return True if a position is within the tolerances."""
        return (
            found.position_error <= self.tolerances[0]
            and found.rotation_error <= self.tolerances[1]
        )

    def score(self, found: Found) -> float:
        """Return the error of a position in units of the arm's size."""
        return found.position_error / self.size + found.rotation_error

    def _fitted(self, position: Array) -> Array | None:
        nearest = self.ranges.nearest(position.tolist(), self.seed)
        return None if nearest is None else np.array(nearest[1])

    def _descend(self, start: Array, *, bounded: bool) -> Array:
        """Return the (n,) position where the iteration from a (n,) start ends [rad or m].

        It ends at the target, where it makes no progress, or when the iterations are used up.

        Args:
            start: first position.
            bounded: True if every step stays inside the limits.
        """
        position = start
        previous, stalled = math.inf, 0
        for iteration in range(self.iterations):
            error, jacobian = self._linearised(position)
            squared = float(error.dot(error))
            if squared < _POLISHED:
                break
            stalled = stalled + 1 if squared > _STALL_RATIO * previous else 0
            if stalled >= _STALL_ITERATIONS and iteration >= _FREE_ITERATIONS:
                break
            previous = min(previous, squared)
            self.spent += 1
            damping = _DAMPING * squared + _LEAST_DAMPING
            pull = min(_GREATEST_PULL, math.sqrt(squared)) if self.centring else 0.0
            position = self._stepped(position, error, jacobian, damping, pull, bounded=bounded)
        return position

    def _stepped(
        self,
        position: Array,
        error: Array,
        jacobian: Array,
        damping: float,
        pull: float = 0.0,
        *,
        bounded: bool,
    ) -> Array:
        """Return the end of one damped step: (JᵀJ + λI) Δ = Jᵀe + λ p (middle - position)."""
        gradient = jacobian.T.dot(error)
        # A joint on its bound that would go farther is held; the others move without it.
        if bounded and (held := self._held(position, gradient)):
            jacobian = jacobian.copy()
            jacobian[:, held] = 0.0
            gradient[held] = 0.0
        normal = jacobian.T.dot(jacobian) + damping * self.identity
        if pull:
            # A prior at the middle of the range: what the task leaves free goes there, what it
            # needs is not affected. It fades with the error, so Newton's steps stay exact.
            gradient += damping * pull * (self.middle - position) / self.joint_unit
        stepped = position + solve_positive_definite(normal, gradient) * self.joint_unit
        return np.minimum(np.maximum(stepped, self.lower), self.upper) if bounded else stepped

    def _held(self, position: Array, gradient: Array) -> list[int]:
        """Return the joints on a bound that a step along a (n,) gradient would move beyond it."""
        limits = self.kinematics.limits
        slopes = zip(position.tolist(), gradient.tolist(), limits.lower, limits.upper, strict=True)
        return [
            joint
            for joint, (value, slope, lower, upper) in enumerate(slopes)
            if (value <= lower and slope < 0.0) or (value >= upper and slope > 0.0)
        ]

    def _linearised(self, position: Array) -> tuple[Array, Array]:
        """Return the (6,) error and the (6, n) Jacobian at a (n,) position, both without unit."""
        rotation, translation, jacobian = self.kinematics.linearise(position)
        error = np.empty(6)
        error[:3] = (self.position - translation) / self.size
        error[3:] = rotation_vector(self.rotation.dot(rotation.T))
        return error, jacobian * self.jacobian_unit


def rotation_angle(first: Array, second: Array) -> float:
    """Return the angle between two (3, 3) rotations [rad], 0 to π."""
    return math.hypot(*rotation_vector(first.dot(second.T)).tolist())
