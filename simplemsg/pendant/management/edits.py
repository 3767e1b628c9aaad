"""Edits and statements of programs as clients give them: JSON objects told apart by their tag.

Each is read as the class of the same name in `statements` or `points`, which says what a field
means, its bounds and its default; here stands only what differs for whoever writes JSON. Numbers of
statements, of points and of signals count from 0; a comment is one line behind the statement.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, NotRequired, TypeAlias, TypedDict


class Speed(TypedDict):
    """How fast a move is.

    Attributes:
        kind: `fraction` of the joints' greatest speeds, or the speed of the `tool`.
    """

    kind: Literal["fraction", "tool"]
    value: float


class Move(TypedDict):
    """Move to a point.

    Attributes:
        speed: how fast; PTP takes a fraction only. Left out for full speed.
        zone: where to turn towards the next point, 0 for a stop there [m; rad for PTP].
    """

    statement: Literal["move"]
    way: Literal["PTP", "LIN", "CIRC", "SPLINE"]
    point: str
    via: NotRequired[Sequence[str]]
    speed: NotRequired[Speed]
    zone: NotRequired[float]
    dwell: NotRequired[float]
    comment: NotRequired[str]


class Wait(TypedDict):
    """Stand still for a time."""

    statement: Literal["wait"]
    duration: float
    comment: NotRequired[str]


class WaitInput(TypedDict):
    """Stand still until an input has a value."""

    statement: Literal["wait-input"]
    signal: int
    value: bool
    timeout: NotRequired[float | None]
    comment: NotRequired[str]


class SetOutput(TypedDict):
    """Give an output a value."""

    statement: Literal["set-output"]
    signal: int
    value: bool
    comment: NotRequired[str]


class ReadInput(TypedDict):
    """Read an input into a flag, for conditions further on."""

    statement: Literal["read-input"]
    signal: int
    flag: str
    comment: NotRequired[str]


class Attach(TypedDict):
    """Let the tool carry an object of the scene."""

    statement: Literal["attach"]
    scene_object: str
    comment: NotRequired[str]


class Detach(TypedDict):
    """Leave an object of the scene where it is."""

    statement: Literal["detach"]
    scene_object: str
    comment: NotRequired[str]


class Loop(TypedDict):
    """Open a block that runs several times; None for ever."""

    statement: Literal["loop"]
    passes: NotRequired[int | None]
    comment: NotRequired[str]


class IfInput(TypedDict):
    """Open a block that runs if an input, read now, has a value."""

    statement: Literal["if-input"]
    signal: int
    value: bool
    comment: NotRequired[str]


class IfFlag(TypedDict):
    """Open a block that runs if a flag, read before, has a value."""

    statement: Literal["if-flag"]
    flag: str
    value: bool
    comment: NotRequired[str]


class Else(TypedDict):
    """What runs if the condition of the block does not hold."""

    statement: Literal["else"]
    comment: NotRequired[str]


class End(TypedDict):
    """Close the block that was opened last."""

    statement: Literal["end"]
    comment: NotRequired[str]


class Call(TypedDict):
    """Run another program."""

    statement: Literal["call"]
    program: str
    comment: NotRequired[str]


class Comment(TypedDict):
    """A line for the reader.

    Attributes:
        comment: the line.
    """

    statement: Literal["comment"]
    comment: NotRequired[str]


Statement: TypeAlias = (
    Move
    | Wait
    | WaitInput
    | SetOutput
    | ReadInput
    | Attach
    | Detach
    | Loop
    | IfInput
    | IfFlag
    | Else
    | End
    | Call
    | Comment
)


class ArmConfiguration(TypedDict):
    """Which of the ways to reach its pose a point takes; turns: full turns of each joint."""

    shoulder: Literal["front", "back"]
    elbow: Literal["up", "down"]
    wrist: Literal["no-flip", "flip"]
    turns: NotRequired[Sequence[int] | None]


class PointPose(TypedDict):
    """Where the tool is.

    Attributes:
        position: x, y, z in the frame [m].
        quaternion: x, y, z, w.
    """

    position: Sequence[float]
    quaternion: Sequence[float]
    frame: str
    tool: str


class TeachPoint(TypedDict):
    """One point.

    Attributes:
        joints: controller side [rad, m for a linear axis].
    """

    name: str
    joints: Sequence[float]
    pose: NotRequired[PointPose | None]
    configuration: NotRequired[ArmConfiguration | None]
    comment: NotRequired[str]


class RecordPoint(TypedDict):
    """Add a point with its numbers, and a move to it; `record` takes where the robot stands.

    Attributes:
        at: the statement that the move is put before; None to append it.
    """

    edit: Literal["record-point"]
    point: TeachPoint
    move: NotRequired[Move | None]
    at: NotRequired[int | None]


class TouchUp(TypedDict):
    """Put a point elsewhere by its numbers; `touch_up` takes where the robot stands."""

    edit: Literal["touch-up"]
    name: str
    joints: Sequence[float]
    pose: NotRequired[PointPose | None]
    configuration: NotRequired[ArmConfiguration | None]


class DeletePoint(TypedDict):
    """Remove a point that no statement moves to."""

    edit: Literal["delete-point"]
    name: str


class RenamePoint(TypedDict):
    """Give a point another name, in all statements too."""

    edit: Literal["rename-point"]
    name: str
    new_name: str


class CommentPoint(TypedDict):
    """Say something about a point; empty to say nothing."""

    edit: Literal["comment-point"]
    name: str
    comment: str


class ReorderPoint(TypedDict):
    """Put a point at another place of the list."""

    edit: Literal["reorder-point"]
    name: str
    to: int


class InsertStatements(TypedDict):
    """Put statements before another; None to append them. Blocks come whole."""

    edit: Literal["insert"]
    statements: Sequence[Statement]
    at: NotRequired[int | None]


class DeleteStatements(TypedDict):
    """Remove statements in a row, one where no count is given. Blocks go whole."""

    edit: Literal["delete"]
    first: int
    count: NotRequired[int]


class ReorderStatements(TypedDict):
    """Move statements in a row; `to` is the number that the first has afterwards.

    Attributes:
        first: number of the first of them.
    """

    edit: Literal["reorder"]
    first: int
    count: int
    to: int


class ReplaceStatement(TypedDict):
    """Change one statement: its speed, its zone, its comment, or all of it."""

    edit: Literal["replace"]
    at: int
    statement: Statement


class CommentStatement(TypedDict):
    """Say something beside a statement; empty to say nothing."""

    edit: Literal["comment"]
    at: int
    comment: str


class DescribeProgram(TypedDict):
    """Change what is said of the whole program; its name is changed by `rename`.

    Attributes:
        name: None; a program is renamed by `programs.rename`.
    """

    edit: Literal["describe"]
    name: NotRequired[None]
    tool: NotRequired[str | None]
    frame: NotRequired[str | None]
    comment: NotRequired[str | None]


Edit: TypeAlias = (
    RecordPoint
    | TouchUp
    | DeletePoint
    | RenamePoint
    | CommentPoint
    | ReorderPoint
    | InsertStatements
    | DeleteStatements
    | ReorderStatements
    | ReplaceStatement
    | CommentStatement
    | DescribeProgram
)
