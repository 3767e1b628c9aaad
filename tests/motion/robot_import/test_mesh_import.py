"""Meshes of an imported robot: kept under their hash within bounds, and hulls for collision."""

import hashlib
import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rigs.data.mesh_files import CUBE_FACES, collision, cube, meshed_robot, obj, prism, stl
from rigs.data.urdf_files import SOUND, written

from openpendant.motion.description.robot import load_robot, robot_from_content, serial_robot
from openpendant.motion.description.schema import MESH_FOLDER, BoxFacts, HullFacts
from openpendant.motion.errors import MeshFileError, RobotFileError
from openpendant.motion.kinematics.serial import Kinematics
from openpendant.motion.robot_import import mesh_keeping
from openpendant.motion.robot_import.hull_process import NoHull, hull_of
from openpendant.motion.robot_import.mesh_keeping import MeshKeeper, stored_meshes
from openpendant.motion.robot_import.urdf import UrdfLink, read_urdf
from openpendant.motion.robot_import.urdf_tree import chain_to
from openpendant.motion.scene.collision import CollisionModel, link_geometry
from openpendant.motion.scene.scene import Box, Scene, SceneObject
from openpendant.tools.cli import main


def link_b(folder: Path, content: bytes, name: str = "part.stl") -> UrdfLink:
    """Return the link whose collision shape is a mesh, as it is read by an import."""
    aside = folder / "aside"
    aside.mkdir()
    return read_urdf(meshed_robot(folder, {name: content}), MeshKeeper(aside)).links["b"]


def imported(
    folder: Path, capsys: pytest.CaptureFixture[str], urdf: Path, *more: str
) -> tuple[Path, list[str]]:
    """Import a description; return its robot file, and the lines of the output."""
    target = folder / "robot.yaml"
    assert main(["robots", "import", str(urdf), "--yes", "-o", str(target), *more]) == 0
    return target, capsys.readouterr().out.splitlines()


def test_a_mesh_becomes_its_convex_hull(tmp_path: Path) -> None:
    points, faces = prism(8, 0.1, 0.3)
    link = link_b(tmp_path, stl(points, faces))
    (shape,) = link.shapes
    assert isinstance(shape, HullFacts)
    assert sorted(shape.size) == pytest.approx([0.2, 0.2, 0.3], abs=1e-6)
    assert "enclosed in its convex hull of 16 points" in link.remarks[0]


@pytest.mark.parametrize(
    ("points", "why"),
    [
        pytest.param(cube((0.2, 0.1, 0.0)), "thin", id="flat"),
        pytest.param(cube((0.2, 0.1, 0.00009)), "0.09 mm thin", id="thinner than 0.1 mm"),
        pytest.param(cube((0.2, 0.0, 0.0)), "thin", id="of one line"),
        pytest.param(cube((0.0, 0.0, 0.0)), "0 mm thin", id="of coincident points"),
    ],
)
def test_a_mesh_without_a_hull_keeps_its_box(tmp_path: Path, points: Any, why: str) -> None:
    link = link_b(tmp_path, stl(points))
    (shape,) = link.shapes
    assert isinstance(shape, BoxFacts)
    assert "keeps its box" in link.remarks[0]
    assert why in link.remarks[0]


def test_a_slanted_plate_keeps_its_box_too(tmp_path: Path) -> None:
    turn = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]
    link = link_b(tmp_path, obj(cube((0.2, 0.1, 0.00005)) @ turn.T), "plate.obj")
    assert isinstance(link.shapes[0], BoxFacts)


def test_the_process_for_hulls_says_of_flat_points_that_they_have_none() -> None:
    with pytest.raises(NoHull, match="flat, in a line or coincident"):
        hull_of(cube((0.2, 0.1, 0.0)))


def test_a_hull_is_around_all_points() -> None:
    points = np.random.default_rng(1).normal(size=(300, 3))
    hull = hull_of(points)
    first, second, third = (hull.vertices[hull.corners[:, each]] for each in range(3))
    normals = np.cross(second - first, third - first)
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    beyond = np.einsum("fi,kfi->kf", normals, points[:, None] - first[None])
    assert beyond.max() <= 1e-12
    assert beyond.min() < -1.0


def test_a_process_that_dies_is_a_mesh_without_a_hull(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.executable", "/bin/false")
    with pytest.raises(NoHull, match="ended with code 1"):
        hull_of(cube())


def test_a_process_that_takes_too_long_is_one_too(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("openpendant.motion.robot_import.hull_process.LONGEST", 0.01)
    with pytest.raises(NoHull, match=r"not found in 0\.01 s"):
        hull_of(cube())


def test_a_hull_of_too_many_points_is_none(monkeypatch: pytest.MonkeyPatch) -> None:
    from openpendant.motion.robot_import import hull_process

    monkeypatch.setattr(hull_process, "MAX_HULL_POINTS", 7)
    with pytest.raises(ValueError, match="has 8 points; accepted: 7"):
        hull_process.faces_of(cube())


@pytest.mark.parametrize(
    ("name", "content", "told"),
    [
        ("part.stl", b"\x7fELF" + bytes(200), "counts 0 triangles"),
        ("part.stl", bytes(80) + (10_000_000).to_bytes(4, "little"), "counts 10000000 triangles"),
        ("part.stl", stl(np.full((8, 3), np.nan)), "not a finite number"),
        ("part.dae", b"<COLLADA/>", "COLLADA, which no library here converts"),
        ("part.glb", b"glTF", "accepted: .stl or .obj"),
    ],
)
def test_what_is_no_mesh_leaves_a_remark_and_no_shape(
    tmp_path: Path, name: str, content: bytes, told: str
) -> None:
    link = link_b(tmp_path, content, name)
    assert link.shapes == ()
    assert link.meshes == ()
    assert told in link.remarks[0]


def test_a_mesh_of_ten_million_facets_is_refused_by_its_count(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(mesh_keeping, "MAX_MESH_BYTES", 1 << 30)
    path = tmp_path / "many.stl"
    with path.open("wb") as file:
        file.write(bytes(80) + (10_000_000).to_bytes(4, "little"))
        file.truncate(84 + 50 * 500_001)
    with pytest.raises(MeshFileError, match="10000000 triangles"):
        mesh_keeping.read_mesh_content(path)


def test_a_file_of_200_mb_is_refused_unread(tmp_path: Path) -> None:
    urdf = meshed_robot(tmp_path, {"part.stl": b""})
    with (tmp_path / "part.stl").open("wb") as file:
        file.truncate(200_000_000)
    link = read_urdf(urdf, MeshKeeper(tmp_path)).links["b"]
    assert f"larger than {32 << 20} bytes" in link.remarks[0]


def test_a_robot_has_so_many_bytes_of_meshes_at_most(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    one, two = stl(cube()), stl(cube((0.2, 0.1, 0.1)))
    monkeypatch.setattr(mesh_keeping, "MAX_ROBOT_BYTES", len(one) + len(two) - 1)
    # The same file twice counts once.
    elements = {"a": collision("1.stl"), "b": collision("2.stl"), "c": collision("1.stl")}
    keeper = MeshKeeper(tmp_path)
    chain = chain_to(
        read_urdf(meshed_robot(tmp_path, {"1.stl": one, "2.stl": two}, elements), keeper), "d"
    )
    assert [mesh.link for mesh in chain.meshes] == ["a", "c"]
    assert set(chain.collision) == {"a", "b", "c"}


def test_a_folder_of_meshes_has_so_many_bytes_at_most(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    aside, folder = tmp_path / "aside", tmp_path / "meshes"
    aside.mkdir()
    folder.mkdir()
    (folder / "other.stl").write_bytes(bytes(60))
    (aside / "new.stl").write_bytes(bytes(50))
    content = {"meshes": [{"hash": "new", "form": "stl"}]}
    monkeypatch.setattr(mesh_keeping, "MAX_STORE_BYTES", 109)
    with (
        pytest.raises(RobotFileError, match="would have 110 bytes; accepted: 109"),
        stored_meshes(content, aside, folder, "r.urdf"),
    ):
        pytest.fail("it was begun")
    assert [each.name for each in folder.iterdir()] == ["other.stl"]
    monkeypatch.setattr(mesh_keeping, "MAX_STORE_BYTES", 110)
    for _ in range(2):  # what is there counts once
        with stored_meshes(content, aside, folder, "r.urdf"):
            pass
    assert (folder / "new.stl").read_bytes() == bytes(50)


def contents(folder: Path) -> dict[str, bytes | None]:
    return {
        str(each.relative_to(folder)): None if each.is_dir() else each.read_bytes()
        for each in folder.rglob("*")
    }


@pytest.mark.parametrize("has_meshes", [False, True])
def test_an_import_that_is_refused_for_a_file_that_is_there_leaves_nothing(
    has_meshes: bool, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    urdf = meshed_robot(tmp_path, {"part.stl": stl(prism(5, 0.1, 0.3)[0], prism(5, 0.1, 0.3)[1])})
    target = tmp_path / "robot.yaml"
    target.write_text("mine")
    if has_meshes:
        (tmp_path / MESH_FOLDER).mkdir()
        (tmp_path / MESH_FOLDER / "other.stl").write_bytes(stl(cube()))
    before = contents(tmp_path)
    assert main(["robots", "import", str(urdf), "-o", str(target)]) == 2
    assert "accepted: a new file, or --yes" in capsys.readouterr().err
    assert contents(tmp_path) == before


def test_a_mesh_that_was_there_stays_where_an_import_fails(tmp_path: Path) -> None:
    aside, folder = tmp_path / "aside", tmp_path / "meshes"
    for each in (aside, folder):
        each.mkdir()
        (each / "shared.stl").write_bytes(bytes(5))
    (aside / "new.stl").write_bytes(bytes(6))
    meshes = [{"hash": "shared", "form": "stl"}, {"hash": "new", "form": "stl"}]
    before = contents(folder)
    stored = stored_meshes({"meshes": meshes}, aside, folder, "r.urdf")
    stored.__enter__()
    assert contents(folder) == before | {"new.stl": bytes(6)}
    assert not stored.__exit__(KeyboardInterrupt, KeyboardInterrupt(), None)
    assert contents(folder) == before


def test_a_disk_that_is_full_leaves_no_half_of_a_mesh(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    aside, folder = tmp_path / "aside", tmp_path / "meshes"
    aside.mkdir()
    for name in ("a.stl", "b.stl"):
        (aside / name).write_bytes(bytes(9))

    def copy(source: Path, target: Path) -> None:
        target.write_bytes(bytes(4 if source.name == "b.stl" else 9))
        if source.name == "b.stl":
            raise OSError(28, "No space left on device")

    monkeypatch.setattr("shutil.copyfile", copy)
    meshes = [{"hash": "a", "form": "stl"}, {"hash": "b", "form": "stl"}]
    with (
        pytest.raises(RobotFileError, match="No space left"),
        stored_meshes({"meshes": meshes}, aside, folder, "r.urdf"),
    ):
        pytest.fail("it was begun")
    assert not folder.exists()


def test_promise_43_a_mesh_is_kept_byte_for_byte_under_its_hash(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    content = stl(cube())
    target, lines = imported(tmp_path, capsys, meshed_robot(tmp_path, {"part.stl": content}))
    robot = serial_robot(target)
    (mesh,) = robot.meshes
    assert mesh.hash == hashlib.sha256(content).hexdigest()
    assert (tmp_path / MESH_FOLDER / mesh.file_name).read_bytes() == content
    assert (mesh.link, mesh.bytes, mesh.scale) == ("b", len(content), (1.0, 1.0, 1.0))
    assert lines[-1].startswith("kept 1 meshes of 0.0 MiB in ")


def test_the_folder_of_meshes_of_the_description_gets_no_file_from_an_import(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "meshes").mkdir()
    files = {"meshes/part.stl": stl(cube())}
    target, _ = imported(tmp_path, capsys, meshed_robot(tmp_path, files))
    assert len(serial_robot(target).meshes) == 1
    assert [each.name for each in (tmp_path / "meshes").iterdir()] == ["part.stl"]


def test_an_import_that_finds_no_mesh_says_so_in_its_last_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    _, lines = imported(tmp_path, capsys, written(tmp_path, SOUND))
    assert lines[-1] == "no mesh was found: simple shapes show the robot"
    assert not (tmp_path / MESH_FOLDER).exists()


def test_an_import_of_refused_meshes_names_each_and_the_links_that_are_not_checked(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    many = bytes(80) + (10_000_000).to_bytes(4, "little")
    files = {"many.stl": many, "large.stl": b"", "part.dae": b"<COLLADA/>"}
    elements = {
        link: collision(name) + collision(name, tag="visual")
        for link, name in zip("abc", files, strict=True)
    }
    urdf = meshed_robot(tmp_path, files, elements)
    with (tmp_path / "large.stl").open("wb") as file:
        file.truncate(200_000_000)
    _, lines = imported(tmp_path, capsys, urdf)
    verdict = next(line for line in lines if line.startswith("wrote "))
    assert verdict.endswith(": good, but no collision is found of a, b, c, d: no shapes")
    why = ("counts 10000000 triangles", f"larger than {32 << 20} bytes", "COLLADA")
    for name, reason, line in zip(files, why, lines[-4:-1], strict=True):
        assert line.startswith(f"refused: mesh '{name}' ")
        assert reason in line
    assert lines[-1] == "no mesh was kept, 3 refused: simple shapes show the robot"


def test_an_import_that_keeps_one_mesh_of_two_says_both(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    files = {"part.stl": stl(cube()), "part.dae": b"<COLLADA/>"}
    elements = {"b": collision("part.stl"), "c": collision("part.dae")}
    _, lines = imported(tmp_path, capsys, meshed_robot(tmp_path, files, elements))
    assert any(
        line.endswith("good, but no collision is found of a, c, d: no shapes") for line in lines
    )
    assert lines[-1].startswith("kept 1 meshes of 0.0 MiB in ")
    assert lines[-1].endswith("; 1 refused")


def test_a_refused_mesh_of_a_link_that_has_a_shape_leaves_it_good(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    box = '<collision><geometry><box size="0.1 0.1 0.1"/></geometry></collision>'
    elements = dict.fromkeys("abcd", box) | {"b": box + collision("part.dae", tag="visual")}
    urdf = meshed_robot(tmp_path, {"part.dae": b"<COLLADA/>"}, elements)
    _, lines = imported(tmp_path, capsys, urdf)
    assert any(line.startswith("wrote ") and line.endswith(": good") for line in lines)


def test_meshes_of_visual_are_shown_and_those_of_collision_only_without(tmp_path: Path) -> None:
    colour = '<material name="m"><color rgba="1 0.5 0 1"/></material>'
    place = '<origin xyz="0 0 0.5" rpy="0 0 0"/>'
    shown = collision("seen.obj", place + colour, "visual")
    elements = {"b": shown + collision("part.stl"), "c": collision("part.stl")}
    files = {"part.stl": stl(cube()), "seen.obj": obj(cube())}
    chain = chain_to(read_urdf(meshed_robot(tmp_path, files, elements), MeshKeeper(tmp_path)), "d")
    first, second = chain.meshes
    assert (first.link, first.form, first.colour, first.xyz) == (
        "b",
        "obj",
        "#ff8000",
        (0.0, 0.0, 0.5),
    )
    assert (second.link, second.form, second.colour) == ("c", "stl", None)
    assert len(chain.collision["b"]) == 1


RED = '<material name="paint"><color rgba="1 0 0 1"/></material>'
BLUE = '<material name="paint"><color rgba="0 0 1 1"/></material>'
PAINT, OTHER = '<material name="paint"/>', '<material name="none"/>'


@pytest.mark.parametrize(
    ("of_robot", "of_links", "colours"),
    [
        pytest.param(RED, (PAINT, PAINT), ("#ff0000", "#ff0000"), id="of the robot, by name"),
        pytest.param(RED, (BLUE, PAINT), ("#0000ff", "#ff0000"), id="its own before the robot's"),
        pytest.param("", (RED, PAINT), ("#ff0000", "#ff0000"), id="of another link, by name"),
        pytest.param("", (PAINT, RED), ("#ff0000", "#ff0000"), id="of a link further down"),
        pytest.param(RED + BLUE, (PAINT, ""), ("#ff0000", None), id="the first of two"),
        pytest.param(RED, (OTHER, ""), (None, None), id="one that is not there"),
        pytest.param(PAINT, (PAINT, ""), (None, None), id="one without a colour"),
        pytest.param(RED, ("<material/>", ""), (None, None), id="one without a name"),
    ],
)
def test_a_material_that_is_referred_to_by_name_is_found(
    of_robot: str, of_links: tuple[str, str], colours: tuple[str | None, ...], tmp_path: Path
) -> None:
    elements = {
        link: collision("part.stl", material, "visual")
        for link, material in zip("bc", of_links, strict=True)
    }
    urdf = meshed_robot(tmp_path, {"part.stl": stl(cube())}, elements)
    urdf.write_text(urdf.read_text().replace("<link", f"{of_robot}<link", 1))
    aside = tmp_path / "aside"
    aside.mkdir()
    links = read_urdf(urdf, MeshKeeper(aside)).links
    assert tuple(links[each].meshes[0].colour for each in "bc") == colours


def test_a_colour_that_is_none_is_refused_at_the_mesh_that_it_shows(tmp_path: Path) -> None:
    bad = '<material name="paint"><color rgba="1 0"/></material>'
    elements = {"b": collision("part.stl", PAINT, "visual")}
    urdf = meshed_robot(tmp_path, {"part.stl": stl(cube())}, elements)
    urdf.write_text(urdf.read_text().replace("<link", f"{bad}<link", 1))
    aside = tmp_path / "aside"
    aside.mkdir()
    link = read_urdf(urdf, MeshKeeper(aside)).links["b"]
    assert link.meshes == ()
    assert "it is not shown" in link.remarks[-1]


def test_the_collision_model_uses_the_hull_and_not_its_box(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    # The post touches the corner of the box, and one of the eight edges of the prism is 16 mm off.
    points, faces = prism(8, 0.1, 0.3)
    target, _ = imported(tmp_path, capsys, meshed_robot(tmp_path, {"p.stl": stl(points, faces)}))
    robot = serial_robot(target)
    kinematics = Kinematics(robot)
    (shape,) = robot.collision["b"]
    assert isinstance(shape, HullFacts)
    edge = SceneObject("post", Box((0.02, 0.02, 0.02)), (0.1 + 0.092, 0.092, 0.2))
    found = CollisionModel(kinematics, Scene((edge,))).distance([0.0, 0.0, 0.0])
    assert found is not None
    assert found.distance == pytest.approx(0.082 * math.sqrt(2.0) - 0.1, abs=1e-5)


def test_a_hull_whose_file_was_changed_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    target, _ = imported(tmp_path, capsys, meshed_robot(tmp_path, {"p.stl": stl(cube())}))
    (shape,) = serial_robot(target).collision["b"]
    assert isinstance(shape, HullFacts)
    shape.file.write_bytes(shape.file.read_bytes().replace(b"v ", b"v 1", 1))
    with pytest.raises(MeshFileError, match="import the robot again"):
        link_geometry(shape)


def test_a_robot_file_may_name_no_path_as_a_mesh(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    target, _ = imported(tmp_path, capsys, meshed_robot(tmp_path, {"p.stl": stl(cube())}))
    told = load_robot(target).model_dump(mode="json", by_alias=True)
    told["meshes"][0]["hash"] = "../../etc/passwd"
    with pytest.raises(RobotFileError, match="meshes"):
        robot_from_content(json.loads(json.dumps(told)), str(target))


def test_the_faces_of_the_cube_of_these_tests_look_outwards() -> None:
    points = cube()
    for face in CUBE_FACES:
        a, b, c = points[list(face)]
        assert np.cross(b - a, c - a) @ a > 0.0
