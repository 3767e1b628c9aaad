"""Frames and tools as a file: JSON of schema `openpendant-frames/1`.

Owns the layout, the bounds and the wording of what is wrong with a file. SI: metres; quaternions
x, y, z, w of length 1. Predefined frames are the robot's and never in the file; parents stand
before children. Knows the tree, and no robot.

    {"schema": "openpendant-frames/1",
     "tools": [{"name": "gripper", "xyz": [0, 0, 0.12], "quat": [0, 0, 0, 1]}],
     "selected_tool": "gripper",
     "frames": [{"name": "table", "parent": "base", "xyz": [0.5, 0, 0], "quat": [0, 0, 0, 1]}]}
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any, Literal, TypeAlias

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from ..bounded_file import read_text
from ..description.field_problems import field_problems
from ..errors import FrameFileError, MotionError
from ..pose import Pose
from .frame_tree import LONGEST_NAME, MOST_FRAMES, Frame, FrameTree

SCHEMA = "openpendant-frames/1"

MAX_FILE_BYTES = 1 << 20

UNIT_TOLERANCE = 1e-6
"""Greatest deviation of a quaternion's length from 1."""

_Real: TypeAlias = Annotated[float, Field(strict=True, allow_inf_nan=False)]
_Name: TypeAlias = Annotated[str, Field(strict=True, min_length=1, max_length=LONGEST_NAME)]


class _Part(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


class _Placed(_Part):
    name: _Name
    xyz: tuple[_Real, _Real, _Real]
    quat: tuple[_Real, _Real, _Real, _Real]


class _UserFrame(_Placed):
    parent: _Name


class _Document(_Part):
    schema_: Literal["openpendant-frames/1"] = Field(alias="schema")
    tools: tuple[_Placed, ...] = Field(default=(), max_length=MOST_FRAMES)
    selected_tool: _Name | None = None
    frames: tuple[_UserFrame, ...] = Field(default=(), max_length=MOST_FRAMES)


def frames_to_json(tree: FrameTree) -> str:
    """Return the frames and tools of users as the text of a file."""
    document = {
        "schema": SCHEMA,
        "tools": [tool_to_data(tool) for tool in tree.tools],
        "selected_tool": tree.selected_tool,
        "frames": [frame_to_data(frame) for frame in tree.user_frames],
    }
    return json.dumps(document, indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def frames_from_json(text: str, file: str = "frames", tree: FrameTree | None = None) -> FrameTree:
    """Return a tree with the frames and tools of a file's text.

    Args:
        tree: the tree that they are added to; base, root, flange and tool if None.

    Raises:
        FrameFileError: the text is not such JSON, or the tree does not accept one of its frames.
    """
    document = _document(_parsed(text, file), file)
    grown = FrameTree() if tree is None else tree
    for index, tool in enumerate(document.tools):
        where = f"tools[{index}]"
        pose = _pose(tool, file, where)
        with _refused_at(file, where):
            grown = grown.add_tool(tool.name, pose)
    for index, frame in enumerate(document.frames):
        where = f"frames[{index}]"
        pose = _pose(frame, file, where)
        with _refused_at(file, where):
            grown = grown.add(frame.name, pose, frame.parent)
    if document.selected_tool is not None:
        with _refused_at(file, "selected_tool"):
            grown = grown.select_tool(document.selected_tool)
    return grown


def save_frames(tree: FrameTree, path: Path) -> None:
    """Write the frames and tools of users, all or nothing, or raise `FrameFileError`."""
    beside = path.with_name(path.name + ".new")
    try:
        beside.write_text(frames_to_json(tree), encoding="utf-8")
        beside.replace(path)
    except (OSError, ValueError) as error:
        problem = getattr(error, "strerror", None) or "cannot be written"
        raise FrameFileError(str(path), "", problem) from error


def load_frames(path: Path, tree: FrameTree | None = None) -> FrameTree:
    """Read a file of frames and tools; arguments and refusals are those of `frames_from_json`."""
    text = read_text(path, MAX_FILE_BYTES, FrameFileError)
    return frames_from_json(text, str(path), tree)


@contextmanager
def _refused_at(file: str, where: str) -> Iterator[None]:
    try:
        yield
    except MotionError as error:
        raise FrameFileError(file, where, str(error)) from error


def frame_to_data(frame: Frame) -> dict[str, Any]:
    """Return a user frame as plain data of the schema."""
    return {**tool_to_data(frame), "parent": frame.parent}


def tool_to_data(frame: Frame) -> dict[str, Any]:
    """Return a tool as plain data of the schema."""
    pose = frame.pose or Pose.identity()  # users' frames do not move
    return {"name": frame.name, "xyz": pose.position.tolist(), "quat": pose.quaternion.tolist()}


def _parsed(text: str, file: str) -> Any:
    def once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        fields: dict[str, Any] = {}
        for key, value in pairs:
            if key in fields:
                raise FrameFileError(file, key[:LONGEST_NAME], "is given twice; accepted: once")
            fields[key] = value
        return fields

    try:
        # Integers are read as reals: one of thousands of digits is then infinite, not an error.
        return json.loads(text, parse_int=float, object_pairs_hook=once)
    except json.JSONDecodeError as error:
        problem = f"is not JSON at line {error.lineno}, column {error.colno}: {error.msg}"
        raise FrameFileError(file, "", problem) from None
    except RecursionError:
        raise FrameFileError(file, "", "nests too deeply") from None


def _document(content: Any, file: str) -> _Document:
    if not isinstance(content, dict):
        raise FrameFileError(file, "", f"is not an object; accepted: one with schema {SCHEMA!r}")
    if content.get("schema") != SCHEMA:
        raise FrameFileError(file, "schema", f"is not {SCHEMA!r}, the one schema accepted")
    for field in ("tools", "frames"):
        # Before each of them is looked at: what is wrong with a hundred thousand takes long to say.
        entries = content.get(field)
        if isinstance(entries, list) and len(entries) > MOST_FRAMES:
            problem = f"has {len(entries)} entries; accepted: at most {MOST_FRAMES}"
            raise FrameFileError(file, field, problem)
    try:
        return _Document.model_validate(content)
    except ValidationError as error:
        raise FrameFileError(file, *field_problems(error, _Document)[0]) from None


def _pose(placed: _Placed, file: str, where: str) -> Pose:
    length = math.hypot(*placed.quat)
    if not abs(length - 1.0) <= UNIT_TOLERANCE:
        problem = f"has length {length:.9g}; accepted: 1, to {UNIT_TOLERANCE:g} (order x, y, z, w)"
        raise FrameFileError(file, f"{where}.quat", problem)
    with _refused_at(file, f"{where}.xyz"):
        return Pose.from_values(placed.xyz, placed.quat)
