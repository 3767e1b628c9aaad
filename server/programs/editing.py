"""Edits of a program as values: `apply(program, edit)` is the edited program.

Owns what each edit changes and what it refuses. An edit either leads to a valid program or to an
error, and the program that it was applied to is untouched.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Annotated, ClassVar, Literal, TypeAlias, TypeVar

from pydantic import ConfigDict, Field, TypeAdapter

from .document import AnyStatement
from .errors import BadValue, PointExists, PointInUse
from .points import CLOSED, ArmConfiguration, JointVector, PointPose, TeachPoint
from .program import Program
from .statements import Move

MOST_INSERTED = 200
"""Statements that one edit inserts; the event loop reads each of them."""

_T = TypeVar("_T")


@dataclass(frozen=True, slots=True)
class RecordPoint:
    """Add a point, and the statement that moves to it.

    Attributes:
        point: the new point.
        move: a move that names it; None for the point alone.
        at: the statement that the move is put before, from 0; None to append it.
    """

    __pydantic_config__: ClassVar[ConfigDict] = CLOSED

    edit: Literal["record-point"] = field(default="record-point", kw_only=True, repr=False)
    point: TeachPoint
    move: Move | None = None
    at: int | None = None


@dataclass(frozen=True, slots=True)
class TouchUp:
    """Put a point where the robot stands now; its name, comment and statements stay."""

    __pydantic_config__: ClassVar[ConfigDict] = CLOSED

    edit: Literal["touch-up"] = field(default="touch-up", kw_only=True, repr=False)
    name: str
    joints: JointVector
    pose: PointPose | None = None
    configuration: ArmConfiguration | None = None


@dataclass(frozen=True, slots=True)
class DeletePoint:
    """Remove a point that no statement moves to."""

    __pydantic_config__: ClassVar[ConfigDict] = CLOSED

    edit: Literal["delete-point"] = field(default="delete-point", kw_only=True, repr=False)
    name: str


@dataclass(frozen=True, slots=True)
class RenamePoint:
    """Give a point another name, in all statements too."""

    __pydantic_config__: ClassVar[ConfigDict] = CLOSED

    edit: Literal["rename-point"] = field(default="rename-point", kw_only=True, repr=False)
    name: str
    new_name: str


@dataclass(frozen=True, slots=True)
class CommentPoint:
    """Say something about a point; empty to say nothing."""

    __pydantic_config__: ClassVar[ConfigDict] = CLOSED

    edit: Literal["comment-point"] = field(default="comment-point", kw_only=True, repr=False)
    name: str
    comment: str


@dataclass(frozen=True, slots=True)
class ReorderPoint:
    """Put a point at another place of the list, from 0."""

    __pydantic_config__: ClassVar[ConfigDict] = CLOSED

    edit: Literal["reorder-point"] = field(default="reorder-point", kw_only=True, repr=False)
    name: str
    to: int


@dataclass(frozen=True, slots=True)
class InsertStatements:
    """Put statements before another, from 0; None to append them. Blocks come whole."""

    __pydantic_config__: ClassVar[ConfigDict] = CLOSED

    edit: Literal["insert"] = field(default="insert", kw_only=True, repr=False)
    statements: Annotated[tuple[AnyStatement, ...], Field(max_length=MOST_INSERTED)]
    at: int | None = None


@dataclass(frozen=True, slots=True)
class DeleteStatements:
    """Remove statements in a row. Blocks go whole."""

    __pydantic_config__: ClassVar[ConfigDict] = CLOSED

    edit: Literal["delete"] = field(default="delete", kw_only=True, repr=False)
    first: int
    count: int = 1


@dataclass(frozen=True, slots=True)
class ReorderStatements:
    """Move statements in a row to another place.

    Attributes:
        first: the first of them, from 0.
        count: how many.
        to: the number that the first has afterwards.
    """

    __pydantic_config__: ClassVar[ConfigDict] = CLOSED

    edit: Literal["reorder"] = field(default="reorder", kw_only=True, repr=False)
    first: int
    count: int
    to: int


@dataclass(frozen=True, slots=True)
class ReplaceStatement:
    """Change one statement: its speed, its zone, its comment, or all of it."""

    __pydantic_config__: ClassVar[ConfigDict] = CLOSED

    edit: Literal["replace"] = field(default="replace", kw_only=True, repr=False)
    at: int
    statement: AnyStatement


@dataclass(frozen=True, slots=True)
class CommentStatement:
    """Say something beside a statement; empty to say nothing."""

    __pydantic_config__: ClassVar[ConfigDict] = CLOSED

    edit: Literal["comment"] = field(default="comment", kw_only=True, repr=False)
    at: int
    comment: str


@dataclass(frozen=True, slots=True)
class DescribeProgram:
    """Change what is said of the whole program; None leaves a value as it is."""

    __pydantic_config__: ClassVar[ConfigDict] = CLOSED

    edit: Literal["describe"] = field(default="describe", kw_only=True, repr=False)
    name: str | None = None
    tool: str | None = None
    frame: str | None = None
    comment: str | None = None


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

EDIT: TypeAdapter[Edit] = TypeAdapter(Annotated[Edit, Field(discriminator="edit")])
"""Reads and writes the JSON of an edit."""


def apply(program: Program, edit: Edit) -> Program:
    """Return the edited program.

    Raises:
        ProgramError: the edit names what is not there, or would leave a program that is not valid.
    """
    match edit:
        case RecordPoint():
            return _record(program, edit)
        case TouchUp(name, joints, pose, configuration):
            old = program.point(name)
            touched = replace(old, joints=joints, pose=pose, configuration=configuration)
            return _with_point(program, name, touched)
        case CommentPoint(name, comment):
            return _with_point(program, name, replace(program.point(name), comment=comment))
        case RenamePoint(name, new_name):
            return _renamed(program, name, new_name)
        case DeletePoint(name):
            uses = program.uses_of(program.point(name).name)
            if uses:
                raise PointInUse(name, uses)
            return replace(program, points=tuple(p for p in program.points if p.name != name))
        case ReorderPoint(name, to):
            first = program.points.index(program.point(name))
            return replace(program, points=_moved(program.points, first, 1, to, "points"))
        case DescribeProgram():
            return _described(program, edit)
    return replace(program, statements=tuple(_edited_statements(program, edit)))


StatementEdit: TypeAlias = (
    InsertStatements | DeleteStatements | ReorderStatements | ReplaceStatement | CommentStatement
)


def _edited_statements(program: Program, edit: StatementEdit) -> tuple[AnyStatement, ...]:
    old = program.statements
    match edit:
        case InsertStatements(statements, at):
            place = _place(len(old) if at is None else at, len(old) + 1)
            return (*old[:place], *statements, *old[place:])
        case DeleteStatements(first, count):
            _check_range(first, count, len(old), "statements")
            return (*old[:first], *old[first + count :])
        case ReorderStatements(first, count, to):
            return _moved(old, first, count, to, "statements")
        case ReplaceStatement(at, statement):
            place = _place(at, len(old))
            return (*old[:place], statement, *old[place + 1 :])
        case CommentStatement(at, comment):
            place = _place(at, len(old))
            return (*old[:place], replace(old[place], comment=comment), *old[place + 1 :])


def _record(program: Program, edit: RecordPoint) -> Program:
    if edit.point.name in program.point_by_name:
        raise PointExists(edit.point.name)
    points = (*program.points, edit.point)
    if edit.move is None:
        return replace(program, points=points)
    if edit.point.name not in edit.move.points:
        names = ", ".join(edit.move.points)
        raise BadValue("the move", f"goes to {names}; accepted: a move to {edit.point.name}")
    statements = _edited_statements(program, InsertStatements((edit.move,), edit.at))
    return replace(program, points=points, statements=statements)


def _with_point(program: Program, name: str, point: TeachPoint) -> Program:
    points = tuple(point if old.name == name else old for old in program.points)
    return replace(program, points=points)


def _renamed(program: Program, name: str, new_name: str) -> Program:
    point = program.point(name)
    if new_name != name and new_name in program.point_by_name:
        raise PointExists(new_name)

    def new(old: str) -> str:
        return new_name if old == name else old

    statements = tuple(
        replace(
            statement,
            point=new(statement.point),
            via=tuple(new(each) for each in statement.via),
        )
        if isinstance(statement, Move)
        else statement
        for statement in program.statements
    )
    points = tuple(replace(p, name=new_name) if p is point else p for p in program.points)
    return replace(program, points=points, statements=statements)


def _described(program: Program, edit: DescribeProgram) -> Program:
    return replace(
        program,
        name=program.name if edit.name is None else edit.name,
        tool=program.tool if edit.tool is None else edit.tool,
        frame=program.frame if edit.frame is None else edit.frame,
        comment=program.comment if edit.comment is None else edit.comment,
    )


def _moved(old: tuple[_T, ...], first: int, count: int, to: int, what: str) -> tuple[_T, ...]:
    _check_range(first, count, len(old), what)
    taken, rest = old[first : first + count], (*old[:first], *old[first + count :])
    place = _place(to, len(rest) + 1)
    return (*rest[:place], *taken, *rest[place:])


def _place(index: int, count: int) -> int:
    if not 0 <= index < count:
        accepted = f"0 to {count - 1}" if count else "none, there are no statements"
        raise BadValue("the place", f"is {index}; accepted: {accepted}")
    return index


def _check_range(first: int, count: int, there: int, what: str) -> None:
    if not (0 <= first and count >= 1 and first + count <= there):
        raise BadValue(what, f"{first} to {first + count - 1} are asked for; there are {there}")
