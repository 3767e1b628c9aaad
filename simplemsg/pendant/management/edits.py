"""Edits and statements of programs as the server takes them: JSON objects told apart by their tag.

Numbers of statements, of points and of signals count from 0; a comment is one line behind the
statement.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, NotRequired, TypeAlias, TypedDict


class Speed(TypedDict):
    """How fast a move is.

    Attributes:
        kind: `fraction` of the joints' greatest speeds, or the speed of the `tool`.
        value: more than 0 and at most 1, or the speed [m/s].
    """

    kind: Literal["fraction", "tool"]
    value: float


class Move(TypedDict):
    """Move to a point.

    Attributes:
        way: how.
        point: name of the point to go to.
        via: the points in between: one for CIRC, any number for SPLINE, none for the others.
        speed: how fast; PTP takes a fraction only. Left out for full speed.
        zone: where to turn towards the next point, 0 for a stop there [m; rad for PTP].
        dwell: how long to stand there [s]; not together with a zone.
        comment: one line behind it.
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
    """Stand still for a time.

    Attributes:
        duration: how long [s].
        comment: one line behind it.
    """

    statement: Literal["wait"]
    duration: float
    comment: NotRequired[str]


class WaitInput(TypedDict):
    """Stand still until an input has a value.

    Attributes:
        signal: number of the input.
        value: the value.
        timeout: how long to wait at most [s]; None for ever.
        comment: one line behind it.
    """

    statement: Literal["wait-input"]
    signal: int
    value: bool
    timeout: NotRequired[float | None]
    comment: NotRequired[str]


class SetOutput(TypedDict):
    """Give an output a value.

    Attributes:
        signal: number of the output.
        value: the value.
        comment: one line behind it.
    """

    statement: Literal["set-output"]
    signal: int
    value: bool
    comment: NotRequired[str]


class ReadInput(TypedDict):
    """Read an input into a flag, for conditions further on.

    Attributes:
        signal: number of the input.
        flag: name of the flag.
        comment: one line behind it.
    """

    statement: Literal["read-input"]
    signal: int
    flag: str
    comment: NotRequired[str]


class Attach(TypedDict):
    """Let the tool carry an object of the scene.

    Attributes:
        scene_object: name of the object.
        comment: one line behind it.
    """

    statement: Literal["attach"]
    scene_object: str
    comment: NotRequired[str]


class Detach(TypedDict):
    """Leave an object of the scene where it is.

    Attributes:
        scene_object: name of the object.
        comment: one line behind it.
    """

    statement: Literal["detach"]
    scene_object: str
    comment: NotRequired[str]


class Loop(TypedDict):
    """Open a block that runs several times; None for ever.

    Attributes:
        passes: how often; None for ever.
        comment: one line behind it.
    """

    statement: Literal["loop"]
    passes: NotRequired[int | None]
    comment: NotRequired[str]


class IfInput(TypedDict):
    """Open a block that runs if an input, read now, has a value.

    Attributes:
        signal: number of the input.
        value: the value.
        comment: one line behind it.
    """

    statement: Literal["if-input"]
    signal: int
    value: bool
    comment: NotRequired[str]


class IfFlag(TypedDict):
    """Open a block that runs if a flag, read before, has a value.

    Attributes:
        flag: name of the flag.
        value: the value.
        comment: one line behind it.
    """

    statement: Literal["if-flag"]
    flag: str
    value: bool
    comment: NotRequired[str]


class Else(TypedDict):
    """What runs if the condition of the block does not hold.

    Attributes:
        comment: one line behind it.
    """

    statement: Literal["else"]
    comment: NotRequired[str]


class End(TypedDict):
    """Close the block that was opened last.

    Attributes:
        comment: one line behind it.
    """

    statement: Literal["end"]
    comment: NotRequired[str]


class Call(TypedDict):
    """Run another program.

    Attributes:
        program: its name.
        comment: one line behind it.
    """

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
    """Which of the ways to reach its pose a point takes; turns: full turns of each joint.

    Attributes:
        shoulder: where the wrist is, seen from axis 1.
        elbow: where the elbow is, seen from the line between shoulder and wrist.
        wrist: the sign of the wrist's middle joint.
        turns: full turns of each joint; None where they are not said.
    """

    shoulder: Literal["front", "back"]
    elbow: Literal["up", "down"]
    wrist: Literal["no-flip", "flip"]
    turns: NotRequired[Sequence[int] | None]


class PointPose(TypedDict):
    """Where the tool is.

    Attributes:
        position: x, y, z in the frame [m].
        quaternion: x, y, z, w.
        frame: the frame's name.
        tool: the tool's name.
    """

    position: Sequence[float]
    quaternion: Sequence[float]
    frame: str
    tool: str


class TeachPoint(TypedDict):
    """One point.

    Attributes:
        name: unique in its program.
        joints: controller side [rad, m for a linear axis].
        pose: where that put the tool; None where nobody measured it.
        configuration: which of the ways to reach the pose; None where the robot has no such words.
        comment: lines of text; empty for none.
    """

    name: str
    joints: Sequence[float]
    pose: NotRequired[PointPose | None]
    configuration: NotRequired[ArmConfiguration | None]
    comment: NotRequired[str]


class RecordPoint(TypedDict):
    """Add a point with its numbers, and a move to it; `record` takes where the robot stands.

    Attributes:
        point: the new point.
        move: a move that names it; None for the point alone.
        at: the statement that the move is put before; None to append it.
    """

    edit: Literal["record-point"]
    point: TeachPoint
    move: NotRequired[Move | None]
    at: NotRequired[int | None]


class TouchUp(TypedDict):
    """Put a point elsewhere by its numbers; `touch_up` takes where the robot stands.

    Attributes:
        name: name of the point.
        joints: controller side [rad, m for a linear axis].
        pose: where that puts the tool; None where nobody measured it.
        configuration: which of the ways to reach the pose.
    """

    edit: Literal["touch-up"]
    name: str
    joints: Sequence[float]
    pose: NotRequired[PointPose | None]
    configuration: NotRequired[ArmConfiguration | None]


class DeletePoint(TypedDict):
    """Remove a point that no statement moves to.

    Attributes:
        name: name of the point.
    """

    edit: Literal["delete-point"]
    name: str


class RenamePoint(TypedDict):
    """Give a point another name, in all statements too.

    Attributes:
        name: name of the point.
        new_name: the name that it has afterwards.
    """

    edit: Literal["rename-point"]
    name: str
    new_name: str


class CommentPoint(TypedDict):
    """Say something about a point; empty to say nothing.

    Attributes:
        name: name of the point.
        comment: lines of text.
    """

    edit: Literal["comment-point"]
    name: str
    comment: str


class ReorderPoint(TypedDict):
    """Put a point at another place of the list.

    Attributes:
        name: name of the point.
        to: its number afterwards.
    """

    edit: Literal["reorder-point"]
    name: str
    to: int


class InsertStatements(TypedDict):
    """Put statements before another; None to append them. Blocks come whole.

    Attributes:
        statements: what to put there.
        at: the statement that they are put before.
    """

    edit: Literal["insert"]
    statements: Sequence[Statement]
    at: NotRequired[int | None]


class DeleteStatements(TypedDict):
    """Remove statements in a row, one where no count is given. Blocks go whole.

    Attributes:
        first: number of the first of them.
        count: how many.
    """

    edit: Literal["delete"]
    first: int
    count: NotRequired[int]


class ReorderStatements(TypedDict):
    """Move statements in a row; `to` is the number that the first has afterwards.

    Attributes:
        first: number of the first of them.
        count: how many.
        to: the number that the first has afterwards.
    """

    edit: Literal["reorder"]
    first: int
    count: int
    to: int


class ReplaceStatement(TypedDict):
    """Change one statement: its speed, its zone, its comment, or all of it.

    Attributes:
        at: number of the statement.
        statement: what stands there afterwards.
    """

    edit: Literal["replace"]
    at: int
    statement: Statement


class CommentStatement(TypedDict):
    """Say something beside a statement; empty to say nothing.

    Attributes:
        at: number of the statement.
        comment: one line.
    """

    edit: Literal["comment"]
    at: int
    comment: str


class DescribeProgram(TypedDict):
    """Change what is said of the whole program; its name is changed by `rename`.

    Attributes:
        name: None; a program is renamed by `programs.rename`.
        tool: the tool that new points are taught with; None as it is.
        frame: the frame that they are taught in; None as it is.
        comment: about the program; None as it is.
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
