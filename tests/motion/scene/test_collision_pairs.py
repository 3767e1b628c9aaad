"""The pairs of a collision model, told for all at once, against the rule told pair by pair."""

from itertools import combinations
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from rigs.motion.loaded_robots import serial_robot

from openpendant.motion.errors import SceneTooLarge
from openpendant.motion.kinematics.pinocchio_model import greatest_travel
from openpendant.motion.kinematics.serial import Kinematics
from openpendant.motion.scene.collision import CollisionModel
from openpendant.motion.scene.scene import Box, Scene, SceneObject, Sphere

ROBOTS = ("ur5", "fanuc_m10ia", "rail_kr5_arc", "fanuc_m410ib", "kuka_iiwa14")
UR5 = Kinematics(serial_robot("ur5"))


def random_scene(links: tuple[str, ...], random: np.random.Generator) -> Scene:
    """Return boxes of which some are held, and pairs of which some may touch."""
    objects = [
        SceneObject(
            f"box {number}",
            Box((0.1, 0.2, 0.3)),
            (float(random.uniform(-1.0, 1.0)), 0.5, 0.2),
            link=str(random.choice(links)) if random.random() < 0.4 else None,
        )
        for number in range(int(random.integers(1, 12)))
    ]
    names = [each.name for each in objects]
    chosen = {(str(random.choice(names)), str(random.choice([*names, *links]))) for _ in range(5)}
    return Scene(tuple(objects), frozenset(pair for pair in chosen if pair[0] != pair[1]))


def plain_pairs(kinematics: Kinematics, scene: Scene) -> list[tuple[str, str]]:
    """Tell the rule of `collision` shape by shape."""
    robot, model = kinematics.robot, kinematics.model
    shapes = [(link, link) for link, each in robot.collision.items() for _ in each]
    shapes += [(each.name, each.link or "") for each in scene.objects]
    joint = {name: _joint(model, link) for name, link in shapes}
    held = {each.name for each in scene.objects if each.link is not None}
    wrist = {model.njoints - 3, model.njoints - 1} if model.njoints > 6 else set()
    allowed = {frozenset(pair[:2]) for pair in robot.allowed_collisions}
    allowed |= {frozenset(pair) for pair in scene.allowed}
    checked = []
    for (first, _), (second, _) in combinations(shapes, 2):
        joints = {joint[first], joint[second]}
        links = {first, second} & set(robot.links)
        if first == second or frozenset((first, second)) in allowed:
            continue
        if joints == {0} and not {first, second} & held:
            continue
        if links == {first, second} and (max(joints) - min(joints) <= 1 or joints == wrist):
            continue
        if not links and len(joints) == 1:
            continue
        checked.append((first, second))
    return checked


def _joint(model: Any, link: str) -> int:
    return int(model.frames[model.getFrameId(link)].parentJoint) if link else 0


@pytest.mark.parametrize("name", ROBOTS)
def test_the_pairs_are_those_of_the_rule_and_in_its_order(name: str) -> None:
    kinematics = Kinematics(serial_robot(name))
    random = np.random.default_rng(11)
    for _ in range(10):
        scene = random_scene(kinematics.robot.links, random)
        assert list(CollisionModel(kinematics, scene).pairs) == plain_pairs(kinematics, scene)


@pytest.mark.parametrize("name", ROBOTS)
def test_the_sweep_of_a_ball_in_a_joint_is_the_lengths_between_and_its_own_reach(name: str) -> None:
    kinematics = Kinematics(serial_robot(name))
    model, moving = kinematics.model, kinematics.robot.moving
    travel = greatest_travel(kinematics.robot)
    stand, held = SceneObject("post", Sphere(0.1), (3.0, 0.0, 0.0)), ball_at_last_joint(kinematics)
    collision = CollisionModel(kinematics, Scene((stand, held)))
    row: NDArray[np.float64] = collision.sweep[collision.pairs.index(("post", "ball"))]
    lever = radius_of(kinematics, held)
    expected = []
    for joint in range(model.njoints - 1, 0, -1):
        expected.append(1.0 if moving[joint - 1].prismatic else lever)
        lever += float(np.linalg.norm(model.jointPlacements[joint].translation))
        lever += travel[joint - 1] if moving[joint - 1].prismatic else 0.0
    np.testing.assert_allclose(row, expected[::-1], rtol=1e-12)


def ball_at_last_joint(kinematics: Kinematics) -> SceneObject:
    return SceneObject("ball", Sphere(0.05), link=kinematics.robot.tool_link)


def radius_of(kinematics: Kinematics, held: SceneObject) -> float:
    """Return how far a ball reaches from the origin of the joint that carries it [m]."""
    model = kinematics.model
    frame = model.frames[model.getFrameId(held.link)]
    return float(np.linalg.norm(frame.placement.translation)) + 0.05


def test_only_pairs_with_an_object_count_and_the_error_tells_them() -> None:
    balls = tuple(SceneObject(f"ball {n}", Sphere(0.01), (1.0, 0.0, 0.0)) for n in range(10))
    of_robot, scene = len(CollisionModel(UR5).pairs), Scene(balls)
    pairs = len(CollisionModel(UR5, scene).pairs) - of_robot
    assert len(CollisionModel(UR5, scene, most_pairs=pairs).pairs) == pairs + of_robot
    with pytest.raises(SceneTooLarge) as caught:
        CollisionModel(UR5, scene, most_pairs=pairs - 1)
    assert (caught.value.pairs, caught.value.limit, caught.value.objects) == (pairs, pairs - 1, 10)
    assert CollisionModel(UR5, most_pairs=0).pairs
