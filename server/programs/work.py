"""What is done to whole programs: read, printed, edited, unpacked; each as a task with a result.

Owns each task from the text that goes in to the text that comes out, and which tasks are small
enough for an event loop. All are plain data, because the others are done in another process. A
program travels as its JSON, one string, so that handing it over costs no walk through its parts.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Literal, TypeAlias

from ..refusal import Refusal
from .document import (
    MOST_JSON_BYTES,
    POINTS,
    STATEMENTS,
    program_from_json,
    program_from_source,
    program_to_json,
)
from .editing import apply
from .edits import Edit
from .errors import ProgramError, ProgramSyntaxError, ProgramTooLarge
from .parser import parse_source
from .points import TeachPoint
from .printer import print_program, statement_lines
from .program import OwnRobot, Program, check_robot
from .renumbering import Renumbering, between, by_edit
from .splice import Splice, splice_between

MOST_TEXT_AT_ONCE = 2_048
"""Characters of a program's text that are parsed where they came in: about a millisecond."""

MOST_JSON_AT_ONCE = 12_288
"""The same of its JSON, which is read in a tenth of the time."""

PACK = 50
"""Points or statements in one piece of an unpacked program, which is read in a millisecond."""

Form: TypeAlias = Literal["text", "json"]


@dataclass(frozen=True, slots=True)
class ReadSource:
    """Read a program that somebody wrote.

    Attributes:
        body: the source.
        form: what it is written in.
        file: its name, for errors.
    """

    body: str = field(repr=False)
    form: Form
    file: str

    @property
    def is_small(self) -> bool:
        """Whether it may be done on an event loop."""
        return len(self.body) <= (MOST_TEXT_AT_ONCE if self.form == "text" else MOST_JSON_AT_ONCE)


@dataclass(frozen=True, slots=True)
class SourceRead:
    """What was read.

    Attributes:
        head: JSON of the program without what it is made of, but for its first point.
        body: its JSON.
        points: how many it has.
        statements: how many it has.
        first_line: line of the first statement in its canonical text; 0 where it has none.
    """

    head: str
    body: str = field(repr=False)
    points: int
    statements: int
    first_line: int


@dataclass(frozen=True, slots=True)
class _OfBody:
    """A task about a program that is kept.

    Attributes:
        body: its JSON.
        file: its name, for errors.
    """

    body: str = field(repr=False)
    file: str

    @property
    def is_small(self) -> bool:
        """Whether it may be done on an event loop."""
        return len(self.body) <= MOST_JSON_AT_ONCE


@dataclass(frozen=True, slots=True)
class PrintBody(_OfBody):
    """Print a program as text."""

    @property
    def is_small(self) -> bool:
        """As of the others; numbers take long to print."""
        return len(self.body) <= MOST_JSON_AT_ONCE // 2


@dataclass(frozen=True, slots=True)
class BodyPrinted:
    """The canonical text."""

    text: str = field(repr=False)


@dataclass(frozen=True, slots=True)
class EditBody(_OfBody):
    """Edit a program.

    Attributes:
        edit: what to change.
        own: the robot that the program must be of; None for any.
    """

    edit: Edit
    own: OwnRobot | None = None


@dataclass(frozen=True, slots=True)
class BodyEdited:
    """What the edit changes.

    Attributes:
        splice: in the program's JSON.
        renumbering: in the numbers of its statements.
    """

    splice: Splice
    renumbering: Renumbering


@dataclass(frozen=True, slots=True)
class CompareBodies(_OfBody):
    """Find the statements of a program again in the JSON of another revision: a `Renumbering`."""

    other: str = field(repr=False)

    @property
    def is_small(self) -> bool:
        """Whether it may be done on an event loop."""
        return len(self.body) + len(self.other) <= MOST_JSON_AT_ONCE


@dataclass(frozen=True, slots=True)
class TakeHead(_OfBody):
    """Look at a program, and at one point of it; None for its first."""

    point: str | None = None


@dataclass(frozen=True, slots=True)
class HeadTaken:
    """JSON of the program without what it is made of, but for the point."""

    head: str


@dataclass(frozen=True, slots=True)
class UnpackBody(_OfBody):
    """Cut a program into pieces that can be read one by one."""


@dataclass(frozen=True, slots=True)
class BodyUnpacked:
    """The pieces.

    Attributes:
        head: JSON of the program without what it is made of.
        points: JSON lists of its points, `PACK` in each.
        statements: JSON lists of its statements.
        parts: how many points and statements there are.
        calls: the programs that it calls, each once.
    """

    head: str
    points: tuple[str, ...] = field(repr=False)
    statements: tuple[str, ...] = field(repr=False)
    parts: int
    calls: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class ProgramRefused:
    """Why a task was not done.

    Attributes:
        refusal: the reason.
        line: where in a text it is, from 1; None for nowhere.
        column: character of the line, from 1.
    """

    refusal: Refusal
    line: int | None = None
    column: int | None = None


Task: TypeAlias = ReadSource | PrintBody | EditBody | CompareBodies | TakeHead | UnpackBody
Done: TypeAlias = SourceRead | BodyPrinted | BodyEdited | Renumbering | HeadTaken | BodyUnpacked
RESULTS = (
    SourceRead,
    BodyPrinted,
    BodyEdited,
    Renumbering,
    HeadTaken,
    BodyUnpacked,
    ProgramRefused,
)
"""The types of all results."""


def perform(task: Task) -> Done | ProgramRefused:
    """Do a task; what is wrong with a program is a result, too."""
    try:
        return _perform(task)
    except ProgramSyntaxError as error:
        return ProgramRefused(error.refusal, error.line, error.column)
    except ProgramError as error:
        return ProgramRefused(error.refusal)


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
            return _unpacked(program)


def read_source(task: ReadSource) -> SourceRead:
    """Read a program that somebody wrote.

    Raises:
        ProgramError: it is none; the error says where.
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
    """Return the JSON of a program that is to be kept, which must be one that can be read again."""
    body = program_to_json(program)
    size = len(body.encode())
    if size > MOST_JSON_BYTES:
        raise ProgramTooLarge(f"bytes in the JSON of {file}", size, MOST_JSON_BYTES)
    return body


def _head(program: Program, point: TeachPoint | None) -> str:
    points = () if point is None else (point,)
    return program_to_json(replace(program, points=points, statements=()))


def _unpacked(program: Program) -> BodyUnpacked:
    points, statements = program.points, program.statements
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
        len(points) + len(statements),
        tuple(dict.fromkeys(name for _, name in program.calls)),
    )
