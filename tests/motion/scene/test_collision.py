import math
from collections.abc import Generator, Sequence
from dataclasses import replace
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from rigs.data.example_counts import counts
from rigs.motion.loaded_robots import SERIAL, arm
from rigs.motion.planning_scenes import free_position, pillar_scene, random_tasks

from openpendant.motion import errors
from openpendant.motion.description.schema import CapsuleFacts as LinkCapsule
from openpendant.motion.kinematics.pinocchio_model import greatest_travel
from openpendant.motion.kinematics.serial import Kinematics
from openpendant.motion.pose import Array, Pose
from openpendant.motion.scene.collision import (
    MOST_CHECKS,
    TOUCHING,
    BuildStep,
    CollisionModel,
)
from openpendant.motion.scene.scene import Box, Capsule, Mesh, Scene, SceneObject, Sphere

UR5 = arm("ur5")
HOME = UR5.robot.home_position


def ball(name: str, position: tuple[float, float, float], radius: float = 0.05) -> SceneObject:
    return SceneObject(name, Sphere(radius), position)


def segment_distance(a: Array, b: Array, c: Array, d: Array) -> float:
    """Distance of the segments ab and cd by brute force: projections to and fro until they rest."""
    best = math.inf
    for place in np.linspace(0.0, 1.0, 9):
        p = a + place * (b - a)
        for _ in range(100):
            q = projected(p, c, d)
            p = projected(q, a, b)
        best = min(best, float(np.linalg.norm(p - q)))
    return best


def projected(point: Array, start: Array, end: Array) -> Array:
    way = end - start
    square = float(way @ way)
    share = float((point - start) @ way) / square if square else 0.0
    nearest: Array = start + min(max(share, 0.0), 1.0) * way
    return nearest


@pytest.mark.parametrize("name", SERIAL)
def test_every_robot_is_free_of_contact_at_home(kinematics: Kinematics) -> None:
    collision = CollisionModel(kinematics)
    assert collision.contacts(kinematics.robot.home_position) == ()
    nearest = collision.distance(kinematics.robot.home_position)
    assert nearest is not None
    assert nearest.distance > 0.005


@pytest.mark.parametrize("count", counts(5, 100))
def test_distances_of_capsules_and_balls_agree_with_brute_force(count: int) -> None:
    random = np.random.default_rng(1)
    rod = SceneObject("rod", Capsule(0.04, 0.6), (0.45, 0.1, 0.4), (0.0, 0.6, 0.0, 0.8))
    collision = CollisionModel(UR5, Scene((rod, ball("ball", (-0.3, 0.4, 0.5)))))
    shapes = UR5.robot.collision["forearm_link"]
    capsules = [shape for shape in shapes if isinstance(shape, LinkCapsule)]
    half = np.array([0.0, 0.0, 0.3])
    ends = [rod.pose.position + rod.pose.rotation @ (sign * half) for sign in (-1, 1)]
    centre = np.array([-0.3, 0.4, 0.5])
    for _ in range(count):
        q = random.uniform(-math.pi, math.pi, 6)
        link = UR5.forward(q, "base", "forearm_link")
        expected: dict[str, list[float]] = {"rod": [], "ball": []}
        for shape in capsules:
            pose = link.compose(Pose.from_rpy(shape.xyz, shape.rpy))
            half = np.array([0.0, 0.0, shape.length / 2.0])
            a, b = (pose.position + pose.rotation @ (sign * half) for sign in (-1, 1))
            expected["rod"].append(segment_distance(a, b, *ends) - shape.radius - 0.04)
            expected["ball"].append(segment_distance(a, b, centre, centre) - shape.radius - 0.05)
        found: dict[str, list[float]] = {"rod": [], "ball": []}
        for pair, distance in zip(collision.pairs, collision.clearances(q), strict=True):
            if pair[0] == "forearm_link" and pair[1] in found:
                found[pair[1]].append(float(distance))
        for name, distances in expected.items():
            # The forearm has two capsules, then a box.
            np.testing.assert_allclose(found[name][:2], distances, atol=2e-5)


def test_the_quick_check_and_the_distances_agree() -> None:
    random = np.random.default_rng(2)
    collision = CollisionModel(UR5, pillar_scene())
    verdicts = []
    for q in random.uniform(-math.pi, math.pi, (300, 6)):
        verdicts.append(collision.collides(q))
        touches = collision.clearances(q).min() <= TOUCHING
        assert verdicts[-1] == touches == bool(collision.contacts(q))
    assert 30 < sum(verdicts) < 270


def test_an_overlap_that_coal_overlooks_unless_asked_for_its_depth_is_found() -> None:
    # Found by chance: 2.9 mm deep, and free by coal's check without contact points.
    size = (0.06876481601541931, 0.06568088520918121, 0.13425593639907435)
    position = (-0.026758230568345615, -0.014824677905028583, 0.23146738268343495)
    turn = (-0.2496163335571758, 0.3964628706791542, -0.823979133814909, -0.3186961958228394)
    collision = CollisionModel(UR5, Scene((SceneObject("box", Box(size), position, turn),)))
    pans = np.linspace(-3.0, 3.0, 50)
    assert all(collision.collides([pan, *HOME[1:]]) for pan in pans)


@pytest.mark.parametrize("name", ["ur5", "kuka_kr5_arc"])
def test_a_shallow_overlap_is_never_overlooked(name: str) -> None:
    random = np.random.default_rng(5)
    for task in random_tasks(name, range(4)):
        collision = task.collision
        for _ in range(8):
            free, touching = free_position(collision, random), random.uniform(-1.5, 1.5, 6)
            if collision.clearances(touching).min() > 0.0:
                continue
            for _ in range(20):  # find where contact begins
                middle = (free + touching) / 2.0
                if collision.clearances(middle).min() <= TOUCHING:
                    touching = middle
                else:
                    free = middle
            way = touching - free
            way /= max(float(np.abs(way).max()), 1e-12)
            for further in (0.0, 1e-4, 3e-4, 1e-3, 3e-3, 1e-2):
                position = touching + further * way
                clearance = float(collision.clearances(position).min())
                if abs(clearance - TOUCHING) > 1e-8:  # nearer than that coal decides by rounding
                    assert collision.collides(position) == (clearance <= TOUCHING)


def test_contacts_name_both_bodies_the_deepest_first() -> None:
    x, y, z = UR5.forward(HOME).position.tolist()
    scene = Scene((ball("near", (x, y, z), 0.2), ball("far", (9.0, 0.0, 0.0))))
    contacts = CollisionModel(UR5, scene).contacts(HOME)
    assert {each.second for each in contacts} == {"near"}
    assert "wrist_3_link" in {each.first for each in contacts}
    distances = [each.distance for each in contacts]
    assert distances == sorted(distances)
    assert distances[0] < 0.0


def test_the_nearest_points_are_as_far_apart_as_the_distance_says() -> None:
    nearest = CollisionModel(UR5, Scene((ball("ball", (0.0, 0.0, 0.9)),))).distance(HOME)
    assert nearest is not None
    gap = float(np.linalg.norm(nearest.first_point - nearest.second_point))
    assert gap == pytest.approx(nearest.distance, abs=1e-6)


def test_an_object_in_the_root_frame_is_elsewhere_in_the_base_frame() -> None:
    x, y, z = UR5.forward(HOME, "root").position.tolist()
    there = SceneObject("ball", Sphere(0.02), (x, y, z), frame="root")
    assert CollisionModel(UR5, Scene((there,))).collides(HOME)
    assert not CollisionModel(UR5, Scene((ball("ball", (x, y, z), 0.02),))).collides(HOME)


def test_an_allowed_pair_may_touch_and_no_other() -> None:
    x, y, z = UR5.forward(HOME).position.tolist()
    scene = Scene((ball("part", (x, y, z), 0.03),))
    touching = {each.first for each in CollisionModel(UR5, scene).contacts(HOME)}
    assert touching == {"wrist_3_link"}
    assert not CollisionModel(UR5, scene.allow("part", "wrist_3_link")).collides(HOME)


def test_what_stands_is_not_checked_against_what_stands() -> None:
    bodies = (ball("one", (0.0, 0.0, 0.0)), ball("other", (0.0, 0.0, 0.01)))
    pairs = CollisionModel(UR5, Scene(bodies)).pairs
    assert not any("base_link_inertia" in pair and {"one", "other"} & set(pair) for pair in pairs)
    assert ("one", "other") not in pairs


def test_a_held_object_moves_with_the_tool_and_touches_the_world() -> None:
    x, y, z = UR5.forward(HOME).position.tolist()
    part = ball("part", (x, y, z - 0.04), 0.03)
    wall = SceneObject("wall", Box((0.02, 2.0, 2.0)), (x, 0.0, 1.0))
    scene = Scene((part, wall)).allow("wall", "wrist_3_link")
    held = scene.attach("part", "tool0", UR5.forward(HOME), ("wrist_3_link",))
    turned = np.array(HOME) + 0.4 * np.eye(6)[0]
    touching = [each[1:3] for each in CollisionModel(UR5, held).contacts(HOME)]
    assert ("part", "wall") in touching
    assert not CollisionModel(UR5, held.remove("wall")).collides(turned)


def test_a_held_object_is_checked_against_the_link_that_holds_it() -> None:
    x, y, z = UR5.forward(HOME).position.tolist()
    scene = Scene((ball("part", (x, y, z), 0.03),)).attach("part", "tool0", UR5.forward(HOME))
    assert CollisionModel(UR5, scene).collides(HOME)
    assert not CollisionModel(UR5, scene.allow("part", "wrist_3_link")).collides(HOME)


def test_a_coupled_robot_is_checked_where_its_controller_says_it_is() -> None:
    kinematics = arm("fanuc_m10ia")
    q = np.add(kinematics.robot.home_position, (0.0, 0.4, 0.2, 0.0, 0.3, 0.0))
    x, y, z = kinematics.forward(q).position.tolist()
    scene = Scene((ball("part", (x, y, z), 0.08),))
    assert CollisionModel(kinematics, scene).collides(q)
    assert not CollisionModel(kinematics, scene).collides(kinematics.robot.home_position)


@pytest.mark.parametrize("name", ["ur5", "fanuc_m10ia", "rail_kr5_arc", "fanuc_m410ib"])
def test_no_pair_moves_farther_than_its_bound(kinematics: Kinematics) -> None:
    collision = CollisionModel(kinematics, Scene((ball("ball", (0.6, 0.3, 0.4)),)))
    random = np.random.default_rng(3)
    for _ in range(60):
        first = random.uniform(kinematics.lower, kinematics.upper)
        moved = first + random.normal(0.0, 0.05, len(first))
        second = np.clip(moved, kinematics.lower, kinematics.upper)
        change = np.abs(collision.clearances(second) - collision.clearances(first))
        travel = np.abs(collision.model_positions(second) - collision.model_positions(first))
        assert (change <= collision.sweep @ travel + 1e-4).all()


@pytest.fixture
def wall_mesh(tmp_path: Path) -> str:
    file = tmp_path / "wall.obj"
    file.write_text("v 0 -1000 0\nv 0 1000 0\nv 0 1000 2000\nv 0 -1000 2000\nf 1 2 3 4\n")
    return str(file)


def test_a_mesh_is_met_like_the_box_it_stands_for(wall_mesh: str) -> None:
    mesh = SceneObject("wall", Mesh(wall_mesh, (1e-3, 1e-3, 1e-3)), (0.4, 0.0, 0.0))
    box = SceneObject("wall", Box((1e-5, 2.0, 2.0)), (0.4, 0.0, 1.0))
    by_mesh, by_box = (CollisionModel(UR5, Scene((each,))) for each in (mesh, box))
    random = np.random.default_rng(4)
    for q in random.uniform(-math.pi, math.pi, (100, 6)):
        assert by_mesh.collides(q) == by_box.collides(q)
        apart = by_box.clearances(q)
        far = apart > 1e-3
        np.testing.assert_allclose(by_mesh.clearances(q)[far], apart[far], atol=1e-4)


def test_what_the_robot_does_not_know_is_refused(tmp_path: Path) -> None:
    part = ball("part", (1.0, 0.0, 0.0))
    with pytest.raises(errors.DuplicateObject):
        CollisionModel(UR5, Scene((ball("tool0", (1.0, 0.0, 0.0)),)))
    with pytest.raises(errors.UnknownObject, match="wrist_9"):
        CollisionModel(UR5, Scene((part,)).allow("part", "wrist_9"))
    with pytest.raises(errors.FrameUnknown):
        CollisionModel(UR5, Scene((SceneObject("part", Sphere(0.1), link="hand"),)))
    with pytest.raises(errors.MeshFileError):
        CollisionModel(UR5, Scene((SceneObject("part", Mesh(str(tmp_path / "no.stl"))),)))


def test_a_bad_position_is_refused_and_never_called_free() -> None:
    collision = CollisionModel(UR5)
    with pytest.raises(errors.NotFinite):
        collision.collides([0.0, 0.0, math.nan, 0.0, 0.0, 0.0])
    with pytest.raises(errors.WrongJointCount):
        collision.distance([0.0])
    with pytest.raises(errors.NotFinite):
        collision.contacts([math.inf] * 6)


ROBOTS = ("ur5", "fanuc_m10ia", "rail_kr5_arc", "fanuc_m410ib", "kuka_iiwa14")


def random_scene(links: tuple[str, ...], random: np.random.Generator) -> Scene:
    """Return boxes of which some are held, and pairs of which some may touch."""
    objects = []
    for number in range(int(random.integers(1, 12))):
        place = (float(random.uniform(-1.0, 1.0)), 0.5, 0.2)
        link = str(random.choice(links)) if random.random() < 0.4 else None
        objects.append(SceneObject(f"box {number}", Box((0.1, 0.2, 0.3)), place, link=link))
    names = [each.name for each in objects]
    chosen = {(str(random.choice(names)), str(random.choice([*names, *links]))) for _ in range(5)}
    return Scene(tuple(objects), frozenset(pair for pair in chosen if pair[0] != pair[1]))


def plain_pairs(kinematics: Kinematics, scene: Scene) -> list[tuple[str, str]]:
    """Tell the rule of `collision` shape by shape."""
    robot, model = kinematics.robot, kinematics.model
    shapes = [(link, link) for link, each in robot.collision.items() for _ in each]
    shapes += [(each.name, each.link or "") for each in scene.objects]
    joint = {
        name: model.frames[model.getFrameId(link)].parentJoint if link else 0
        for name, link in shapes
    }
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


@pytest.mark.parametrize("name", ROBOTS)
def test_the_pairs_are_those_of_the_rule_and_where_few_in_its_order(
    kinematics: Kinematics,
) -> None:
    random = np.random.default_rng(11)
    few = 0
    for _ in range(10):
        scene = random_scene(kinematics.robot.links, random)
        pairs, expected = CollisionModel(kinematics, scene).pairs, plain_pairs(kinematics, scene)
        assert sorted(pairs) == sorted(expected)
        if len(expected) <= MOST_CHECKS:
            few += 1
            assert list(pairs) == expected
    assert few


@pytest.mark.parametrize("name", ROBOTS)
def test_the_sweep_of_a_ball_is_the_lengths_between_and_its_reach(kinematics: Kinematics) -> None:
    model, moving = kinematics.model, kinematics.robot.moving
    travel = greatest_travel(kinematics.robot)
    held = SceneObject("ball", Sphere(0.05), link=kinematics.robot.tool_link)
    stand = SceneObject("post", Sphere(0.1), (3.0, 0.0, 0.0))
    collision = CollisionModel(kinematics, Scene((stand, held)))
    row: NDArray[np.float64] = collision.sweep[collision.pairs.index(("post", "ball"))]
    # How far the ball reaches from the origin of the joint that carries it.
    placement = model.frames[model.getFrameId(held.link)].placement
    lever = float(np.linalg.norm(placement.translation)) + 0.05
    expected = []
    for joint in range(model.njoints - 1, 0, -1):
        expected.append(1.0 if moving[joint - 1].prismatic else lever)
        lever += float(np.linalg.norm(model.jointPlacements[joint].translation))
        lever += travel[joint - 1] if moving[joint - 1].prismatic else 0.0
    np.testing.assert_allclose(row, expected[::-1], rtol=1e-12)


def test_only_pairs_with_an_object_count_and_the_error_tells_them() -> None:
    balls = tuple(SceneObject(f"ball {n}", Sphere(0.01), (1.0, 0.0, 0.0)) for n in range(10))
    of_robot, scene = len(CollisionModel(UR5).pairs), Scene(balls)
    pairs = len(CollisionModel(UR5, scene).pairs) - of_robot
    assert len(CollisionModel(UR5, scene, most_pairs=pairs).pairs) == pairs + of_robot
    with pytest.raises(errors.SceneTooLarge) as caught:
        CollisionModel(UR5, scene, most_pairs=pairs - 1)
    assert (caught.value.pairs, caught.value.limit, caught.value.objects) == (pairs, pairs - 1, 10)
    assert CollisionModel(UR5, most_pairs=0).pairs


def crowd(count: int) -> Scene:
    """Return boxes around a UR5 of which the last is held by its tool."""
    random = np.random.default_rng(3)
    boxes = [
        SceneObject(f"box {number}", Box((0.05, 0.1, 0.02)), tuple(random.uniform(-1.0, 1.0, 3)))
        for number in range(count)
    ]
    return Scene((*boxes, SceneObject("held", Box((0.02, 0.02, 0.1)), link="tool0")))


def in_one_go(steps: Generator[BuildStep, None, Any]) -> Any:
    while True:
        try:
            next(steps)
        except StopIteration as end:
            return end.value


def distances(
    model: CollisionModel, position: Sequence[float]
) -> dict[tuple[str, str, int], float]:
    """Return the distance of each pair by its names; of several shapes of a link, counted."""
    found: dict[tuple[str, str, int], float] = {}
    for (first, second), distance in zip(
        model.pairs, model.clearances(np.array(position)).tolist(), strict=True
    ):
        number = 0
        while (first, second, number) in found:
            number += 1
        found[first, second, number] = distance
    return found


def test_a_large_model_has_all_the_pairs_of_the_rule_each_with_its_distance() -> None:
    scene = crowd(150)
    model = CollisionModel(UR5, scene)
    assert sorted(model.pairs) == sorted(plain_pairs(UR5, scene))
    assert len(model.sweep) == len(model.pairs) > 10 * 100
    found = distances(model, HOME)
    for one in (0, 7, 70, 149):
        pair = Scene((scene.objects[one], scene.objects[-1]))
        for key, distance in distances(CollisionModel(UR5, pair), HOME).items():
            assert found[key] == pytest.approx(distance, abs=1e-6)
    some = list(range(0, len(model.pairs), 31))
    clear = model.clearances(np.array(HOME))
    assert model.clearances_of(some, np.array(HOME)) == pytest.approx(clear[some], abs=1e-6)
    nearest = model.distance(HOME)
    assert nearest is not None
    assert nearest.distance == pytest.approx(clear.min(), abs=1e-6)
    in_turns = in_one_go(model.distance_in_steps(HOME))
    assert in_turns.distance == pytest.approx(nearest.distance, abs=1e-6)
    assert in_turns[1:3] == nearest[1:3]
    assert model.collides(HOME) is bool(clear.min() < TOUCHING)
    far = replace(
        scene,
        objects=tuple(
            each.at(Pose.from_values((9.0, 9.0, 9.0), (0, 0, 0, 1)), "base")
            for each in scene.objects
        ),
    )
    hit = replace(far, objects=(*far.objects, ball("ball", UR5.forward(HOME).position.tolist())))
    assert not CollisionModel(UR5, far).collides(HOME)
    assert CollisionModel(UR5, hit).collides(HOME)


def test_a_model_built_on_the_one_before_is_the_one_built_anew() -> None:
    random = np.random.default_rng(5)
    model = CollisionModel(UR5, crowd(60))
    for step in range(25):
        scene = model.scene
        name = str(random.choice([name for name in scene.names if name.startswith("box")]))
        match step % 5:
            case 0:
                place = tuple(random.uniform(-1.0, 1.0, 3).tolist())
                scene = scene.add(SceneObject(f"box new {step}", Box((0.1, 0.1, 0.1)), place))
            case 1:
                scene = scene.remove(name)
            case 2:
                there = Pose.from_values(random.uniform(-1.0, 1.0, 3).tolist(), (0, 0, 0, 1))
                scene = scene.move(name, there)
            case 3:
                scene = scene.allow(name, "forearm_link")
            case 4:
                scene = scene.remove("held") if "held" in scene.names else scene
                flange = UR5.forward(HOME)
                scene = (
                    scene.attach(name, "tool0", flange)
                    .remove(name)
                    .add(SceneObject("held", Box((0.02, 0.02, 0.1)), link="tool0"))
                )
        model = in_one_go(CollisionModel.in_steps(UR5, scene, before=model))
        anew = CollisionModel(UR5, scene)
        assert model.pairs == anew.pairs
        np.testing.assert_array_equal(model.sweep, anew.sweep)
        # Each search for a distance begins where the one before ended, so the last digits differ.
        here = np.array(HOME)
        np.testing.assert_allclose(model.clearances(here), anew.clearances(here), atol=1e-6)


def test_a_step_is_bounded_and_an_object_added_to_many_is_a_part_or_two() -> None:
    before = CollisionModel(UR5, crowd(150))
    alone = [step.effort for step in CollisionModel.in_steps(UR5, crowd(150))]
    assert max(alone) < 600.0
    scene = before.scene.add(ball("new", (3.0, 0.0, 0.0)))
    steps = CollisionModel.in_steps(UR5, scene, before=before)
    kept = {id(part) for part in before.parts_to_drop()}
    new = in_one_go(steps)
    shared = [part for part in new.parts_to_drop() if id(part) in kept]
    assert len(shared) >= 6
    assert before.pairs == CollisionModel(UR5, crowd(150)).pairs


def test_that_a_scene_does_not_fit_is_known_before_any_of_it_is_built() -> None:
    steps = CollisionModel.in_steps(UR5, crowd(150), most_pairs=100)
    seen: list[BuildStep] = []
    with pytest.raises(errors.SceneTooLarge):
        seen.extend(steps)
    assert not any(step.fits for step in seen)
