import math
import re
from functools import cache
from itertools import pairwise
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from rigs.data.urdf_files import ROBOTS_FILES
from rigs.motion.loaded_robots import SERIAL, load_robot, serial_robot
from rigs.motion.nearness import assert_same_pose

from openpendant.motion.cli.robots import main
from openpendant.motion.description.robot import SerialRobot, robot_names
from openpendant.motion.description.robot import serial_robot as robot_of_file
from openpendant.motion.description.schema import BoxFacts, CapsuleFacts
from openpendant.motion.kinematics.serial import Kinematics
from openpendant.motion.pose import Pose
from openpendant.motion.visuals import drawing
from openpendant.motion.visuals.visuals import (
    ShapeForm,
    VisualPart,
    VisualShape,
    box_of,
    chord,
    robot_visuals,
)

Capture = pytest.CaptureFixture[str]

HERE = Pose.identity()


@cache
def drawn(name: str) -> tuple[drawing.Facet, ...]:
    """A robot of the project at home, from where `draw` looks at it."""
    return drawing.draw(load_robot(name))


@pytest.mark.parametrize("name", SERIAL)
def test_every_link_has_a_shape_and_every_turning_joint_a_hub(robot: SerialRobot) -> None:
    shapes = robot_visuals(robot).shapes
    assert {shape.link for shape in shapes} == set(robot.links)
    hubs = [shape.link for shape in shapes if shape.part is VisualPart.JOINT]
    assert hubs == [joint.child for joint in robot.moving]


@pytest.mark.parametrize("name", robot_names())
def test_visuals_are_of_sensible_size(name: str) -> None:
    visuals = robot_visuals(load_robot(name))
    assert visuals.name == name
    for shape in visuals.shapes:
        assert all(0.001 < edge < 6.0 for edge in shape.size)
        assert len(bytes.fromhex(shape.colour[1:])) == 3


@pytest.mark.parametrize("name", SERIAL)
def test_body_shapes_are_as_large_as_their_collision_shapes(robot: SerialRobot) -> None:
    shown = [each for each in robot_visuals(robot).shapes if each.part is VisualPart.BODY]
    for link, shapes in robot.collision.items():
        for shape in shapes:
            box = box_of(shape)
            assert any(
                each.link == link
                and np.allclose(each.pose.position, box.centre)
                and sorted(each.size) == pytest.approx(sorted(box.size), rel=0.35)
                for each in shown
            )


@pytest.mark.parametrize("name", ["ur5", "fanuc_m10ia", "fanuc_m410ib", "rail_kr5_arc"])
def test_links_are_drawn_where_forward_kinematics_puts_them(robot: SerialRobot) -> None:
    position = np.array(robot.home_position) + 0.1
    places, kinematics = drawing.link_poses(robot, position.tolist()), Kinematics(robot)
    for link in robot.links:
        expected = kinematics.forward(position, "root", link)
        assert_same_pose(places[link], expected)


def test_a_joint_moves_what_is_beyond_it_and_nothing_before_it() -> None:
    robot = serial_robot("ur5")
    moved = list(robot.home_position)
    moved[3] += 0.5
    before, after = drawing.link_poses(robot), drawing.link_poses(robot, moved)
    still = [link for link in robot.links if before[link].rotation_distance(after[link]) < 1e-12]
    assert still == list(robot.links[: robot.links.index("wrist_1_link")])


@pytest.mark.parametrize("name", ["ur5", "kuka_iiwa14", "abb_irb2400"])
def test_a_hub_lies_on_its_joints_axis(robot: SerialRobot) -> None:
    shapes = robot_visuals(robot).shapes
    hubs = {each.link: each for each in shapes if each.part is VisualPart.JOINT}
    for joint in robot.moving:
        hub, axis = hubs[joint.child], np.array(joint.axis)
        assert abs(hub.pose.rotation[:, 2] @ axis) == pytest.approx(1.0)
        assert np.cross(hub.pose.position, axis) == pytest.approx([0, 0, 0], abs=1e-12)


def test_makers_have_their_colours() -> None:
    bodies = {
        name: next(
            s.colour for s in robot_visuals(load_robot(name)).shapes if s.part is VisualPart.BODY
        )
        for name in ("abb_irb2400", "fanuc_s430i", "kuka_kr6_2", "ur5", "motoman_gp7", "puma560")
    }
    assert len(set(bodies.values())) == len(bodies)
    assert bodies["fanuc_s430i"] == "#f5cf1b"


def test_the_platform_stands_on_six_struts_of_its_leg_lengths() -> None:
    robot = load_robot("stewart_classroom")
    visuals, places = robot_visuals(robot), drawing.link_poses(robot)
    assert len(visuals.struts) == 6
    for strut in visuals.struts:
        ends = [
            places[link].compose(Pose.from_values(point, (0, 0, 0, 1))).position
            for link, point in ((strut.first_link, strut.first), (strut.second_link, strut.second))
        ]
        assert math.dist(*ends) == pytest.approx(0.27, abs=1e-5)


@pytest.mark.parametrize("form", list(ShapeForm))
def test_the_facets_of_a_solid_close_it_and_face_outwards(form: ShapeForm) -> None:
    size = (0.4, 0.4, 0.4) if form is ShapeForm.SPHERE else (0.4, 0.4, 1.0)
    shape = VisualShape("a", form, VisualPart.BODY, size, HERE, "#000000")
    volume = 0.0
    corners = []
    for polygon in drawing.shape_polygons(shape):
        corners.append(polygon)
        for one, two in pairwise(polygon[1:]):
            # The divergence theorem: signed volumes of the tetrahedra over all triangles.
            volume += float(polygon[0] @ np.cross(one, two)) / 6.0
    radius = 0.2
    exact = {
        ShapeForm.BOX: 0.16,
        ShapeForm.CYLINDER: math.pi * radius**2,
        ShapeForm.CAPSULE: math.pi * radius**2 * 0.6 + 4 / 3 * math.pi * radius**3,
        ShapeForm.SPHERE: 4 / 3 * math.pi * radius**3,
    }[form]
    assert volume == pytest.approx(exact, rel=0.05)
    assert np.ptp(np.vstack(corners), axis=0) == pytest.approx(size, rel=0.02)


@pytest.mark.parametrize("perspective", [False, True])
def test_the_whole_robot_is_in_the_picture_the_farthest_facets_first(perspective: bool) -> None:
    facets = drawing.draw(load_robot("motoman_gp7"), view=drawing.View(perspective=perspective))
    shown = facets[64:]
    assert max(float(np.abs(facet.points).max()) for facet in shown) < (1.3 if perspective else 1.0)
    depths = [float(facet.depths.mean()) for facet in shown]
    assert depths == sorted(depths, reverse=True)


def test_an_orthographic_front_view_is_to_scale() -> None:
    upright = [0.0, -math.pi / 2.0, 0.0, 0.0, 0.0, 0.0]
    front = drawing.View(azimuth=0.0, elevation=0.0)
    pictures = (drawing.draw(load_robot("ur5"), each, front)[64:] for each in (upright, [0.0] * 6))
    tall, folded = (max(float(each.points[:, 1].max()) for each in facets) for facets in pictures)
    assert tall > 0.9
    assert folded < 0.7


@pytest.fixture
def small(monkeypatch: pytest.MonkeyPatch) -> int:
    """Pictures of a quarter of the size; a point of a large one takes as long as its neighbours."""
    monkeypatch.setattr(drawing, "SIZE", drawing.SIZE // 4)
    return drawing.SIZE


def test_the_picture_shows_the_makers_colour_on_white(small: int) -> None:
    pixels = drawing.raster(drawn("fanuc_m410ib"))
    assert pixels.shape == (small, small, 3)
    red, green, blue = (pixels[..., channel].astype(int) for channel in range(3))
    yellow = (red > 100) & (green > 80) & (blue < red / 2)
    assert 0.03 < yellow.mean() < 0.6
    assert (pixels[0, 0] == 255).all()


def test_the_nearer_facet_hides_the_farther(small: int) -> None:
    near, far = drawn("fanuc_m410ib")[64:66]
    corners = np.array([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]])
    front, behind = (
        type(near)(corners, np.full(4, depth), colour)
        for depth, colour in ((0.0, (255, 0, 0)), (1.0, (0, 255, 0)))
    )
    for order in ([front, behind], [behind, front]):
        assert tuple(drawing.raster(order)[small // 2, small // 2]) == (255, 0, 0)
    assert far.points.shape[1] == 2


def test_svg_and_png_are_what_they_say() -> None:
    facets = drawn("fanuc_m410ib")
    document = ElementTree.fromstring(drawing.svg(facets, "<M-410 & more>"))
    assert document.findtext("{http://www.w3.org/2000/svg}title") == "<M-410 & more>"
    # One more is the background.
    assert len(list(document.iter("{http://www.w3.org/2000/svg}path"))) == len(facets) + 1
    assert (document.get("width"), document.get("height")) == ("540pt", "540pt")  # 720 in a browser
    picture = drawing.png(facets[:100])
    assert picture.startswith(b"\x89PNG\r\n\x1a\n")
    assert picture.endswith(b"IEND\xaeB`\x82")


def test_a_picture_is_the_same_each_time() -> None:
    facets = drawn("fanuc_m410ib")[:100]
    assert drawing.svg(facets, "arm") == drawing.svg(facets, "arm")
    assert drawing.png(facets) == drawing.png(facets)


def test_an_svg_paints_the_facets_in_their_order() -> None:
    facets = drawn("fanuc_m410ib")
    document = ElementTree.fromstring(drawing.svg(facets, "arm"))
    paths = document.iter("{http://www.w3.org/2000/svg}path")
    painted = [re.findall(r"#\w{6}", path.get("style", ""))[0] for path in paths]
    assert painted[1:] == ["#" + bytes(facet.colour).hex() for facet in facets]


def test_a_line_cuts_a_box_where_it_enters_and_leaves() -> None:
    facts = BoxFacts(type="box", size=(2.0, 4.0, 6.0), xyz=(1.0, 0.0, 0.0), rpy=(0.0, 0.0, 0.0))
    box = box_of(facts)
    x, z = np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0])
    assert chord(box, np.array([-5.0, 0.0, 0.0]), x) == pytest.approx((5.0, 7.0))
    assert chord(box, np.array([-5.0, 0.0, 0.0]), z) is None
    assert box.distance(np.array([5.0, 0.0, 0.0])) == pytest.approx(3.0)
    capsule = CapsuleFacts(type="capsule", radius=0.5, length=2.0, xyz=(0, 0, 0), rpy=(0, 0, 0))
    assert box_of(capsule).size == (1.0, 1.0, 3.0)
    assert box_of(capsule).width_across(z) == 1.0


def test_draw_writes_a_picture(capsys: Capture, tmp_path: Path) -> None:
    target = tmp_path / "arm.svg"
    options = ["-o", str(target), "--orthographic", "--azimuth", "30"]
    assert main(["draw", "motoman_gp7", *options]) == 0
    assert f"wrote {target}" in capsys.readouterr().out
    assert ElementTree.parse(target).getroot().tag == "{http://www.w3.org/2000/svg}svg"


@pytest.mark.parametrize(
    ("argv", "says"),
    [
        (["draw", "ur6"], "known"),
        (["draw", "motoman_gp7", "-o", "arm.jpg"], ".svg or .png"),
        (["draw", "motoman_gp7", "-o", "/no/such/folder/arm.svg"], "can be written"),
        (["draw", "ur5", "--joints", "[0]"], "6 driven joints"),
        (["draw", "ur5", "--joints", "[0,0,0,0,0,NaN]"], "finite"),
        (["draw", "ur5", "--elevation", "90"], "elevation"),
        (["draw", "stewart_classroom", "--joints", "[0,0]"], "6 driven joints"),
        (["draw", "ur5", "--azimuth", "nan"], "azimuth"),
    ],
)
def test_a_bad_drawing_is_one_line_of_complaint(
    capsys: Capture, argv: list[str], says: str
) -> None:
    assert main(argv) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert says in line


def test_an_imported_robot_without_any_shapes_is_drawn_too(tmp_path: Path, capsys: Capture) -> None:
    text = (ROBOTS_FILES / "gantry_arm.urdf").read_text()
    stripped = re.sub(r"<collision>.*?</collision>", "", text)
    source = f"{tmp_path}/bare.urdf"
    Path(source).write_text(stripped)
    assert main(["import", source, "--yes", "-o", f"{tmp_path}/bare.yaml"]) == 0
    robot = robot_of_file(f"{tmp_path}/bare.yaml")
    assert robot.collision == {}
    assert {shape.link for shape in robot_visuals(robot).shapes} == set(robot.links)
    assert len(drawing.draw(robot)) > 500
