"""Tasks on whole programs: read, print, edit, compare, unpack; each with a result.

Owns each task from its input text to its output text, and which tasks are small enough for an event
loop. All are plain data, because the others are done in another process. A program travels as its
JSON, one string, so that passing it on costs no walk through its parts.

Owns the size of a step of `Unpacking`: a program that was cut into pieces is read piece by piece,
so that no step holds up an event loop. The whole program was checked when it was cut.

Owns the conditions for keeping a program: one rule for pendants that save and for imports.
`read_source` reads the source; the rule judges its head, which is enough. That its points are in
reach is checked where the program is run, because limits may change.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field, replace
from typing import ClassVar, Literal, TypeAlias

from openpendant.simplemsg.pendant.management.program_values import (
    BadValue,
    ProgramError,
    TeachPoint,
)
from openpendant.simplemsg.pendant.management.statements import Edit, Statement

from ...refusal import Refusal
from ..language.parser import parse_source
from ..language.printer import print_program, statement_lines
from ..language.program import OwnRobot, Program, check_robot
from ..language.program_errors import ProgramSyntaxError, ProgramTooLarge, program_refusal
from ..language.program_json import (
    MOST_JSON_BYTES,
    POINTS,
    STATEMENTS,
    program_from_json,
    program_from_source,
    program_to_json,
)
from .edit_history import Renumbering, Splice, between, by_edit, splice_between
from .edits import apply

MOST_TEXT_AT_ONCE = 512
"""Greatest text of a program parsed on the event loop [characters]: it takes about 1 ms."""

MOST_JSON_AT_ONCE = 8_192
"""The same for its JSON, which is read in a tenth of the time."""

PACK = 50
"""Points or statements in one piece of an unpacked program; reading it takes 1 ms."""

Form: TypeAlias = Literal["text", "json"]


@dataclass(frozen=True, slots=True)
class ReadSource:
    """Task: read the source of a program."""

    body: str = field(repr=False)
    form: Form
    file: str

    @property
    def is_small(self) -> bool:
        """True if it may be done on an event loop."""
        return len(self.body) <= (MOST_TEXT_AT_ONCE if self.form == "text" else MOST_JSON_AT_ONCE)


@dataclass(frozen=True, slots=True)
class SourceRead:
    """Result of `ReadSource`.

    Attributes:
        head: JSON of the program without its points and statements, but with its first point.
        first_line: line of the first statement in its canonical text; 0 where it has none.
    """

    head: str
    body: str = field(repr=False)
    points: int
    statements: int
    first_line: int


@dataclass(frozen=True, slots=True)
class _OfBody:
    """Task on a program that is kept.

    Attributes:
        body: its JSON.
    """

    MOST_AT_ONCE: ClassVar[int] = MOST_JSON_AT_ONCE

    body: str = field(repr=False)
    file: str

    @property
    def is_small(self) -> bool:
        """True if it may be done on an event loop."""
        return len(self.body) <= self.MOST_AT_ONCE


@dataclass(frozen=True, slots=True)
class PrintBody(_OfBody):
    """Task: print a program as text."""

    MOST_AT_ONCE = MOST_JSON_AT_ONCE // 2  # numbers take long to print


@dataclass(frozen=True, slots=True)
class BodyPrinted:
    """Result of `PrintBody`: the canonical text."""

    text: str = field(repr=False)


@dataclass(frozen=True, slots=True)
class EditBody(_OfBody):
    """Task: edit a program.

    Attributes:
        own: the robot that the program must be of; None for any.
    """

    edit: Edit
    own: OwnRobot | None = None


@dataclass(frozen=True, slots=True)
class BodyEdited:
    """Result of `EditBody`."""

    splice: Splice
    renumbering: Renumbering


@dataclass(frozen=True, slots=True)
class CompareBodies(_OfBody):
    """Task: find a program's statements in the JSON of another revision: a `Renumbering`."""

    other: str = field(repr=False)

    @property
    def is_small(self) -> bool:
        """True if it may be done on an event loop."""
        return len(self.body) + len(self.other) <= MOST_JSON_AT_ONCE


@dataclass(frozen=True, slots=True)
class TakeHead(_OfBody):
    """Task: read a program's head with one of its points; None for the first."""

    point: str | None = None


@dataclass(frozen=True, slots=True)
class HeadTaken:
    """Result of `TakeHead`: JSON of the program without its statements and other points."""

    head: str


@dataclass(frozen=True, slots=True)
class UnpackBody(_OfBody):
    """Task: cut a program into pieces that can be read one by one."""


@dataclass(frozen=True, slots=True)
class BodyUnpacked:
    """Result of `UnpackBody`: the pieces.

    Attributes:
        head: JSON of the program without its points and statements.
        points: JSON lists of its points, `PACK` in each.
        statements: JSON lists of its statements.
        calls: the programs that it calls, each once.
    """

    head: str
    points: tuple[str, ...] = field(repr=False)
    statements: tuple[str, ...] = field(repr=False)
    parts: int
    calls: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class ProgramRefused:
    """Refusal of a task.

    Attributes:
        line: its line in a text, from 1; None without one.
        column: character of the line, from 1.
    """

    refusal: Refusal
    line: int | None = None
    column: int | None = None


Task: TypeAlias = ReadSource | PrintBody | EditBody | CompareBodies | TakeHead | UnpackBody
Done: TypeAlias = SourceRead | BodyPrinted | BodyEdited | Renumbering | HeadTaken | BodyUnpacked
TaskResult: TypeAlias = Done | ProgramRefused


def perform(task: Task) -> TaskResult:
    """Return the result of a task; a fault of a program is a result, too."""
    try:
        return _perform(task)
    except ProgramSyntaxError as error:
        return ProgramRefused(program_refusal(error), error.line, error.column)
    except ProgramError as error:
        return ProgramRefused(program_refusal(error))


def _perform(task: Task) -> Done:
    if isinstance(task, ReadSource):
        return read_source(task)
    program = program_from_json(task.body, task.file)
    match task:
        case PrintBody():
            return BodyPrinted(print_program(program))
        case EditBody(edit=edit, own=own):
            if own is not None:
                check_robot(program, own.name, own.limits)
            edited = _json(apply(program, edit), task.file)
            renumbering = by_edit(edit, len(program.statements))
            return BodyEdited(splice_between(task.body, edited), renumbering)
        case CompareBodies(other=other):
            statements = program_from_json(other, task.file).statements
            return between(program.statements, statements)
        case TakeHead(point=name):
            first = program.points[0] if program.points else None
            return HeadTaken(_head(program, first if name is None else program.point(name)))
        case UnpackBody():
            return unpacked(program)


def read_source(task: ReadSource) -> SourceRead:
    """Return the result of reading a program's source.

    Raises:
        ProgramError: it is no program; the error names the place.
    """
    if task.form == "json":
        program = program_from_source(task.body, task.file)
    else:
        program = parse_source(task.body, task.file).program
    return SourceRead(
        _head(program, program.points[0] if program.points else None),
        _json(program, task.file),
        len(program.points),
        len(program.statements),
        min(statement_lines(program), default=0),
    )


def _json(program: Program, file: str) -> str:
    """Return the JSON of a program that is to be kept, after reading it again."""
    body = program_to_json(program)
    size = len(body.encode())
    if size > MOST_JSON_BYTES:
        raise ProgramTooLarge(f"bytes in the JSON of {file}", size, MOST_JSON_BYTES)
    return body


def _head(program: Program, point: TeachPoint | None) -> str:
    points = () if point is None else (point,)
    return program_to_json(replace(program, points=points, statements=()))


def unpacked(program: Program) -> BodyUnpacked:
    """Return a program in pieces."""
    points, statements = program.points, program.statements
    parts = len(points) + len(statements)
    calls = tuple(dict.fromkeys(name for _, name in program.calls))
    return BodyUnpacked(
        _head(program, None),
        tuple(
            POINTS.dump_json(points[first : first + PACK]).decode()
            for first in range(0, len(points), PACK)
        ),
        tuple(
            STATEMENTS.dump_json(statements[first : first + PACK]).decode()
            for first in range(0, len(statements), PACK)
        ),
        parts,
        calls,
    )


class Unpacking:
    """Program under construction from its pieces."""

    def __init__(self, unpacked: BodyUnpacked) -> None:
        self._head = unpacked.head
        self._point_packs = deque(unpacked.points)
        self._statement_packs = deque(unpacked.statements)
        self._points: list[TeachPoint] = []
        self._statements: list[Statement] = []
        self._program: Program | None = None

    def step(self) -> Program | None:
        """Read fewer than two packs; return the program once it is complete."""
        if self._program is not None:
            return self._program
        read = 0
        while read < PACK and (self._point_packs or self._statement_packs):
            read += self._read_pack()
        # The end costs as much as a step, so for a long program it is a separate one.
        if self._point_packs or self._statement_packs or read >= PACK:
            return None
        head = program_from_json(self._head)
        whole = replace(head, points=tuple(self._points), statements=tuple(self._statements))
        if len(self._points) + len(self._statements) < PACK:
            return whole
        # So does the work after it; its calls are looked up now for that.
        self._program = whole
        _ = whole.calls
        return None

    def _read_pack(self) -> int:
        if self._point_packs:
            points = POINTS.validate_json(self._point_packs.popleft())
            self._points += points
            return len(points)
        statements = STATEMENTS.validate_json(self._statement_packs.popleft())
        self._statements += statements
        return len(statements)


def check_to_be_kept(read: SourceRead, own: OwnRobot | None, name: str | None = None) -> Program:
    """Return the head of a program that may be kept.

    Args:
        own: the robot that it must be of; None where that robot is not known here.
        name: its name in the store; None where it is only checked.

    Raises:
        WrongRobot: it is of another robot, or was taught on other joints.
        BadValue: it states another name.
    """
    head = program_from_json(read.head)
    if own is not None:
        check_robot(head, own.name, own.limits)
    if name is not None and head.name != name:
        raise BadValue("the program's name", f"is {head.name!r}; accepted: {name!r}", part="name")
    return head
