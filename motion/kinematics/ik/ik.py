"""Inverse kinematics: a joint position that puts the tool at a pose.

Owns the interface: the three functions, their defaults, and the answer. The effort of a search is
counted in restarts, so that the same query gets the same answer on any machine; time is only an
outer limit. Every answer is checked again by forward kinematics and against the limits.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from ...errors import BadArgument
from ...pose import Array, Pose
from ..serial import Kinematics
from .configuration import Configuration, configuration_of
from .ik_problem import Budget, IkProblem
from .levenberg_marquardt import Found

POSITION_TOLERANCE = 1e-5  # m
ROTATION_TOLERANCE = 1e-4  # rad

_RESTARTS, _ITERATIONS = 50, 30


@dataclass(frozen=True, slots=True, eq=False)
class Solution:
    """Joint position that reaches the asked pose.

    Attributes:
        joint_position: (n,) controller-side [rad or m], inside the limits.
        restarts: random restarts used; 0 if the search from the seed or a closed form sufficed.
        iterations: iterations of all numeric attempts together.
        position_error: distance to the asked position [m], by forward kinematics.
        rotation_error: angle to the asked orientation [rad], by forward kinematics.
        kinematics: the robot that was asked; None for a platform, which has no flags.
    """

    joint_position: Array
    restarts: int
    iterations: int
    position_error: float
    rotation_error: float
    kinematics: Kinematics | None = field(default=None, repr=False)

    @property
    def configuration(self) -> Configuration | None:
        """Flags and revolutions, computed when read; None if the robot's family has none."""
        if self.kinematics is None:
            return None
        return configuration_of(self.kinematics, self.joint_position)


def solve(
    kinematics: Kinematics,
    target: Pose,
    seed: Sequence[float] | Array,
    *,
    frame: str = "base",
    restarts: int = _RESTARTS,
    iterations: int = _ITERATIONS,
    time_cap: float | None = 5.0,
    random_seed: int = 0,
    position_tolerance: float = POSITION_TOLERANCE,
    rotation_tolerance: float = ROTATION_TOLERANCE,
    configuration: Configuration | None = None,
) -> Solution:
    """Return a joint position, the nearest to the seed where the arm has a closed form.

    Args:
        target: the wanted tool pose in `frame`.
        seed: (n,) controller-side joint position to start from [rad or m]; it is moved to the
            nearest bound where it lies outside the limits.
        frame: `base` or `root`.
        restarts: random restarts after the attempts from the seed.
        iterations: iterations of each attempt.
        time_cap: greatest duration [s] whatever the budget; None for no limit.
        random_seed: the same number gives the same answer.
        position_tolerance: greatest accepted distance [m].
        rotation_tolerance: greatest accepted angle [rad].
        configuration: the flags the answer must have, and the revolutions if it names them; None
            for any.

    Raises:
        PoseUnreachable: no joint position reaches the pose; with the nearest residual.
        OutOfRange: the pose is reached only with a joint outside its range.
        WrongJointCount, NotFinite: the seed is not one finite value per driven joint.
        FrameUnknown: there is no such frame.
        BadArgument: a budget or a tolerance is out of range, or a configuration is asked of a
            robot without flags.
    """
    budget = Budget(restarts, iterations, random_seed, time_cap)
    tolerances = (position_tolerance, rotation_tolerance)
    question = IkProblem(
        kinematics, target, frame, seed, configuration, tolerances, budget, _clock(time_cap)
    )
    return _solution(question, question.best())


def solve_all(
    kinematics: Kinematics,
    target: Pose,
    seed: Sequence[float] | Array,
    *,
    frame: str = "base",
    restarts: int = _RESTARTS,
    iterations: int = _ITERATIONS,
    time_cap: float | None = 5.0,
    random_seed: int = 0,
    position_tolerance: float = POSITION_TOLERANCE,
    rotation_tolerance: float = ROTATION_TOLERANCE,
    configuration: Configuration | None = None,
) -> tuple[Solution, ...]:
    """Return every joint position inside the limits that reaches a pose, the nearest to seed first.

    With a closed form these are all branches in all revolutions. A joint that the pose leaves free,
    at a singularity or because it is spare, keeps the seed's value where that works. Without a
    closed form they are the answers that the restarts find.

    Args: as of `solve`.

    Raises:
        MotionError: as of `solve`; otherwise there is at least one answer.
    """
    budget = Budget(restarts, iterations, random_seed, time_cap)
    tolerances = (position_tolerance, rotation_tolerance)
    question = IkProblem(
        kinematics, target, frame, seed, configuration, tolerances, budget, _clock(time_cap)
    )
    return tuple(_solution(question, found) for found in question.every())


@dataclass(frozen=True, slots=True, eq=False)
class Configurations:
    """Answers to one pose, an answer for each configuration of the arm, or each of its turns.

    Attributes:
        listed: answers, the nearest to the seed first, at most as many as were asked for.
        numbers: the configuration of each, from 1, the one nearest to the seed first.
        total: how many answers there are.
    """

    listed: tuple[Solution, ...]
    numbers: tuple[int, ...]
    total: int


def solve_configurations(
    kinematics: Kinematics,
    target: Pose,
    seed: Sequence[float] | Array,
    *,
    frame: str = "base",
    most: int,
    in_every_turn: bool = False,
    restarts: int = _RESTARTS,
    random_seed: int = 0,
    time_cap: float | None = 5.0,
) -> Configurations:
    """Return an answer of each configuration, in the turn nearest to the seed or in every turn.

    Two answers are of one configuration if they differ by full revolutions only. Takes a small part
    of the time of `solve_all` where an arm has many turns.

    Args:
        most: answers to list, and to check by forward kinematics, of all that there are.
        restarts: random restarts, of an arm without a closed form.
        random_seed: the same number gives the same answers.
        time_cap: greatest duration [s] whatever the budget; None for no limit.

    Raises:
        MotionError: as of `solve`; otherwise there is at least one answer.
    """
    budget = Budget(restarts, _ITERATIONS, random_seed, time_cap)
    tolerances = (POSITION_TOLERANCE, ROTATION_TOLERANCE)
    question = IkProblem(
        kinematics, target, frame, seed, None, tolerances, budget, _clock(time_cap)
    )
    found = question.configurations()
    if not in_every_turn:
        listed = found[:most]
        numbers = tuple(range(1, len(listed) + 1))
        return Configurations(_solutions(question, listed), numbers, len(found))
    turned = question.in_every_turn(found)
    listed = [question.placed(np.array(position)) for _, position in turned[:most]]
    numbers = tuple(place + 1 for place, _ in turned[:most])
    return Configurations(_solutions(question, listed), numbers, len(turned))


def _solutions(question: IkProblem, found: Sequence[Found]) -> tuple[Solution, ...]:
    return tuple(_solution(question, each) for each in found)


def branch_of(
    kinematics: Kinematics,
    target: Pose,
    seed: Sequence[float] | Array,
    branch: int,
    *,
    frame: str = "base",
) -> Solution:
    """Return the answer of one configuration, in the turn nearest to the seed.

    Args:
        branch: its number in `solve_configurations`, from 1, the nearest to the seed first.

    Raises:
        BadArgument: there are not so many.
        MotionError: as of `solve_configurations`.
    """
    found = solve_configurations(kinematics, target, seed, frame=frame, most=max(branch, 1))
    if not 1 <= branch <= len(found.listed):
        raise BadArgument("branch", branch, f"1 to {found.total} at this pose")
    return found.listed[branch - 1]


def _clock(time_cap: float | None) -> Callable[[], bool]:
    """Return a function that returns True once a time [s] from now is over."""
    if time_cap is None:
        return lambda: False
    deadline = time.monotonic() + time_cap
    return lambda: time.monotonic() > deadline


def _solution(question: IkProblem, found: Found) -> Solution:
    found.joint_position.flags.writeable = False
    restarts, iterations = question.effort
    return Solution(
        found.joint_position,
        restarts,
        iterations,
        found.position_error,
        found.rotation_error,
        question.kinematics,
    )
