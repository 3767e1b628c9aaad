"""Inverse kinematics: a joint position that puts the tool at a pose.

Owns the search: Levenberg–Marquardt with a damping scaled by the remaining error, from the seed
first and then from random positions inside the limits. The effort is counted in restarts, so that
the same question gets the same answer on any machine; time is only an outer cap. Every answer is
re-checked by forward kinematics and against the limits. Knows no pinocchio: it asks `Kinematics`.
"""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .errors import BadArgument, Unreachable
from .kinematics import Array, Kinematics, rotation_vector
from .pose import Pose

POSITION_TOLERANCE = 1e-5  # m
ROTATION_TOLERANCE = 1e-4  # rad

_FULL_TURN = 2.0 * math.pi

# Errors are scaled by the arm's size, so these have no unit. The damping is that fraction of the
# squared error: large steps far away, Newton's steps near the target.
_DAMPING = 0.1
_LEAST_DAMPING = 1e-12
_POLISHED = 1e-20  # squared error
_STALL_RATIO = 0.98  # of squared errors of successive iterations
_STALL_ITERATIONS = 3
_FREE_ITERATIONS = 5  # the first ones may rise without meaning anything

_SNAP = 1e-8  # rad or m: rounding noise of an answer that lies on a bound


@dataclass(frozen=True, slots=True, eq=False)
class Solution:
    """A joint position that reaches the asked pose.

    Attributes:
        joint_position: (n,) controller-side [rad or m], inside the limits.
        restarts: random restarts used; 0 if the search from the seed sufficed.
        iterations: iterations of all attempts together.
        position_error: distance to the asked position [m], by forward kinematics.
        rotation_error: angle to the asked orientation [rad], by forward kinematics.
    """

    joint_position: Array
    restarts: int
    iterations: int
    position_error: float
    rotation_error: float


def solve(
    kinematics: Kinematics,
    target: Pose,
    seed: Sequence[float] | Array,
    *,
    frame: str = "base",
    restarts: int = 50,
    iterations: int = 30,
    time_cap: float | None = 5.0,
    random_seed: int = 0,
    position_tolerance: float = POSITION_TOLERANCE,
    rotation_tolerance: float = ROTATION_TOLERANCE,
) -> Solution:
    """Find a joint position, near the seed where the search from there succeeds.

    Args:
        kinematics: the robot.
        target: the wanted tool pose in `frame`.
        seed: (n,) controller-side joint position to start from [rad or m]; it is moved to the
            nearest bound where it lies outside the limits.
        frame: `base` or `root`.
        restarts: random restarts after the attempts from the seed.
        iterations: iterations of each attempt.
        time_cap: give up after this long [s] whatever the budget; None for never.
        random_seed: the same number gives the same answer.
        position_tolerance: greatest accepted distance [m].
        rotation_tolerance: greatest accepted angle [rad].

    Raises:
        Unreachable: no attempt ended on the pose inside the limits.
        WrongJointCount: the seed does not have one value per driven joint.
        NotFinite: a value of the seed is infinite or not a number.
        FrameUnknown: there is no such frame.
        BadArgument: a budget or a tolerance is out of range.
    """
    for name, number, least in (
        ("restarts", restarts, 0),
        ("iterations", iterations, 1),
        ("random_seed", random_seed, 0),
    ):
        if number < least:
            raise BadArgument(name, number, f"{least} or more")
    tolerances = (position_tolerance, rotation_tolerance)
    if not min(tolerances) > 0.0:
        raise BadArgument("tolerance", tolerances, "more than 0")
    start = np.asarray(seed, dtype=np.float64)
    kinematics.limits.check_finite(start.tolist(), "the seed")
    start = np.clip(start, kinematics.lower, kinematics.upper)
    deadline = math.inf if time_cap is None else time.monotonic() + time_cap
    search = _Search(kinematics, kinematics.to_base(target, frame), start, iterations, tolerances)
    if solution := search.from_seed():
        return solution
    random = np.random.default_rng(random_seed)
    while search.restarts < restarts and time.monotonic() <= deadline:
        if solution := search.from_random(random):
            return solution
    position_error, rotation_error = search.best_residual
    raise Unreachable(target, frame, position_error, rotation_error, search.restarts)


class _Search:
    """One question: the target, the tolerances, and what was tried so far."""

    def __init__(
        self,
        kinematics: Kinematics,
        target: Pose,
        seed: Array,
        iterations: int,
        tolerances: tuple[float, float],
    ) -> None:
        self.kinematics = kinematics
        self.rotation, self.position = target.rotation, target.position
        self.seed = seed
        self.iterations = iterations
        self.tolerances = tolerances
        self.lower, self.upper = kinematics.lower, kinematics.upper
        self.turning = kinematics.turning
        self.size = kinematics.size
        # In units of the arm's size a prismatic joint weighs like a revolute one.
        self.joint_unit = np.where(kinematics.limits.prismatic, self.size, 1.0)
        self.redundant = kinematics.dof > 6
        self.restarts = 0
        self.spent = 0
        self.best_residual = (math.inf, math.inf)
        self._best_score = math.inf

    def from_seed(self) -> Solution | None:
        """Search from the seed: freely, then along the limits, then on another turn."""
        free = self._descend(self.seed, bounded=False)
        nearest = self._nearest_turn(free)
        if solution := self._accepted(nearest):
            return solution
        if solution := self._accepted(self._descend(self.seed, bounded=True)):
            return solution
        return self._accepted(self._turned_inside(nearest))

    def from_random(self, random: np.random.Generator) -> Solution | None:
        """Search from a random position inside the limits."""
        self.restarts += 1
        start = random.uniform(self.lower, self.upper)
        if self.redundant and self.restarts % 2 == 0:
            # A spare joint can move an answer back inside the limits, so it pays to search there.
            return self._accepted(self._descend(start, bounded=True))
        nearest = self._nearest_turn(self._descend(start, bounded=False))
        return self._accepted(self._turned_inside(nearest))

    def _descend(self, start: Array, *, bounded: bool) -> Array:
        position = start
        previous, stalled = math.inf, 0
        for iteration in range(self.iterations):
            error, jacobian = self._linearised(position)
            squared = float(error @ error)
            if squared < _POLISHED:
                break
            stalled = stalled + 1 if squared > _STALL_RATIO * previous else 0
            if stalled >= _STALL_ITERATIONS and iteration >= _FREE_ITERATIONS:
                break
            previous = min(previous, squared)
            self.spent += 1
            gradient = jacobian.T @ error
            if bounded:
                # A joint on its bound that wants to go farther is held, the others work round it.
                held = ((position <= self.lower) & (gradient < 0.0)) | (
                    (position >= self.upper) & (gradient > 0.0)
                )
                jacobian[:, held] = 0.0
                gradient[held] = 0.0
            normal = jacobian.T @ jacobian
            normal.flat[:: len(position) + 1] += _DAMPING * squared + _LEAST_DAMPING
            position = position + np.linalg.solve(normal, gradient) * self.joint_unit
            if bounded:
                position = np.clip(position, self.lower, self.upper)
        return position

    def _linearised(self, position: Array) -> tuple[Array, Array]:
        rotation, translation, jacobian = self.kinematics.linearise(position)
        error = np.empty(6)
        error[:3] = (self.position - translation) / self.size
        error[3:] = rotation_vector(self.rotation @ rotation.T)
        jacobian = jacobian * self.joint_unit
        jacobian[:3] /= self.size
        return error, jacobian

    def _nearest_turn(self, position: Array) -> Array:
        turns = np.round((position - self.seed) / _FULL_TURN)
        return position - np.where(self.turning, turns * _FULL_TURN, 0.0)

    def _turned_inside(self, position: Array) -> Array:
        below = np.ceil((self.lower - position - _SNAP) / _FULL_TURN)
        above = np.ceil((position - self.upper - _SNAP) / _FULL_TURN)
        turns = np.maximum(below, 0.0) - np.maximum(above, 0.0)
        return position + np.where(self.turning, turns * _FULL_TURN, 0.0)

    def _accepted(self, position: Array) -> Solution | None:
        inside = np.clip(position, self.lower, self.upper)
        rotation, translation = self.kinematics.place(inside)
        position_error = math.dist(self.position, translation)
        rotation_error = math.hypot(*rotation_vector(self.rotation @ rotation.T))
        in_limits = bool((np.abs(inside - position) <= _SNAP).all())
        at_target = position_error <= self.tolerances[0] and rotation_error <= self.tolerances[1]
        if in_limits and at_target:
            return Solution(inside, self.restarts, self.spent, position_error, rotation_error)
        score = position_error / self.size + rotation_error
        if score < self._best_score:
            self._best_score = score
            self.best_residual = (position_error, rotation_error)
        return None
