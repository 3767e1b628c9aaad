"""Problem of inverse kinematics: one query, its budget, the order of the methods, and the choice.

Owns that order: a numeric search from the seed when the target is near it; a closed form where the
arm has one, with every branch and revolution; otherwise a numeric search from the seed, then from
random positions. Every answer is checked again by forward kinematics and against the limits. Effort
is counted in restarts and iterations, so that the same query gets the same answer on any machine.
Knows no clock: a function tells it that the time is over.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import cached_property
from typing import NamedTuple, TypeAlias

import numpy as np

from ...errors import BadArgument, MotionError, PoseUnreachable, WrongJointCount
from ...pose import Array, Pose
from ..serial import Kinematics
from .branches import BranchPreference, Offer
from .configuration import Configuration
from .ik_context import arm_of
from .levenberg_marquardt import DampedSearch, Found, rotation_angle

_Offered: TypeAlias = Callable[[Array, BranchPreference], Iterator[Sequence[float]]]
"""Returns (n,) positions of a closed form for a (4, 4) target."""


class Budget(NamedTuple):
    """Restarts, iterations of each attempt, and the greatest duration of a search [s]."""

    restarts: int
    iterations: int
    random_seed: int
    time_cap: float | None

    def check(self) -> None:
        """Refuse a number out of range by a `BadArgument` with its name."""
        if self.restarts < 0:
            raise BadArgument("restarts", self.restarts, "0 or more")
        if self.iterations < 1:
            raise BadArgument("iterations", self.iterations, "1 or more")
        if self.random_seed < 0:
            raise BadArgument("random_seed", self.random_seed, "0 or more")
        if self.time_cap is not None and not self.time_cap >= 0.0:
            raise BadArgument("time_cap", self.time_cap, "0 or more, or None")


_NEAR_DISTANCE = 0.02  # m: nearer targets are searched from the seed first
_NEAR_ANGLE = 0.1  # rad
_GREATEST_NEAR_STEP = 0.5  # rad or m: a joint that moves more is not near the seed
_POLISHED = 1e-8  # m or rad: a closed-form answer with a greater error is improved numerically
_MISSES_TRIED = 4
_GREATEST_CHORD = math.sqrt(8.0)  # Frobenius distance of rotations that are π apart
_SAME = 1e-6  # rad or m: answers nearer than this are one


def _differ_by_turns(kinematics: Kinematics, position: Array, other: Array) -> bool:
    """Return True if two (n,) joint positions are the same one but for full revolutions."""
    apart = np.abs(position - other)
    turned = np.abs(apart - 2.0 * math.pi * np.round(apart / (2.0 * math.pi)))
    return bool((np.where(kinematics.turning, turned, apart) < _SAME).all())


class IkProblem:
    """Query for one pose of one robot, and the results so far.

    Attributes:
        target: (4, 4) wanted tool placement in the base frame.
        position: its three coordinates [m].
        seed: (n,) position that the answer should be near, inside the limits.
    """

    def __init__(
        self,
        kinematics: Kinematics,
        target: Pose,
        frame: str,
        seed: Sequence[float] | Array,
        configuration: Configuration | None,
        tolerances: tuple[float, float],
        budget: Budget,
        expired: Callable[[], bool],
    ) -> None:
        """Check and start a query; arguments and refusals as of `ik.solve`.

        `tolerances` are the distance [m] and the angle [rad]; `expired` returns True once the time
        is over.
        """
        if not min(tolerances) > 0.0:
            raise BadArgument("tolerance", tolerances, "more than 0")
        budget.check()
        limits = kinematics.limits
        values = np.asarray(seed, dtype=np.float64).tolist()
        limits.check_finite(values, "the seed")
        self.kinematics, self.arm = kinematics, arm_of(kinematics)
        self.asked, self.frame, self.configuration = target, frame, configuration
        if configuration is not None:
            self._check_configuration(configuration)
        self.tolerances, self.budget = tolerances, budget
        self.expired = expired
        self.seed = self.arm.ranges.clamped(values)
        pose = kinematics.to_base(target, frame)
        self.target, self.position = pose.to_matrix(), pose.position.tolist()

    @cached_property
    def search(self) -> DampedSearch:
        """Numeric search, built when it is first needed."""
        return self._new_search(self.target[:3, :3])

    @property
    def effort(self) -> tuple[int, int]:
        """Random restarts and iterations used so far."""
        search = self.__dict__.get("search")
        return (search.restarts, search.spent) if search else (0, 0)

    def best(self) -> Found:
        """Return the answer nearest to the seed, by the first method that has one."""
        if found := self._near() or self._by_formula() or self._by_search():
            return found
        raise self._unreachable()

    def every(self) -> list[Found]:
        """Return all answers, at least one, the nearest to the seed first."""
        choice = self.arm.choice
        return self._ordered(self._verified_of(choice.every) if choice else self._every_by_search())

    def configurations(self) -> list[Found]:
        """Return one answer of each configuration, at least one, the nearest to the seed first.

        Each is in the revolution that is nearest to the seed.
        """
        choice = self.arm.choice
        answers = self._verified_of(choice.nearest_of_each) if choice else self._every_by_search()
        different: list[Found] = []
        for found in self._ordered(answers):
            position = found.joint_position
            if not any(
                _differ_by_turns(self.kinematics, position, each.joint_position)
                for each in different
            ):
                different.append(found)
        return different

    def in_every_turn(self, answers: Sequence[Found]) -> list[tuple[int, tuple[float, ...]]]:
        """Return answers in every revolution inside the limits, the nearest to the seed first.

        They need no check: a full revolution leaves the tool where it was.

        Returns:
            The place of each among the answers, and the (n,) position.
        """
        ranges = self.arm.ranges
        turned = [
            (place, position)
            for place, found in enumerate(answers)
            for position in ranges.every(found.joint_position.tolist())
        ]
        turned.sort(key=lambda pair: ranges.distance(pair[1], self.seed))
        return turned

    def _ordered(self, answers: Iterable[Found]) -> list[Found]:
        """Return what is different of answers, the nearest to the seed first; the best for none."""
        distance = self.arm.ranges.distance
        different: dict[tuple[int, ...], tuple[float, Found]] = {}
        for found in answers:
            values = found.joint_position.tolist()
            place = tuple(round(value / _SAME) for value in values)
            different.setdefault(place, (distance(values, self.seed), found))
        if not different:
            return [self.best()]
        nearest_first = sorted(different.values(), key=lambda pair: pair[0])
        return [found for _, found in nearest_first]

    def _near(self) -> Found | None:
        """Search from the seed where the target is near it: continuous, even at singularities."""
        rotation, position = self.kinematics.place(np.array(self.seed))
        if math.dist(position.tolist(), self.position) > _NEAR_DISTANCE:
            return None
        if rotation_angle(self.search.rotation, rotation) > _NEAR_ANGLE:
            return None
        found = self.search.from_seed(near=True)
        if found is None or not self._as_configured(found):
            return None
        step = float(np.abs(found.joint_position - self.seed).max())
        return found if step <= _GREATEST_NEAR_STEP else None

    def _by_formula(self) -> Found | None:
        """Return the closed form's answer, None without one; raise if it proves that none is."""
        form, choice = self.arm.form, self.arm.choice
        if form is None or choice is None:
            return None
        if form.free_joint is not None:
            self._refuse_far()
        refused: list[Offer] = []
        for offer in choice.offers(self.target, self._wish()):
            for position in offer.fitting:
                if found := self._verified(position):
                    return found
            if offer.fitting or offer.borderline:
                return None
            refused.append(offer)
        if form.free_joint is None:
            raise self._refusal(refused[0])
        return self._between(refused)

    def _refusal(self, offer: Offer) -> MotionError:
        """Return the reason why the only offer of a closed form is none."""
        if offer.outside is not None:
            return offer.outside
        miss = offer.miss and self.placed(np.array(offer.miss))
        return self._unreachable(miss or None)

    def _between(self, refused: list[Offer]) -> Found | None:
        """Search from the nearest misses: the spare joint may fit between the values tried."""
        for offer in sorted(refused, key=lambda offer: offer.gap)[:_MISSES_TRIED]:
            if offer.miss is not None:
                found = self.search.polished(offer.miss)
                if found and self._as_configured(found):
                    return found
        return None

    def _by_search(self) -> Found | None:
        """Search numerically from the seed, then from random positions, within the budget."""
        self._refuse_far()
        self._refuse_tilt()
        found = self.search.from_seed(near=False)
        if found and self._as_configured(found):
            return found
        for found in self._restarted():
            if self._as_configured(found):
                return found
        # At a singularity the search converges slowly: its nearest position is worth continuing.
        # In a corner of the limits that position lies beside the answer, and a search from the seed
        # that never steps to a greater error gets there.
        nearest = self.search.best
        for start in (*((nearest.joint_position,) if nearest else ()), self.seed):
            found = self.search.polished(start)
            if found and self._as_configured(found):
                return found
        return None

    def _restarted(self) -> Iterator[Found]:
        random = np.random.default_rng(self.budget.random_seed)
        while self.search.restarts < self.budget.restarts and not self.expired():
            if found := self.search.from_random(random):
                yield found

    def _verified_of(self, offered: _Offered) -> Iterator[Found]:
        for position in offered(self.target, self._wish()):
            if found := self._verified(position):
                yield found

    def _every_by_search(self) -> Iterator[Found]:
        self._refuse_far()
        self._refuse_tilt()
        first = self.search.from_seed(near=False)
        for found in (*((first,) if first else ()), *self._restarted()):
            for position in self.arm.ranges.every(found.joint_position.tolist()):
                if turned := self.search.accepted(np.array(position)):
                    yield turned

    def _verified(self, position: Sequence[float]) -> Found | None:
        """Check a closed-form answer by forward kinematics, and improve it if it is inexact."""
        found = self.placed(np.array(position))
        if found.position_error <= _POLISHED and found.rotation_error <= _POLISHED:
            return found
        found = self.search.measured(found.joint_position)
        if polished := self.search.polished(position):
            found = min(found, polished, key=self.search.score)
        return found if self.search.suffices(found) else None

    def placed(self, joint_position: Array) -> Found:
        """Return a closed-form answer with its errors by forward kinematics.

        Rotations an angle θ apart differ by √8 |sin θ/2| in the Frobenius norm, which gives small
        angles without a logarithm.
        """
        rotation, position = self.kinematics.place(joint_position)
        (a, b, c), (u, v, w, _) = rotation.tolist(), self.target.tolist()
        chord = math.dist((*a, *b, *c), (*u[:3], *v[:3], *w[:3]))
        angle = 2.0 * math.asin(min(chord / _GREATEST_CHORD, 1.0))
        return Found(joint_position, math.dist(position.tolist(), self.position), angle)

    def _refuse_far(self) -> None:
        """Refuse a pose beyond the arm's reach, after one computation of its distance."""
        if self.arm.reach.beyond(self.position) > self.tolerances[0]:
            self.search.from_seed(near=False)
            if self.search.best is not None:
                self.search.polished(self.search.best.joint_position)
            raise self._unreachable()

    def _refuse_tilt(self) -> None:
        """Refuse a pose for which a SCARA or a palletiser would have to tilt its tool."""
        kept, rotation = self.arm.kept, self.target[:3, :3]
        if kept is None:
            return
        tilt = kept.tilt(rotation)
        if tilt <= self.tolerances[1]:
            return
        level = self._new_search(kept.levelled(rotation))
        found, random = level.from_seed(near=False), np.random.default_rng(self.budget.random_seed)
        while found is None and level.restarts < self.budget.restarts:
            if self.expired():
                break
            found = level.from_random(random)
        nearest = found or level.best
        if nearest is not None:
            self.search.measured(nearest.joint_position)
        self.search.restarts = level.restarts
        raise self._unreachable()

    def _wish(self) -> BranchPreference:
        return BranchPreference(self.seed, self.configuration, self.tolerances[0])

    def _new_search(self, rotation: Array) -> DampedSearch:
        return DampedSearch(
            self.kinematics,
            self.arm.ranges,
            (rotation, self.target[:3, 3]),
            self.seed,
            self.budget.iterations,
            self.tolerances,
        )

    def _check_configuration(self, configuration: Configuration) -> None:
        if self.arm.form is None:
            accepted = f"none: {self.kinematics.robot.name} has no closed form, so no flags"
            raise BadArgument("configuration", configuration, accepted)
        if configuration.turns is not None and len(configuration.turns) != self.kinematics.dof:
            raise WrongJointCount(len(configuration.turns), self.kinematics.dof)

    def _as_configured(self, found: Found) -> bool:
        wanted, form = self.configuration, self.arm.form
        if wanted is None or form is None:
            return True
        values = found.joint_position.tolist()
        turns = wanted.turns
        if turns is not None and self.arm.ranges.with_revolutions(values, turns) != values:
            return False
        return wanted.agrees_with(form.measures(self.kinematics.robot.to_model(values)))

    def _unreachable(self, nearest: Found | None = None) -> PoseUnreachable:
        """Return the refusal with the errors of a position: the given one, or the best found."""
        best = nearest or self.search.best
        errors = (best.position_error, best.rotation_error) if best else (math.inf, math.inf)
        x, y, z = self.asked.position.tolist()
        return PoseUnreachable((x, y, z), self.frame, *errors, self.effort[0])
