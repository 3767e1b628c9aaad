"""Editing a program: `apply(program, edit)` is the edited program.

Owns what each edit changes and what it refuses. An edit either leads to a valid program or to an
error, and the program that it was applied to is untouched.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TypeVar

from .document import AnyStatement
from .edits import (
    CommentPoint,
    CommentStatement,
    DeletePoint,
    DeleteStatements,
    DescribeProgram,
    Edit,
    InsertStatements,
    RecordPoint,
    RenamePoint,
    ReorderPoint,
    ReorderStatements,
    ReplaceStatement,
    StatementEdit,
    TouchUp,
)
from .errors import BadValue, PointExists, PointInUse
from .points import TeachPoint
from .program import Program
from .statements import Move

_T = TypeVar("_T")


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
