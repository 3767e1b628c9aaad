"""What a cell takes and leaves: what is demanded, told, and shown by a part sensor (promise 36)."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from rigs.cells.surrounded_cell import SurroundedCell, robot

from openpendant.motion.kinematics.serial import Kinematics
from openpendant.motion.pose import Pose
from openpendant.server.events.cell_events import RunningProgram
from openpendant.server.refusal import Refusal
from openpendant.server.store.documents import DocumentKind
from openpendant.server.store.store_errors import DiskFull
from openpendant.simplemsg import ReplyCode, accepted, refused
from openpendant.simplemsg.pendant import Capability, ProgramState, ReadSignalsReply, SetInputs
from openpendant.simplemsg.verdicts import VerdictCode as V

UNTURNED = (0.0, 0.0, 0.0, 1.0)
TCP = (0.0, 0.0, 0.12)
TIP = (
    Kinematics(robot()).forward(robot().home_position).compose(Pose.from_values(TCP, UNTURNED))
).position.tolist()
PART = 3


class GrippingCell(SurroundedCell):
    """A cell whose robot has a gripper with a reach of 20 mm and a part sensor."""

    def __init__(
        self, folder: Path, *, file: bool = False, controller: bool = False, apart: bool = False
    ) -> None:
        """Begin with a controller that is emulated by the word of its cell's file, or its own."""
        super().__init__(folder, is_told_emulated=file, reads_apart=apart)
        self.cell.feedback.says_emulated = controller
        self.report()
        grasp = {"reach": 0.02, "part": PART}
        self.ask(
            "tools.add", name="gripper", tcp={"position": TCP}, grasp=grasp, expected_revision=0
        )
        self.ask("tools.select", name="gripper", expected_revision=1)
        self.around.signals.link_changed(True, self.now)
        self.perform(self.around.signals.tick(self.now))
        told = ReadSignalsReply(0, 0, 0, 16, 16, reply_code=ReplyCode.SUCCESS)
        self.perform(self.around.signals.answered(told, self.now))
        self.queries.clear()
        self.report()

    @property
    def revision(self) -> int:
        return self.around.world.revisions[DocumentKind.SCENE]

    def put(self, name: str, beside: float) -> None:
        """Add a ball of 10 mm whose nearest point is so far from the grasp point [m]."""
        x, y, z = TIP
        shape = {"type": "sphere", "radius": 0.01}
        thing = {"name": name, "shape": shape, "position": [x, y + 0.01 + beside, z]}
        self.ask("scene.add", object=thing, expected_revision=self.revision)

    def take(self, name: str = "ball", **fields: Any) -> dict[str, Any]:
        fields = {"expected_revision": self.revision, **fields}
        return self.ask("scene.attach", name=name, **fields)

    def refusal(self, op: str, name: str = "ball", **fields: Any) -> dict[str, Any]:
        """Ask for what is refused, and changes nothing; return the answer."""
        before, revision = self.mathematics.scene, self.revision
        self.refused(op, name=name, **{"expected_revision": self.revision, **fields})
        assert (self.mathematics.scene, self.revision) == (before, revision)
        return self.answers[-1][1]

    @property
    def shown(self) -> list[tuple[int, int]]:
        """Input and value of each message that set one."""
        sets = [each for each in self.queries if isinstance(each, SetInputs)]
        return [(each.first + each.mask.bit_length() - 1, int(bool(each.values))) for each in sets]


@pytest.fixture
def cell(tmp_path: Path) -> Iterator[GrippingCell]:
    made = GrippingCell(tmp_path)
    yield made
    made.store.close()


def test_a_grasp_within_reach_is_told_with_its_distance_and_pose(cell: GrippingCell) -> None:
    cell.put("ball", 0.019)
    taken = cell.take()
    assert taken["revision"] == 2
    assert taken["distance"] == pytest.approx(0.019, abs=1e-9)
    tool = Pose.from_values(*cell.mathematics.tool_pose(robot().home_position))
    held = Pose.from_values(taken["grasp"]["position"], taken["grasp"]["orientation"])
    x, y, z = TIP
    assert tool.compose(held).position.tolist() == pytest.approx([x, y + 0.029, z])


def test_what_is_beyond_reach_stays_and_the_refusal_says_how_far(cell: GrippingCell) -> None:
    cell.put("ball", 0.06)
    answer = cell.refusal("scene.attach")
    assert answer["code"] == V.NOTHING_GRIPPED
    assert answer["value"] == pytest.approx(0.06, abs=1e-6)
    assert answer["limit"] == 0.02
    assert answer["text"] == "gripper is 60.0 mm from ball; reach 20 mm"


def test_what_is_held_is_not_taken_and_what_stands_not_left(cell: GrippingCell) -> None:
    cell.put("ball", 0.0)
    assert cell.refusal("scene.detach")["code"] == V.NOT_HELD
    cell.take()
    cell.report()
    assert cell.refusal("scene.attach")["code"] == V.NOT_HELD
    assert "tool0 holds 'ball'" in cell.refusal("scene.attach")["text"]


@pytest.mark.parametrize("op", ["scene.attach", "scene.detach"])
def test_an_object_that_there_is_not_is_refused(cell: GrippingCell, op: str) -> None:
    assert cell.refusal(op, "nothing")["code"] == V.UNKNOWN_OBJECT


@pytest.mark.parametrize("op", ["scene.attach", "scene.detach"])
def test_joints_that_were_reported_long_ago_measure_nothing(cell: GrippingCell, op: str) -> None:
    cell.put("ball", 0.0)
    if op == "scene.detach":
        cell.take()
    cell.report()
    cell.now += 101_000_000
    answer = cell.refusal(op)
    assert (answer["code"], answer["text"]) == (
        V.FEEDBACK_STALE,
        "the last position report is 101 ms old",
    )
    cell.report()
    cell.now += 99_000_000
    cell.ask(op, name="ball", expected_revision=cell.revision)


@pytest.mark.parametrize("op", ["scene.attach", "scene.detach"])
def test_nothing_changes_hands_while_the_joints_move(cell: GrippingCell, op: str) -> None:
    cell.put("ball", 0.0)
    if op == "scene.detach":
        cell.take()
    cell.report(velocity=0.1)
    assert cell.refusal(op)["code"] == V.CHANGE_WHILE_MOVING


@pytest.mark.parametrize("op", ["scene.attach", "scene.detach"])
def test_nothing_changes_hands_for_a_pendant_while_a_program_runs(
    cell: GrippingCell, op: str
) -> None:
    cell.put("ball", 0.06)
    cell.cell.program = RunningProgram("main", ProgramState.RUNNING, 1, 1)
    answer = cell.refusal(op)
    assert answer["code"] == V.CHANGE_WHILE_MOVING
    assert "'main'" in answer["text"]


def test_a_grasp_names_the_revision_that_it_was_made_from(cell: GrippingCell) -> None:
    cell.put("ball", 0.0)
    assert cell.refusal("scene.attach", expected_revision=0)["code"] == V.REVISION_CONFLICT


def test_another_link_takes_from_its_origin(cell: GrippingCell) -> None:
    cell.put("ball", 0.0)
    answer = cell.refusal("scene.attach", link="wrist_1_link")
    assert answer["code"] == V.NOTHING_GRIPPED
    assert answer["limit"] == 0.01
    assert answer["text"].startswith("wrist_1_link is ")


def test_the_bare_flange_reaches_ten_millimetres(cell: GrippingCell) -> None:
    cell.ask("tools.select", name=None, expected_revision=2)
    cell.put("ball", 0.0)
    answer = cell.refusal("scene.attach")
    assert (answer["limit"], answer["text"][:7]) == (0.01, "flange ")


def test_a_moved_tool_has_the_grasp_of_the_request_or_the_default(cell: GrippingCell) -> None:
    cell.put("ball", 0.019)
    tcp = {"position": TCP}
    cell.ask("tools.move", name="gripper", tcp=tcp, expected_revision=2)
    assert cell.refusal("scene.attach")["limit"] == 0.01
    (tool,) = cell.ask("frames.show")["content"]["tools"]
    assert "grasp" not in tool
    cell.ask("tools.move", name="gripper", tcp=tcp, grasp={"reach": 0.02}, expected_revision=3)
    assert cell.take()["distance"] == pytest.approx(0.019, abs=1e-9)


def test_tools_travel_by_file_with_their_grasp(cell: GrippingCell) -> None:
    content = cell.ask("frames.show")["content"]
    assert content["tools"][0]["grasp"] == {"point": [0, 0, 0], "reach": 0.02, "part": PART}
    cell.ask("tools.import", content={**content, "selected_tool": None}, expected_revision=2)
    cell.ask("tools.import", content=content, expected_revision=3)
    assert cell.mathematics.frames.grasp.reach == 0.02


def test_a_grasp_is_there_after_a_restart(cell: GrippingCell, tmp_path: Path) -> None:
    cell.store.close()
    again = SurroundedCell(tmp_path)
    assert (again.mathematics.frames.grasp.reach, again.mathematics.frames.grasp.part) == (0.02, 3)
    again.store.close()


@pytest.mark.parametrize(
    "grasp", [{"reach": -1e-9}, {"reach": 0.0501}, {"part": 512}, {"point": [0, 0, 2e3]}]
)
def test_a_grasp_that_is_none_is_refused(cell: GrippingCell, grasp: dict[str, Any]) -> None:
    tcp = {"position": TCP}
    code, _ = cell.refused("tools.add", name="hand", tcp=tcp, grasp=grasp, expected_revision=2)
    assert code is V.BAD_ARGUMENT
    assert "hand" not in cell.mathematics.frames.frames


def test_a_cell_with_a_scene_offers_grasps(cell: GrippingCell) -> None:
    assert Capability.GRASP in cell.around.capabilities


# The other ways to a carried object.


def ball(beside: float, link: str = robot().tool_link) -> dict[str, Any]:
    """Return a ball of 10 mm whose nearest point is so far from the grasp point of its holder."""
    height = TCP[2] if link == robot().tool_link else 0.0
    shape = {"type": "sphere", "radius": 0.01}
    return {"name": "ball", "shape": shape, "position": [0, 0.01 + beside, height], "link": link}


def scene_of(*objects: dict[str, Any]) -> dict[str, Any]:
    return {"schema": "openpendant-scene/1", "objects": list(objects), "allowed": []}


def ways(thing: dict[str, Any]) -> list[tuple[str, dict[str, Any]]]:
    return [("scene.add", {"object": thing}), ("scene.import", {"content": scene_of(thing)})]


@pytest.fixture(params=[False, True], ids=["at once", "apart"])
def any_cell(tmp_path: Path, request: pytest.FixtureRequest) -> Iterator[GrippingCell]:
    made = GrippingCell(tmp_path, apart=request.param)
    yield made
    made.store.close()


@pytest.mark.parametrize("way", [0, 1], ids=["add", "import"])
@pytest.mark.parametrize(
    ("link", "reach"), [(robot().tool_link, 0.02), ("forearm_link", 0.01)], ids=["tool", "link"]
)
def test_a_held_object_beyond_reach_neither_is_added_nor_comes_by_file(
    any_cell: GrippingCell, way: int, link: str, reach: float
) -> None:
    op, fields = ways(ball(reach + 0.001, link))[way]
    any_cell.refused(op, expected_revision=0, **fields)
    told = any_cell.answers[-1][1]
    assert (told["code"], told["limit"]) == (V.NOTHING_GRIPPED, reach)
    assert told["value"] == pytest.approx(reach + 0.001, abs=1e-6)
    assert any_cell.mathematics.scene.objects == ()
    op, fields = ways(ball(reach - 0.001, link))[way]
    assert any_cell.ask(op, expected_revision=0, **fields)["revision"] == 1


def test_what_is_carried_already_stays_whatever_tool_is_selected(any_cell: GrippingCell) -> None:
    any_cell.ask("scene.add", object=ball(0.019), expected_revision=0)
    any_cell.ask("tools.select", name=None, expected_revision=2)
    content = any_cell.ask("scene.show")["content"]
    assert any_cell.ask("scene.import", content=content, expected_revision=1)["revision"] == 2


# The part sensor.


def rearrange(cell: GrippingCell, does: str) -> Refusal | None:
    """Take or leave the ball as a program does; return why it was refused."""
    told: list[Refusal | None] = []
    change = cell.around.attach if does == "attach" else cell.around.detach
    cell.perform(change("ball", cell.now, told.append))
    cell.until(lambda: bool(told))
    cell.report()
    return told[0]


@pytest.mark.parametrize(("file", "controller"), [(False, False), (True, False), (False, True)])
def test_what_may_be_a_real_controller_is_never_told_what_its_inputs_are(
    file: bool, controller: bool, tmp_path: Path
) -> None:
    cell = GrippingCell(tmp_path, file=file, controller=controller)
    cell.put("ball", 0.0)
    cell.take()
    cell.report()
    cell.ask("scene.detach", name="ball", expected_revision=cell.revision)
    cell.report()
    assert rearrange(cell, "attach") is None
    assert rearrange(cell, "detach") is None
    assert cell.shown == []
    cell.store.close()


@pytest.fixture
def emulated(tmp_path: Path) -> Iterator[GrippingCell]:
    made = GrippingCell(tmp_path, file=True, controller=True)
    yield made
    made.store.close()


def test_the_part_sensor_is_1_after_a_grasp_and_0_after_letting_go(emulated: GrippingCell) -> None:
    emulated.put("ball", 0.0)
    emulated.take()
    assert emulated.shown == [(PART, 1)]
    emulated.report()
    emulated.ask("scene.detach", name="ball", expected_revision=emulated.revision)
    assert emulated.shown == [(PART, 1), (PART, 0)]
    emulated.report()
    assert rearrange(emulated, "attach") is None
    assert rearrange(emulated, "detach") is None
    assert emulated.shown == [(PART, 1), (PART, 0)] * 2


@pytest.mark.parametrize("by_program", [False, True])
def test_the_part_sensor_is_0_after_a_miss(emulated: GrippingCell, by_program: bool) -> None:
    emulated.put("ball", 0.06)
    if by_program:
        missed = rearrange(emulated, "attach")
        assert missed is not None
        assert missed.code is V.NOTHING_GRIPPED
    else:
        emulated.refusal("scene.attach")
    assert emulated.shown == [(PART, 0)]


def test_other_refusals_and_other_links_leave_the_part_sensor(emulated: GrippingCell) -> None:
    emulated.put("ball", 0.0)
    emulated.refusal("scene.detach")
    emulated.refusal("scene.attach", "nothing")
    emulated.refusal("scene.attach", link="wrist_1_link")
    assert emulated.shown == []


def test_what_is_held_and_could_not_be_kept_is_shown_as_held(emulated: GrippingCell) -> None:
    emulated.put("ball", 0.0)
    emulated.refuse_with = DiskFull("no space")
    code, text = emulated.refused("scene.attach", name="ball", expected_revision=1)
    assert code is V.DISK_FULL
    assert "in force until the server ends" in text
    assert emulated.shown == [(PART, 1)]


def test_a_program_reads_the_part_sensor_as_it_was_set(emulated: GrippingCell) -> None:
    emulated.put("ball", 0.0)
    emulated.take()
    signals = emulated.around.signals
    assert signals.input(PART, emulated.now) is False
    (message,) = [each for each in emulated.queries if isinstance(each, SetInputs)]
    emulated.perform(signals.answered(accepted(message), emulated.now))
    assert signals.input(PART, emulated.now) is True


def test_a_sensor_that_could_not_be_set_is_logged_and_the_grasp_stands(
    emulated: GrippingCell,
) -> None:
    emulated.put("ball", 0.0)
    emulated.take()
    (message,) = [each for each in emulated.queries if isinstance(each, SetInputs)]
    (line,) = emulated.around.signals.answered(refused(message), emulated.now)
    assert "the part sensor, input 3, was not set" in repr(line)
    assert emulated.mathematics.scene.get("ball").link == robot().tool_link


def test_an_input_that_there_is_not_is_logged(emulated: GrippingCell) -> None:
    tcp = {"position": TCP}
    emulated.ask("tools.move", name="gripper", tcp=tcp, grasp={"part": 16}, expected_revision=2)
    emulated.put("ball", 0.0)
    emulated.take()
    assert emulated.shown == []
    (line,) = emulated.lines
    assert "input 16, was not set" in line
