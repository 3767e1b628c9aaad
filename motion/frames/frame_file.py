"""Frames and tools as a file: JSON of schema `openpendant-frames/1`.

Owns the layout, the bounds and the wording of what is wrong with a file. SI: metres; quaternions
x, y, z, w of length 1. Predefined frames are the robot's and never in the file; parents stand
before children. A tool's `grasp`, and each key of it, may be left out. Knows the tree, and no
robot.

    {"schema": "openpendant-frames/1",
     "tools": [{"name": "gripper", "xyz": [0, 0, 0.12], "quat": [0, 0, 0, 1],
                "grasp": {"point": [0, 0, 0.01], "reach": 0.02, "part": 3}}],
     "selected_tool": "gripper",
     "frames": [{"name": "table", "parent": "base", "xyz": [0.5, 0, 0], "quat": [0, 0, 0, 1]}]}
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal, TypeAlias

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from ..bounded_file import read_text
from ..description.field_problems import field_problems
from ..errors import FrameFileError, MotionError
from ..pickled_pieces import A_PIECE, LongTuple
from ..pose import Pose
from ..steps import Stepwise, at_once
from .frame_tree import FLANGE, LONGEST_NAME, MOST_FRAMES, Frame, FrameTree, GrowingTree
from .grasp import DEFAULT_GRASP, MOST_OFFSET, MOST_PARTS, MOST_REACH, Grasp

SCHEMA = "openpendant-frames/1"

MAX_FILE_BYTES = 1 << 20

UNIT_TOLERANCE = 1e-6
"""Greatest deviation of a quaternion's length from 1."""

# About how long it takes on an ordinary machine [µs].
_PER_PARSED = 0.03  # character
_PER_CHECKED = 0.03  # character
_PER_READ = 13.0  # entry
_PER_UNPICKLED = 2.5  # frame
_PER_ADDED = 2.5  # frame
_PER_COPIED = 0.3  # frame of a tree

_Real: TypeAlias = Annotated[float, Field(strict=True, allow_inf_nan=False)]
_Name: TypeAlias = Annotated[str, Field(strict=True, min_length=1, max_length=LONGEST_NAME)]


class _Part(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


class _Placed(_Part):
    name: _Name
    xyz: tuple[_Real, _Real, _Real]
    quat: tuple[_Real, _Real, _Real, _Real]


_Offset: TypeAlias = Annotated[_Real, Field(ge=-MOST_OFFSET, le=MOST_OFFSET)]


class _Grasp(_Part):
    point: tuple[_Offset, _Offset, _Offset] = DEFAULT_GRASP.point
    reach: Annotated[_Real, Field(ge=0.0, le=MOST_REACH)] = DEFAULT_GRASP.reach
    # A whole number, which is read as a real.
    part: Annotated[_Real, Field(ge=0, lt=MOST_PARTS, multiple_of=1)] | None = None

    @property
    def value(self) -> Grasp:
        return Grasp(self.point, self.reach, None if self.part is None else int(self.part))


class _Tool(_Placed):
    grasp: _Grasp | None = None


class _UserFrame(_Placed):
    parent: _Name


class _Document(_Part):
    schema_: Literal["openpendant-frames/1"] = Field(alias="schema")
    tools: tuple[_Tool, ...] = Field(default=(), max_length=MOST_FRAMES)
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


def part_of_frames(tree: FrameTree, first: int, most: int) -> tuple[dict[str, Any], int]:
    """Return some of the tools and user frames as a file's content, and how many there are in all.

    Args:
        first: number of the first that is wanted; the tools come before the frames.
    """
    tools, frames = tree.tools, tree.user_frames
    behind = first + most
    from_frame, to_frame = (max(at - len(tools), 0) for at in (first, behind))
    content = {
        "schema": SCHEMA,
        "tools": [tool_to_data(tool) for tool in tools[first:behind]],
        "selected_tool": tree.selected_tool,
        "frames": [frame_to_data(frame) for frame in frames[from_frame:to_frame]],
    }
    return content, len(tools) + len(frames)


@dataclass(frozen=True, slots=True)
class FramesFile:
    """What a file of frames and tools says, before a tree has accepted it.

    It can come from another process, which has read the text; to be added to a tree is cheap.

    Attributes:
        file: its name in errors.
        placed: the tools and then the frames, up to the first that no tree would accept.
        tools: how many of the file's entries are tools.
        selected_tool: the tool that it selects; None for none.
        problem: what is wrong behind those placed, or with the whole file; None for nothing.
    """

    file: str
    placed: LongTuple[Frame]
    tools: int = 0
    selected_tool: str | None = None
    problem: FrameFileError | None = None

    def added_to(self, tree: FrameTree) -> Stepwise[FrameTree]:
        """Return a tree with the frames and tools of the file, in steps.

        Raises:
            FrameFileError: there is a problem, or the tree does not accept one of its frames.
        """
        placed = yield from self.placed.steps()
        yield _PER_COPIED * len(tree.frames)
        growing = GrowingTree(tree)
        for first in range(0, len(placed), A_PIECE):
            some = placed[first : first + A_PIECE]
            yield _PER_ADDED * len(some)
            for index, frame in enumerate(some, first):
                assert frame.pose is not None
                assert frame.parent is not None
                with _refused_at(self.file, _where(index, self.tools)):
                    growing.add(frame.name, frame.pose, frame.parent, frame.grasp)
        if self.problem is not None:
            raise self.problem
        yield _PER_COPIED * len(placed)
        if self.selected_tool is None:
            return growing.tree
        with _refused_at(self.file, "selected_tool"):
            return growing.tree.select_tool(self.selected_tool)


def read_frames(text: str, file: str = "frames") -> Stepwise[FramesFile]:
    """Read the text of a file, in steps; what is wrong with it is in what they return."""
    yield _PER_PARSED * len(text)
    try:
        content = _parsed(text, file)
        yield _PER_CHECKED * len(text)
        document = _document(content, file)
    except FrameFileError as error:
        return FramesFile(file, LongTuple((), _PER_UNPICKLED), problem=error)
    tools = len(document.tools)
    entries = [*document.tools, *document.frames]
    placed: list[Frame] = []

    def read(problem: FrameFileError | None) -> FramesFile:
        frames = LongTuple(placed, _PER_UNPICKLED)
        return FramesFile(file, frames, tools, document.selected_tool, problem)

    for first in range(0, len(entries), A_PIECE):
        some = entries[first : first + A_PIECE]
        yield _PER_READ * len(some)
        for index, entry in enumerate(some, first):
            try:
                pose = _pose(entry, file, _where(index, tools))
            except FrameFileError as error:
                return read(error)
            parent = entry.parent if isinstance(entry, _UserFrame) else FLANGE
            grasp = entry.grasp.value if isinstance(entry, _Tool) and entry.grasp else None
            placed.append(Frame(entry.name, parent, pose, grasp=grasp))
    return read(None)


def _where(index: int, tools: int) -> str:
    """Return where an entry of a file is, the tools being the first."""
    return f"tools[{index}]" if index < tools else f"frames[{index - tools}]"


def frames_from_json(text: str, file: str = "frames", tree: FrameTree | None = None) -> FrameTree:
    """Return a tree with the frames and tools of a file's text.

    Args:
        tree: the tree that they are added to; base, root, flange and tool if None.

    Raises:
        FrameFileError: the text is not such JSON, or the tree does not accept one of its frames.
    """
    read = at_once(read_frames(text, file))
    return at_once(read.added_to(FrameTree() if tree is None else tree))


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
    data = {"name": frame.name, "xyz": pose.position.tolist(), "quat": pose.quaternion.tolist()}
    grasp = frame.grasp
    if grasp is not None:
        data["grasp"] = {"point": list(grasp.point), "reach": grasp.reach, "part": grasp.part}
    return data


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
