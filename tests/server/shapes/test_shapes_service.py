"""What robots look like and their meshes, as a pendant asks, on the virtual clock."""

import base64
import hashlib
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from promises.promise_table import figure
from rigs.cells.emulated_cell import EmulatedCell
from rigs.cells.server_rig import ready
from rigs.data.mesh_files import meshed_robot, prism, stl
from rigs.motion.loaded_robots import serial_robot

from openpendant.motion.description.robot import SerialRobot, load_robot, robot_names
from openpendant.motion.description.schema import MESH_FOLDER
from openpendant.motion.kinematics.pinocchio_model import model_map
from openpendant.motion.kinematics.serial import Kinematics
from openpendant.motion.pose import Array, Pose
from openpendant.motion.robot_report.shapes_report import shapes_report
from openpendant.server.access.connection_loads import ConnectionLoad, LoadQuestion
from openpendant.server.events.effects import Ask, Cancel
from openpendant.server.events.events import Answered, Closed, Received
from openpendant.server.planning.jobs import PlanAnswer, ShapesFound, ShapesQuestion
from openpendant.server.planning.worker.shapes_answers import answer_shapes
from openpendant.simplemsg.pendant import Capability, HelloReply, Management
from openpendant.simplemsg.pendant.management.shapes import ReadMesh, ShowShapes
from openpendant.simplemsg.verdicts import VerdictCode as V
from openpendant.tools.cli import main

UNREAD = figure(43, "unread").bytes


@pytest.fixture(scope="module")
def meshed(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, bytes]:
    """An imported robot that is shown by a mesh of 80,084 bytes, and these."""
    folder = tmp_path_factory.mktemp("meshed")
    points, faces = prism(401, 0.1, 0.3)
    content = stl(points, faces)
    urdf = meshed_robot(folder, {"part.stl": content})
    target = folder / "meshed.yaml"
    assert main(["robots", "import", str(urdf), "--yes", "-o", str(target)]) == 0
    return target, content


class AskedCell:
    """A cell with surroundings and a pendant that looks on."""

    def __init__(self, robot: str = "ur5") -> None:
        self.cell = EmulatedCell(robot, has_surroundings=True)
        self.pendant = self.cell.stranger()
        (welcome,) = (m for m in self.pendant.hello() if isinstance(m, HelloReply))
        self.offers = Capability(welcome.capabilities)
        self.cell.wait(50)

    def ask(self, op: str, **fields: Any) -> dict[str, Any]:
        """Ask; return the answer, which may be a refusal."""
        return self.pendant.ask(f"shapes.{op}", **fields)


@pytest.fixture(scope="module")
def asked() -> AskedCell:
    return AskedCell()


def test_the_capability_is_offered(asked: AskedCell) -> None:
    assert Capability.SHAPES in asked.offers


def test_a_cell_without_surroundings_offers_no_shapes_and_refuses_them() -> None:
    pendant = ready().stranger()
    (welcome,) = (m for m in pendant.hello() if isinstance(m, HelloReply))
    assert Capability.SHAPES not in Capability(welcome.capabilities)
    assert pendant.ask("shapes.show")["code"] == V.BAD_ARGUMENT


def test_show_tells_of_the_cells_own_robot_where_none_is_named(asked: AskedCell) -> None:
    told = asked.ask("show")
    assert told == json.loads(json.dumps(shapes_report(serial_robot("ur5"))))
    names = [joint["display_name"] for joint in told["joints"] if joint["driven"]]
    assert names[:3] == ["Base", "Lower-Arm", "Upper-Arm"]
    assert {link["mesh"] for link in told["links"]} == {None}


@pytest.mark.parametrize("name", robot_names())
def test_show_tells_of_each_robot_of_the_catalogue_within_a_frame(name: str) -> None:
    found = answer_shapes("ur5", ShowShapes(name))
    assert isinstance(found, ShapesFound)
    told = json.loads(found.body)
    assert told["robot"] == name
    assert told["shapes"]
    assert len(told["home"]) == load_robot(name).dof
    assert len(found.body) < 16_000
    body = {key: value for key, value in told.items() if key != "hash"}
    assert told["hash"] == hashlib.sha256(json.dumps(body, sort_keys=True).encode()).hexdigest()


def drawn(told: dict[str, Any], controller: dict[str, float]) -> dict[str, Array]:
    """Return the (4, 4) place of each link, by the rule that the answer states."""
    places = {told["links"][0]["link"]: np.eye(4)}
    for joint in told["joints"]:
        value = controller.get(joint["name"], 0.0) if joint["driven"] else 0.0
        value += joint["offset"]
        value += sum(each["gain"] * controller[each["joint"]] for each in joint["coupled_to"])
        moved = np.eye(4)
        if joint["type"] == "prismatic":
            moved[:3, 3] = value * np.array(joint["axis"])
        elif joint["type"] == "revolute":
            axis = np.array(joint["axis"]) / np.linalg.norm(joint["axis"])
            quaternion = [*(np.sin(value / 2.0) * axis), np.cos(value / 2.0)]
            moved = Pose.from_values((0, 0, 0), quaternion).to_matrix()
        origin = Pose.from_values(joint["xyz"], joint["quat"]).to_matrix()
        places[joint["child"]] = places[joint["parent"]] @ origin @ moved
    return places


@pytest.mark.parametrize(
    "name", [name for name in robot_names() if isinstance(load_robot(name), SerialRobot)]
)
def test_a_page_that_follows_the_joints_draws_the_tool_where_it_is(name: str) -> None:
    robot = serial_robot(name)
    told = shapes_report(robot)
    chance = np.random.default_rng(7)
    position = chance.uniform(robot.limits.lower, robot.limits.upper) * 0.9
    values = dict(zip((joint.name for joint in robot.driven), position.tolist(), strict=True))
    found = drawn(told, values)[robot.tool_link]
    kinematics = Kinematics(robot)
    root_in_base = kinematics.to_base(Pose.identity(), "root")
    exact = root_in_base.inverse().compose(kinematics.forward(position)).to_matrix()
    assert found == pytest.approx(exact, abs=1e-9)
    # So that the coupled and the dependent ones are among what is tried.
    assert (model_map(robot)[0].shape[0]) == sum(1 for each in told["joints"] if each["axis"])


@pytest.mark.parametrize("name", ["nobody", "../ur5", "/etc/passwd", "", "x" * 65])
def test_show_of_no_robot_of_the_catalogue_is_refused(asked: AskedCell, name: str) -> None:
    told = asked.ask("show", robot=name)
    assert told["code"] == V.BAD_ARGUMENT


def test_show_takes_no_path_of_a_robot_file(meshed: tuple[Path, bytes]) -> None:
    found = answer_shapes("ur5", ShowShapes(str(meshed[0])))
    assert not isinstance(found, ShapesFound)
    assert found.code is V.BAD_ARGUMENT


def test_what_the_cells_own_robot_looks_like_is_answered_at_once(asked: AskedCell) -> None:
    core, session = asked.cell.core, asked.pendant.session
    received = Received(session, Management(9, b'{"op":"shapes.show"}'))
    out = core.handle(received, asked.cell.now)
    assert not [each for each in out if isinstance(each, Ask)]


def test_an_answer_is_worked_out_once(asked: AskedCell) -> None:
    first = asked.ask("show", robot="puma560")
    core, session = asked.cell.core, asked.pendant.session
    body = b'{"op":"shapes.show","robot":"puma560"}'
    out = core.handle(Received(session, Management(9, body)), asked.cell.now)
    assert not [each for each in out if isinstance(each, Ask)]
    assert asked.ask("show", robot="puma560") == first


def test_a_robot_of_the_catalogue_has_no_meshes(asked: AskedCell) -> None:
    assert asked.ask("meshes") == {"meshes": []}
    assert asked.ask("mesh", hash="0" * 64)["code"] == V.UNKNOWN_MESH


def test_meshes_tells_where_each_mesh_of_an_imported_robot_is(meshed: tuple[Path, bytes]) -> None:
    file, content = meshed
    cell = AskedCell(str(file))
    (mesh,) = cell.ask("meshes")["meshes"]
    name = hashlib.sha256(content).hexdigest()
    assert (mesh["hash"], mesh["bytes"], mesh["form"]) == (name, len(content), "stl")
    assert mesh["unit_scale"] == [1.0, 1.0, 1.0]
    assert mesh["links"] == [{"link": "b", "xyz": [0.0] * 3, "quat": [0.0, 0.0, 0.0, 1.0]}]
    links = {link["link"]: link["mesh"] for link in cell.ask("show")["links"]}
    assert links == {"a": None, "b": name, "c": None, "d": None}


def test_promise_43_the_chunks_of_a_mesh_are_its_bytes(meshed: tuple[Path, bytes]) -> None:
    file, content = meshed
    cell = AskedCell(str(file))
    name = hashlib.sha256(content).hexdigest()
    found, has_more = b"", True
    while has_more:
        told = cell.ask("mesh", hash=name, offset=len(found))
        assert (told["bytes_total"], told["offset"]) == (len(content), len(found))
        data = base64.b64decode(told["data"])
        assert len(data) <= 32_768
        found, has_more = found + data, told["more"]
        cell.cell.wait(50)
    assert hashlib.sha256(found).hexdigest() == name
    assert found == content


@pytest.mark.parametrize(
    ("past", "code"), [(0, None), (1, V.BAD_ARGUMENT), (1 << 80, V.BAD_ARGUMENT)]
)
def test_an_offset_is_within_the_mesh(
    meshed: tuple[Path, bytes], past: int, code: V | None
) -> None:
    file, content = meshed
    asked = ReadMesh(hashlib.sha256(content).hexdigest(), len(content) + past)
    found = answer_shapes(str(file), asked)
    if code is None:
        assert isinstance(found, ShapesFound)
        assert (json.loads(found.body)["data"], json.loads(found.body)["more"]) == ("", False)
    else:
        assert not isinstance(found, ShapesFound)
        assert found.code is code


@pytest.mark.parametrize("name", ["0" * 64, "../meshed.yaml", "/etc/passwd", "", "*"])
def test_a_mesh_that_is_none_of_this_robot_is_refused(
    meshed: tuple[Path, bytes], name: str
) -> None:
    found = answer_shapes(str(meshed[0]), ReadMesh(name))
    assert not isinstance(found, ShapesFound)
    assert found.code is V.UNKNOWN_MESH


def test_a_mesh_whose_file_is_gone_or_short_is_refused(
    meshed: tuple[Path, bytes], tmp_path: Path
) -> None:
    file, content = meshed
    name = hashlib.sha256(content).hexdigest()
    copied = tmp_path / "copied.yaml"
    copied.write_bytes(file.read_bytes())
    gone = answer_shapes(str(copied), ReadMesh(name))
    (tmp_path / MESH_FOLDER).mkdir()
    (tmp_path / MESH_FOLDER / f"{name}.stl").write_bytes(content[:100])
    short = answer_shapes(str(copied), ReadMesh(name, 100))
    for found in (gone, short):
        assert not isinstance(found, ShapesFound)
        assert found.code is V.UNKNOWN_MESH


def test_a_connection_gets_so_many_chunks_a_second(asked: AskedCell) -> None:
    asked.cell.wait(1_000)
    codes = []
    for _ in range(200):
        codes.append(asked.ask("mesh", hash="0" * 64)["code"])
        asked.cell.wait(10)
    assert set(codes) == {V.UNKNOWN_MESH, V.TOO_OFTEN}
    # Two at once, and one each 50 ms for 2 s.
    assert codes.count(V.UNKNOWN_MESH) in (40, 41, 42)


def test_a_refusal_tells_how_long_to_wait(asked: AskedCell) -> None:
    asked.cell.wait(1_000)
    told = [asked.ask("mesh", hash="0" * 64) for _ in range(3)][-1]
    assert (told["code"], told["limit"]) == (V.TOO_OFTEN, 20.0)
    assert told["value"] == pytest.approx(0.05, abs=0.011)


def test_promise_43_of_a_mesh_one_chunk_at_a_time_is_under_way() -> None:
    cell = AskedCell()
    core, session, now = cell.cell.core, cell.pendant.session, cell.cell.now

    def asked_by(number: int) -> list[Ask]:
        body = json.dumps({"op": "shapes.mesh", "hash": "0" * 64}).encode()
        out = core.handle(Received(session, Management(number, body)), now)
        return [each for each in out if isinstance(each, Ask)]

    (measuring,) = asked_by(7)
    assert isinstance(measuring.question, LoadQuestion)
    out = core.handle(Answered(measuring, {session: ConnectionLoad()}), now)
    (reading,) = [each for each in out if isinstance(each, Ask)]
    assert isinstance(reading.question, ShapesQuestion)
    assert asked_by(8) == []
    # Once it is answered the next may come.
    core.handle(Answered(reading, PlanAnswer(reading.id, ShapesFound("{}"), 0.0)), now)
    assert asked_by(9)


def test_promise_43_no_chunk_is_added_to_so_many_unread_bytes() -> None:
    cell = AskedCell()
    codes = []
    room = UNREAD - 43_948  # base64 of a chunk, and the rest of its frame
    for unread in (room, room + 1, 1 << 20, 0):
        cell.cell.unread = unread
        cell.cell.wait(100)
        codes.append(cell.ask("mesh", hash="0" * 64)["code"])
    assert codes == [V.UNKNOWN_MESH, V.TOO_OFTEN, V.TOO_OFTEN, V.UNKNOWN_MESH]


def test_a_frame_with_a_whole_chunk_is_as_large_as_is_counted() -> None:
    told = {"bytes_total": 1 << 25, "offset": 1 << 25, "data": "", "more": False}
    head = len(json.dumps(told).encode()) + 4 * 4 + 64
    assert head < 256


def test_what_a_connection_asked_is_withdrawn_when_it_ends() -> None:
    cell = AskedCell()
    core, session, now = cell.cell.core, cell.pendant.session, cell.cell.now
    body = b'{"op":"shapes.show","robot":"epson_c3"}'
    out = core.handle(Received(session, Management(7, body)), now)
    (asking,) = [each for each in out if isinstance(each, Ask)]
    assert Cancel(asking.id) in core.handle(Closed(session), now)


def test_other_answers_are_counted_too(asked: AskedCell) -> None:
    asked.cell.wait(3_000)
    codes = [asked.ask("meshes").get("code") for _ in range(60)]
    assert codes[:24] == [None] * 24
    assert V.TOO_OFTEN in codes
