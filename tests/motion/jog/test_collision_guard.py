"""Promise 16: jogs among bodies, from free places and from contact.

What the guard itself tells of bodies at known distances is worked out by hand: jogs slow for what
is nearer than 20 mm and rest 5 mm before it, of which 1 mm is kept for what a distance may dip
between two places; so what is left of the speed is the root of (distance - 6 mm) / 14 mm, of
0.25 m/s of closing.
"""

import math
from collections.abc import Mapping

import numpy as np
import pytest
from promises.promise_table import figure
from rigs.data.example_counts import counts
from rigs.motion.bodies_on_rails import BodiesOnRails, always, standing_at
from rigs.motion.jog_referee import Referee
from rigs.motion.jogged_robots import FAST, UR5_BENT
from rigs.motion.loaded_robots import arm
from rigs.motion.planning_scenes import free_position, random_tasks

from openpendant.motion.jog import (
    JogCaps,
    JogCause,
    Jogger,
    JogModel,
    JogSlowdown,
    JointJog,
    ToolJog,
)
from openpendant.motion.jog.collision_guard import CLEAR, NEAR, SLOW, CollisionGuard
from openpendant.motion.jog.jog_robot import Posture
from openpendant.motion.jog.path_node import HALT_CONDITION, PathNode, scales
from openpendant.motion.paths.mechanism import mechanism
from openpendant.motion.pose import Pose
from openpendant.motion.scene.collision import CollisionModel
from openpendant.motion.scene.scene import Box, Scene, SceneObject

DOWN = ToolJog((0.0, 0.0, -1.0))


def block_below(clearance: float) -> CollisionModel:
    """A block so far below the tool of the bent UR5, and nothing else near."""
    kinematics = arm("ur5")
    x, y, _ = kinematics.forward(UR5_BENT).position.tolist()
    scene = Scene((SceneObject("block", Box((0.2, 0.2, 0.1)), (x, y, -1.0)),))
    model = CollisionModel(kinematics, scene)
    pairs = [index for index, pair in enumerate(model.pairs) if "block" in pair]
    low, high = -1.0, 1.0
    for _ in range(50):
        middle = 0.5 * (low + high)
        there = scene.move("block", Pose.from_values((x, y, middle), (0.0, 0.0, 0.0, 1.0)))
        near = CollisionModel(kinematics, there).clearances(np.array(UR5_BENT))[pairs].min()
        low, high = (middle, high) if near > clearance else (low, middle)
    there = scene.move("block", Pose.from_values((x, y, low), (0.0, 0.0, 0.0, 1.0)))
    return CollisionModel(kinematics, there)


def watch_in(collision: CollisionModel, start: list[float], caps: JogCaps | None = None) -> Referee:
    chosen = caps or JogCaps(joint_fraction=1.0)
    # The referee looks through a model of its own.
    own = CollisionModel(collision.kinematics, collision.scene)
    jogger = Jogger(JogModel(collision.kinematics, None, own), start, chosen)
    robot_of = mechanism(collision.kinematics.robot)
    return Referee(robot_of, jogger, collision=collision, reduced=chosen.reduced)


def block_distance(collision: CollisionModel, position: list[float]) -> float:
    found = collision.clearances(np.array(position))
    pairs = [index for index, pair in enumerate(collision.pairs) if "block" in pair]
    return float(found[pairs].min())


@pytest.mark.parametrize("by", ["tool", "joints"])
def test_promise_16_a_jog_slows_near_a_body_and_rests_5_mm_before_it(by: str) -> None:
    collision = block_below(0.1)
    target = DOWN if by == "tool" else JointJog((0.0, 1.0, 0.0, 0.0, 0.0, 0.0))
    watched = watch_in(collision, UR5_BENT)
    step = watched.rest(target, 400)
    assert step.reason is JogSlowdown.COLLISION
    assert step.cause is not None
    assert step.cause.pair is not None
    assert "block" in step.cause.pair
    clear, near = figure(16, "clear").bound / 1e3, figure(16, "near").bound / 1e3
    assert clear <= block_distance(collision, step.position) < clear + 0.003
    slowed = [each for each in watched.steps if each.reason is JogSlowdown.COLLISION]
    # The first is slowed for the place on its way that is just so near.
    assert slowed[0].cause is not None
    assert 0.6 * near < slowed[0].cause.value <= near
    assert block_distance(collision, slowed[0].position) > slowed[0].cause.value
    assert any(each.scale < 0.7 and not each.at_rest for each in slowed)


def test_moving_away_and_along_is_free() -> None:
    watched = watch_in(block_below(0.03), UR5_BENT)
    watched.rest(DOWN)
    for target in (ToolJog((1.0, 0.0, 0.0)), ToolJog((0.0, 0.0, 1.0))):
        assert watched.run(target, 25).scale == 1.0
        watched.rest(None)


def test_from_contact_only_what_parts_is_done_and_the_way_is_suggested() -> None:
    collision = block_below(-0.01)
    watched = watch_in(collision, UR5_BENT)
    held = watched.run(DOWN, 5)
    assert held.at_rest
    assert held.reason is JogSlowdown.COLLISION
    assert held.position == UR5_BENT
    assert held.retreat is not None
    assert held.retreat.joints is not None
    watched.run(JointJog(held.retreat.joints), 100)
    assert block_distance(collision, watched.position) > 0.005


def test_a_tool_jog_leads_up_out_of_contact() -> None:
    watched = watch_in(block_below(-0.005), UR5_BENT)
    step = watched.run(ToolJog((0.0, 0.0, 1.0)), 40)
    assert not step.at_rest
    assert step.scale == 1.0


@pytest.mark.parametrize("name", ["ur5", "abb_irb2400"])
def test_random_jogs_in_random_scenes_keep_clear(name: str) -> None:
    for seed, task in enumerate(random_tasks(name, range(2))):
        random = np.random.default_rng(seed)
        watched = watch_in(task.collision, task.start.tolist())
        _press(watched, random, 4, 50)


@pytest.mark.soak
@pytest.mark.parametrize("name", ["ur5", "abb_irb2400", "kuka_iiwa14"])
@pytest.mark.parametrize("block", range(10))
def test_promise_16_in_a_thousand_scenes(name: str, block: int) -> None:
    for seed, task in enumerate(random_tasks(name, range(34 * block, 34 * (block + 1)))):
        random = np.random.default_rng([block, seed])
        start = free_position(task.collision, random)
        watched = watch_in(task.collision, start.tolist(), FAST if seed % 3 == 0 else None)
        _press(watched, random, 6, 150)


def _press(watched: Referee, random: np.random.Generator, presses: int, ticks: int) -> None:
    for _ in range(presses):
        if random.random() < 0.5:
            watched.run(JointJog(tuple(random.uniform(-1.0, 1.0, len(watched.position)))), ticks)
        else:
            rates = random.uniform(-1.0, 1.0, 3)
            watched.run(ToolJog(tuple(rates / np.abs(rates).max())), ticks)


@pytest.mark.parametrize("count", counts(15, 400))
@pytest.mark.parametrize("name", ["ur5", "abb_irb2400", "kuka_iiwa14", "abb_irb4400l30"])
def test_promise_16_no_near_pair_is_overlooked_on_a_walk(name: str, count: int) -> None:
    kinematics = arm(name)
    collision, random = CollisionModel(kinematics), np.random.default_rng(3)
    guard = CollisionGuard(CollisionModel(kinematics))
    place, near = np.array(kinematics.robot.home_position), 0
    for _ in range(count):
        direction = random.uniform(-0.05, 0.05, len(place))
        for _ in range(25):
            place = np.clip(place + direction, kinematics.lower, kinematics.upper)
            told = guard.look(place.tolist()) or {}
            true = collision.clearances(place)
            for pair in np.flatnonzero(true <= NEAR).tolist():
                assert told[pair] == pytest.approx(true[pair], abs=1e-6)
                near += 1
    assert near > 2 * count


def test_a_way_begins_near_bodies_without_a_place_before() -> None:
    collision = block_below(0.01)
    model = JogModel(collision.kinematics, None, collision)
    distances = CollisionGuard(collision).look(UR5_BENT)
    assert distances is not None
    beyond = Posture(2.0, JogCause(JogSlowdown.WORKSPACE, 2.0, 1.0))
    first = PathNode(0.0, UR5_BENT, [0.0] * 6, np.zeros(6), HALT_CONDITION)
    first.posture, first.distances = beyond, distances
    assert scales(model, None, first) == []
    after = PathNode(0.1, UR5_BENT, [0.0] * 6, np.zeros(6), HALT_CONDITION)
    after.posture = beyond
    assert [cause.reason for _, cause in scales(model, first, after)] == []
    jogger = Jogger(model, UR5_BENT, JogCaps())
    jogger.aim(DOWN)
    assert jogger.step(0.01).position != UR5_BENT


STILL = ((0.0, 0.0), (0.0, 0.0))
AHEAD = ((0.0, 0.0), (1.0, 0.0))
TICK = 0.02


def guard_of(*distances: float) -> CollisionGuard:
    return CollisionGuard(BodiesOnRails(*map(always, distances)).model)


def test_the_distances_are_those_of_the_page() -> None:
    assert (CLEAR, SLOW, NEAR) == (0.005, 0.020, 0.040)


@pytest.mark.parametrize(
    ("before", "after", "share"),
    [
        ({0: 0.018}, {0: 0.013}, math.sqrt(0.5)),  # closing at 0.25 m/s
        ({0: 0.023}, {0: 0.013}, math.sqrt(0.5) / 2.0),  # at twice that
        ({0: 0.0115}, {0: 0.0065}, math.sqrt(1.0 / 28.0)),
        ({0: 0.010}, {0: 0.006}, 0.0),
        ({0: 0.010}, {0: 0.0051}, 0.0),
        ({0: 0.003}, {0: 0.002}, 0.0),
        ({0: -0.010}, {0: -0.011}, 0.0),
        ({}, {0: 0.0095}, 0.5 * 0.25 / ((0.040 - 0.0095) / TICK)),  # from as far as the eye sees
        (None, {0: 0.0095}, 0.5 * 0.25 / ((0.040 - 0.0095) / TICK)),
        ({0: 0.018, 1: 0.0145}, {0: 0.013, 1: 0.0095}, 0.5),  # the nearer of two
        ({0: 0.0145, 1: 0.018}, {0: 0.0095, 1: 0.013}, 0.5),
    ],
)
def test_what_comes_nearer_slows_by_the_root_of_what_is_left(
    before: Mapping[int, float] | None, after: Mapping[int, float], share: float
) -> None:
    found = guard_of(0.02, 0.02).nearing(before, after, STILL, TICK)
    assert found is not None
    assert found[0] == pytest.approx(share, abs=1e-12)
    assert (found[1].reason, found[1].limit) == (JogSlowdown.COLLISION, 0.005)


@pytest.mark.parametrize(
    ("before", "after"),
    [
        ({0: 0.025}, {0: 0.020}),  # not near enough
        ({0: 0.010}, {0: 0.0101}),  # parts
        ({0: 0.010}, {0: 0.010}),  # slides along
        ({0: -0.010}, {0: -0.009}),  # parts out of contact
        ({0: 0.0196}, {0: 0.0195}),  # so slowly that all of the speed is left
        ({0: 0.010}, None),
    ],
)
def test_what_stays_away_parts_or_slides_along_slows_nothing(
    before: Mapping[int, float], after: Mapping[int, float] | None
) -> None:
    assert guard_of(0.02).nearing(before, after, STILL, TICK) is None


def test_bodies_that_touch_without_depth_may_part_but_not_be_pressed() -> None:
    def pressed(first: float, second: float) -> float:
        return 0.0 if first <= 0.05 else -1.0

    def parted(first: float, second: float) -> float:
        return 0.0 if first <= 0.05 else 1.0

    touching = {0: 0.0}
    held = CollisionGuard(BodiesOnRails(pressed).model).nearing(touching, touching, AHEAD, TICK)
    assert held is not None
    assert held[0] == 0.0
    free = CollisionGuard(BodiesOnRails(parted).model).nearing(touching, touching, AHEAD, TICK)
    assert free is None


class TestLook:
    def test_tells_all_near_pairs_once_one_is_near(self) -> None:
        assert guard_of(0.039, 0.09, 0.2).look((0.0, 0.0)) == {0: 0.039, 1: 0.09}

    def test_tells_nothing_while_all_are_farther_than_40_mm(self) -> None:
        assert guard_of(0.041, 0.09, 0.2).look((0.0, 0.0)) is None

    @pytest.mark.parametrize("side", [1.0, -1.0])
    @pytest.mark.parametrize("others", [(), (9.0,)])
    def test_finds_what_was_far_and_is_near(self, side: float, others: tuple[float, ...]) -> None:
        """200 mm away, of which 160 may go by unseen."""
        bodies = BodiesOnRails(standing_at(side * 0.2), *map(standing_at, others))
        guard = CollisionGuard(bodies.model)
        assert guard.look((0.0, 0.0)) is None
        assert guard.look((side * 0.159, 0.0)) is None
        assert len(bodies.looked_at) == 1
        found = guard.look((side * 0.17, 0.0))
        assert found is not None
        assert found[0] == pytest.approx(0.03)

    def test_adds_up_what_all_joints_do(self) -> None:
        guard = CollisionGuard(BodiesOnRails(standing_at(0.2)).model)
        assert guard.look((0.0, 0.0)) is None
        assert guard.look((0.1, 0.15)) == pytest.approx({0: 0.025})

    def test_looks_again_from_where_it_looked_last(self) -> None:
        guard = CollisionGuard(BodiesOnRails(standing_at(0.5)).model)
        for place in (0.0, 0.3, 0.4, 0.461):
            found = guard.look((place, 0.0))
        assert found == pytest.approx({0: 0.039})

    def test_looks_again_where_it_comes_back_to(self) -> None:
        """Between a body 30 mm behind and one 500 mm ahead, there and back in two steps."""
        guard = CollisionGuard(BodiesOnRails(standing_at(0.5), standing_at(-0.03)).model)
        for place in (0.0, 0.47, 0.0):
            found = guard.look((place, 0.0))
            assert found is not None
            assert min(found.values()) == pytest.approx(0.03)

    def test_watches_each_place_of_what_was_near_at_the_last_look(self) -> None:
        guard = CollisionGuard(BodiesOnRails(standing_at(0.09)).model)
        assert guard.look((0.0, 0.0)) is None
        assert guard.look((0.06, 0.0)) == pytest.approx({0: 0.03})

    def test_of_a_model_whose_joints_go_farther_than_the_robots_looks_sooner(self) -> None:
        guard = CollisionGuard(BodiesOnRails(standing_at(0.2), gain=2.0).model)
        assert guard.look((0.0, 0.0)) is None
        assert guard.look((0.085, 0.0)) == pytest.approx({0: 0.03})


class TestClearWay:
    """How far along a line all bodies surely stay beyond 20 mm."""

    def way(self, *places: float, rates: tuple[float, ...] = (1.0, 0.0), at: float = 0.0) -> float:
        guard = CollisionGuard(BodiesOnRails(*map(standing_at, places)).model)
        guard.look((0.0, 0.0))
        if at:
            guard.look((at, 0.0))
        return guard.clear_distance(guard.closing(rates))

    def test_of_a_watched_pair_is_what_is_left_before_20_mm(self) -> None:
        assert self.way(0.05) == pytest.approx(0.03)
        assert self.way(0.05, 0.03) == pytest.approx(0.01)
        assert self.way(0.03, 0.05) == pytest.approx(0.01)

    def test_of_a_far_pair_is_what_is_left_before_40_mm(self) -> None:
        assert self.way(0.2) == pytest.approx(0.16)
        assert self.way(9.0, 0.2) == pytest.approx(0.16)

    def test_of_both_is_the_shorter(self) -> None:
        assert self.way(0.2, 0.095) == pytest.approx(0.075)
        assert self.way(0.11, 0.095) == pytest.approx(0.07)

    def test_is_the_shorter_the_more_was_gone_since_the_last_look_at_all(self) -> None:
        assert self.way(0.2, at=0.1) == pytest.approx(0.06)

    @pytest.mark.parametrize("rates", [(2.0, 0.0), (-2.0, 0.0), (1.0, 2.0), (0.0, -4.0)])
    def test_is_the_shorter_the_faster_bodies_close_whatever_the_joint_and_side(
        self, rates: tuple[float, float]
    ) -> None:
        assert self.way(0.05, rates=rates) == pytest.approx(0.015)
        assert self.way(0.2, rates=rates) == pytest.approx(0.08)

    def test_without_bodies_has_no_end(self) -> None:
        assert self.way() == math.inf


def test_a_cell_of_a_way_ends_before_bodies_could_meet_and_part_in_it_unseen() -> None:
    guard = guard_of(0.025, 0.035)
    distances = {0: 0.025, 1: 0.035}
    assert guard.unseen_distance(distances, (1.0, 0.0)) == pytest.approx(0.8 * 2.0 * 0.02)
    assert guard.unseen_distance(distances, (0.0, -1.0)) == pytest.approx(0.8 * 2.0 * 0.04)


@pytest.mark.parametrize(("least", "touches"), [(0.005, False), (0.0049, True), (-0.01, True)])
def test_bodies_nearer_than_5_mm_are_in_contact(least: float, touches: bool) -> None:
    assert guard_of(0.02).in_contact({0: 0.03, 1: least}) is touches
    assert not guard_of(0.02).in_contact(None)


def test_the_way_apart_leads_away_from_what_is_near() -> None:
    guard = CollisionGuard(BodiesOnRails(standing_at(0.01), standing_at(-0.018)).model)
    assert guard.separating_direction((0.0, 0.0)) == pytest.approx([-1.0, -0.5])
    far = CollisionGuard(BodiesOnRails(standing_at(0.03)).model)
    assert far.separating_direction((0.0, 0.0)) is None


def test_the_nearest_pair_is_named() -> None:
    cause = guard_of(0.03, 0.01, 0.035).nearest((0.0, 0.0))
    assert cause is not None
    assert (cause.value, cause.pair) == (0.01, ("robot", "body 1"))
