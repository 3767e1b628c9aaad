"""Edits of a program: `apply(program, edit)`, the edited program.

Owns the changes of each edit and its refusals. An edit leads either to a valid program or to an
error, and the program that it was applied to is unchanged.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TypeVar

from openpendant.simplemsg.pendant.management.program_values import BadValue, TeachPoint
from openpendant.simplemsg.pendant.management.statements import (
    CommentPoint,
    CommentStatement,
    DeletePoint,
    DeleteStatements,
    DescribeProgram,
    Edit,
    InsertStatements,
    Move,
    RecordPoint,
    RenamePoint,
    ReorderPoint,
    ReorderStatements,
    ReplaceStatement,
    Statement,
    StatementEdit,
    TouchUp,
)

from ..language.printer import first_line, in_words, last_of, places_of
from ..language.program import Program
from ..language.program_errors import (
    BadBlocks,
    PointExists,
    PointInUse,
    PointUnknown,
    StatementRefused,
)

_T = TypeVar("_T")


def apply(program: Program, edit: Edit) -> Program:
    """Return the edited program.

    Raises:
        ProgramError: the edit names something missing, or would leave a program that is not valid.
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
                raise PointInUse(name, uses, places_of(program, uses))
            return replace(program, points=tuple(p for p in program.points if p.name != name))
        case ReorderPoint(name, to):
            first, last = program.points.index(program.point(name)), len(program.points) - 1
            if not 0 <= to <= last:
                text = f"is {to}, counted from 0; accepted: 0 to {last}"
                raise BadValue("the place among the points", text)
            return replace(program, points=_moved(program.points, first, 1, to))
        case DescribeProgram():
            return _described(program, edit)
    return _with_statements(program, _edited_statements(program, edit))


def _with_statements(program: Program, statements: tuple[Statement, ...]) -> Program:
    """Return a program with other statements.

    Raises:
        StatementRefused: they do not fit each other or the points.
    """
    try:
        return replace(program, statements=statements)
    except (BadBlocks, PointUnknown) as error:
        index = error.index or 0
        line, words = first_line(program) + index, in_words(statements[index])
        raise StatementRefused(f"line {line} of the edited text, {words}", index, error) from None


def _edited_statements(program: Program, edit: StatementEdit) -> tuple[Statement, ...]:
    old = program.statements
    match edit:
        case InsertStatements(statements, at):
            place = len(old) if at is None else at
            _check_statement(program, place, len(old))
            return (*old[:place], *statements, *old[place:])
        case DeleteStatements(first, count):
            _check_statements(program, first, count)
            return (*old[:first], *old[first + count :])
        case ReorderStatements(first, count, to):
            _check_statements(program, first, count)
            _check_statement(program, to, len(old) - count)
            return _moved(old, first, count, to)
        case ReplaceStatement(at, statement):
            _check_statement(program, at, len(old) - 1)
            return (*old[:at], statement, *old[at + 1 :])
        case CommentStatement(at, comment):
            _check_statement(program, at, len(old) - 1)
            return (*old[:at], replace(old[at], comment=comment), *old[at + 1 :])


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
    return _with_statements(replace(program, points=points), statements)


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


def _moved(old: tuple[_T, ...], first: int, count: int, to: int) -> tuple[_T, ...]:
    taken, rest = old[first : first + count], (*old[:first], *old[first + count :])
    return (*rest[:to], *taken, *rest[to:])


def _check_statement(program: Program, index: int, last: int) -> None:
    """Refuse the number of a statement that is not from 0 to the last that is accepted."""
    if not 0 <= index <= last:
        accepted = "none" if last < 0 else "0" if last == 0 else f"0 to {last}"
        text = f"is {index}, counted from 0; accepted: {accepted}; {last_of(program)}"
        raise BadValue("the place", text)


def _check_statements(program: Program, first: int, count: int) -> None:
    """Refuse a range of statements that is empty or not wholly in the program."""
    there = len(program.statements)
    if count < 1:
        raise BadValue("the count", f"is {count}; accepted: 1 statement or more")
    if first < 0 or first + count > there:
        asked = f"{first} to {first + count - 1}, counted from 0, are asked for"
        raise BadValue("statements", f"{asked}; there are {there}; {last_of(program)}")
