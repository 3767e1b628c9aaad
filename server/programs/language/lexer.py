"""Lexer of a program's text: lines cut into words, and words taken from the front of a line.

Owns the definition of a word: a quoted name, or characters up to the next space; `#` begins a
comment that ends with the line. Reads line by line, so that memory stays bounded by the text.

Owns the wording of the text found and of what would be accepted, and the place of the word of each
value: faults of a value are found when all of them are known. Knows no statement.

Owns the unit words and their conversion into SI. A decimal is converted exactly and then rounded
once to the nearest real, so every real has a text in degrees or millimetres that reads back as
itself, which a multiplication of reals by π/180 could not guarantee.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from decimal import Context, Decimal
from enum import Enum
from functools import cache
from typing import NamedTuple, TypeAlias

from openpendant.simplemsg.pendant.management.program_values import BadValue

from .program_errors import ProgramSyntaxError, ProgramTooLarge, excerpt

_BARE_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_.-]*", re.ASCII)

_CLAUSE_WORDS = frozenset(
    "via speed zone dwell robot linear frame tool joints pose config into timeout".split()
)
"""Words that may follow a name; a name that is one of them is quoted, for readers too."""


def named(name: str) -> str:
    """Return a name in its text form: bare where it cannot be mistaken, else quoted."""
    if _BARE_NAME.fullmatch(name) and name not in _CLAUSE_WORDS:
        return name
    return f'"{name}"'


LONGEST_NUMBER = 40
"""Greatest number of characters of a number."""

_NUMBER = re.compile(r"[+-]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][+-]?\d{1,3})?", re.ASCII)
_EXACT = Context(prec=60)
_DEGREE = _EXACT.divide(
    Decimal("3.14159265358979323846264338327950288419716939937510582097494459"), Decimal(180)
)
_DIGITS = (12, 15, 16, 17, 18, 19, 20)
"""Numbers of digits tried in order: those that people type, then those that any real needs."""


class Dimension(Enum):
    """Quantity that a number measures."""

    ANGLE = "an angle"
    LENGTH = "a length"
    TIME = "a time"
    FRACTION = "a fraction"
    VELOCITY = "a speed of the tool"


@dataclass(frozen=True, slots=True)
class Unit:
    """Unit word.

    Attributes:
        factor: its size in SI.
    """

    dimension: Dimension
    factor: Decimal


UNITS: Mapping[str, Unit] = {
    "deg": Unit(Dimension.ANGLE, _DEGREE),
    "rad": Unit(Dimension.ANGLE, Decimal(1)),
    "mm": Unit(Dimension.LENGTH, Decimal("0.001")),
    "m": Unit(Dimension.LENGTH, Decimal(1)),
    "s": Unit(Dimension.TIME, Decimal(1)),
    "ms": Unit(Dimension.TIME, Decimal("0.001")),
    "%": Unit(Dimension.FRACTION, Decimal("0.01")),
    "mm/s": Unit(Dimension.VELOCITY, Decimal("0.001")),
    "m/s": Unit(Dimension.VELOCITY, Decimal(1)),
}
"""Every unit word of the grammar; those of one dimension stand together."""


@cache
def unit_words(*dimensions: Dimension) -> tuple[str, ...]:
    """Return the unit words of some dimensions."""
    return tuple(word for word, unit in UNITS.items() if unit.dimension in dimensions)


@cache
def units_of(*dimensions: Dimension) -> str:
    """Return the unit words of some dimensions, for a message."""
    return " or ".join(unit_words(*dimensions))


def is_number(text: str) -> bool:
    """Return True if a word is a number of the grammar."""
    return len(text) <= LONGEST_NUMBER and _NUMBER.fullmatch(text) is not None


def to_si(number: str, unit: str) -> float:
    """Return a number with a unit in SI: the nearest real, an infinity beyond all reals.

    Args:
        number: a text for which `is_number` holds.
        unit: a word of `UNITS`.
    """
    return float(_EXACT.multiply(Decimal(number), UNITS[unit].factor)) + 0.0


def from_si(value: float, unit: str) -> str:
    """Return the number that reads back as a real with this unit, with few digits."""
    exact = _EXACT.divide(Decimal(value), UNITS[unit].factor)
    for digits in _DIGITS:
        text = _plain(Context(prec=digits).plus(exact))
        if to_si(text, unit) == value:
            return text
    raise AssertionError("twenty digits tell all reals apart")


def plain_number(value: float) -> str:
    """Return a finite real without a unit, as short as it reads back exactly."""
    return _plain(Decimal(repr(value)))


def _plain(value: Decimal) -> str:
    if not value:
        return "0"
    value = value.normalize(_EXACT)
    # People do not write 1E+2; but neither do they write forty zeros.
    return format(value, "f") if -9 <= value.adjusted() <= 15 else str(value).replace("E+", "E")


def read_number(number: str) -> float:
    """Return the real nearest to a number for which `is_number` holds; infinite beyond all."""
    return float(number) + 0.0


MOST_BYTES = 1 << 20
"""Largest text [bytes of UTF-8]."""

LONGEST_LINE = 8_192
"""Characters of a line; a spline through the most points of the longest names has 7,200."""

_WORD = re.compile(r'"([^"]*)"|([^\s"#]+)')
_PLAIN = re.compile(r"[ !$-~]+")
_BARE = re.compile(r"[^ ]+")


class Word(NamedTuple):
    """Word of a line.

    Attributes:
        text: what it says, without quotation marks.
        column: its first character, from 1: a tab, a letter and a combining accent are one each.
        quoted: True if it stands in quotation marks, so is a name and no keyword.
    """

    text: str
    column: int
    quoted: bool = False


@dataclass(frozen=True, slots=True)
class Line:
    """Line that is not empty.

    Attributes:
        number: from 1.
        words: what stands on it before a comment.
        comment: the comment, trimmed; None for none.
        comment_column: where it begins, from 1.
        end: the column behind the last word.
    """

    number: int
    words: tuple[Word, ...]
    comment: str | None
    comment_column: int
    end: int


def decoded(raw: bytes, file: str) -> str:
    """Return the text of a file.

    Raises:
        ProgramTooLarge: it exceeds `MOST_BYTES`.
        ProgramSyntaxError: it is not UTF-8.
    """
    if len(raw) > MOST_BYTES:
        raise ProgramTooLarge(f"bytes in {file}", len(raw), MOST_BYTES)
    try:
        return raw.decode()
    except UnicodeDecodeError as error:
        before = raw[: error.start].decode().removeprefix("\ufeff")
        line = before.count("\n") + 1
        column = len(before) - before.rfind("\n")
        problem = f"byte 0x{raw[error.start]:02X} is not UTF-8"
        raise ProgramSyntaxError(file, line, column, problem, "text in UTF-8") from None


def lines_of(text: str, file: str) -> Iterator[Line]:
    """Yield the lines that are not empty.

    Args:
        text: the whole text; lines end with LF or CR LF.

    Raises:
        ProgramSyntaxError: a line is too long, a quotation mark is not closed, or words touch.
    """
    for number, raw in enumerate(text.split("\n"), start=1):
        line = raw.removesuffix("\r")
        if len(line) > LONGEST_LINE:
            problem = f"the line has {len(line)} characters"
            raise ProgramSyntaxError(
                file, number, LONGEST_LINE + 1, problem, f"up to {LONGEST_LINE}"
            )
        found = _split(line, number, file)
        if found.words or found.comment is not None:
            yield found


def _split(line: str, number: int, file: str) -> Line:
    if _PLAIN.fullmatch(line):
        # Fast path: no quotation mark, comment or tab, as nearly all lines of a long text.
        plain = tuple(Word(found[0], found.start() + 1) for found in _BARE.finditer(line))
        return Line(number, plain, None, 0, len(line.rstrip(" ")) + 1)
    words: list[Word] = []
    place = end = 0
    while place < len(line):
        if line[place] in " \t":
            place += 1
            continue
        if line[place] == "#":
            return Line(number, tuple(words), line[place + 1 :].strip(" \t"), place + 1, end + 1)
        found = _WORD.match(line, place)
        if found is None:
            raise ProgramSyntaxError(file, number, place + 1, *_unreadable(line[place:]))
        if words and place == end:
            raise ProgramSyntaxError(
                file, number, place + 1, "two words touch", "a space between them"
            )
        quoted = found[1] is not None
        words.append(Word(found[1] if quoted else found[2], place + 1, quoted))
        place = end = found.end()
    return Line(number, tuple(words), None, 0, end + 1)


def _unreadable(rest: str) -> tuple[str, str]:
    if rest.startswith('"'):
        return "the quotation mark is not closed", 'a name between two " on one line'
    return f"found {excerpt(rest[0])}", "spaces or tabs between words"


_SHAPE_OF_A_NUMBER = "a number with a decimal dot"


class TextPlace(NamedTuple):
    """Start of a word: its line and its character in it, both from 1."""

    line: int
    column: int


Places: TypeAlias = dict[str, list[TextPlace]]
"""Places of the values of each part, by the name of the part in an error."""


def place_of(error: BadValue, places: Places, whole: TextPlace) -> TextPlace:
    """Return the place of a value; `whole` for one that was left out."""
    marked = places.get(error.part, [])
    return marked[error.place] if error.place < len(marked) else whole


class Clauses:
    """Words of a line, taken from the front."""

    def __init__(self, line: Line, file: str) -> None:
        self.places: Places = {}
        self._line = line
        self._words = line.words
        self._file = file
        self._place = 0

    @property
    def next(self) -> Word | None:
        """Next word; None at the end of the line."""
        return self._words[self._place] if self._place < len(self._words) else None

    def at(self, part: str) -> Clauses:
        """Mark the place of the next word, or of the end, for a part; return the same clauses."""
        word = self.next
        column = self._line.end if word is None else word.column
        self.places.setdefault(part, []).append(TextPlace(self._line.number, column))
        return self

    def at_keyword(self, *keywords: str) -> bool:
        """Return True if the next word is one of some keywords."""
        word = self.next
        return word is not None and not word.quoted and word.text in keywords

    def at_number(self) -> bool:
        """Return True if the next word is a number."""
        word = self.next
        return word is not None and not word.quoted and is_number(word.text)

    def take(self, accepted: str) -> Word:
        """Take the next word.

        Raises:
            ProgramSyntaxError: the line ends here.
        """
        word = self.next
        if word is None:
            raise self.refuse(accepted)
        self._place += 1
        return word

    def skip(self, keyword: str) -> bool:
        """Take the next word if it is a keyword; return True if it was."""
        if not self.at_keyword(keyword):
            return False
        self.take(keyword)
        return True

    def keyword(self, keywords: Sequence[str], also: str = "") -> str:
        """Take one of some keywords; `also` names what else would be accepted."""
        if not self.at_keyword(*keywords):
            raise self.refuse(", ".join([*keywords, *([also] if also else [])]))
        return self.take("").text

    def name(self, accepted: str, owner: str) -> str:
        """Take a name, quoted or bare; it is marked as one of its owner, such as `the point`."""
        return self.at(f"the name of {owner}").take(accepted).text

    def number(self) -> float:
        """Take a number without a unit."""
        word = self._number()
        return self._finite(read_number(word.text), word)

    def integer(self, what: str) -> int:
        """Take a whole number without sign."""
        word = self.next
        if word is None or word.quoted or not (word.text.isascii() and word.text.isdigit()):
            raise self.refuse(f"{what}, a whole number")
        if len(word.text) > LONGEST_NUMBER:
            raise self.refuse(f"{what}, with up to {LONGEST_NUMBER} digits")
        return int(self.take("").text)

    def quantity(self, *dimensions: Dimension) -> tuple[float, Dimension]:
        """Take a number and its unit; return it in SI with what it measures."""
        number = self._number()
        unit = self._unit(dimensions, units_of(*dimensions))
        return self._finite(to_si(number.text, unit), number), UNITS[unit].dimension

    def quantities(self, part: str, *dimensions: Dimension) -> list[tuple[float, Dimension]]:
        """Take numbers with a unit behind them, or groups of such; return them in SI.

        Args:
            part: what each number is marked for.
            dimensions: what they may measure.
        """
        found: list[tuple[float, Dimension]] = []
        while self.at_number() or not found:
            numbers = [self.at(part)._number()]
            while self.at_number():
                numbers.append(self.at(part).take(""))
            unit = self._unit(dimensions, f"{_SHAPE_OF_A_NUMBER}, or {units_of(*dimensions)}")
            found += [
                (self._finite(to_si(each.text, unit), each), UNITS[unit].dimension)
                for each in numbers
            ]
        return found

    def done(self, accepted: Sequence[str] = ()) -> None:
        """Check that the line ends here; `accepted` are the clauses that could have followed."""
        if self.next is not None:
            raise self.refuse(", ".join([*accepted, "the end of the line"]))

    def refuse(self, accepted: str) -> ProgramSyntaxError:
        """Return the error for a next word that is not accepted here."""
        word = self.next
        if word is None:
            return self._error(self._line.end, "the line ends here", accepted)
        found = f"found {excerpt(word.text)}{' in quotation marks' if word.quoted else ''}"
        return self._error(word.column, found, accepted)

    def _number(self) -> Word:
        if not self.at_number():
            raise self.refuse(_SHAPE_OF_A_NUMBER)
        return self.take("")

    def _unit(self, dimensions: tuple[Dimension, ...], accepted: str) -> str:
        if not self.at_keyword(*unit_words(*dimensions)):
            raise self.refuse(accepted)
        return self.take("").text

    def _finite(self, value: float, word: Word) -> float:
        if not math.isfinite(value):
            raise self._error(word.column, "the number is too large", "numbers up to 1.7e308")
        return value

    def _error(self, column: int, problem: str, accepted: str) -> ProgramSyntaxError:
        return ProgramSyntaxError(self._file, self._line.number, column, problem, accepted)
