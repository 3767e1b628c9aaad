"""From a program's text to the program; `docs/programs.md` has the grammar.

Owns the order of a file: its format, the header, the points, the statements; and what becomes of
comments. Every error names file, line, column, what was found and what would be accepted. Knows no
robot. The largest text takes most of a second, so neither this nor the printer belongs on an event
loop; the JSON of a program takes a tenth of that.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Final, NoReturn

from .clauses import Clauses
from .errors import (
    BadBlocks,
    BadValue,
    PointUnknown,
    ProgramError,
    ProgramSyntaxError,
    ProgramTooLarge,
    excerpt,
)
from .point_clauses import POINT_CLAUSES, PointClauses
from .points import TeachPoint
from .program import MOST_POINTS, MOST_STATEMENTS, Program
from .statement_clauses import STATEMENTS, read_statement
from .statements import Comment, Statement
from .tokens import Line, decoded, lines_of

FORMAT: Final = "openpendant-program/1"
"""First word of a program's text, and `format` of its JSON."""

_HEADER = ("robot", "linear", "tool", "frame")


@dataclass(frozen=True, slots=True)
class Source:
    """A program with the lines of the text that it was read from.

    Attributes:
        program: the program.
        point_lines: line of each point, from 1.
        statement_lines: line of each statement, from 1.
    """

    program: Program
    point_lines: tuple[int, ...]
    statement_lines: tuple[int, ...]


def parse(text: str, file: str = "program") -> Program:
    """Return the program that a text says; see `parse_source`."""
    return parse_source(text, file).program


def parse_bytes(raw: bytes, file: str = "program") -> Source:
    """As `parse_source`, of a file's bytes.

    Raises:
        ProgramError: the bytes are no text, or too many; or as `parse_source`.
    """
    return parse_source(decoded(raw, file), file)


def parse_source(text: str, file: str = "program") -> Source:
    """Return the program that a text says, and where it says what.

    Args:
        text: the whole text.
        file: its name, for errors.

    Raises:
        ProgramSyntaxError: the text is not a program; its refusal has the code of the rule.
        ProgramTooLarge: it has more points or statements than are taken.
    """
    parser = _Parser(file)
    for line in lines_of(text, file):
        parser.read(line)
    return parser.finish(text.count("\n") + 1)


class _Parser:
    """What was read so far."""

    def __init__(self, file: str) -> None:
        self._file = file
        self._header: Program | None = None
        self._points: list[TeachPoint] = []
        self._names: set[str] = set()
        self._point_lines: list[int] = []
        self._statements: list[Statement] = []
        self._statement_lines: list[int] = []
        self._point: PointClauses | None = None
        self._comments: list[tuple[int, str]] = []
        self._read: Callable[[Line, Clauses], None] = self._read_format

    def read(self, line: Line) -> None:
        """Take the next line."""
        if line.words:
            self._read(line, Clauses(line, self._file))
        elif line.comment is not None:
            self._comments.append((line.number, line.comment))

    def finish(self, last_line: int) -> Source:
        """Return what was read; `last_line` is where a text ends that is incomplete."""
        if self._header is None:
            missing = FORMAT if self._read == self._read_format else 'program "NAME" robot NAME'
            raise ProgramSyntaxError(self._file, last_line, 1, "the text ends here", missing)
        self._close_point()
        self._comments_as_statements()
        return Source(
            self._whole(self._header), tuple(self._point_lines), tuple(self._statement_lines)
        )

    def _whole(self, header: Program) -> Program:
        try:
            return replace(header, points=tuple(self._points), statements=tuple(self._statements))
        except (BadBlocks, PointUnknown) as error:
            index = error.index or 0
            raise ProgramSyntaxError(
                self._file, self._statement_lines[index], 1, str(error), code=error.code
            ) from None

    def _read_format(self, line: Line, clauses: Clauses) -> None:
        if not clauses.skip(FORMAT):
            raise clauses.refuse(f"{FORMAT}, as the first word of a program")
        clauses.done()
        self._keep_comment(line)
        self._read = self._read_header

    def _read_header(self, line: Line, clauses: Clauses) -> None:
        clauses.keyword(["program"])
        given: dict[str, str] = {"name": clauses.name("the program's name")}
        axes: list[int] = []
        while clauses.next is not None:
            left = [word for word in _HEADER if word not in given]
            keyword = clauses.keyword(left)
            given[keyword] = ""
            if keyword == "linear":
                axes.append(clauses.integer("the number of a linear axis"))
                while clauses.at_number():
                    axes.append(clauses.integer("the number of a linear axis"))
            else:
                given[keyword] = clauses.name(f"the {keyword}'s name")
        if "robot" not in given:
            raise clauses.refuse("robot NAME")
        self._keep_comment(line)
        with self._placed(line):
            self._header = Program(
                name=given["name"],
                robot=given["robot"],
                linear_axes=tuple(axis - 1 for axis in axes),
                tool=given.get("tool", Program.tool),
                frame=given.get("frame", Program.frame),
                comment=self._taken_comment(),
            )
        self._read = self._read_body

    def _read_body(self, line: Line, clauses: Clauses) -> None:
        if clauses.at_keyword(*POINT_CLAUSES):
            if self._point is None:
                raise clauses.refuse("point NAME before its clauses")
            self._read_point(line, clauses, self._point)
        elif clauses.skip("point"):
            self._close_point()
            self._open_point(line, clauses)
        else:
            self._close_point()
            self._comments_as_statements()
            self._read_statement(line, clauses)

    def _open_point(self, line: Line, clauses: Clauses) -> None:
        if self._statements:
            self._fail(line, "a point stands behind a statement", "points before all statements")
        if len(self._points) == MOST_POINTS:
            raise ProgramTooLarge(f"points in {self._file}", MOST_POINTS + 1, MOST_POINTS)
        name = clauses.name("the point's name")
        if name in self._names:
            place = self._point_lines[[point.name for point in self._points].index(name)]
            found = f"point {excerpt(name)} stands in line {place} already"
            self._fail(line, found, "a name of its own")
        self._names.add(name)
        self._point = PointClauses(name, line.number, self._known_header)
        self._read_point(line, clauses, self._point)

    def _read_point(self, line: Line, clauses: Clauses, point: PointClauses) -> None:
        self._keep_comment(line)
        with self._placed(line):
            point.read(clauses)
        point.comments += [text for _, text in self._comments]
        self._comments.clear()

    def _close_point(self) -> None:
        if self._point is None:
            return
        try:
            self._points.append(self._point.point())
        except BadValue as error:
            self._raise_placed(error, self._point.line)
        self._point_lines.append(self._point.line)
        self._point = None
        first, last = self._points[0], self._points[-1]
        if len(last.joints) != len(first.joints):
            found = f"point {excerpt(last.name)} has {len(last.joints)} joints"
            accepted = f"{len(first.joints)}, as point {excerpt(first.name)}"
            raise ProgramSyntaxError(self._file, self._point_lines[-1], 1, found, accepted)

    def _read_statement(self, line: Line, clauses: Clauses) -> None:
        if not clauses.at_keyword(*STATEMENTS):
            points = [] if self._statements else ["point"]
            raise clauses.refuse(", ".join([*points, *STATEMENTS]))
        with self._placed(line):
            self._add(read_statement(clauses, line.comment or ""), line.number)

    def _add(self, statement: Statement, line: int) -> None:
        if len(self._statements) == MOST_STATEMENTS:
            what = f"statements in {self._file}"
            raise ProgramTooLarge(what, MOST_STATEMENTS + 1, MOST_STATEMENTS)
        self._statements.append(statement)
        self._statement_lines.append(line)

    def _comments_as_statements(self) -> None:
        for number, text in self._comments:
            try:
                self._add(Comment(comment=text), number)
            except BadValue as error:
                self._raise_placed(error, number)
        self._comments.clear()

    def _keep_comment(self, line: Line) -> None:
        if line.comment is not None:
            self._comments.append((line.number, line.comment))

    def _taken_comment(self) -> str:
        comment = "\n".join(text for _, text in self._comments)
        self._comments.clear()
        return comment

    @property
    def _known_header(self) -> Program:
        if self._header is None:
            raise AssertionError("points are read behind the header only")
        return self._header

    @contextmanager
    def _placed(self, line: Line) -> Iterator[None]:
        """Give an error of a value the place of its line."""
        try:
            yield
        except BadValue as error:
            self._raise_placed(error, line.number, line.words[0].column)

    def _raise_placed(self, error: ProgramError, line: int, column: int = 1) -> NoReturn:
        raise ProgramSyntaxError(self._file, line, column, str(error), code=error.code) from None

    def _fail(self, line: Line, problem: str, accepted: str) -> NoReturn:
        column = line.words[0].column
        raise ProgramSyntaxError(self._file, line.number, column, problem, accepted)
