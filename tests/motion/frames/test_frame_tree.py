import json
import math
import pickle
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rigs.motion.nearness import assert_near, assert_same_pose

from openpendant.motion import errors
from openpendant.motion.errors import FrameFileError
from openpendant.motion.frames.frame_file import (
    MAX_FILE_BYTES,
    SCHEMA,
    frames_from_json,
    frames_to_json,
    load_frames,
    save_frames,
)
from openpendant.motion.frames.frame_tree import (
    BASE,
    FLANGE,
    MOST_FRAMES,
    ROOT,
    TOOL,
    FrameTree,
    transform_point,
    transform_twist,
    transform_vector,
)
from openpendant.motion.frames.grasp import Grasp
from openpendant.motion.orientation import rotation_of_vector
from openpendant.motion.pose import Array, Pose

coordinates, angles = st.floats(-2.0, 2.0), st.floats(-3.0, 3.0)
vectors = st.tuples(coordinates, coordinates, coordinates)
turns = st.tuples(angles, st.floats(-1.5, 1.5), angles)
poses = st.builds(Pose.from_rpy, vectors, turns)
HERE = Pose.from_rpy((0.5, 0.1, 0.2), (0.1, 0.2, 0.3))
THERE = Pose.from_rpy((-0.3, 0.4, 0.0), (0.0, 0.0, 1.0))


def shift(x: float, y: float = 0.0, z: float = 0.0) -> Pose:
    return Pose.from_rpy((x, y, z), (0.0, 0.0, 0.0))


@pytest.fixture
def tree() -> FrameTree:
    """base ── table ── part ── hole, base ── bin; tools gripper (selected) and torch."""
    return (
        FrameTree()
        .add("table", HERE)
        .add("part", THERE, "table")
        .add("hole", shift(0.0, 0.0, 0.01), "part")
        .add("bin", shift(1.0))
        .add_tool("gripper", shift(0.0, 0.0, 0.12))
        .add_tool("torch", shift(0.0, 0.05, 0.3))
        .select_tool("gripper")
    )


def test_base_root_flange_and_tool_are_there_from_the_start() -> None:
    tree = FrameTree()
    assert tuple(tree.frames) == (BASE, ROOT, FLANGE, TOOL)
    assert all(frame.predefined for frame in tree.frames.values())
    assert [frame.name for frame in tree.frames.values() if frame.moving] == [FLANGE]


def test_a_robot_brings_its_root_and_its_links() -> None:
    tree = FrameTree.of_robot(root=shift(0.0, 0.0, -0.45), links=("link_1", "link_2"))
    assert_same_pose(tree.transform(ROOT, BASE), shift(0.0, 0.0, -0.45))
    assert tree["link_2"].moving
    assert tree["link_2"].parent == BASE


def test_a_change_leaves_the_old_tree_as_it_was(tree: FrameTree) -> None:
    tree.add("more", HERE)
    tree.remove("hole")
    tree.move("table", THERE)
    assert "more" not in tree.frames
    assert "hole" in tree.frames
    assert tree["table"].pose is HERE


def test_frames_and_tools_are_listed_apart_parents_first(tree: FrameTree) -> None:
    moved = tree.move("bin", THERE, parent="hole")
    assert [frame.name for frame in moved.user_frames] == ["table", "part", "hole", "bin"]
    assert [tool.name for tool in moved.tools] == ["gripper", "torch"]


@given(poses, poses, poses)
def test_a_way_up_is_a_product(a: Pose, b: Pose, c: Pose) -> None:
    tree = FrameTree().add("a", a).add("b", b, "a").add("c", c, "b")
    product = a.to_matrix() @ b.to_matrix() @ c.to_matrix()
    assert_near(tree.transform("c", BASE).to_matrix(), product, 1e-12)


@given(poses, poses, poses)
def test_there_and_back_is_nowhere_and_a_detour_the_same(a: Pose, b: Pose, c: Pose) -> None:
    tree = FrameTree().add("a", a).add("b", b, "a").add("c", c)
    assert_same_pose(tree.transform("b", "c").compose(tree.transform("c", "b")), Pose.identity())
    detour = tree.transform("a", "c").compose(tree.transform("b", "a"))
    assert_same_pose(detour, tree.transform("b", "c"))


def test_a_frame_in_itself_is_the_identity(tree: FrameTree) -> None:
    for name in tree.frames:
        assert_same_pose(tree.transform(name, name), Pose.identity())


def test_what_hangs_together_needs_no_place_of_the_moving_frame_above(tree: FrameTree) -> None:
    assert_same_pose(tree.transform("torch", "gripper"), shift(0.0, 0.05, 0.18))
    assert tree.moving_between("torch", "gripper") == ()


def test_the_tool_in_the_base_needs_the_flange(tree: FrameTree) -> None:
    assert tree.moving_between(TOOL, "table") == (FLANGE,)
    in_base = HERE.compose(shift(0.0, 0.0, 0.12))
    assert_same_pose(tree.transform(TOOL, BASE, {FLANGE: HERE}), in_base)
    with pytest.raises(errors.FrameUnknown, match="flange"):
        tree.transform(TOOL, BASE)


def test_a_pose_goes_into_base_from_a_frame_that_stands_still_only(tree: FrameTree) -> None:
    place = tree.standing_in_base("part")
    assert_same_pose(place, HERE.compose(THERE))
    with pytest.raises(errors.BadArgument, match="'flange'; accepted: base, root or a frame"):
        tree.standing_in_base(FLANGE)
    with pytest.raises(errors.FrameUnknown):
        tree.standing_in_base("nowhere")


def test_the_frame_tool_is_the_selected_one_or_the_flange(tree: FrameTree) -> None:
    assert_same_pose(tree.transform(TOOL, "gripper"), Pose.identity())
    assert_same_pose(tree.select_tool("torch").transform(TOOL, "torch"), Pose.identity())
    assert_same_pose(tree.select_tool(None).transform(TOOL, FLANGE), Pose.identity())


def test_moving_the_selected_tool_moves_the_frame_tool(tree: FrameTree) -> None:
    moved = tree.move("gripper", shift(0.0, 0.0, 0.2))
    assert_same_pose(moved.transform(TOOL, FLANGE), shift(0.0, 0.0, 0.2))


def test_moving_a_frame_takes_along_what_hangs_from_it(tree: FrameTree) -> None:
    before = tree.transform("hole", "table")
    moved = tree.move("table", THERE)
    assert_same_pose(moved.transform("hole", "table"), before)
    assert_same_pose(moved.transform("hole", BASE), THERE.compose(before))


def test_renaming_keeps_parents_children_selection_and_order(tree: FrameTree) -> None:
    renamed = tree.rename("table", "bench").rename("gripper", "hand")
    assert renamed["part"].parent == "bench"
    assert renamed.selected_tool == "hand"
    order = [name.replace("table", "bench").replace("gripper", "hand") for name in tree.frames]
    assert list(renamed.frames) == order
    assert_same_pose(renamed.transform("hole", BASE), tree.transform("hole", BASE))
    assert renamed.rename("bench", "bench") is renamed


def test_removing_from_the_leaves_leaves_the_robot_alone(tree: FrameTree) -> None:
    empty = tree.select_tool(None)
    for name in ("hole", "part", "table", "bin", "gripper", "torch"):
        empty = empty.remove(name)
    assert tuple(empty.frames) == tuple(FrameTree().frames)


def test_a_tree_survives_the_way_between_processes(tree: FrameTree) -> None:
    again = pickle.loads(pickle.dumps(tree))
    assert list(again.frames) == list(tree.frames)
    assert again.selected_tool == "gripper"
    assert_same_pose(again.transform("hole", BASE), tree.transform("hole", BASE))


Change = Callable[[FrameTree], object]


@pytest.mark.parametrize(
    ("change", "error", "words"),
    [
        (lambda t: t.add("table", HERE), errors.FrameExists, ["'table'"]),
        (lambda t: t.add("base", HERE), errors.FrameExists, ["'base'"]),
        (lambda t: t.add_tool("bin", HERE), errors.FrameExists, ["'bin'"]),
        (lambda t: t.rename("bin", "table"), errors.FrameExists, ["'table'"]),
        (lambda t: t.add("x", HERE, "nowhere"), errors.FrameUnknown, ["'nowhere'", "table"]),
        (lambda t: t.move("nowhere", HERE), errors.FrameUnknown, ["'nowhere'"]),
        (lambda t: t.remove("nowhere"), errors.FrameUnknown, ["'nowhere'"]),
        (lambda t: t.rename("nowhere", "x"), errors.FrameUnknown, ["'nowhere'"]),
        (lambda t: t.transform("nowhere", BASE), errors.FrameUnknown, ["'nowhere'"]),
        (lambda t: t.transform(BASE, "nowhere"), errors.FrameUnknown, ["'nowhere'"]),
        (lambda t: t.select_tool("bin"), errors.FrameUnknown, ["'bin'", "gripper, torch"]),
        (lambda t: t["nowhere"], errors.FrameUnknown, ["'nowhere'"]),
        (lambda t: t.move("table", HERE, "table"), errors.FrameCycle, ["'table'"]),
        (lambda t: t.move("table", HERE, "hole"), errors.FrameCycle, ["'table'", "'hole'"]),
        (lambda t: t.move("base", HERE), errors.FramePredefined, ["'base'", "moved"]),
        (lambda t: t.move("tool", HERE), errors.FramePredefined, ["'tool'", "moved"]),
        (lambda t: t.remove("flange"), errors.FramePredefined, ["'flange'", "removed"]),
        (lambda t: t.rename("root", "x"), errors.FramePredefined, ["'root'", "renamed"]),
        (lambda t: t.add("x", HERE, "tool"), errors.FramePredefined, ["'tool'", "parent"]),
        (lambda t: t.move("bin", HERE, "tool"), errors.FramePredefined, ["'tool'", "parent"]),
        (lambda t: t.remove("table"), errors.FrameInUse, ["'table'", "part"]),
        (lambda t: t.remove("gripper"), errors.FrameInUse, ["'gripper'", "tool"]),
        (lambda t: t.move("gripper", HERE, "base"), errors.FrameInUse, ["'gripper'", "tool"]),
        (lambda t: t.add("", HERE), errors.BadArgument, ["''", "1 to 64"]),
        (lambda t: t.add(" x", HERE), errors.BadArgument, ["' x'", "no space"]),
        (lambda t: t.add("a\nb", HERE), errors.BadArgument, ["printable"]),
        (lambda t: t.rename("bin", "y" * 65), errors.BadArgument, ["64"]),
        (lambda t: t.add("x", shift(math.nan)), errors.MotionError, ["finite"]),
    ],
)
def test_a_change_that_cannot_be_is_refused(
    tree: FrameTree, change: Change, error: type[errors.MotionError], words: list[str]
) -> None:
    with pytest.raises(error) as refusal:
        change(tree)
    assert [word for word in words if word not in str(refusal.value)] == []


def test_the_number_of_frames_is_bounded() -> None:
    tree = FrameTree()
    for number in range(MOST_FRAMES - len(tree.frames)):
        tree = tree.add(f"f{number}", HERE)
    with pytest.raises(errors.BadArgument, match="1000"):
        tree.add("one more", HERE)


def test_a_deep_tree_is_followed_to_its_end() -> None:
    tree = FrameTree()
    parent = BASE
    for number in range(500):
        tree = tree.add(f"f{number}", shift(0.001), parent)
        parent = f"f{number}"
    assert tree.transform(parent, BASE).position[0] == pytest.approx(0.5)


twists = st.tuples(*[coordinates] * 6)

Rule = Callable[[Pose, tuple[float, ...]], Array]


@given(poses, vectors)
def test_points_shift_and_turn_and_vectors_turn(pose: Pose, values: tuple[float, ...]) -> None:
    matrix = pose.to_matrix()
    assert_near(transform_point(pose, values), (matrix @ [*values, 1.0])[:3], 1e-12)
    assert_near(transform_vector(pose, values), (matrix @ [*values, 0.0])[:3], 1e-12)


@pytest.mark.parametrize("rule", [transform_point, transform_vector])
@given(first=poses, second=poses, values=vectors)
def test_two_transforms_in_turn_are_their_product(
    rule: Rule, first: Pose, second: Pose, values: tuple[float, ...]
) -> None:
    once = rule(first.compose(second), values)
    assert_near(once, rule(first, tuple(rule(second, values))), 1e-12)


@given(poses, poses, twists)
def test_a_twist_goes_by_the_product_and_back(
    first: Pose, second: Pose, values: tuple[float, ...]
) -> None:
    once = transform_twist(first.compose(second), values)
    assert_near(once, transform_twist(first, transform_twist(second, values)), 1e-11)
    back = transform_twist(first.inverse(), transform_twist(first, values))
    assert_near(back, values, 1e-11)


@given(poses, twists, vectors)
def test_a_twist_tells_the_same_velocity_of_every_point_in_both_frames(
    pose: Pose, values: tuple[float, ...], point: tuple[float, ...]
) -> None:
    twist = np.array(values)
    here = twist[:3] + np.cross(twist[3:], point)
    moved = transform_twist(pose, twist)
    there = moved[:3] + np.cross(moved[3:], transform_point(pose, point))
    assert_near(there, transform_vector(pose, here), 1e-11)


def test_a_twist_is_what_a_small_motion_does() -> None:
    pose = Pose.from_rpy((0.3, -0.2, 0.5), (0.4, 0.1, -0.7))
    twist = np.array([0.1, 0.2, -0.3, 0.5, -0.4, 0.2])
    step = 1e-6
    motion = np.eye(4)
    motion[:3, :3], motion[:3, 3] = rotation_of_vector(step * twist[3:]), step * twist[:3]
    matrix = pose.to_matrix()
    seen = (matrix @ motion @ np.linalg.inv(matrix) - np.eye(4)) / step
    found = [*seen[:3, 3], seen[2, 1], seen[0, 2], seen[1, 0]]
    assert transform_twist(pose, twist) == pytest.approx(found, abs=1e-5)


def test_a_point_of_the_table_is_found_in_the_bin() -> None:
    quarter = Pose.from_rpy((1.0, 0.0, 0.0), (0.0, 0.0, math.pi / 2))
    tree = FrameTree().add("table", quarter).add("bin", Pose.from_rpy((0, 0, 0.5), (0, 0, 0)))
    in_bin = transform_point(tree.transform("table", "bin"), (0.2, 0.0, 0.0))
    assert in_bin == pytest.approx([1.0, 0.2, -0.5])
    in_base = transform_point(tree.transform("table", BASE), (0.2, 0.0, 0.0))
    assert in_base == pytest.approx([1.0, 0.2, 0.0])


@pytest.mark.parametrize("rule", [transform_point, transform_vector, transform_twist])
def test_what_is_no_vector_is_refused(rule: Rule) -> None:
    count = 6 if rule is transform_twist else 3
    with pytest.raises(errors.BadArgument, match=f"{count} numbers"):
        rule(Pose.identity(), (0.0,) * (count - 1))
    with pytest.raises(errors.NotFinite):
        rule(Pose.identity(), (0.0,) * (count - 1) + (math.nan,))


QUAT = [0.0, 0.0, 0.0, 1.0]
TABLE = {"name": "table", "parent": "base", "xyz": [0.5, 0.0, 0.0], "quat": QUAT}
HAND = {"name": "hand", "xyz": [0.0, 0.0, 0.1], "quat": QUAT}

far = st.floats(-1e5, 1e5)
far_poses = st.builds(Pose.from_rpy, st.tuples(far, far, far), turns)
names = st.text(min_size=1, max_size=12).filter(lambda n: n.isprintable() and n == n.strip())


@st.composite
def trees(draw: st.DrawFn) -> FrameTree:
    tree = FrameTree()
    for name in draw(st.lists(names, max_size=5, unique=True)):
        if name in tree.frames:
            continue
        parents = [frame for frame in tree.frames if frame != "tool"]
        tree = tree.add(name, draw(far_poses), draw(st.sampled_from(parents)))
    tools = [tool.name for tool in tree.tools]
    return tree.select_tool(draw(st.sampled_from([None, *tools])))


def document(**fields: Any) -> str:
    return json.dumps({"schema": SCHEMA, "frames": [TABLE], "tools": [HAND], **fields})


@given(trees())
def test_frames_survive_the_way_through_a_file(tree: FrameTree) -> None:
    found = frames_from_json(frames_to_json(tree))
    assert found.frames.keys() == tree.frames.keys()
    assert found.selected_tool == tree.selected_tool
    for name, frame in tree.frames.items():
        again = found[name]
        assert again.parent == frame.parent
        if frame.pose is not None and again.pose is not None:
            assert again.pose.position.tolist() == frame.pose.position.tolist()
            assert again.pose.rotation_distance(frame.pose) < 1e-15


def test_a_file_is_written_and_read(tmp_path: Path) -> None:
    tree = FrameTree().add("Tisch № 1", Pose.from_rpy((0.1, 0.2, 0.3), (0.0, 0.0, 1.0)))
    path = tmp_path / "frames.json"
    save_frames(tree, path)
    assert list(load_frames(path).frames) == list(tree.frames)
    assert [entry.name for entry in tmp_path.iterdir()] == ["frames.json"]


def test_frames_are_added_to_those_of_the_robot() -> None:
    robot = FrameTree.of_robot(links=("link_1",))
    carried = {**TABLE, "name": "carried", "parent": "link_1"}
    assert frames_from_json(document(frames=[carried]), tree=robot)["carried"].parent == "link_1"


def test_a_minimal_file_has_its_schema_only() -> None:
    assert frames_from_json(json.dumps({"schema": SCHEMA})).user_frames == ()


def test_whole_numbers_are_numbers() -> None:
    tree = frames_from_json(document(frames=[{**TABLE, "xyz": [1, 0, 0], "quat": [0, 0, 0, 1]}]))
    assert tree.transform("table", BASE).position.tolist() == [1.0, 0.0, 0.0]
    assert tree["hand"].parent == FLANGE


def changed(which: dict[str, Any], **fields: Any) -> str:
    key = "frames" if which is TABLE else "tools"
    return document(**{key: [{**which, **fields}]})


@pytest.mark.parametrize(
    ("text", "field", "words"),
    [
        ("", "", ["not JSON", "line 1, column 1"]),
        ("{", "", ["not JSON"]),
        ("[]", "", ["not an object", SCHEMA]),
        ("{}", "schema", [SCHEMA]),
        (json.dumps({"schema": "openpendant-frames/2"}), "schema", [SCHEMA]),
        ('{"schema": 1, "schema": 2}', "schema", ["twice"]),
        ("[" * 100_000, "", []),
        (document(more=1), "more", ["accepted: schema, tools, selected_tool, frames"]),
        (document(frame=[]), "frame", ["perhaps 'frames' is meant"]),
        (document(frames=5), "frames", ["accepted: a list"]),
        (changed(TABLE, name=""), "frames[0].name", ["at least 1 character"]),
        (changed(TABLE, name="x" * 65), "frames[0].name", ["at most 64"]),
        (changed(TABLE, name="a\nb"), "frames[0]", ["printable"]),
        (changed(TABLE, name="base"), "frames[0]", ["'base'", "not in use"]),
        (changed(TABLE, name="hand"), "frames[0]", ["'hand'"]),
        (changed(TABLE, name=3), "frames[0].name", ["accepted: text"]),
        (changed(TABLE, parent="nowhere"), "frames[0]", ["'nowhere'", "known: base"]),
        (changed(TABLE, parent="table"), "frames[0]", ["'table'", "known"]),
        (changed(TABLE, parent="tool"), "frames[0]", ["'tool'", "selected tool"]),
        (changed(TABLE, xyz=[1.0, 2.0]), "frames[0].xyz[2]", ["required"]),
        (changed(TABLE, xyz=[1.0, "2", 3.0]), "frames[0].xyz[1]", ["number"]),
        (changed(TABLE, xyz=[1e7, 0.0, 0.0]), "frames[0].xyz", ["million metres"]),
        (changed(TABLE, xyz=[math.nan, 0.0, 0.0]), "frames[0].xyz[0]", ["finite"]),
        (changed(TABLE, xyz=[math.inf, 0.0, 0.0]), "frames[0].xyz[0]", ["finite"]),
        (changed(TABLE, quat=[0.0, 0.0, 0.0, 2.0]), "frames[0].quat", ["length 2", "x, y, z, w"]),
        (changed(TABLE, quat=[0.0] * 4), "frames[0].quat", ["length 0"]),
        (changed(TABLE, quat=[0.0, 0.0, 0.0, 1.00001]), "frames[0].quat", ["1.00001"]),
        (changed(TABLE, quat=[0.0, 0.0, 1.0]), "frames[0].quat[3]", ["required"]),
        (changed(TABLE, rpy=[0, 0, 0]), "frames[0].rpy", ["not permitted"]),
        (changed(HAND, parent="flange"), "tools[0].parent", ["accepted: name, xyz, quat"]),
        (changed(HAND, quat=[1.0, 1.0, 0.0, 0.0]), "tools[0].quat", ["length 1.414"]),
        (changed(HAND, grasp={"reach": 0.06}), "tools[0].grasp.reach", ["0.05"]),
        (changed(HAND, grasp={"reach": math.nan}), "tools[0].grasp.reach", ["finite"]),
        (changed(HAND, grasp={"point": [0, 0, 2e3]}), "tools[0].grasp.point[2]", ["1000"]),
        (changed(HAND, grasp={"part": 1.5}), "tools[0].grasp.part", ["multiple of 1"]),
        (changed(HAND, grasp={"part": 512}), "tools[0].grasp.part", ["512"]),
        (changed(HAND, grasp={"part": True}), "tools[0].grasp.part", ["number"]),
        (changed(HAND, grasp={"force": 1}), "tools[0].grasp.force", ["not permitted"]),
        (changed(TABLE, grasp={}), "frames[0].grasp", ["not permitted"]),
        (document(selected_tool="gone"), "selected_tool", ["'gone'", "hand"]),
    ],
)
def test_a_malformed_file_is_refused_in_one_line_that_names_file_and_field(
    text: str, field: str, words: list[str]
) -> None:
    with pytest.raises(FrameFileError) as refusal:
        frames_from_json(text, "cell.json")
    error = refusal.value
    assert error.field == field
    assert str(error).startswith(f"cell.json: {field}")
    assert "\n" not in str(error)
    assert [word for word in words if word not in str(error)] == []


GRASP = Grasp((0.0, 0.01, 0.02), 0.03, 4)


def test_the_grasp_of_the_selected_tool_counts_and_is_the_default_where_it_has_none(
    tree: FrameTree,
) -> None:
    grasping = tree.add_tool("hand", HERE, GRASP)
    assert (tree.grasp, grasping.grasp) == (Grasp(), Grasp())
    assert grasping.select_tool("hand").grasp == GRASP
    assert grasping.select_tool("hand").select_tool(None).grasp == Grasp((0.0, 0.0, 0.0), 0.010)


def test_a_tool_keeps_its_grasp_under_another_name_and_in_another_process() -> None:
    tree = FrameTree().add_tool("hand", HERE, GRASP).rename("hand", "fist")
    assert pickle.loads(pickle.dumps(tree))["fist"].grasp == GRASP
    assert tree.move("fist", THERE)["fist"].grasp == GRASP
    assert tree.move("fist", THERE, BASE)["fist"].grasp is None


def test_a_tool_that_is_moved_has_the_grasp_that_is_given_with_the_move() -> None:
    tree = FrameTree().add_tool("hand", HERE, GRASP).select_tool("hand")
    assert tree.move_tool("hand", THERE, Grasp(reach=0.05)).grasp.reach == 0.05
    moved = tree.move_tool("hand", THERE)
    assert moved.grasp == Grasp()
    assert_same_pose(moved.transform(TOOL, FLANGE), THERE)


def test_grasps_travel_by_file_and_a_tool_without_one_is_written_as_before() -> None:
    tree = FrameTree().add_tool("hand", HERE, GRASP).add_tool("torch", THERE)
    text = frames_to_json(tree)
    hand, torch = json.loads(text)["tools"]
    assert hand["grasp"] == {"point": [0.0, 0.01, 0.02], "reach": 0.03, "part": 4}
    assert list(torch) == ["name", "xyz", "quat"]
    again = frames_from_json(text)
    assert [tool.grasp for tool in again.tools] == [GRASP, None]
    assert frames_from_json(changed(HAND, grasp={}))["hand"].grasp == Grasp()


def test_a_frame_without_a_grasp_is_told_in_the_words_that_journals_hold() -> None:
    hand = FrameTree().add_tool("hand", shift(0.0))["hand"]
    assert repr(hand).endswith("predefined=False)")
    assert "grasp=" in repr(FrameTree().add_tool("hand", shift(0.0), GRASP)["hand"])


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"\xff\xfe", "UTF-8"),
        (b" " * (MAX_FILE_BYTES + 1), f"{MAX_FILE_BYTES} bytes"),
    ],
)
def test_a_file_that_is_no_text_is_refused(tmp_path: Path, content: bytes, words: str) -> None:
    path = tmp_path / "frames.json"
    path.write_bytes(content)
    with pytest.raises(FrameFileError, match=words):
        load_frames(path)


def test_a_file_that_is_not_there_or_cannot_be_made_is_refused(tmp_path: Path) -> None:
    with pytest.raises(FrameFileError, match="No such file"):
        load_frames(tmp_path / "none.json")
    with pytest.raises(FrameFileError, match="No such file"):
        save_frames(FrameTree(), tmp_path / "none" / "frames.json")
