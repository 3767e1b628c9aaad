"""Which branches of a closed form a question accepts, and why not where it accepts none.

Owns the step from chain-side branches to controller-side joint positions inside the limits: the
coupling by the robot's own map, the asked configuration, turns, order by distance from the seed,
and the refusal by numbers. Knows no forward kinematics: whoever asks verifies.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple

import numpy as np

from .closed_form import Branch, ClosedForm
from .configuration import Configuration
from .errors import OutOfRange
from .kinematics import Array, Kinematics
from .turns import JointRanges

_BORDERLINE = 1e-3  # m or rad from a singularity
_FREE_VALUES = 33  # tried over the range of a spare joint


class Offer(NamedTuple):
    """What a closed form offers for one target.

    Attributes:
        fitting: controller-side positions inside the limits, the nearest to the seed first; some
            that are farther may be left out.
        outside: the refusal of the branch that is least outside the limits, if any branch reaches
            the pose and none fits.
        borderline: whether such a branch is so near to a singularity that a little farther on it
            might fit, within the tolerances.
        miss: how near the arm comes, controller side, where no branch reaches the pose.
        gap: how far that stays from the pose [m].
    """

    fitting: list[list[float]]
    outside: OutOfRange | None = None
    miss: Sequence[float] | None = None
    gap: float = math.inf
    borderline: bool = False


class Wish(NamedTuple):
    """What a question asks of the branches.

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
        """The turns wanted, None for any."""
        return None if self.configuration is None else self.configuration.turns


class BranchChoice:
    """The closed form of one robot, with its limits and its coupling."""

    def __init__(self, kinematics: Kinematics, form: ClosedForm, ranges: JointRanges) -> None:
        robot = kinematics.robot
        self._robot, self._form, self._ranges = robot, form, ranges
        # The robot's own map of unit vectors, as a matrix: all branches go through it at once.
        rows = np.array([robot.to_controller(row) for row in np.eye(robot.dof).tolist()])
        self._to_controller = None if np.array_equal(rows, np.eye(robot.dof)) else rows

    def offers(self, target: Array, wish: Wish) -> Iterator[Offer]:
        """Yield what the closed form offers: once, or for one value after another of a spare joint.

        Args:
            target: (4, 4) wanted tool placement in the base frame.
            wish: seed, configuration and tolerance.
        """
        for preferred in self._preferences(wish.seed):
            yield self._offer(self._form.branches(target, preferred), wish)

    def every(self, target: Array, wish: Wish) -> Iterator[Sequence[float]]:
        """Yield every turn inside the limits of every branch that has the configuration.

        A spare joint has the first of its values for which there is any.

        Args:
            target: (4, 4) wanted tool placement in the base frame.
            wish: seed, configuration and tolerance.
        """
        for preferred in self._preferences(wish.seed):
            any_fits = False
            agreeing = _agreeing(self._form, self._form.branches(target, preferred), wish)
            reached = [branch for branch in agreeing if branch.gap <= wish.gap]
            for position in self._controller_side(reached):
                for turned in self._in_every_turn(position, wish):
                    any_fits = True
                    yield turned
            if any_fits:
                return

    def _preferences(self, seed: Sequence[float]) -> Iterator[Sequence[float]]:
        """Yield chain-side values that free joints shall keep: the seed's, then others.

        A spare joint takes values from the middle of its range outwards, so that what is taken
        first is far from its limits.
        """
        preferred = list(self._robot.to_model(seed) if self._to_controller is not None else seed)
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

    def _in_every_turn(self, position: Sequence[float], wish: Wish) -> Iterator[Sequence[float]]:
        if wish.turns is None:
            yield from self._ranges.every(position)
        elif fitted := self._ranges.in_turns(position, wish.turns, wish.seed):
            yield fitted[1]

    def _offer(self, branches: list[Branch], wish: Wish) -> Offer:
        agreeing = _agreeing(self._form, branches, wish)
        reached = [branch for branch in agreeing if branch.gap <= wish.gap]
        if not reached:
            miss = min(agreeing or branches, key=lambda branch: branch.gap)
            return Offer([], miss=self._controller_side([miss])[0], gap=miss.gap)
        reaching = self._controller_side(reached)
        ranges, turns, seed = self._ranges, wish.turns, wish.seed
        fitting: list[list[float]] = []
        within = math.inf
        for position in reaching:
            if turns is None:
                fit = ranges.nearest(position, seed, within)
            else:
                fit = ranges.in_turns(position, turns, seed)
            if fit is not None and fit[0] <= within:
                within = fit[0]
                fitting.insert(0, fit[1])
        if fitting:
            return Offer(fitting)
        blamed = (ranges.blame(position, turns) for position in reaching)
        outside = _least(blame for blame in blamed if blame is not None)
        borderline = any(_borderline(self._form, branch) for branch in reached)
        return Offer([], outside, borderline=borderline)

    def _controller_side(self, branches: list[Branch]) -> Sequence[Sequence[float]]:
        positions = [branch.position for branch in branches]
        if self._to_controller is None or not positions:
            return positions
        rows: list[list[float]] = (np.array(positions) @ self._to_controller).tolist()
        return rows


def _agreeing(form: ClosedForm, branches: list[Branch], wish: Wish) -> list[Branch]:
    wanted = wish.configuration
    if wanted is None:
        return branches
    return [branch for branch in branches if wanted.agrees_with(form.measures(branch.position))]


def _borderline(form: ClosedForm, branch: Branch) -> bool:
    shoulder, _, wrist = form.measures(branch.position)
    return abs(shoulder) < _BORDERLINE or abs(math.sin(wrist)) < _BORDERLINE


def _least(blamed: Iterable[tuple[float, OutOfRange]]) -> OutOfRange:
    return min(blamed, key=lambda blame: blame[0])[1]
