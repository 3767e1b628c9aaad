import math
import pickle
import struct
from pathlib import Path

import numpy as np
import pytest
from rigs.motion.nearness import assert_near, assert_same_pose
from rigs.motion.planning_scenes import pillar_scene

from openpendant.motion.errors import (
    BadArgument,
    DuplicateObject,
    FrameUnknown,
    MeshFileError,
    MotionError,
    NotFinite,
    ObjectHeld,
    ObjectNotHeld,
    SceneFileError,
    UnknownObject,
)
from openpendant.motion.pose import Pose
from openpendant.motion.scene.mesh_file import read_mesh
from openpendant.motion.scene.scene import Box, Capsule, Cylinder, Mesh, Scene, SceneObject, Sphere
from openpendant.motion.scene.scene_file import load_scene, save_scene

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
        (lambda: SCENE.detach("part", HAND), ObjectNotHeld),
        (lambda: SCENE.attach("part", "a", HAND).attach("part", "b", HAND), ObjectHeld),
    ],
)
def test_what_makes_no_sense_is_refused(make: object, error: type[MotionError]) -> None:
    assert callable(make)
    with pytest.raises(error):
        make()


HEAD = "schema: openpendant-scene/1\n"
BOX = "{name: box, shape: {type: box, size: [1, 2]}}"
BALL = "{name: ball, shape: {type: sphere, radius: 0.1}"


def full_scene(folder: Path) -> Scene:
    more = (
        SceneObject("ball", Sphere(0.1), (0.1, 0.2, 0.3), (0.6, 0.0, 0.0, 0.8), "root"),
        SceneObject("can", Cylinder(0.05, 0.2), link="tool0"),
        SceneObject("pill", Capsule(0.05, 0.2)),
        SceneObject("jig", Mesh(str(folder / "jig.stl"), (0.001, 0.001, 0.001))),
    )
    return Scene((*pillar_scene().objects, *more), frozenset({("can", "wrist_3_link")}), 7)


@pytest.mark.parametrize("name", ["a.yaml", "a.json"])
def test_a_scene_comes_back_as_it_was_saved(tmp_path: Path, name: str) -> None:
    scene = full_scene(tmp_path)
    save_scene(scene, tmp_path / name)
    assert load_scene(tmp_path / name) == scene


def test_a_mesh_is_found_beside_its_scene_file(tmp_path: Path) -> None:
    text = HEAD + "objects: [{name: jig, shape: {type: mesh, file: parts/jig.stl}}]"
    (tmp_path / "a.yaml").write_text(text)
    (jig,) = load_scene(tmp_path / "a.yaml").objects
    assert jig.shape == Mesh(str(tmp_path / "parts/jig.stl"))


def refused(folder: Path, text: str, links: tuple[str, ...] | None = None) -> SceneFileError:
    """Return the refusal of a scene file, which is one line that begins with its name."""
    file = folder / "a.yaml"
    file.write_text(text)
    with pytest.raises(SceneFileError) as refusal:
        load_scene(file, links)
    assert str(refusal.value).startswith(str(file))
    assert "\n" not in str(refusal.value)
    return refusal.value


@pytest.mark.parametrize(
    ("text", "field"),
    [
        ("objects: []", "schema"),
        ("schema: openpendant-scene/2", "schema"),
        (HEAD + "bodies: []", "bodies"),
        (HEAD + f"objects: [{BALL}, position: [0, 0]}}]", "objects[0].position[2]"),
        (HEAD + f"objects: [{BALL}, frame: tool}}]", "objects[0].frame"),
        (HEAD + f"objects: [{BALL}, position: [0, 0, .nan]}}]", "objects[0].position[2]"),
        (HEAD + f"objects: [{BALL}, quaternion: [0, 0, 0, 2]}}]", "objects[0] (ball)"),
        (HEAD + "objects: [{name: a, shape: {type: cone}}]", "objects[0].shape.type"),
        (HEAD + "objects: [{name: a, shape: {size: 1}}]", "objects[0].shape.type"),
        (HEAD + f"objects: [{BOX}]", "objects[0].shape.size[2]"),
        (HEAD + "objects: [{name: a, shape: {type: sphere, radius: 0}}]", "objects[0] (a)"),
        (HEAD + f"objects: [{BALL}}}, {BALL}}}]", "objects[1].name"),
        (HEAD + f"objects: [{BALL}}}]\nallowed: [[one, two]]", "allowed[0]"),
        (HEAD + f"objects: [{BALL}}}]\nallowed: [[ball, a], [ball, ball]]", "allowed[1]"),
        ("[1, 2]", ""),
        ("a: [", ""),
    ],
)
def test_a_bad_scene_file_is_refused_by_field(tmp_path: Path, text: str, field: str) -> None:
    assert refused(tmp_path, text).field == field


@pytest.mark.parametrize(
    ("text", "refusal"),
    [
        (
            f"objects: [{BALL}, link: moon}}]",
            "objects[0].link: is 'moon'; accepted: a link of the robot: base_link, tool0",
        ),
        (
            f"objects: [{BALL}}}]\nallowed: [[ball, tool0], [ball, zz]]",
            "allowed[1][1]: is 'zz'; accepted: an object: ball; or a link: base_link, tool0",
        ),
        (
            f"objects: [{BALL}}}, {BALL.replace('ball', 'tool0')}}}]",
            "objects[1].name: is 'tool0', which is taken;"
            " accepted: a name of no other object and no link",
        ),
    ],
)
def test_what_names_a_link_is_checked_by_the_robot(tmp_path: Path, text: str, refusal: str) -> None:
    found = refused(tmp_path, HEAD + text, ("base_link", "tool0"))
    assert str(found) == f"{tmp_path / 'a.yaml'}: {refusal}"
    assert len(load_scene(tmp_path / "a.yaml").objects) > 0


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("objects: [{name: a, shape: {type: mesh, file: a.stl, scale: 0}}]",
         "is 0; accepted: a list of 3 numbers"),
        ("objects: [{name: a, shape: {type: box, size: [1, 1, 1, 1]}}]",
         "is [1, 1, 1, 1]; accepted: at most 3 items"),
        ("objects: [{name: a, shape: {type: cone}}]",
         "is 'cone'; accepted: box, capsule, cylinder, mesh, sphere"),
        ("objects: [{name: a, shape: {size: 1}}]",
         "is missing; accepted: box, capsule, cylinder, mesh, sphere"),
        ("objects: [{name: a, shape: 3}]", "is 3; accepted: a mapping"),
        ("objects: [{name: a, shape: {type: sphere, radius: 1}, quaternion: [0, 0, 0, 3]}]",
         "quaternion of a is (0.0, 0.0, 0.0, 3.0); accepted: a norm of 1 within 0.001;"
         " this one is 3"),
        ("objects: [3]", "is 3; accepted: a mapping with the fields name, shape, position,"
         " quaternion, frame, link"),
        ("allowed: [a]", "is 'a'; accepted: a list of 2 texts"),
        ("allowed: a", "is 'a'; accepted: a list of items"),
        ("objects: [{name: 3, shape: {type: sphere, radius: 1}}]", "is 3; accepted: text"),
    ],
)  # fmt: skip
def test_what_is_accepted_is_told_in_a_files_words(tmp_path: Path, text: str, problem: str) -> None:
    assert refused(tmp_path, HEAD + text).problem == problem


def test_an_unknown_field_is_refused_with_the_nearest_and_the_known_ones(tmp_path: Path) -> None:
    shape = "{type: box, size: [1, 1, 1], sise: 2}"
    text = f"objects: [{{name: a, shape: {shape}, positon: [0, 0, 0]}}]"
    found = refused(tmp_path, HEAD + text)
    assert found.field == "objects[0].shape.sise"
    assert found.problem == "is not permitted, perhaps 'size' is meant; accepted: type, size"
    ((field, problem),) = found.more
    assert field == "objects[0].positon"
    assert "'position'" in problem
    assert "accepted: name, shape, position, quaternion, frame, link" in problem


def test_a_file_full_of_unknown_fields_is_refused_at_once(tmp_path: Path) -> None:
    more = refused(tmp_path, HEAD + "".join(f"object{n}: 1\n" for n in range(2000))).more
    assert len(more) == 1999
    told = [problem for _, problem in more if "perhaps 'objects'" in problem]
    assert 0 < len(told) < 20


def test_a_missing_scene_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(SceneFileError, match="No such file"):
        load_scene(tmp_path / "a.yaml")


CORNERS = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.5]])
FACET = (
    "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0.5\nendloop\nendfacet"
)


def binary_stl(corners: np.ndarray, count: int | None = None) -> bytes:
    triangle = struct.pack("<12fH", 0.0, 0.0, 1.0, *corners.ravel().tolist(), 0)
    return b"solid, although binary".ljust(80) + struct.pack("<I", count or 1) + triangle


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("a.stl", binary_stl(CORNERS)),
        ("a.STL", f"solid x\n{FACET}\nendsolid x\n".encode()),
        ("a.obj", b"# x\nv 0 0 0\nv 1 0 0\nv 0 1 0.5\nvn 0 0 1\nf 1/1/1 2//1 3\n"),
        ("b.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0.5\nf -3 -2 -1\n"),
    ],
)
def test_a_triangle_is_read_from_every_format(tmp_path: Path, name: str, content: bytes) -> None:
    (tmp_path / name).write_bytes(content)
    mesh = read_mesh(tmp_path / name)
    np.testing.assert_array_equal(mesh.vertices[mesh.corners[0]], CORNERS)


def test_a_polygon_becomes_a_fan(tmp_path: Path) -> None:
    (tmp_path / "a.obj").write_text("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n")
    assert read_mesh(tmp_path / "a.obj").corners.tolist() == [[0, 1, 2], [0, 2, 3]]


@pytest.mark.parametrize(
    ("name", "content", "place"),
    [
        ("a.ply", b"", ""),
        ("a.stl", b"", "byte 0"),
        ("a.stl", b"\x00" * 50, "byte 50"),
        ("a.stl", binary_stl(CORNERS, count=7).replace(b"solid", b"xxxxx"), "byte 80"),
        ("a.stl", binary_stl(np.full((3, 3), np.nan)), "byte 84"),
        ("a.stl", b"solid x\nendsolid x\n".ljust(90), ""),
        ("a.stl", b"solid x\nfacet\nvertex 1 2\n".ljust(90), "line 3"),
        ("a.stl", b"solid x\nvertex 1 2 nan\n".ljust(90), "line 2"),
        ("a.stl", b"solid x\nvertex 1 2 3\nendfacet\n".ljust(90), "line 3"),
        ("a.stl", b"solid x\nvertex 1 2 3\n".ljust(90), ""),
        ("a.stl", b"solid \xff\xfe".ljust(90), "byte 6"),
        ("a.obj", b"v 1 2 3\nf 1 1 2\n", "line 2"),
        ("a.obj", b"v 1 2 3\nf 1 1 0\n", "line 2"),
        ("a.obj", b"v 1 2 3\nf 1 1\n", "line 2"),
        ("a.obj", b"v 1 2 3\nf 1 1 x\n", "line 2"),
        ("a.obj", b"v 1 2 3\n", ""),
    ],
)
def test_a_bad_mesh_is_refused_there(tmp_path: Path, name: str, content: bytes, place: str) -> None:
    (tmp_path / name).write_bytes(content)
    with pytest.raises(MeshFileError) as refused:
        read_mesh(tmp_path / name)
    assert refused.value.place == place
    assert "\n" not in str(refused.value)


def test_a_missing_mesh_is_refused(tmp_path: Path) -> None:
    with pytest.raises(MeshFileError, match="No such file"):
        read_mesh(tmp_path / "a.stl")
