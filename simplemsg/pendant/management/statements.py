"""Statements of programs as the server takes and gives them: JSON objects told apart by their tag.

Numbers of statements count from 0, signals too; a comment is one line behind the statement.
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
