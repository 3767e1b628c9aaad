"""The bounds of a jog's ticks, one by one: by numbers that are worked out by hand.

Then how fast a joint may get before the ends of its range, and where it stands beyond them.
"""

import math
from collections.abc import Callable, Sequence
from itertools import pairwise
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from rigs.motion.bodies_on_rails import BodiesOnRails, standing_at
from rigs.motion.jogged_robots import FAST, UR5_BENT, model, robot
from rigs.motion.loaded_robots import arm

from openpendant.motion.description.limits import JointLimits
from openpendant.motion.jog import JogCaps, Jogger, JogModel, JogSlowdown, JointJog
from openpendant.motion.jog.collision_guard import CollisionGuard
from openpendant.motion.jog.jog_commands import LONGEST_STEP, JogCause
from openpendant.motion.jog.jog_robot import Footing, Posture
from openpendant.motion.jog.joint_braking import JointLimitBraking, StopOutlook, point_excess
from openpendant.motion.jog.joint_jog import StopSurroundings
from openpendant.motion.jog.lookahead import LookAhead
from openpendant.motion.jog.path_node import PathNode, is_even, scales, speed_bounds, stop
from openpendant.motion.jog.tool_path import JogTwist, ToolPath

LIMITS = JointLimits(
    names=("a", "b"),
    lower=(-2.0, -2.0),
    upper=(2.0, 2.0),
    velocity=(1.0, 1.0),
    acceleration=(4.0, 8.0),
    prismatic=(False, False),
)
DT = 0.01
"""s: in which a joint changes its velocity by 0.04 rad/s, the other by 0.08."""


class TestSpeedBounds:
    """The least and the greatest speed along the way at which joints keep to their limits."""

    @pytest.mark.parametrize(
        ("rate", "before", "bounds"),
        [
            ((1.0, 0.0), (0.5, 0.0), (0.46, 0.54)),
            ((-1.0, 0.0), (-0.5, 0.0), (0.46, 0.54)),
            ((0.0, 2.0), (0.0, 0.5), (0.21, 0.29)),
            ((1.0, 1.0), (0.5, 0.5), (0.46, 0.54)),  # the one that changes less
            ((1.0, 1.0), (0.5, 0.6), (0.52, 0.54)),  # what both leave
            ((1.0, 1.0), (0.5, 0.7), (0.62, 0.54)),  # nothing
            ((1.0, 0.0), (0.99, 0.0), (0.95, 0.9995)),
            ((-1.0, 0.0), (-0.99, 0.0), (0.95, 0.9995)),
            ((1.0, 0.0), (0.01, 0.0), (0.0, 0.05)),
            ((0.0, 0.0), (0.03, 0.07), (0.0, math.inf)),
            ((0.0, 0.0), (0.05, 0.0), (math.inf, 0.0)),  # it cannot stand yet
            ((0.0, 0.0), (-0.05, 0.0), (math.inf, 0.0)),
        ],
    )
    def test_are_those_of_the_joint_that_leaves_least(
        self, rate: Sequence[float], before: Sequence[float], bounds: tuple[float, float]
    ) -> None:
        assert speed_bounds(LIMITS, rate, before, DT) == pytest.approx(bounds)


@pytest.mark.parametrize(
    ("joint", "way", "even"),
    [
        (0, 0.99e-4, True),
        (0, -0.99e-4, True),
        (0, 1.01e-4, False),
        (0, -1.01e-4, False),
        (1, 1.9e-4, True),
        (1, 2.1e-4, False),
    ],
)
def test_a_way_differs_from_that_of_the_mean_velocity_by_a_quarter_of_the_acceleration(
    joint: int, way: float, even: bool
) -> None:
    end = [0.1 + 0.006, 0.1 + 0.006]
    end[joint] += way
    before, after = ([0.1, 0.1], [0.4, 0.4]), (end, [0.8, 0.8])
    assert is_even(LIMITS, before, after, DT) is even


Points = Callable[[Sequence[float], Sequence[float]], tuple[float, float]]


def excess(
    points: Points,
    *,
    way: float = 0.1,
    velocity: Sequence[float] = (1.0, 1.0),
    here: Sequence[float] = (0.0, 0.0),
    rigid: bool = True,
) -> tuple[float, JogCause | None]:
    """Return what is judged of a stop from a place, the first joint going by `way`; limit 0.25."""
    arm = SimpleNamespace(point_speeds=points, rigid=rigid)
    ends = {"lower": [-2.0, -2.0], "upper": [2.0, 2.0], "margin": [0.1, 0.1]}
    model = SimpleNamespace(arm=arm, unit=[1.0, 1.0], limits=LIMITS, **ends)
    there = [here[0] + way, *here[1:]]
    ahead = StopOutlook(list(velocity), list(here), there, 0.25)
    return point_excess(cast(JogModel, model), ahead, 0.25)


class TestPointSpeeds:
    """Of tool and elbow, from a tick's end to rest: 0.25 m/s, of which a reserve is kept."""

    @pytest.mark.parametrize(
        ("tool", "elbow", "reason"),
        [
            (0.3, 0.1, JogSlowdown.TOOL_SPEED),
            (0.1, 0.3, JogSlowdown.ELBOW_SPEED),
        ],
    )
    def test_the_faster_of_two_counts(self, tool: float, elbow: float, reason: JogSlowdown) -> None:
        found, cause = excess(lambda *_: (tool, elbow))
        assert found == pytest.approx(0.3 / (0.998 * 0.25))
        assert cause is not None
        assert (cause.reason, cause.value, cause.limit) == (reason, 0.3, 0.25)

    @pytest.mark.parametrize(("speed", "is_allowed"), [(0.2494, True), (0.2496, False)])
    def test_a_reserve_is_kept_for_what_ticks_change(self, speed: float, is_allowed: bool) -> None:
        assert (excess(lambda *_: (speed, 0.0))[0] <= 1.0) is is_allowed

    @pytest.mark.parametrize("point", [0, 1])
    def test_a_point_that_the_stop_makes_faster_counts_at_its_fastest(self, point: int) -> None:
        """At √(1 - p) (0.2 + 0.5 p), greatest at p = 8/15: 0.3188 m/s."""

        def stretching(place: Sequence[float], _: Sequence[float]) -> tuple[float, float]:
            speed = 0.2 + place[0]
            return (speed, 0.0) if point == 0 else (0.0, speed)

        _, cause = excess(stretching, way=0.5)
        assert cause is not None
        assert 0.31879 <= cause.value <= 0.36

    def test_a_long_stop_is_looked_at_all_along(self) -> None:
        """2 rad, of which the point is fast between 0.7 and 1.1 only."""

        def swinging(place: Sequence[float], _: Sequence[float]) -> tuple[float, float]:
            return (0.8 if 0.7 < place[0] < 1.1 else 0.2), 0.0

        _, cause = excess(swinging, way=2.0)
        assert cause is not None
        assert cause.value == pytest.approx(1.02 * 0.8 * math.sqrt(1.0 - 0.375))

    @pytest.mark.parametrize(("rigid", "is_allowed"), [(True, True), (False, False)])
    def test_one_joint_is_as_fast_but_on_a_platform(self, rigid: bool, is_allowed: bool) -> None:
        def stretching(place: Sequence[float], _: Sequence[float]) -> tuple[float, float]:
            return 0.2 + place[0], 0.0

        found, _ = excess(stretching, way=0.5, velocity=(1.0, 0.0), rigid=rigid)
        assert (found <= 1.0) is is_allowed

    @pytest.mark.parametrize("side", [1.0, -1.0])
    @pytest.mark.parametrize("joint", [0, 1])
    def test_what_a_joint_undid_misses_once_its_range_ends(self, joint: int, side: float) -> None:
        """Two joints that undo each other, one of which has to brake before the other."""

        def undoing(_: Sequence[float], rates: Sequence[float]) -> tuple[float, float]:
            return float(abs(rates[0] - rates[1])), 0.0

        velocity, here = [side, side], [0.0, 0.0]
        assert excess(undoing, velocity=velocity, way=0.0)[0] == 0.0
        here[joint] = side * (2.0 - 0.34)  # which leaves less than 0.25 s and a margin of 0.1
        found, _ = excess(undoing, velocity=velocity, here=here, way=0.0)
        assert found == pytest.approx(1.0 / (0.998 * 0.25))
        here[joint] = side * (2.0 - 0.36)
        assert excess(undoing, velocity=velocity, here=here, way=0.0)[0] == 0.0


class TestNearness:
    """What ends a way, and what slows it, between two of its places."""

    @staticmethod
    def model() -> JogModel:
        ends = {"lower": [-2.0, -2.0], "upper": [2.0, 2.0], "margin": [0.1, 0.1]}
        return cast(JogModel, SimpleNamespace(limits=LIMITS, guard=None, **ends))

    @staticmethod
    def cell(
        before: float,
        after: float,
        rates: tuple[float, float] = (1.0, 1.0),
        conditions: tuple[float, float] = (5.0, 5.0),
        uses: tuple[float, float] | None = None,
    ) -> tuple[PathNode, PathNode]:
        """Return two places of a way, 0.1 apart, of the first joint."""
        places = zip((0.0, 0.1), (before, after), rates, conditions, strict=True)
        nodes = [
            PathNode(sigma, [place, 0.0], [rate, 0.0], np.zeros(6), condition)
            for sigma, place, rate, condition in places
        ]
        if uses is not None:
            for node, use in zip(nodes, uses, strict=True):
                node.posture = Posture(use, JogCause(JogSlowdown.WORKSPACE, use, 1.0))
        nodes[0].lead_to(nodes[1], LIMITS.acceleration)
        return nodes[0], nodes[1]

    @pytest.mark.parametrize(
        ("cell", "reason"),
        [
            (cell(1.95, 2.01), JogSlowdown.JOINT_LIMIT),
            (cell(-1.95, -2.01, (-1.0, -1.0)), JogSlowdown.JOINT_LIMIT),
            (cell(2.2, 2.1, (-1.0, -1.0)), None),  # back from beyond it
            (cell(2.1, 2.2), JogSlowdown.JOINT_LIMIT),
            (cell(1.99, 1.99, (1.0, -1.0)), JogSlowdown.JOINT_LIMIT),  # to 2.015, and back
            (cell(-1.99, -1.99, (-1.0, 1.0)), JogSlowdown.JOINT_LIMIT),
            (cell(1.9, 1.9, (1.0, -1.0)), None),
            (cell(0.0, 0.1, conditions=(29.0, 30.0)), JogSlowdown.SINGULARITY),
            (cell(0.0, 0.1, conditions=(29.0, 29.9)), None),
            (cell(0.0, 0.1, conditions=(40.0, 35.0)), None),  # out of it
            (cell(0.0, 0.1, uses=(0.99, 1.01)), JogSlowdown.WORKSPACE),
            (cell(0.0, 0.1, uses=(1.2, 1.1)), None),
            (cell(0.0, 0.1, uses=(0.9, 0.99)), None),
        ],
    )
    def test_what_ends_a_way(
        self, cell: tuple[PathNode, PathNode], reason: JogSlowdown | None
    ) -> None:
        last, node = cell
        found = stop(self.model(), last, node, min(last.condition, 36.0))
        assert (None if found is None else found.reason) is reason

    @pytest.mark.parametrize(
        ("cell", "scale"),
        [
            (cell(1.9, 1.975), 0.5),  # a quarter of the margin is left
            (cell(-1.9, -1.975, (-1.0, -1.0)), 0.5),
            (cell(1.99, 1.975, (-1.0, -1.0)), None),
            (cell(-1.99, -1.975), None),
            (cell(1.8, 1.89), None),
            (cell(0.0, 0.1, conditions=(23.0, 23.5)), math.sqrt(0.5)),
            (cell(0.0, 0.1, conditions=(24.0, 23.5)), None),
            (cell(0.0, 0.1, conditions=(16.0, 17.0)), None),
            (cell(0.0, 0.1, uses=(0.9, 0.975)), 0.5),
            (cell(0.0, 0.1, uses=(0.99, 0.975)), None),
            (cell(0.0, 0.1, uses=(0.8, 0.9)), None),
        ],
    )
    def test_what_slows_a_way(self, cell: tuple[PathNode, PathNode], scale: float | None) -> None:
        found = scales(self.model(), *cell)
        assert [share for share, _ in found] == ([] if scale is None else [pytest.approx(scale)])


class TestStopSurroundings:
    """Bodies and a platform's own limits near the place where a stop would end."""

    @staticmethod
    def left(use: float, ahead: float) -> tuple[float, JogSlowdown] | None:
        """Return what is left of 0.25 m/s towards a body so far ahead of where a stop ends.

        Args:
            use: of the platform's limits there; 0.5 where it is.
            ahead: of that place [m].
        """

        def posture(place: Sequence[float]) -> Posture:
            value = use if place[0] > 0.005 else 0.5
            return Posture(value, JogCause(JogSlowdown.WORKSPACE, value, 1.0))

        guard = CollisionGuard(BodiesOnRails(standing_at(0.01 + ahead)).model)
        arm = SimpleNamespace(posture=posture)
        model = SimpleNamespace(guard=guard, arm=arm, watches_posture=True)
        ahead_of = StopOutlook([0.25, 0.0], [0.0025, 0.0], [0.01, 0.0], 0.01)
        found = StopSurroundings(cast(JogModel, model)).left(DT, [0.0, 0.0], [0.25, 0.0], ahead_of)
        return None if found is None else (found[0], found[1].reason)

    @pytest.mark.parametrize(
        ("use", "ahead", "left", "reason"),
        [
            (0.5, 0.006, 0.0, JogSlowdown.COLLISION),
            (1.0, 0.5, 0.0, JogSlowdown.WORKSPACE),
            (0.975, 0.5, 0.5, JogSlowdown.WORKSPACE),
            (0.975, 0.006, 0.0, JogSlowdown.COLLISION),
            (1.0, 0.013, 0.0, JogSlowdown.WORKSPACE),
            (0.91, 0.0095, 0.25 * 0.5 * 0.02 / 0.01, JogSlowdown.COLLISION),
        ],
    )
    def test_what_leaves_least_counts(
        self, use: float, ahead: float, left: float, reason: JogSlowdown
    ) -> None:
        found = self.left(use, ahead)
        assert found is not None
        assert found[0] == pytest.approx(left, abs=1e-9)
        assert found[1] is reason

    def test_far_from_both_all_is_left(self) -> None:
        assert self.left(0.9, 0.021) is None


class TestCells:
    """The places of a tool jog's way: between two of them the joints go along a cubic."""

    def test_no_cell_leads_from_one_posture_of_the_arm_to_another(
        self, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        """Where the arm's answer jumps, here by 0.05 rad of the last joint, the way ends."""
        arm = model("ur5").arm
        rotation, point = arm.place(UR5_BENT)
        follow = arm.follow

        def jumping(
            guess: list[float], rotation: np.ndarray, there: np.ndarray, twist: np.ndarray
        ) -> Footing | None:
            found = follow(guess, rotation, there, twist)
            if found is None or there[1] - point[1] < 0.05:
                return found
            return found._replace(position=[*found.position[:5], found.position[5] + 0.05])

        monkeypatch.setattr(arm, "follow", jumping)
        twist = JogTwist(np.array([0.0, 0.2, 0.0]), np.zeros(3))
        ahead = LookAhead(model("ur5"), ToolPath(rotation, point, twist), UR5_BENT, 0.25)
        ahead.extend(60, 0)
        assert ahead.end is not None
        assert 0.04 < 0.2 * ahead.nodes[-1].sigma < 0.05
        places = [node.position[5] for node in ahead.nodes]
        assert max(abs(after - before) for before, after in pairwise(places)) < 0.03


class TestBodies:
    """A UR5 whose tool is taken for a body on a rail: its first joint leads it ahead by a metre."""

    @staticmethod
    def jogger(*ahead: float, caps: JogCaps = FAST) -> tuple[Jogger, float]:
        """Return a jog that begins so far before bodies, and where its body is."""
        at = UR5_BENT[0] + 0.5 * UR5_BENT[1]
        bodies = BodiesOnRails(*(standing_at(at + each) for each in ahead), joints=6)
        return Jogger(JogModel(arm("ur5"), None, bodies.model), UR5_BENT, caps), at

    @staticmethod
    def run(jogger: Jogger, at: float, rates: Sequence[float], ticks: int = 400) -> list[float]:
        """Return how far the body has come after each tick."""
        jogger.aim(JointJog((*rates, 0.0, 0.0, 0.0, 0.0)))
        positions = [jogger.step(0.01).position for _ in range(ticks)]
        return [position[0] + 0.5 * position[1] - at for position in positions]

    @pytest.mark.parametrize("fraction", [0.02, 0.1, 1.0])
    @pytest.mark.parametrize("ahead", [0.03, 0.09, 0.3, 0.8])
    def test_a_jog_of_joints_rests_between_5_and_8_mm_before_a_body(
        self, ahead: float, fraction: float
    ) -> None:
        caps = JogCaps(joint_fraction=fraction, tool_speed=9.0, reduced=False)
        jogger, at = self.jogger(ahead, caps=caps)
        ways = self.run(jogger, at, (1.0, 0.0), 2000)
        assert ways == sorted(ways)
        assert 0.005 <= ahead - ways[-1] <= 0.008
        assert jogger.at_rest

    @pytest.mark.parametrize("rates", [(1.0, 0.3), (0.3, 1.0)])
    def test_so_does_one_of_two_joints(self, rates: tuple[float, float]) -> None:
        jogger, at = self.jogger(0.4, 0.9)
        ways = self.run(jogger, at, rates)
        assert 0.005 <= 0.4 - ways[-1] <= 0.008

    def test_it_is_slower_from_20_mm_on_and_not_before(self) -> None:
        caps = JogCaps(joint_fraction=0.08, tool_speed=9.0, reduced=False)
        jogger, at = self.jogger(0.3, caps=caps)
        ways = self.run(jogger, at, (1.0, 0.0))
        full = 0.08 * robot("ur5").limits.velocity[0]
        speeds = [((b - a) / 0.01, 0.3 - a) for a, b in pairwise(ways[20:])]
        assert min(speed for speed, left in speeds if left > 0.045) == pytest.approx(full)
        for speed, left in speeds:
            allowed = 0.25 * math.sqrt(max(left - 0.006, 0.0) / 0.014)
            assert speed <= max(allowed, 0.01) * 1.02

    @pytest.mark.parametrize("ahead", [0.004, -0.004])
    def test_from_contact_it_leads_away_and_not_nearer(self, ahead: float) -> None:
        jogger, at = self.jogger(ahead)
        toward = math.copysign(1.0, ahead)
        ways = self.run(jogger, at, (toward, 0.0), 50)
        assert ways == [0.0] * 50
        assert abs(self.run(jogger, at, (-toward, 0.0), 50)[-1]) > 0.05

    def test_a_body_that_is_passed_at_30_mm_slows_nothing(self) -> None:
        jogger, at = self.jogger(-0.03)
        assert self.run(jogger, at, (1.0, 0.0), 60)[-1] > 0.3


UR5 = model("ur5")
SPEEDS = [0.5 * limit for limit in UR5.limits.velocity]
ENDS = JointLimitBraking(UR5, SPEEDS)


def test_far_from_all_ends_only_the_accelerations_bind() -> None:
    bounds = ENDS.bounds(0.01, UR5_BENT, [0.0] * UR5.dof)
    assert [bound[:2] for bound in bounds] == [(-math.inf, math.inf)] * UR5.dof
    gains = [0.01 * limit for limit in UR5.limits.acceleration]
    assert [bound[2] for bound in bounds] == pytest.approx(gains, rel=1e-5)


def test_only_the_joint_that_is_near_its_end_is_bound_and_only_towards_it() -> None:
    place = [*UR5_BENT[:2], UR5.upper[2] - 0.02, *UR5_BENT[3:]]
    bounds = ENDS.bounds(0.01, place, [0.0] * UR5.dof)
    least, most, _ = bounds[2]
    assert least == -math.inf
    assert 0.0 < most < SPEEDS[2]
    assert all(math.isinf(bound[1]) for bound in [*bounds[:2], *bounds[3:]])


@pytest.mark.parametrize("dt", [0.004, 0.01, LONGEST_STEP])
@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("speed", [0.3, 1.0, 1.5])
def test_a_joint_at_its_bound_rests_before_the_end(speed: float, side: float, dt: float) -> None:
    """However fast it comes: faster than is asked too, as after another override."""
    end = UR5.upper[0] if side > 0.0 else UR5.lower[0]
    place, velocity = list(UR5_BENT), [0.0] * UR5.dof
    velocity[0] = side * speed
    limit = UR5.limits.acceleration[0]
    place[0] = end - side * (speed * speed / (2.0 * 0.95 * limit) + speed * LONGEST_STEP)
    for _ in range(2000):
        least, most, gain = ENDS.bounds(dt, place, velocity)[0]
        after = min(most, velocity[0] + gain) if side > 0.0 else max(least, velocity[0] - gain)
        assert abs(after - velocity[0]) <= gain * (1.0 + 1e-9)
        place[0] += 0.5 * dt * (velocity[0] + after)
        velocity[0] = after
        assert side * (end - place[0]) >= 0.0
    assert velocity[0] == 0.0
    assert abs(end - place[0]) < 1e-3


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("rate", [0.3, -0.3])
def test_from_beyond_a_limit_no_way_is_free(side: float, rate: float) -> None:
    beyond = UR5.limits.upper[0] + 0.1 if side > 0.0 else UR5.limits.lower[0] - 0.1
    assert ENDS.free_distance([beyond, *UR5_BENT[1:]], [rate, 0.0, 0.0, 0.0, 0.0, 0.0]) == 0.0


def test_joints_that_stand_may_do_so_for_ever() -> None:
    assert ENDS.free_distance(UR5_BENT, [0.0] * 6) == math.inf


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_joint_that_is_faster_than_is_asked_rests_before_the_end_too(side: float) -> None:
    """At 1.5 rad/s when 0.03 are asked: as after a smaller override."""
    slow = JointLimitBraking(UR5, [0.01 * limit for limit in UR5.limits.velocity])
    limit = UR5.limits.acceleration[0]
    end = UR5.upper[0] if side > 0.0 else UR5.lower[0]
    place, velocity = list(UR5_BENT), [side * 1.5, 0.0, 0.0, 0.0, 0.0, 0.0]
    place[0] = end - side * (1.5**2 / (2.0 * 0.95 * limit) + 1.5 * LONGEST_STEP)
    for _ in range(400):
        least, most, gain = slow.bounds(0.01, place, velocity)[0]
        wanted = min(max(side * 1.5, least), most)  # nobody brakes but for the end
        after = min(max(wanted, velocity[0] - gain), velocity[0] + gain)
        place[0] += 0.005 * (velocity[0] + after)
        velocity[0] = after
        assert side * (end - place[0]) >= 0.0
