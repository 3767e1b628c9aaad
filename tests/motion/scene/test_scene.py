import math
import pickle

import pytest
from rigs.motion.nearness import assert_near, assert_same_pose

from openpendant.motion.errors import (
    BadArgument,
    DuplicateObject,
    FrameUnknown,
    MotionError,
    NotFinite,
    UnknownObject,
)
from openpendant.motion.pose import Pose
from openpendant.motion.scene.scene import Box, Capsule, Cylinder, Mesh, Scene, SceneObject, Sphere

PART = SceneObject("part", Box((0.1, 0.1, 0.1)), (0.4, 0.0, 0.05))
TABLE = SceneObject("table", Box((1.0, 1.0, 0.1)), (0.0, 0.0, -0.05))
SCENE = Scene((PART, TABLE))
HAND = Pose.from_rpy([0.4, 0.0, 0.2], [math.pi, 0.0, 0.3])


def test_every_change_counts_one_revision_and_leaves_the_scene_before_alone() -> None:
    changed = SCENE.remove("table").add(TABLE).move("part", Pose.identity()).allow("part", "table")
    assert (SCENE.revision, changed.revision) == (0, 4)
    assert SCENE.get("part").position == (0.4, 0.0, 0.05)
    assert changed.get("part").position == (0.0, 0.0, 0.0)


def test_pairs_that_may_touch_are_written_down_in_one_order_in_every_process() -> None:
    """A journal notes the scene as it is written here, and another process compares."""
    numbers = "123456789"
    scene = Scene((PART,), frozenset((f"link {number}", "part") for number in numbers), 3)
    pairs = ", ".join(f"('link {number}', 'part')" for number in numbers)
    assert repr(scene) == (
        "Scene(objects=(SceneObject(name='part', shape=Box(size=(0.1, 0.1, 0.1)),"
        " position=(0.4, 0.0, 0.05), quaternion=(0.0, 0.0, 0.0, 1.0), frame='base', link=None),),"
        f" allowed=frozenset({{{pairs}}}), revision=3)"
    )
    assert repr(Scene()) == "Scene(objects=(), allowed=frozenset(), revision=0)"


def test_a_held_object_keeps_its_place_relative_to_the_hand() -> None:
    held = SCENE.attach("part", "tool0", HAND)
    assert held.get("part").link == "tool0"
    carried = held.detach("part", Pose.from_rpy([0.0, 0.5, 0.2], [math.pi, 0.0, 0.3]))
    assert_near(carried.get("part").position, (-0.4 + 0.4, 0.5, 0.05), 1e-12)


def test_letting_go_where_it_was_taken_changes_no_pose() -> None:
    back = SCENE.attach("part", "tool0", HAND).detach("part", HAND).get("part")
    assert back.link is None
    assert_same_pose(back.pose, PART.pose)


def test_attaching_allows_only_the_pairs_that_are_named() -> None:
    held = SCENE.attach("part", "tool0", HAND, touching=("wrist_3_link",))
    assert held.allowed == {("part", "wrist_3_link")}
    assert SCENE.attach("part", "tool0", HAND).allowed == frozenset()


def test_removing_an_object_removes_its_allowed_pairs() -> None:
    assert SCENE.allow("table", "part").remove("part").allowed == frozenset()


def test_a_scene_is_a_value_that_travels_between_processes() -> None:
    assert pickle.loads(pickle.dumps(SCENE.allow("part", "table"))) == SCENE.allow("table", "part")


def test_a_quaternion_within_tolerance_is_brought_to_norm_one() -> None:
    turned = SceneObject("x", Sphere(0.1), quaternion=(0.0, 0.0, 0.0, 1.0005))
    assert turned.quaternion == (0.0, 0.0, 0.0, 1.0)


@pytest.mark.parametrize(
    ("make", "error"),
    [
        (lambda: Box((0.1, 0.0, 0.1)), BadArgument),
        (lambda: Box((0.1, math.nan, 0.1)), NotFinite),
        (lambda: Sphere(-0.1), BadArgument),
        (lambda: Sphere(math.inf), NotFinite),
        (lambda: Cylinder(0.1, 0.0), BadArgument),
        (lambda: Capsule(1e9, 0.1), BadArgument),
        (lambda: Mesh(""), BadArgument),
        (lambda: Mesh("a.stl", (1.0, 0.0, 1.0)), BadArgument),
        (lambda: SceneObject("", Sphere(0.1)), BadArgument),
        (lambda: SceneObject("a\nb", Sphere(0.1)), BadArgument),
        (lambda: SceneObject("x", Sphere(0.1), (math.nan, 0.0, 0.0)), NotFinite),
        (lambda: SceneObject("x", Sphere(0.1), (1e4, 0.0, 0.0)), BadArgument),
        (lambda: SceneObject("x", Sphere(0.1), quaternion=(0.0, 0.0, 0.0, 0.9)), BadArgument),
        (lambda: SceneObject("x", Sphere(0.1), quaternion=(0.0, 0.0, 0.0, 0.0)), BadArgument),
        (lambda: SceneObject("x", Sphere(0.1), frame="tool"), FrameUnknown),
        (lambda: SCENE.add(PART), DuplicateObject),
        (lambda: Scene((PART, PART)), DuplicateObject),
        (lambda: SCENE.get("nothing"), UnknownObject),
        (lambda: SCENE.remove("nothing"), UnknownObject),
        (lambda: SCENE.move("nothing", HAND), UnknownObject),
        (lambda: SCENE.move("part", HAND, "tool"), FrameUnknown),
        (lambda: SCENE.allow("one", "other"), UnknownObject),
        (lambda: SCENE.allow("part", "part"), BadArgument),
        (lambda: SCENE.forbid("part", "table"), BadArgument),
        (lambda: SCENE.detach("part", HAND), BadArgument),
        (lambda: SCENE.attach("part", "a", HAND).attach("part", "b", HAND), BadArgument),
    ],
)
def test_what_makes_no_sense_is_refused(make: object, error: type[MotionError]) -> None:
    assert callable(make)
    with pytest.raises(error):
        make()
