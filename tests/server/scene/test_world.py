import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from rigs.cells.expectations import known
from rigs.cells.surrounded_cell import SurroundedCell, robot

from openpendant.motion.frames.frame_tree import FLANGE
from openpendant.motion.kinematics.serial import Kinematics
from openpendant.motion.pose import Pose
from openpendant.server.events.cell_events import RunningProgram
from openpendant.server.refusal import Refusal
from openpendant.server.scene.trace import ToolTrace
from openpendant.server.shell import robot_kinematics
from openpendant.server.shell.robot_kinematics import MOST_PAIRS
from openpendant.server.store.store_errors import DiskFull
from openpendant.simplemsg.pendant import ProgramState
from openpendant.simplemsg.verdicts import VerdictCode as V

TURNED = [0, 0, math.sin(0.5), math.cos(0.5)]
TABLE: dict[str, Any] = {"position": [0.5, 0.0, 0.0], "orientation": TURNED}
GRIPPER = {"position": [0.0, 0.0, 0.12]}
BOX = {"name": "box", "shape": {"type": "box", "size": [0.1, 0.1, 0.1]}, "position": [2, 0, 0]}
AT_THE_FLANGE = Kinematics(robot()).forward(robot().home_position).position.tolist()


@pytest.fixture
def cell(tmp_path: Path) -> Iterator[SurroundedCell]:
    made = SurroundedCell(tmp_path)
    made.report()
    yield made
    made.store.close()


def test_tools_and_scene_are_there_after_a_restart(cell: SurroundedCell, tmp_path: Path) -> None:
    cell.ask("tools.add", name="gripper", tcp=GRIPPER, expected_revision=0)
    cell.ask("tools.select", name="gripper", expected_revision=1)
    cell.ask("frames.add", name="tip", parent="gripper", pose=GRIPPER, expected_revision=0)
    cell.ask("scene.add", object=BOX, expected_revision=0)
    cell.store.close()
    again = SurroundedCell(tmp_path)
    assert again.mathematics.frames.selected_tool == "gripper"
    assert again.mathematics.scene.names == ("box",)
    shown = again.ask("frames.show")
    assert (shown["problems"], "tip" in shown["names"]) == ({}, True)
    assert again.cell.motions.scene == again.mathematics.scene
    again.store.close()


def test_the_later_of_two_changes_is_refused_with_both_revisions(cell: SurroundedCell) -> None:
    cell.ask("frames.add", name="table", pose=TABLE, expected_revision=0)
    code, text = cell.refused("frames.add", name="shelf", pose=TABLE, expected_revision=0)
    assert code is V.REVISION_CONFLICT
    assert "revision 0" in text
    assert "kept is 1" in text


@pytest.mark.parametrize(
    ("op", "fields"),
    [
        ("frames.add", {"name": "table", "pose": TABLE}),
        ("tools.add", {"name": "gripper", "tcp": GRIPPER}),
        ("tools.select", {"name": None}),
        ("scene.import", {"content": {"schema": "openpendant-scene/1"}}),
    ],
)
def test_nothing_but_an_addition_to_the_scene_is_changed_while_a_program_runs(
    cell: SurroundedCell, op: str, fields: dict[str, Any]
) -> None:
    cell.ask("scene.add", object=BOX, expected_revision=0)
    cell.cell.program = RunningProgram("weld", ProgramState.RUNNING, 3, 1)
    revision = 1 if op.startswith("scene") else 0
    code, text = cell.refused(op, **fields, expected_revision=revision)
    assert code is V.CHANGE_WHILE_MOVING
    assert "weld" in text
    other = BOX | {"name": "other"}
    cell.ask("scene.add", object=other, expected_revision=1)
    assert cell.mathematics.scene.names == ("box", "other")


def test_a_tool_that_could_not_be_kept_is_not_selected(cell: SurroundedCell) -> None:
    """Feature F-7: a screen shows another tool only once the server has it."""
    cell.ask("tools.add", name="gripper", tcp=GRIPPER, expected_revision=0)
    cell.refuse_with = DiskFull("disk full")
    assert cell.refused("tools.select", name="gripper", expected_revision=1)[0] is V.DISK_FULL
    assert cell.mathematics.frames.selected_tool is None


def test_an_object_counts_at_once_even_if_the_disk_is_full(cell: SurroundedCell) -> None:
    cell.refuse_with = DiskFull("disk full")
    code, text = cell.refused("scene.add", object=BOX, expected_revision=0)
    assert code is V.DISK_FULL
    assert "in force" in text
    assert cell.cell.motions.scene is not None
    assert cell.cell.motions.scene.names == ("box",)


def test_the_selected_tool_moves_where_the_tool_is(cell: SurroundedCell) -> None:
    home = robot().home_position
    flange, _ = cell.mathematics.tool_pose(home)
    cell.ask("tools.add", name="gripper", tcp=GRIPPER, expected_revision=0)
    cell.ask("tools.select", name="gripper", expected_revision=1)
    tool, _ = cell.mathematics.tool_pose(home)
    assert math.dist(flange, tool) == pytest.approx(0.12)


def test_a_robot_that_stands_still_shows_the_tool_just_selected(cell: SurroundedCell) -> None:
    home, rest = robot().home_position, (0.0,) * len(robot().home_position)
    before = cell.mathematics.tool_motion(home, rest)
    assert cell.mathematics.tool_motion(home, rest) == before
    cell.ask("tools.add", name="gripper", tcp=GRIPPER, expected_revision=0)
    cell.ask("tools.select", name="gripper", expected_revision=1)
    after = cell.mathematics.tool_motion(home, rest)
    assert after == (*cell.mathematics.tool_pose(home), 0.0)
    assert math.dist(before[0], after[0]) == pytest.approx(0.12)
    assert cell.mathematics.tool_motion(home, (0.1, *rest[1:]))[2] > 0.01


def test_a_pose_in_a_user_frame_is_where_the_selected_tool_goes(cell: SurroundedCell) -> None:
    cell.ask("tools.add", name="gripper", tcp=GRIPPER, expected_revision=0)
    cell.ask("tools.select", name="gripper", expected_revision=1)
    cell.ask("frames.add", name="table", pose=TABLE, expected_revision=0)
    position, orientation = cell.mathematics.tool_pose(robot().home_position)
    pose = {"position": position, "orientation": orientation}
    there = cell.ask("frames.transform", source="base", target="table", pose=pose)["pose"]
    back = Pose.from_values(there["position"], there["orientation"])
    in_base = cell.mathematics.frames.standing_in_base("table").compose(back)
    assert in_base.position == pytest.approx(position)
    assert cell.mathematics.tool_in_flange is not None
    assert math.hypot(*cell.mathematics.tool_in_flange.position) == pytest.approx(0.12)


def test_where_the_tool_was_is_still_known(cell: SurroundedCell) -> None:
    """Feature F-3: transforms at a time in the past."""
    home = robot().home_position
    for step in range(100):
        cell.report((home[0] + 0.01 * step, *home[1:]))

    then = cell.mathematics.tool_pose((home[0] + 0.01 * 49, *home[1:]))[0]
    told = cell.ask("frames.transform", source=FLANGE, target="base", seconds_ago=0.5)
    assert told["pose"]["position"] == pytest.approx(then, abs=1e-6)
    code, _ = cell.refused("frames.transform", source=FLANGE, target="base", seconds_ago=9)
    assert code is V.NOT_IN_HISTORY


def test_a_frame_can_be_used_before_the_controller_reports_again(cell: SurroundedCell) -> None:
    cell.report()
    cell.now += 1
    cell.ask("frames.add", name="table", pose=TABLE, expected_revision=0)
    answer = cell.ask("frames.transform", source="table", target="base")
    assert answer["pose"]["position"] == pytest.approx(list(TABLE["position"]))


def test_three_points_teach_a_frame(cell: SurroundedCell) -> None:
    points = [[0.5, 0.0, 0.1], [0.7, 0.0, 0.1], [0.5, 0.3, 0.1]]
    answer = cell.ask("frames.teach", points=points)
    assert answer["pose"]["position"] == pytest.approx([0.5, 0.0, 0.1])
    assert answer["angle"] == pytest.approx(math.pi / 2)


def test_points_in_a_line_teach_nothing(cell: SurroundedCell) -> None:
    points = [[0.5, 0.0, 0.1], [0.7, 0.0, 0.1], [0.9, 0.0, 0.1]]
    assert cell.refused("frames.teach", points=points)[0] is V.POOR_GEOMETRY


def test_a_frame_that_another_hangs_from_stays(cell: SurroundedCell) -> None:
    cell.ask("tools.add", name="gripper", tcp=GRIPPER, expected_revision=0)
    cell.ask("frames.add", name="tip", parent="gripper", pose=GRIPPER, expected_revision=0)
    refused = cell.refused("tools.remove", name="gripper", expected_revision=1)
    assert refused[0] is V.FRAME_REFUSED


def test_frames_travel_by_file(cell: SurroundedCell) -> None:
    cell.ask("frames.add", name="table", pose=TABLE, expected_revision=0)
    content = cell.ask("frames.show")["content"]
    cell.ask("frames.remove", name="table", expected_revision=1)
    cell.ask("frames.import", content=content, expected_revision=2)
    assert "table" in cell.ask("frames.show")["names"]


def test_a_mesh_is_not_read_for_whoever_asks(cell: SurroundedCell) -> None:
    mesh = BOX | {"shape": {"type": "mesh", "file": "/etc/passwd"}}
    code, text = cell.refused("scene.add", object=mesh, expected_revision=0)
    assert code is V.BAD_FILE
    assert "accepted: box" in text


def test_an_object_named_like_a_link_changes_nothing(cell: SurroundedCell) -> None:
    link = BOX | {"name": robot().tool_link}
    assert cell.refused("scene.add", object=link, expected_revision=0)[0] is V.DUPLICATE_OBJECT
    assert cell.mathematics.scene.names == ()


def test_a_carried_object_moves_with_the_flange(cell: SurroundedCell) -> None:
    cell.ask("scene.add", object=BOX | {"position": AT_THE_FLANGE}, expected_revision=0)
    told: list[Refusal | None] = []
    cell.perform(cell.around.attach("box", cell.now, told.append))
    held = cell.mathematics.scene.get("box")
    assert held.link == robot().tool_link
    cell.perform(cell.around.detach("box", cell.now, told.append))
    assert told == [None, None]
    assert cell.mathematics.scene.get("box").position == pytest.approx(AT_THE_FLANGE)


def test_the_nearest_bodies_are_told_with_their_points(cell: SurroundedCell) -> None:
    x, y, z = cell.mathematics.tool_pose(robot().home_position)[0]
    near = BOX | {"position": [x, y, z - 0.3]}
    cell.ask("scene.add", object=near, expected_revision=0)
    answer = cell.ask("scene.nearest")
    between = math.dist(answer["first_point"], answer["second_point"])
    assert between == pytest.approx(answer["distance"], abs=1e-6)


def test_another_robot_is_not_loaded_into_a_cell(cell: SurroundedCell) -> None:
    assert cell.ask("robots.list")["loaded"] == "ur5"
    assert cell.ask("robots.load", name="ur5") == {"loaded": "ur5"}
    code, text = cell.refused("robots.load", name="puma560")
    assert code is V.ROBOT_FIXED
    assert "'ur5'" in text


def test_the_robot_is_described_with_its_limits(cell: SurroundedCell) -> None:
    told = cell.ask("robots.describe")
    assert told["facts"]["name"] == "ur5"
    assert len(told["home_position"]) == 6


def test_the_trace_is_the_way_of_the_tool_until_it_is_cleared(cell: SurroundedCell) -> None:
    """Feature M07; RoboAnalyzer calls it ClearTrace."""
    home = robot().home_position
    for step in range(200):
        cell.report((home[0] + 0.005 * step, *home[1:]))
    points = cell.ask("trace.show")["points"]
    assert 5 < len(points) < 60
    cell.ask("trace.clear")
    assert cell.ask("trace.show")["total"] == 0


@pytest.mark.parametrize("body", [b'{"op": "frames.fly"}', b'{"op": "scene.add"}'])
def test_a_request_that_is_none_is_refused(cell: SurroundedCell, body: bytes) -> None:
    cell.perform(cell.answered(body))
    done, answer = cell.answers[-1]
    assert not done
    assert answer["code"] == V.BAD_ARGUMENT


SHAPES_THAT_MOVE = 8  # of a UR5
MOST_BALLS = MOST_PAIRS // SHAPES_THAT_MOVE


def ball(number: int) -> dict[str, Any]:
    place = [2.0 + 0.1 * number, 0, 0]
    return {"name": f"b{number}", "shape": {"type": "sphere", "radius": 0.01}, "position": place}


def balls(count: int) -> dict[str, Any]:
    return {"schema": "openpendant-scene/1", "objects": [ball(number) for number in range(count)]}


def test_a_scene_of_too_many_pairs_is_refused_and_the_old_one_stays(cell: SurroundedCell) -> None:
    cell.ask("scene.import", content=balls(MOST_BALLS), expected_revision=0)
    code, text = cell.refused("scene.add", object=ball(MOST_BALLS), expected_revision=1)
    assert code is V.TOO_LARGE
    assert f"{(MOST_BALLS + 1) * SHAPES_THAT_MOVE} pairs" in text
    assert f"{MOST_PAIRS} at most" in text
    assert len(cell.mathematics.scene.objects) == MOST_BALLS
    cell.ask("scene.remove", name="b0", expected_revision=1)


def test_a_program_takes_no_object_that_makes_too_many_pairs(cell: SurroundedCell) -> None:
    content = balls(MOST_BALLS)
    content["objects"][0]["position"] = AT_THE_FLANGE
    cell.ask("scene.import", content=content, expected_revision=0)
    cell.report()
    told: list[Refusal | None] = []
    cell.perform(cell.around.attach("b0", cell.now, told.append))
    cell.until(lambda: bool(told))
    assert known(told[0]).code is V.TOO_LARGE
    assert cell.mathematics.scene.get("b0").link is None


def test_a_stored_scene_that_is_too_large_is_not_in_force_after_a_start_until_another_is_saved(
    cell: SurroundedCell, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """That is told, and nothing moves until then."""
    cell.ask("scene.import", content=balls(20), expected_revision=0)
    cell.store.close()
    monkeypatch.setattr(robot_kinematics, "MOST_PAIRS", 100)
    again = SurroundedCell(tmp_path)
    again.report()
    problems = again.ask("frames.show")["problems"]
    assert "160 pairs" in problems["scene"]
    assert "100 at most" in problems["scene"]
    assert again.mathematics.scene.objects == ()
    assert "160 pairs" in again.cell.unread
    again.ask("scene.import", content=balls(3), expected_revision=1)
    assert again.cell.unread == ""
    assert again.ask("frames.show")["problems"] == {}
    again.store.close()


def test_another_tool_needs_no_new_model_of_the_same_scene(cell: SurroundedCell) -> None:
    cell.ask("scene.import", content=balls(2), expected_revision=0)
    before = cell.mathematics.built.collision
    cell.ask("tools.add", name="g", tcp={"position": [0, 0, 0.1]}, expected_revision=0)
    cell.ask("tools.select", name="g", expected_revision=1)
    assert cell.mathematics.built.collision is before
    assert cell.ask("scene.nearest")["distance"] > 0.0


def test_a_tool_is_calibrated_from_twenty_positions_at_most(cell: SurroundedCell) -> None:
    positions = [list(robot().home_position)] * 21
    code, text = cell.refused("tools.calibrate", positions=positions)
    assert code is V.BAD_ARGUMENT
    assert "20" in text
    code, _ = cell.refused("tools.calibrate", positions=positions[:20])
    assert code is V.POOR_GEOMETRY


def test_a_straight_way_is_its_two_ends() -> None:
    trace = ToolTrace()
    for step in range(40):
        trace.add((0.01 * step, 0.0, 0.5))
    assert trace.points == [(0.0, 0.0, 0.5), (0.39, 0.0, 0.5)]


def test_a_circle_is_kept_to_the_tolerance() -> None:
    trace = ToolTrace(tolerance=1e-3)
    places = [(math.cos(n / 500), math.sin(n / 500), 0.0) for n in range(3_000)]
    for place in places:
        trace.add(place)
    assert len(trace.points) < 200
    chords = zip(trace.points, trace.points[1:], strict=False)
    middles = [math.hypot((a[0] + b[0]) / 2, (a[1] + b[1]) / 2) for a, b in chords]
    assert min(middles) > 1 - 3e-3


def test_a_robot_that_stands_adds_nothing() -> None:
    trace = ToolTrace()
    for _ in range(100):
        trace.add((0.1, 0.2, 0.3))
    assert len(trace.points) == 1


def test_memory_is_bounded_and_the_latest_way_stays_whole() -> None:
    trace = ToolTrace(most=100)
    for step in range(10_000):
        trace.add((0.01 * step, 0.01 * (step % 2), 0.0))
    assert len(trace.points) <= 100
    assert trace.points[-1] == (0.01 * 9_999, 0.01, 0.0)


def test_no_place_is_farther_from_what_is_kept_than_the_tolerance() -> None:
    # Slowly to the side, so that what is told of all dropped places at once adds up and is redone.
    trace = ToolTrace(tolerance=1e-3)
    places = [(0.004 * n, 0.02 * math.sin(0.03 * n), 1e-4 * (n % 3)) for n in range(400)]
    for place in places:
        trace.add(place)
    assert 2 < len(trace.points) < 60
    pieces = list(zip(trace.points, trace.points[1:], strict=False))
    for x, y, z in places:
        begin, end = next(piece for piece in pieces if x <= piece[1][0])
        share = (x - begin[0]) / (end[0] - begin[0])
        beside = [a + share * (b - a) for a, b in zip(begin, end, strict=True)]
        assert math.dist((x, y, z), beside) <= 1.01e-3
