"""Grasping: how far a tool is from an object, and what it takes (promise 36)."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rigs.motion.bodies_and_points import any_solid, distance_to, to_triangle
from rigs.motion.nearness import assert_same_pose

from openpendant.motion.description.robot import serial_robot
from openpendant.motion.errors import (
    BadArgument,
    FrameUnknown,
    MotionError,
    NotFinite,
    NothingGripped,
    ObjectHeld,
    UnknownObject,
)
from openpendant.motion.frames.frame_tree import FrameTree
from openpendant.motion.frames.grasp import Grasp
from openpendant.motion.kinematics.serial import Kinematics
from openpendant.motion.pose import Pose
from openpendant.motion.scene.collision import distance_to_point
from openpendant.motion.scene.grasping import Grip, gripped
from openpendant.motion.scene.scene import Mesh, Scene, SceneObject, Sphere

UR5 = Kinematics(serial_robot("ur5"))
HOME = UR5.robot.home_position
FLANGE = UR5.forward(HOME)
TCP = Pose.from_rpy((0.01, -0.02, 0.15), (0.3, 0.1, -0.4))
POINT = (0.005, 0.01, 0.02)
TOOLED = FrameTree().add_tool("gripper", TCP, Grasp(POINT, 0.03)).select_tool("gripper")


def shift(x: float, y: float = 0.0, z: float = 0.0) -> Pose:
    return Pose.from_rpy((x, y, z), (0.0, 0.0, 0.0))


def ball_at(place: Pose, radius: float = 0.02) -> Scene:
    x, y, z = place.position.tolist()
    return Scene((SceneObject("part", Sphere(radius), (x, y, z)),))


def grip(
    scene: Scene, frames: FrameTree = TOOLED, link: str | None = None, name: str = "part"
) -> Grip:
    return gripped(UR5, frames, scene, name, HOME, link)


def missed(scene: Scene, frames: FrameTree = TOOLED, link: str | None = None) -> NothingGripped:
    with pytest.raises(NothingGripped) as refused:
        grip(scene, frames, link)
    return refused.value


@pytest.mark.parametrize("seed", range(5))
def test_the_distance_from_a_solid_is_that_of_its_formula(seed: int) -> None:
    random = np.random.default_rng(seed)
    for _ in range(200):
        shape, point = any_solid(random), random.normal(size=3) * 10 ** random.uniform(-3, 0.5)
        assert distance_to_point(shape, point) == pytest.approx(distance_to(shape, point), abs=1e-9)


def tetrahedron(path: Path, corners: Any) -> list[Any]:
    """Write the four triangles between four corners as an STL file, and return them."""
    faces = [corners[list(face)] for face in ((0, 1, 2), (0, 1, 3), (0, 2, 3), (1, 2, 3))]
    lines = ["solid part"]
    for face in faces:
        rows = [f"vertex {x!r} {y!r} {z!r}" for x, y, z in face.tolist()]
        lines += ["facet normal 0 0 1", "outer loop", *rows, "endloop", "endfacet"]
    path.write_text("\n".join([*lines, "endsolid part", ""]))
    return faces


def test_the_distance_from_a_mesh_is_that_of_its_nearest_triangle(tmp_path: Path) -> None:
    random = np.random.default_rng(7)
    for number in range(40):
        path = tmp_path / f"part{number}.stl"
        faces = tetrahedron(path, random.normal(size=(4, 3)))
        for point in random.normal(size=(5, 3)):
            expected = min(to_triangle(point, *face) for face in faces)
            assert distance_to_point(Mesh(str(path)), point) == pytest.approx(expected, abs=1e-6)


def test_a_mesh_has_no_inside(tmp_path: Path) -> None:
    corners = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    tetrahedron(tmp_path / "part.stl", corners)
    inside = distance_to_point(Mesh(str(tmp_path / "part.stl")), (0.1, 0.1, 0.1))
    assert inside == pytest.approx(0.1, abs=1e-6)
    scaled = distance_to_point(Mesh(str(tmp_path / "part.stl"), (2.0, 2.0, 2.0)), (0.1, 0.1, 0.1))
    assert scaled == pytest.approx(0.1, abs=1e-6)


def test_an_object_is_measured_from_the_grasp_point_of_the_selected_tool() -> None:
    point = FLANGE.compose(TCP).compose(shift(*POINT))
    assert grip(ball_at(point)).distance == 0.0
    beside = ball_at(point.compose(shift(0.0, 0.045)))
    assert grip(beside).distance == pytest.approx(0.025, abs=1e-9)
    far = missed(ball_at(point.compose(shift(0.0, 0.0, 0.06))))
    assert (far.name, far.tool) == ("part", "gripper")
    assert far.value == pytest.approx(0.04, abs=1e-9)
    assert far.limit == 0.03
    assert str(far) == "gripper is 40.0 mm from part; reach 30 mm"


def test_reach_is_met_to_a_micrometre_and_the_text_shows_what_is_missing() -> None:
    point = FLANGE.compose(TCP).compose(shift(*POINT))
    assert grip(ball_at(point.compose(shift(0.05 - 1e-6)))).distance <= 0.03
    just = missed(ball_at(point.compose(shift(0.05 + 1e-6))))
    assert "is 30.001000 mm from part; reach 30 mm" in str(just)


def test_the_bare_flange_and_a_tool_that_says_nothing_reach_ten_millimetres() -> None:
    silent = FrameTree().add_tool("torch", TCP).select_tool("torch")
    for frames, tip, name in (
        (FrameTree(), FLANGE, "flange"),
        (silent, FLANGE.compose(TCP), "torch"),
    ):
        assert grip(ball_at(tip.compose(shift(0.029))), frames).distance > 0.0
        far = missed(ball_at(tip.compose(shift(0.031))), frames)
        assert (far.tool, far.limit) == (name, 0.01)


def test_another_link_is_measured_from_its_origin_with_the_default_reach() -> None:
    origin = UR5.forward(HOME, link="wrist_1_link")
    taken = grip(ball_at(origin.compose(shift(0.029))), link="wrist_1_link")
    assert taken.scene.get("part").link == "wrist_1_link"
    far = missed(ball_at(origin.compose(shift(0.031))), link="wrist_1_link")
    assert (far.tool, far.limit) == ("wrist_1_link", 0.01)


def test_the_link_of_the_tool_by_its_name_is_the_tool() -> None:
    point = FLANGE.compose(TCP).compose(shift(*POINT))
    assert grip(ball_at(point), link="tool0").scene == grip(ball_at(point)).scene


@pytest.mark.parametrize("frame", ["base", "root"])
def test_what_is_taken_stays_where_it_is(frame: str) -> None:
    point = FLANGE.compose(TCP).compose(Pose.from_rpy(POINT, (0.2, 0.3, 0.4)))
    in_base = UR5.to_base(Pose.identity(), frame)
    placed = in_base.inverse().compose(point)
    part = ball_at(point).get("part").at(placed, frame)
    taken = grip(Scene((part,)))
    held = taken.scene.get("part")
    assert held.link == "tool0"
    assert_same_pose(FLANGE.compose(held.pose), point)
    assert_same_pose(FLANGE.compose(TCP).compose(taken.grasp), point)
    assert taken.scene.allowed == {("part", "tool0")}


@pytest.mark.parametrize(
    ("name", "link", "error"),
    [
        ("nothing", None, UnknownObject),
        ("held", None, ObjectHeld),
        ("part", "nowhere", FrameUnknown),
    ],
)
def test_what_cannot_be_taken_is_refused_by_name(
    name: str, link: str | None, error: type[MotionError]
) -> None:
    held = SceneObject("held", Sphere(0.1), link="wrist_1_link")
    with pytest.raises(error):
        grip(ball_at(FLANGE).add(held), link=link, name=name)


@pytest.mark.parametrize(
    ("fields", "error"),
    [
        ({"reach": math.nan}, NotFinite),
        ({"reach": -0.001}, BadArgument),
        ({"reach": 0.0501}, BadArgument),
        ({"point": (0.0, math.inf, 0.0)}, NotFinite),
        ({"point": (0.0, 2e3, 0.0)}, BadArgument),
        ({"point": (0.0, 0.0)}, BadArgument),
        ({"part": -1}, BadArgument),
        ({"part": 512}, BadArgument),
    ],
)
def test_a_grasp_out_of_bounds_is_none(fields: dict[str, Any], error: type[MotionError]) -> None:
    with pytest.raises(error):
        Grasp(**fields)
    assert Grasp((1.0, 2.0, 3.0), 0.05, 511).part == 511
