"""Promise 16: jogs among bodies, from free places and from contact."""

import numpy as np
import pytest
from promises.promise_table import figure
from rigs.data.example_counts import counts
from rigs.motion.jog_referee import Referee
from rigs.motion.jogged_robots import FAST, UR5_BENT, robot
from rigs.motion.loaded_robots import serial_robot
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
from openpendant.motion.jog.collision_guard import NEAR, CollisionGuard
from openpendant.motion.jog.jog_robot import Posture
from openpendant.motion.jog.path_node import HALT_CONDITION, PathNode, scales
from openpendant.motion.kinematics.serial import Kinematics
from openpendant.motion.paths.mechanism import SerialMechanism, mechanism
from openpendant.motion.pose import Array, Pose
from openpendant.motion.scene.collision import CollisionModel
from openpendant.motion.scene.scene import Box, Scene, SceneObject

DOWN = ToolJog((0.0, 0.0, -1.0))


def ur5() -> Kinematics:
    found = robot("ur5")
    assert isinstance(found, SerialMechanism)
    return found.kinematics


def block_below(clearance: float) -> CollisionModel:
    """A block so far below the tool of the bent UR5, and nothing else near."""
    kinematics = ur5()
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
    return CollisionModel(
        kinematics, scene.move("block", Pose.from_values((x, y, low), (0.0, 0.0, 0.0, 1.0)))
    )


def watched_in(
    collision: CollisionModel, start: list[float], caps: JogCaps | None = None
) -> Referee:
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
    watched = watched_in(collision, UR5_BENT)
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
    assert not watched.faults


def test_moving_away_and_along_is_free() -> None:
    watched = watched_in(block_below(0.03), UR5_BENT)
    watched.rest(DOWN)
    for target in (ToolJog((1.0, 0.0, 0.0)), ToolJog((0.0, 0.0, 1.0))):
        assert watched.run(target, 25).scale == 1.0
        watched.rest(None)
    assert not watched.faults


def test_from_contact_only_what_parts_is_done_and_the_way_is_suggested() -> None:
    collision = block_below(-0.01)
    watched = watched_in(collision, UR5_BENT)
    held = watched.run(DOWN, 5)
    assert held.at_rest
    assert held.reason is JogSlowdown.COLLISION
    assert held.position == UR5_BENT
    assert held.retreat is not None
    assert held.retreat.joints is not None
    watched.run(JointJog(held.retreat.joints), 100)
    assert block_distance(collision, watched.position) > 0.005
    assert not watched.faults


def test_a_tool_jog_leads_up_out_of_contact() -> None:
    watched = watched_in(block_below(-0.005), UR5_BENT)
    step = watched.run(ToolJog((0.0, 0.0, 1.0)), 40)
    assert not step.at_rest
    assert step.scale == 1.0
    assert not watched.faults


@pytest.mark.parametrize("name", ["ur5", "abb_irb2400"])
def test_random_jogs_in_random_scenes_keep_clear(name: str) -> None:
    for seed, task in enumerate(random_tasks(name, range(2))):
        random = np.random.default_rng(seed)
        watched = watched_in(task.collision, task.start.tolist())
        _press(watched, random, 4, 50)
        assert not watched.faults


@pytest.mark.soak
@pytest.mark.parametrize("name", ["ur5", "abb_irb2400", "kuka_iiwa14"])
@pytest.mark.parametrize("block", range(10))
def test_promise_16_in_a_thousand_scenes(name: str, block: int) -> None:
    for seed, task in enumerate(random_tasks(name, range(34 * block, 34 * (block + 1)))):
        random = np.random.default_rng([block, seed])
        start = free_position(task.collision, random)
        watched = watched_in(task.collision, start.tolist(), FAST if seed % 3 == 0 else None)
        _press(watched, random, 6, 150)
        assert not watched.faults


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
    found = robot(name)
    assert isinstance(found, SerialMechanism)
    collision, random = CollisionModel(found.kinematics), np.random.default_rng(3)
    guard = CollisionGuard(CollisionModel(found.kinematics))
    place, near = np.array(found.kinematics.robot.home_position), 0
    for _ in range(count):
        direction = random.uniform(-0.05, 0.05, len(place))
        for _ in range(25):
            place = np.clip(place + direction, found.kinematics.lower, found.kinematics.upper)
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


def test_far_from_everything_nothing_is_computed() -> None:
    kinematics = Kinematics(serial_robot("abb_irb2400"))
    collision = CollisionModel(kinematics)
    start = list(kinematics.robot.home_position)
    looks = []
    original = collision.clearances

    def counted(joint_position: Array) -> Array:
        looks.append(joint_position)
        return original(joint_position)

    collision.clearances = counted  # type: ignore[method-assign]  # to count the calls
    guard = CollisionGuard(collision)
    for shift in np.linspace(0.0, 0.02, 50):
        assert guard.look([start[0] + shift, *start[1:]]) is None
    assert len(looks) == 1
