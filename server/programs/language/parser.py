"""Parser of a program's text; `docs/programs.md` has the grammar.

Owns the order of a file: its format, the header, the points, the statements; and what becomes of
comments. Every error names file, line, column, what was found and what would be accepted. Knows no
robot. The largest text takes most of a second, so neither this nor the printer belongs on an event
loop; the JSON of a program takes a tenth of that.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Final, NamedTuple, NoReturn

from openpendant.simplemsg.pendant.management.program_values import (
    COMMENT,
    BadValue,
    ProgramError,
    TeachPoint,
)
from openpendant.simplemsg.pendant.management.programs import MOST_STATEMENTS
from openpendant.simplemsg.pendant.management.statements import Comment, Statement

from .grammar import POINT_CLAUSES, STATEMENTS, PointClauses, read_statement
from .lexer import Clauses, Line, Places, TextPlace, decoded, lines_of, place_of
from .program import MOST_POINTS, Program
from .program_errors import BadBlocks, PointUnknown, ProgramSyntaxError, ProgramTooLarge, excerpt

FORMAT: Final = "openpendant-program/1"
"""First word of a program's text, and `format` of its JSON."""

_HEADER = ("robot", "linear", "tool", "frame")


@dataclass(frozen=True, slots=True)
class Source:
    """A program with the lines of the text that it was read from.

    Attributes:
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

    Raises:
        ProgramSyntaxError: the text is not a program; its refusal has the code of the rule.
        ProgramTooLarge: it has more points or statements than are taken.
    """
    parser = _Parser(file)
    # Some editors put a byte order mark in front; it is no character of the first line.
    text = text.removeprefix("\ufeff")
    for line in lines_of(text, file):
        parser.read(line)
    return parser.finish(text.count("\n") + 1)


class _Comment(NamedTuple):
    """A comment that waits for what it belongs to."""

    place: TextPlace
    text: str


class _Parser:
    """The part of a program that was read so far."""

    def __init__(self, file: str) -> None:
        self._file = file
        self._header: Program | None = None
        self._points: list[TeachPoint] = []
        self._names: set[str] = set()
        self._point_lines: list[int] = []
        self._statements: list[Statement] = []
        self._statement_begins: list[TextPlace] = []
        self._statement_places: list[Places] = []
        self._point: PointClauses | None = None
        self._comments: list[_Comment] = []
        self._read: Callable[[Line, Clauses], None] = self._read_format

    def read(self, line: Line) -> None:
        """Take the next line."""
        if line.words:
            self._read(line, Clauses(line, self._file))
        elif line.comment is not None:
            self._keep_comment(line)

    def finish(self, last_line: int) -> Source:
        """Return what was read; `last_line` is where a text ends that is incomplete."""
        if self._header is None:
            missing = FORMAT if self._read == self._read_format else 'program "NAME" robot NAME'
            raise ProgramSyntaxError(self._file, last_line, 1, "the text ends here", missing)
        self._close_point()
        self._comments_as_statements()
        lines = tuple(begin.line for begin in self._statement_begins)
        return Source(self._whole(self._header), tuple(self._point_lines), lines)

    def _whole(self, header: Program) -> Program:
        try:
            return replace(header, points=tuple(self._points), statements=tuple(self._statements))
        except BadBlocks as error:
            self._raise_placed(error, self._statement_begins[error.index])
        except PointUnknown as error:
            names = self._statement_places[error.index or 0]["the name of the point"]
            self._raise_placed(error, names[error.place])

    def _read_format(self, line: Line, clauses: Clauses) -> None:
        if not clauses.skip(FORMAT):
            raise clauses.refuse(f"{FORMAT}, as the first word of a program")
        clauses.done()
        self._keep_comment(line)
        self._read = self._read_header

    def _read_header(self, line: Line, clauses: Clauses) -> None:
        clauses.keyword(["program"])
        given: dict[str, str] = {"name": clauses.name("the program's name", "the program")}
        axes: list[int] = []
        while clauses.next is not None:
            left = [word for word in _HEADER if word not in given]
            keyword = clauses.keyword(left)
            given[keyword] = ""
            if keyword == "linear":
                axes.append(_axis(clauses))
                while clauses.at_number():
                    axes.append(_axis(clauses))
            else:
                given[keyword] = clauses.name(f"the {keyword}'s name", f"the {keyword}")
        if "robot" not in given:
            raise clauses.refuse("robot NAME")
        self._keep_comment(line)
        comment = self._taken_comments(clauses.places)
        with self._placed(line, clauses):
            self._header = Program(
                name=given["name"],
                robot=given["robot"],
                linear_axes=tuple(axis - 1 for axis in axes),
                tool=given.get("tool", Program.tool),
                frame=given.get("frame", Program.frame),
                comment="\n".join(comment),
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
            found = "a point stands behind a statement"
            self._fail(_begin(line), found, "points before all statements")
        if len(self._points) == MOST_POINTS:
            raise ProgramTooLarge(f"points in {self._file}", MOST_POINTS + 1, MOST_POINTS)
        name = clauses.name("the point's name", "the point")
        if name in self._names:
            first = self._point_lines[[point.name for point in self._points].index(name)]
            found = f"point {excerpt(name)} stands in line {first} already"
            self._fail(clauses.places["the name of the point"][0], found, "a name of its own")
        self._names.add(name)
        self._point = PointClauses(name, _begin(line), self._known_header)
        self._read_point(line, clauses, self._point)

    def _read_point(self, line: Line, clauses: Clauses, point: PointClauses) -> None:
        self._keep_comment(line)
        with self._placed(line, clauses):
            point.read(clauses)
        point.comments += self._taken_comments(point.places)
        for part, places in clauses.places.items():
            point.places.setdefault(part, []).extend(places)

    def _close_point(self) -> None:
        if self._point is None:
            return
        read, self._point = self._point, None
        try:
            point = read.point()
        except BadValue as error:
            self._raise_placed(error, place_of(error, read.places, read.begin))
        self._points.append(point)
        self._point_lines.append(read.begin.line)
        first, count = self._points[0], len(point.joints)
        if count != len(first.joints):
            found = f"point {excerpt(point.name)} has {count} joints"
            accepted = f"{len(first.joints)}, as point {excerpt(first.name)}"
            # The first that is too many, or the last where there are too few.
            place = read.places["joints"][min(count - 1, len(first.joints))]
            self._fail(place, found, accepted)

    def _read_statement(self, line: Line, clauses: Clauses) -> None:
        if not clauses.at_keyword(*STATEMENTS):
            points = [] if self._statements else ["point"]
            raise clauses.refuse(", ".join([*points, *STATEMENTS]))
        if line.comment is not None:
            clauses.places[COMMENT] = [TextPlace(line.number, line.comment_column)]
        with self._placed(line, clauses):
            self._add(read_statement(clauses, line.comment or ""), _begin(line), clauses.places)

    def _add(self, statement: Statement, begin: TextPlace, places: Places) -> None:
        if len(self._statements) == MOST_STATEMENTS:
            what = f"statements in {self._file}"
            raise ProgramTooLarge(what, MOST_STATEMENTS + 1, MOST_STATEMENTS)
        self._statements.append(statement)
        self._statement_begins.append(begin)
        self._statement_places.append(places)

    def _comments_as_statements(self) -> None:
        for place, text in self._comments:
            try:
                self._add(Comment(comment=text), place, {})
            except BadValue as error:
                self._raise_placed(error, place)
        self._comments.clear()

    def _keep_comment(self, line: Line) -> None:
        if line.comment is not None:
            self._comments.append(
                _Comment(TextPlace(line.number, line.comment_column), line.comment)
            )

    def _taken_comments(self, places: Places) -> list[str]:
        """Take the comments that wait; their places are added to those of their owner."""
        taken, self._comments = self._comments, []
        places.setdefault(COMMENT, []).extend(comment.place for comment in taken)
        return [comment.text for comment in taken]

    @property
    def _known_header(self) -> Program:
        if self._header is None:
            raise AssertionError("points are read behind the header only")
        return self._header

    @contextmanager
    def _placed(self, line: Line, clauses: Clauses) -> Iterator[None]:
        """Give an error of a value the place of that value in the line."""
        try:
            yield
        except BadValue as error:
            self._raise_placed(error, place_of(error, clauses.places, _begin(line)))

    def _raise_placed(self, error: ProgramError, place: TextPlace) -> NoReturn:
        raise ProgramSyntaxError(self._file, *place, str(error), code=error.code) from None

    def _fail(self, place: TextPlace, problem: str, accepted: str) -> NoReturn:
        raise ProgramSyntaxError(self._file, *place, problem, accepted)


def _begin(line: Line) -> TextPlace:
    return TextPlace(line.number, line.words[0].column)


def _axis(clauses: Clauses) -> int:
    return clauses.at("the linear axes").integer("the number of a linear axis")
