"""Branch choice: the branches of a closed form that a query accepts, or the refusal.

Owns the step from chain-side branches to controller-side joint positions inside the limits: the
coupling by the robot's own map, the asked configuration, revolutions, order by distance from the
seed, and the refusal by numbers. Knows no forward kinematics: the caller verifies.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from operator import itemgetter
from typing import NamedTuple, TypeAlias

import numpy as np

from ...errors import OutOfRange
from ...pose import Array
from ..closed_form.geometry import Branches, ClosedForm, Position
from ..revolutions import JointRanges
from ..serial import Kinematics
from .configuration import Configuration

_BORDERLINE = 1e-3  # m or rad from a singularity
_FREE_VALUES = 33  # values tried over the range of a spare joint

_Terms: TypeAlias = tuple[tuple[int, int, float], ...]
"""Term of a linear map: the joint that it is added to, the joint that it is of, and the factor."""


class Offer(NamedTuple):
    """Answers of a closed form for one target.

    Attributes:
        fitting: controller-side positions inside the limits, the nearest to the seed first; some
            that are farther may be left out.
        outside: the refusal of the branch that is least outside the limits, if any branch reaches
            the pose and none fits.
        borderline: True if such a branch is so near to a singularity that a little farther on it
            might fit, within the tolerances.
        miss: the nearest position inside the limits, controller side, where no branch reaches the
            pose.
        gap: its distance from the pose [m].
    """

    fitting: list[list[float]]
    outside: OutOfRange | None = None
    miss: Sequence[float] | None = None
    gap: float = math.inf
    borderline: bool = False


class BranchPreference(NamedTuple):
    """Requirements of a query on the branches.

    Attributes:
        seed: (n,) controller-side joint position inside the limits.
        configuration: the flags wanted, None for any.
        gap: greatest miss of a branch that still counts as reaching the pose [m].
    """

    seed: Sequence[float]
    configuration: Configuration | None
    gap: float

    @property
    def turns(self) -> tuple[int, ...] | None:
        """Revolutions wanted, None for any."""
        return None if self.configuration is None else self.configuration.turns


class BranchChoice:
    """Closed form of one robot, with its limits and its coupling."""

    def __init__(self, kinematics: Kinematics, form: ClosedForm, ranges: JointRanges) -> None:
        robot = kinematics.robot
        self._size = kinematics.size
        self._robot, self._form, self._ranges = robot, form, ranges
        self._to_controller = _terms(robot.to_controller, robot.dof)
        self._to_chain = _terms(robot.to_model, robot.dof)

    def offers(self, target: Array, wish: BranchPreference) -> Iterator[Offer]:
        """Yield the offers of the closed form: one, or one for each value of a spare joint.

        Args:
            target: (4, 4) wanted tool placement in the base frame.
        """
        for preferred in self._preferences(wish.seed):
            yield self._offer(self._form.branches(target, preferred), wish)

    def every(self, target: Array, wish: BranchPreference) -> Iterator[Sequence[float]]:
        """Yield every revolution inside the limits of every branch that has the configuration.

        A spare joint has the first of its values for which there is any.

        Args:
            target: (4, 4) wanted tool placement in the base frame.
        """
        for preferred in self._preferences(wish.seed):
            any_fits = False
            branches = self._form.branches(target, preferred)
            reached = self._agreeing(branches, wish.configuration).within(wish.gap)
            for position in reached:
                here = _mapped(position, self._to_controller)
                for turned in self._in_every_turn(here, wish):
                    any_fits = True
                    yield turned
            if any_fits:
                return

    def nearest_of_each(self, target: Array, wish: BranchPreference) -> Iterator[Sequence[float]]:
        """Yield of every branch the revolution inside the limits that is nearest to the seed.

        A spare joint has the first of its values for which there is any.

        Args:
            target: (4, 4) wanted tool placement in the base frame.
        """
        nearest = self._ranges.around(wish.seed).of
        for preferred in self._preferences(wish.seed):
            reached = self._form.branches(target, preferred).within(wish.gap)
            fits = [nearest(_mapped(position, self._to_controller)) for position in reached]
            yield from (fit[1] for fit in fits if fit is not None)
            if any(fits):
                return

    def _preferences(self, seed: Sequence[float]) -> Iterator[Sequence[float]]:
        """Yield chain-side values that free joints keep: the seed's, then others.

        A spare joint takes values from the middle of its range outwards, so that the first ones are
        far from its limits.
        """
        preferred = _mapped(seed, self._to_chain)
        yield preferred
        free = self._form.free_joint
        if free is None:
            return
        limits = self._robot.limits
        middle = (limits.lower[free] + limits.upper[free]) / 2.0
        step = (limits.upper[free] - limits.lower[free]) / (_FREE_VALUES - 1)
        for number in range(_FREE_VALUES):
            preferred[free] = middle + (number + 1) // 2 * step * (1 if number % 2 else -1)
            yield preferred

    def _in_every_turn(
        self, position: Sequence[float], wish: BranchPreference
    ) -> Iterator[Sequence[float]]:
        if wish.turns is None:
            yield from self._ranges.every(position)
        elif fitted := self._ranges.in_revolutions(position, wish.turns, wish.seed):
            yield fitted[1]

    def _offer(self, branches: Branches, wish: BranchPreference) -> Offer:
        agreeing = self._agreeing(branches, wish.configuration)
        if min(agreeing.gaps, default=math.inf) > wish.gap:
            return self._nearest_miss(agreeing if agreeing.gaps else branches)
        reached = agreeing.within(wish.gap)
        terms = self._to_controller
        reaching = [_mapped(position, terms) for position in reached] if terms else reached
        ranges, turns, seed = self._ranges, wish.turns, wish.seed
        nearest = ranges.around(seed).of
        fitting: list[list[float]] = []
        within = math.inf
        for position in reaching:
            if turns is None:
                fit = nearest(position, within)
            else:
                fit = ranges.in_revolutions(position, turns, seed)
            if fit is not None and fit[0] <= within:
                within = fit[0]
                fitting.insert(0, fit[1])
        if fitting:
            return Offer(fitting)
        blamed = (ranges.blame(position, turns) for position in reaching)
        outside = _least(blame for blame in blamed if blame is not None)
        borderline = any(self._borderline(position) for position in reached)
        return Offer([], outside, borderline=borderline)

    def _nearest_miss(self, branches: Branches) -> Offer:
        """Return the branch that stays nearest to the pose once it is moved into the limits.

        The distance is estimated from angles and the arm's size: forward kinematics of every branch
        would take longer than a refusal may.
        """
        least, best, nearest = math.inf, math.inf, None
        pairs = zip(branches.gaps, branches.positions, strict=True)
        for gap, position in sorted(pairs, key=itemgetter(0)):
            if gap / self._size >= least:
                break
            outside, inside = self._ranges.drawn_in(_mapped(position, self._to_controller))
            if (cost := gap / self._size + outside) < least:
                least, best, nearest = cost, gap, inside
        return Offer([], miss=nearest, gap=best)

    def _agreeing(self, branches: Branches, wanted: Configuration | None) -> Branches:
        """Return the branches that have the flags wanted."""
        if wanted is None:
            return branches
        pairs = [
            (position, gap)
            for position, gap in zip(*branches, strict=True)
            if wanted.agrees_with(self._form.measures(position))
        ]
        return Branches([position for position, _ in pairs], [gap for _, gap in pairs])

    def _borderline(self, position: Position) -> bool:
        shoulder, _, wrist = self._form.measures(position)
        return abs(shoulder) < _BORDERLINE or abs(math.sin(wrist)) < _BORDERLINE


def _terms(linear: Callable[[list[float]], Sequence[float]], dof: int) -> _Terms:
    """Return the terms of a linear map of `dof` joints, read off its unit vectors."""
    identity = np.eye(dof)
    added = np.array([linear(row) for row in identity.tolist()]) - identity
    return tuple(
        (int(joint), int(other), float(added[other, joint])) for other, joint in np.argwhere(added)
    )


def _mapped(position: Sequence[float], terms: _Terms) -> list[float]:
    """Return a joint position on the other side of the coupling: q + terms · q."""
    mapped = list(position)
    for joint, other, gain in terms:
        mapped[joint] += gain * position[other]
    return mapped


def _least(blamed: Iterable[tuple[float, OutOfRange]]) -> OutOfRange:
    return min(blamed, key=lambda blame: blame[0])[1]
