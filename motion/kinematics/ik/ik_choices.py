"""Choices of inverse kinematics: the answers to one pose, counted by configuration and by turn.

Owns what a person is offered to choose from: the nearest answer, each configuration once at the
turn that is nearest to the seed, or every full turn inside the limits; and the number of each
configuration (`branch`), by which a plan names one. `ik` owns how answers are found, and which is
the nearest: a slow joint weighs more than a fast one there (`revolutions`), and branches are
numbered by that. Listed they are in the order of the distance that is told of each.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from ...pose import Pose
from ..closed_form import closed_form
from ..serial import Kinematics
from .ik import Solution, solve, solve_configurations

MOST_CHOICES = 64
"""Answers that are listed; of more the nearest. An arm whose joints turn twice has up to 256."""

LONGEST_SEARCH = 0.5
"""Outer limit of a search [s]; the effort of the dearest robot takes a tenth of it."""

_RESTARTS = 20
"""Random restarts of an arm without a closed form: two or three times as many as find all answers
of a palletiser, and a fair sample of a self-motion."""

_SINGULAR = 1e-6
"""Distance from a singularity below which a family of answers reaches the pose [m or rad]."""


class WantedBranches(StrEnum):
    """Which answers are wanted."""

    NEAREST = "nearest"
    ALL = "all"
    TURNS = "turns"


@dataclass(frozen=True, slots=True, eq=False)
class IkChoice:
    """One answer.

    Attributes:
        branch: number of its configuration, from 1, the one nearest to the seed first.
        distance: greatest change of a joint from the seed [rad or m].
    """

    branch: int
    solution: Solution
    distance: float


@dataclass(frozen=True, slots=True)
class Choices:
    """The answers to one pose.

    Attributes:
        listed: the smallest change of a joint first, at most `MOST_CHOICES`.
        total: how many there are of the kind that was asked for.
        is_complete: nothing is missing in `total`. False where the nearest alone was asked for,
            and where the answers are a sample: of an arm without a closed form, of one with a
            self-motion, and at a singularity, where a family of positions reaches the pose.
    """

    listed: tuple[IkChoice, ...]
    total: int
    is_complete: bool


def choices(
    kinematics: Kinematics,
    target: Pose,
    seed: Sequence[float],
    wanted: WantedBranches,
    *,
    frame: str = "base",
) -> Choices:
    """Return the answers to one pose inside the limits.

    Args:
        target: the tool pose in `frame`, `base` or `root`.
        seed: (n,) controller-side joint position to be near to [rad or m].

    Raises:
        MotionError: as of `ik.solve`; otherwise there is at least one answer.
    """
    if wanted is WantedBranches.NEAREST:
        nearest = solve(kinematics, target, seed, frame=frame, time_cap=LONGEST_SEARCH)
        return Choices((choice(1, nearest, seed),), 1, False)
    found = solve_configurations(
        kinematics,
        target,
        seed,
        frame=frame,
        most=MOST_CHOICES,
        restarts=_RESTARTS,
        in_every_turn=wanted is WantedBranches.TURNS,
        time_cap=LONGEST_SEARCH,
    )
    numbered = zip(found.numbers, found.listed, strict=True)
    told = (choice(number, solution, seed) for number, solution in numbered)
    listed = tuple(sorted(told, key=lambda each: each.distance))
    return Choices(listed, found.total, _has_all(kinematics, found.listed))


def choice(branch: int, solution: Solution, seed: Sequence[float]) -> IkChoice:
    """Return one answer, with how far it is from a (n,) seed."""
    change = np.abs(solution.joint_position - np.asarray(seed, dtype=np.float64))
    return IkChoice(branch, solution, float(change.max()))


def _has_all(kinematics: Kinematics, found: Sequence[Solution]) -> bool:
    form = closed_form(kinematics)
    if form is None or form.free_joint is not None:
        return False
    for solution in found:
        measures = form.measures(kinematics.robot.to_model(solution.joint_position.tolist()))
        # Above axis 1 any angle of it will do, and with parallel wrist axes any split of a turn.
        if abs(measures.shoulder) < _SINGULAR or abs(math.sin(measures.wrist)) < _SINGULAR:
            return False
    return True
