import json
import math
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from openpendant.motion.errors import FrameFileError
from openpendant.motion.frames.frame_file import (
    MAX_FILE_BYTES,
    SCHEMA,
    frames_from_json,
    frames_to_json,
    load_frames,
    save_frames,
)
from openpendant.motion.frames.frame_tree import BASE, FLANGE, FrameTree
from openpendant.motion.pose import Pose

QUAT = [0.0, 0.0, 0.0, 1.0]
TABLE = {"name": "table", "parent": "base", "xyz": [0.5, 0.0, 0.0], "quat": QUAT}
HAND = {"name": "hand", "xyz": [0.0, 0.0, 0.1], "quat": QUAT}

coordinates = st.floats(-1e5, 1e5)
poses = st.builds(
    Pose.from_rpy,
    st.tuples(coordinates, coordinates, coordinates),
    st.tuples(st.floats(-3.0, 3.0), st.floats(-1.5, 1.5), st.floats(-3.0, 3.0)),
)
names = st.text(min_size=1, max_size=12).filter(lambda n: n.isprintable() and n == n.strip())


@st.composite
def trees(draw: st.DrawFn) -> FrameTree:
    tree = FrameTree()
    for name in draw(st.lists(names, max_size=8, unique=True)):
        if name in tree.frames:
            continue
        parents = [frame for frame in tree.frames if frame != "tool"]
        tree = tree.add(name, draw(poses), draw(st.sampled_from(parents)))
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
