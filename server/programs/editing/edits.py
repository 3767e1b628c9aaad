"""Edits of a program: a closed set of values, read from the requests of pendants.

Owns the fields of each edit; `editing` owns its effect on a program.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated, ClassVar, Literal, TypeAlias

from pydantic import ConfigDict, Field

from ..language.points import CLOSED, ArmConfiguration, JointVector, PointPose, TeachPoint
from ..language.program_json import AnyStatement
from ..language.statements import Move

MOST_INSERTED = 200
"""Statements that one edit inserts; the event loop reads each of them."""


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
