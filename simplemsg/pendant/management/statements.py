"""The statements of a program and its edits: two closed sets of values.

Owns what each statement says and which values it takes, and the fields of each edit. A block (loop
or condition) is opened by its statement and closed by `End`, as the lines of the text are: so a
statement has a number, and edits, breakpoints and the current line speak of that. That blocks close
is checked by the server.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum
from typing import Annotated, Literal, TypeAlias

from .declaration import Length, ToldApart
from .program_values import (
    ArmConfiguration,
    BadValue,
    JointVector,
    PointPose,
    TeachPoint,
    Value,
    check_comment_line,
    check_name,
    check_number,
)

LONGEST_WAIT = 86_400.0
"""Longest wait, dwell or time limit [s]: a day."""

MOST_PASSES = 1_000_000
"""Passes of a counted loop."""

MOST_VIAS = 100
"""Points that one spline goes through before its last."""

LARGEST_SIGNAL = 65_535
"""Largest number of an input or an output."""

FASTEST_TOOL = 10.0
"""Fastest speed of the tool that a statement may ask for [m/s]."""

LEAST_ZONE, LARGEST_ZONE = 1e-6, 10.0
"""Bounds of a zone [m, or rad for PTP]."""


class Way(StrEnum):
    """How the robot gets to a point."""

    PTP = "PTP"
    LIN = "LIN"
    CIRC = "CIRC"
    SPLINE = "SPLINE"


class SpeedKind(StrEnum):
    """What a speed is relative to."""

    FRACTION = "fraction"
    TOOL = "tool"


@dataclass(frozen=True, slots=True)
class Speed(Value):
    """How fast.

    Attributes:
        kind: whether the value is a fraction of the joints' greatest speeds, or the tool's speed.
        value: more than 0 and at most 1, or the speed [m/s].
    """

    kind: SpeedKind
    value: float

    def __post_init__(self) -> None:
        if self.kind is SpeedKind.FRACTION:
            check_number(self.value, "the speed", 1e-4, 1.0)
        else:
            check_number(self.value, "the speed", 1e-4, FASTEST_TOOL, "m/s")


FULL_SPEED = Speed(SpeedKind.FRACTION, 1.0)


@dataclass(frozen=True, slots=True)
class _Statement(Value):
    """What all statements have: a comment behind them, one line, empty for none."""

    comment: str = field(default="", kw_only=True)
    """one line behind it."""

    def __post_init__(self) -> None:
        check_comment_line(self.comment)
        self._check()

    def _check(self) -> None:
        """Check the values of the statement's own."""


@dataclass(frozen=True, slots=True)
class Move(_Statement):
    """Move to a point.

    Attributes:
        way: how.
        point: name of the point to go to.
        via: the points in between: one for CIRC, any number for SPLINE, none for the others.
        speed: how fast; PTP takes a fraction only.
        zone: distance from the point at which to turn towards the next one, 0 for a stop there:
            of the tool [m], for PTP of the joints [rad]; none for SPLINE, which ends at rest.
        dwell: how long to stand there [s]; not together with a zone.
    """

    statement: Literal["move"] = field(default="move", kw_only=True, repr=False)
    way: Way
    point: str
    via: tuple[str, ...] = ()
    speed: Speed = FULL_SPEED
    zone: float = 0.0
    dwell: float = 0.0

    def _check(self) -> None:
        for place, name in enumerate(self.points):
            check_name(name, "the point", place)
        self._check_via()
        if self.way is Way.PTP and self.speed.kind is SpeedKind.TOOL:
            raise BadValue("the speed", "of PTP is of the joints; accepted: a percentage")
        if self.zone != 0.0:
            unit = "rad" if self.way is Way.PTP else "m"
            check_number(self.zone, "the zone", LEAST_ZONE, LARGEST_ZONE, unit)
        check_number(self.dwell, "the dwell", 0.0, LONGEST_WAIT, "s")
        if self.zone and self.way is Way.SPLINE:
            raise BadValue("the zone", "of SPLINE is given; accepted: none, it ends at rest")
        if self.zone and self.dwell:
            raise BadValue("the dwell", "stands beside a zone; accepted: one of both")

    def _check_via(self) -> None:
        count = len(self.via)
        match self.way:
            case Way.CIRC if count != 1:
                problem = f"names {count} points; accepted: one for CIRC"
                raise BadValue("via", problem, place=min(count, 1))
            case Way.PTP | Way.LIN if count:
                raise BadValue("via", f"names {count} points; accepted: none for {self.way}")
        if count > MOST_VIAS:
            problem = f"names {count} points; accepted: up to {MOST_VIAS}"
            raise BadValue("via", problem, place=MOST_VIAS)

    @property
    def points(self) -> tuple[str, ...]:
        """All points that it names, the one to go to first."""
        return (self.point, *self.via)


@dataclass(frozen=True, slots=True)
class Wait(_Statement):
    """Stand still for a time [s]."""

    statement: Literal["wait"] = field(default="wait", kw_only=True, repr=False)
    duration: float
    """how long [s]."""

    def _check(self) -> None:
        check_number(self.duration, "the wait", 0.0, LONGEST_WAIT, "s")


@dataclass(frozen=True, slots=True)
class WaitInput(_Statement):
    """Stand still until an input has a value.

    Attributes:
        signal: number of the input.
        value: the value.
        timeout: how long to wait at most [s]; None for ever.
    """

    statement: Literal["wait-input"] = field(default="wait-input", kw_only=True, repr=False)
    signal: int
    value: bool
    timeout: float | None = None

    def _check(self) -> None:
        check_number(self.signal, "the input", 0, LARGEST_SIGNAL)
        if self.timeout is not None:
            check_number(self.timeout, "the timeout", 0.0, LONGEST_WAIT, "s")


@dataclass(frozen=True, slots=True)
class SetOutput(_Statement):
    """Give an output a value."""

    statement: Literal["set-output"] = field(default="set-output", kw_only=True, repr=False)
    signal: int
    """number of the output."""
    value: bool
    """the value."""

    def _check(self) -> None:
        check_number(self.signal, "the output", 0, LARGEST_SIGNAL)


@dataclass(frozen=True, slots=True)
class ReadInput(_Statement):
    """Read an input into a flag, for conditions further on."""

    statement: Literal["read-input"] = field(default="read-input", kw_only=True, repr=False)
    signal: int
    """number of the input."""
    flag: str
    """name of the flag."""

    def _check(self) -> None:
        check_number(self.signal, "the input", 0, LARGEST_SIGNAL)
        check_name(self.flag, "the flag")


@dataclass(frozen=True, slots=True)
class Attach(_Statement):
    """Let the tool carry an object of the scene."""

    statement: Literal["attach"] = field(default="attach", kw_only=True, repr=False)
    scene_object: str
    """name of the object."""

    def _check(self) -> None:
        check_name(self.scene_object, "the object")


@dataclass(frozen=True, slots=True)
class Detach(_Statement):
    """Leave an object of the scene where it is."""

    statement: Literal["detach"] = field(default="detach", kw_only=True, repr=False)
    scene_object: str
    """name of the object."""

    def _check(self) -> None:
        check_name(self.scene_object, "the object")


@dataclass(frozen=True, slots=True)
class Loop(_Statement):
    """Open a block that runs several times; None for ever."""

    statement: Literal["loop"] = field(default="loop", kw_only=True, repr=False)
    passes: int | None = None
    """how often; None for ever."""

    def _check(self) -> None:
        if self.passes is not None:
            check_number(self.passes, "the number of passes", 1, MOST_PASSES)


@dataclass(frozen=True, slots=True)
class IfInput(_Statement):
    """Open a block that runs if an input, read now, has a value."""

    statement: Literal["if-input"] = field(default="if-input", kw_only=True, repr=False)
    signal: int
    """number of the input."""
    value: bool
    """the value."""

    def _check(self) -> None:
        check_number(self.signal, "the input", 0, LARGEST_SIGNAL)


@dataclass(frozen=True, slots=True)
class IfFlag(_Statement):
    """Open a block that runs if a flag, read before, has a value."""

    statement: Literal["if-flag"] = field(default="if-flag", kw_only=True, repr=False)
    flag: str
    """name of the flag."""
    value: bool
    """the value."""

    def _check(self) -> None:
        check_name(self.flag, "the flag")


@dataclass(frozen=True, slots=True)
class Else(_Statement):
    """What runs if the condition of the block does not hold."""

    statement: Literal["else"] = field(default="else", kw_only=True, repr=False)


@dataclass(frozen=True, slots=True)
class End(_Statement):
    """Close the block that was opened last."""

    statement: Literal["end"] = field(default="end", kw_only=True, repr=False)


@dataclass(frozen=True, slots=True)
class Call(_Statement):
    """Run another program."""

    statement: Literal["call"] = field(default="call", kw_only=True, repr=False)
    program: str
    """its name."""

    def _check(self) -> None:
        check_name(self.program, "the program")


@dataclass(frozen=True, slots=True)
class Comment(_Statement):
    """A line for the reader; its text is `comment`."""

    statement: Literal["comment"] = field(default="comment", kw_only=True, repr=False)


If: TypeAlias = IfInput | IfFlag
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

AnyStatement: TypeAlias = Annotated[Statement, ToldApart("statement")]
"""A statement as it is read from JSON."""

MOST_INSERTED = 200
"""Statements that one edit inserts; the event loop reads each of them."""


@dataclass(frozen=True, slots=True)
class RecordPoint(Value):
    """Add a point, and the statement that moves to it.

    Attributes:
        point: the new point.
        move: a move that names it; None for the point alone.
        at: the statement that the move is put before, from 0; None to append it.
    """

    edit: Literal["record-point"] = field(default="record-point", kw_only=True, repr=False)
    point: TeachPoint
    move: Move | None = None
    at: int | None = None


@dataclass(frozen=True, slots=True)
class TouchUp(Value):
    """Put a point where the robot stands now; its name, comment and statements stay."""

    edit: Literal["touch-up"] = field(default="touch-up", kw_only=True, repr=False)
    name: str
    """name of the point."""
    joints: JointVector
    """controller side [rad, m for a linear axis]."""
    pose: PointPose | None = None
    """where that puts the tool; None where nobody measured it."""
    configuration: ArmConfiguration | None = None
    """which of the ways to reach the pose."""


@dataclass(frozen=True, slots=True)
class DeletePoint(Value):
    """Remove a point that no statement moves to."""

    edit: Literal["delete-point"] = field(default="delete-point", kw_only=True, repr=False)
    name: str
    """name of the point."""


@dataclass(frozen=True, slots=True)
class RenamePoint(Value):
    """Give a point another name, in all statements too."""

    edit: Literal["rename-point"] = field(default="rename-point", kw_only=True, repr=False)
    name: str
    """name of the point."""
    new_name: str
    """the name that it has afterwards."""


@dataclass(frozen=True, slots=True)
class CommentPoint(Value):
    """Say something about a point; empty to say nothing."""

    edit: Literal["comment-point"] = field(default="comment-point", kw_only=True, repr=False)
    name: str
    """name of the point."""
    comment: str
    """lines of text."""


@dataclass(frozen=True, slots=True)
class ReorderPoint(Value):
    """Put a point at another place of the list, from 0."""

    edit: Literal["reorder-point"] = field(default="reorder-point", kw_only=True, repr=False)
    name: str
    """name of the point."""
    to: int
    """its number afterwards."""


@dataclass(frozen=True, slots=True)
class InsertStatements(Value):
    """Put statements before another, from 0; None to append them. Blocks come whole."""

    edit: Literal["insert"] = field(default="insert", kw_only=True, repr=False)
    statements: Annotated[tuple[AnyStatement, ...], Length(None, MOST_INSERTED)]
    """what to put there."""
    at: int | None = None
    """the statement that they are put before."""


@dataclass(frozen=True, slots=True)
class DeleteStatements(Value):
    """Remove statements in a row. Blocks go whole."""

    edit: Literal["delete"] = field(default="delete", kw_only=True, repr=False)
    first: int
    """number of the first of them."""
    count: int = 1
    """how many."""


@dataclass(frozen=True, slots=True)
class ReorderStatements(Value):
    """Move statements in a row to another place.

    Attributes:
        first: the first of them, from 0.
        count: how many.
        to: the number that the first has afterwards.
    """

    edit: Literal["reorder"] = field(default="reorder", kw_only=True, repr=False)
    first: int
    count: int
    to: int


@dataclass(frozen=True, slots=True)
class ReplaceStatement(Value):
    """Change one statement: its speed, its zone, its comment, or all of it."""

    edit: Literal["replace"] = field(default="replace", kw_only=True, repr=False)
    at: int
    """number of the statement."""
    statement: AnyStatement
    """what stands there afterwards."""


@dataclass(frozen=True, slots=True)
class CommentStatement(Value):
    """Say something beside a statement; empty to say nothing."""

    edit: Literal["comment"] = field(default="comment", kw_only=True, repr=False)
    at: int
    """number of the statement."""
    comment: str
    """one line."""


@dataclass(frozen=True, slots=True)
class DescribeProgram(Value):
    """Change what is said of the whole program; None leaves a value as it is."""

    edit: Literal["describe"] = field(default="describe", kw_only=True, repr=False)
    name: str | None = None
    tool: str | None = None
    """the tool that new points are taught with; None as it is."""
    frame: str | None = None
    """the frame that they are taught in; None as it is."""
    comment: str | None = None
    """about the program; None as it is."""


StatementEdit: TypeAlias = (
    InsertStatements | DeleteStatements | ReorderStatements | ReplaceStatement | CommentStatement
)
Edit: TypeAlias = (
    RecordPoint
    | TouchUp
    | DeletePoint
    | RenamePoint
    | CommentPoint
    | ReorderPoint
    | StatementEdit
    | DescribeProgram
)

AnyEdit: TypeAlias = Annotated[Edit, ToldApart("edit")]
"""An edit as it is read from JSON."""
