"""Tokens of a program's text: its words with their places.

Owns the definition of a word: a quoted name, or characters up to the next space; `#` begins a
comment that ends with the line. Knows no grammar. Reads line by line, so that memory stays bounded
by the text.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

from .program_errors import ProgramSyntaxError, ProgramTooLarge, excerpt

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
