"""Programs come back from text and JSON exactly as they were; what is no program is refused."""

import json
import math
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from rigs.data.example_counts import examples
from rigs.data.program_samples import HEAD, program, programs

from openpendant.server.programs.language import lexer, linking, program_json
from openpendant.server.programs.language.grammar import STATEMENTS
from openpendant.server.programs.language.parser import parse, parse_source
from openpendant.server.programs.language.printer import print_program, statement_lines
from openpendant.server.programs.language.program import DEEPEST_NESTING, MOST_POINTS, Program
from openpendant.server.programs.language.program_errors import ProgramSyntaxError, ProgramTooLarge
from openpendant.server.programs.language.program_json import program_from_json, program_to_json
from openpendant.simplemsg.names import LONGEST_NAME
from openpendant.simplemsg.pendant.management import program_values, statements
from openpendant.simplemsg.pendant.management.program_values import (
    LONGEST_COMMENT,
    MOST_JOINTS,
    MOST_TURNS,
    ProgramError,
    TeachPoint,
)
from openpendant.simplemsg.pendant.management.programs import MOST_STATEMENTS
from openpendant.simplemsg.pendant.management.statements import Move, Speed, SpeedKind, Way
from openpendant.simplemsg.verdicts import VerdictCode as V


@pytest.fixture
def document() -> dict[str, Any]:
    found: dict[str, Any] = json.loads(program_to_json(program("move PTP a\nwait 1 s")))
    return found


def refused(body: Any) -> ProgramError:
    text = body if isinstance(body, str) else json.dumps(body)
    with pytest.raises(ProgramError) as caught:
        program_from_json(text, "body")
    return caught.value


def test_the_format_is_named(document: dict[str, Any]) -> None:
    assert document["format"] == "openpendant-program/1"
    assert document["statements"][1] == {"statement": "wait", "duration": 1.0, "comment": ""}


@pytest.mark.parametrize(
    ("path", "value", "message", "code"),
    [
        (["format"], "openpendant-program/2", "body: format: ", V.PROGRAM_SYNTAX),
        (["name"], "a/b", "the name of the program has '/'", V.BAD_NAME),
        (["name"], 7, "body: name: ", V.PROGRAM_SYNTAX),
        (["extra"], 7, "body: extra: ", V.PROGRAM_SYNTAX),
        (["points", 0, "joints", 2], "1", "body: points[0].joints[2]: ", V.PROGRAM_SYNTAX),
        (["points", 0, "joints", 2], 1e9, "body: points[0]: joint 3 of ", V.PROGRAM_INVALID),
        (["points", 0, "joints", 0], math.nan, "joint 1 of point a is nan", V.PROGRAM_INVALID),
        (["points", 1, "name"], "a", "there is a point 'a' already", V.POINT_EXISTS),
        (["statements", 0, "point"], "x", "no point is named 'x'", V.POINT_UNKNOWN),
        (["statements", 0, "statement"], "fly", "body: statements[0]: ", V.PROGRAM_SYNTAX),
        (["statements", 0, "way"], "ptp", "body: statements[0].move.way: ", V.PROGRAM_SYNTAX),
        (["statements", 0, "zone"], True, "body: statements[0].move.zone: ", V.PROGRAM_SYNTAX),
        (["linear_axes"], [2, 1], "the linear axes are [2, 1]", V.PROGRAM_INVALID),
    ],
)
def test_a_wrong_field_is_named(
    document: dict[str, Any], path: list[Any], value: Any, message: str, code: V
) -> None:
    place: Any = document
    for step in path[:-1]:
        place = place[step]
    place[path[-1]] = value
    error = refused(document)
    assert message in f"body: {error}" if "body: the" in message else message in str(error)
    assert error.code is code


@pytest.mark.parametrize(
    "body",
    [
        *("", "[]", "null", "{}", "{", "[" * 100_000, '{"format":' * 100_000),
        *("\udc00", '{"name": NaN}', '{"format": "openpendant-program/1", "name": "\\u0000"}'),
    ],
)
def test_what_is_no_program_is_refused(body: str) -> None:
    assert refused(body).code is V.PROGRAM_SYNTAX


def test_a_body_that_is_too_large_is_refused_unread() -> None:
    with pytest.raises(ProgramTooLarge, match=str(program_json.MOST_JSON_BYTES)):
        program_from_json(" " * (program_json.MOST_JSON_BYTES + 1))


def from_bytes(text: str, file: str) -> Program:
    return program_json.source_of(text.encode(), file).program


by_each_reader = pytest.mark.parametrize("read", [program_json.program_from_source, from_bytes])


@pytest.mark.parametrize(
    ("once", "twice", "key"),
    [
        ('"name":"main"', '"name":"main","name":"other"', "name"),
        ('"point":"a"', '"point":"a","point":"b"', "point"),
        ('"duration":1.0', '"duration":1.0,"duration":1.0', "duration"),
    ],
)
@by_each_reader
def test_a_key_that_stands_twice_in_what_somebody_wrote_is_refused(
    document: dict[str, Any], read: Callable[[str, str], Program], once: str, twice: str, key: str
) -> None:
    text = json.dumps(document, separators=(",", ":"))
    assert text.count(once) == 1
    with pytest.raises(ProgramError, match=f"^body: has the key '{key}' twice") as caught:
        read(text.replace(once, twice), "body")
    assert caught.value.code is V.PROGRAM_SYNTAX


@by_each_reader
def test_a_byte_order_mark_is_taken_before_json_as_before_text(
    document: dict[str, Any], read: Callable[[str, str], Program]
) -> None:
    text = json.dumps(document)
    assert read("\ufeff" + text, "body") == program_from_json(text)
    with pytest.raises(ProgramError):
        read("\ufeff\ufeff" + text, "body")


@pytest.mark.parametrize("body", ["\udc00", "[" * 100_000, "{", b"\xff{}"])
def test_what_is_no_json_is_refused_as_what_is_no_program(body: str | bytes) -> None:
    with pytest.raises(ProgramError) as caught:
        program_json.program_from_source(body)
    assert caught.value.code is V.PROGRAM_SYNTAX


@settings(max_examples=examples(20, in_soak=5_000))
@given(programs())
def test_every_program_comes_back_from_its_text(program: Program) -> None:
    text = print_program(program)
    source = parse_source(text)
    assert (source.program, source.statement_lines) == (program, statement_lines(program))
    assert print_program(source.program) == text


@settings(max_examples=examples(20, in_soak=5_000))
@given(programs())
def test_every_program_comes_back_from_its_json(program: Program) -> None:
    assert program_from_json(program_to_json(program)) == program


def test_the_layout_is_canonical() -> None:
    text = (
        HEAD
        + """point "d e" joints 1 0 0 0 0 0.5 rad pose 1 2 3 mm quat 0 0 0 1
  # go
  loop 3 # thrice
move  LIN a speed 0.25 m/s zone 1 mm
if flag ok on
wait 500 ms
  else
set output 1 off
end
end"""
    )
    printed = print_program(parse(text))
    assert (
        printed.partition('point "d e"')[2]
        == """
  joints 57.29577951308232 0 0 0 0 28.64788975654116 deg
  pose 1 2 3 mm quat 0 0 0 1 frame base tool flange

# go
loop 3  # thrice
  move LIN a speed 250 mm/s zone 1 mm
  if flag ok on
    wait 0.5 s
  else
    set output 1 off
  end
end
"""
    )


def test_a_text_that_could_not_be_read_back_is_not_printed() -> None:
    comment = statements.Comment(comment="ß" * 200)
    with pytest.raises(ProgramTooLarge, match="bytes in the text of long; accepted: up to 1048576"):
        print_program(Program("long", "ur5", statements=(comment,) * 3_000))


LONG_NUMBER = 123456.78901234567
LONG_DIGITS = 0.00012345678901234567


def name(letter: str, number: int = 0) -> str:
    """The longest name, in quotation marks as it has a space."""
    return f"{number:3d}".replace(" ", "x") + " " + letter * (LONGEST_NAME - 4)


def spline(letter: str) -> Program:
    """The longest move, as far inside as it may be."""
    goal, *vias = (name(letter, n) for n in range(statements.MOST_VIAS + 1))
    speed = Speed(SpeedKind.TOOL, LONG_DIGITS)
    comment = letter * LONGEST_COMMENT
    move = Move(Way.SPLINE, goal, tuple(vias), speed, dwell=LONG_DIGITS, comment=comment)
    opened, closed = (statements.Loop(),) * DEEPEST_NESTING, (statements.End(),) * DEEPEST_NESTING
    taught = tuple(TeachPoint(each, (0.0,) * 6) for each in (goal, *vias))
    return replace(program(""), points=taught, statements=(*opened, move, *closed))


def point(letter: str) -> Program:
    rotation = (0.5000000000000001, 0.49999999999999994, 0.5000000000000001, 0.4999999999999999)
    pose = program_values.PointPose((LONG_NUMBER,) * 3, rotation, name(letter, 1), name(letter, 2))
    arm = program_values.ArmConfiguration("front", "down", "no-flip", (-MOST_TURNS,) * MOST_JOINTS)
    axes = tuple(range(0, MOST_JOINTS, 2))
    numbers = (LONG_DIGITS, LONG_NUMBER) * (MOST_JOINTS // 2)
    found = TeachPoint(name(letter), numbers, pose, arm, letter * LONGEST_COMMENT)
    whole = replace(program(""), points=(found,), linear_axes=axes)
    return replace(whole, tool=name(letter, 3), frame=name(letter, 4))


@pytest.mark.parametrize("letter", ["x", "ß", "点", "𝄞"])
@pytest.mark.parametrize("longest", [spline, point])
def test_the_longest_lines_can_be_read_back(longest: Callable[[str], Program], letter: str) -> None:
    found = longest(letter)
    assert parse(print_program(found)) == found


def test_no_statement_has_a_line_that_the_parser_refuses() -> None:
    """The move through the most points, were all its numbers as long as any may be."""
    names = (statements.MOST_VIAS + 1) * (LONGEST_NAME + 3)
    numbers = 3 * (lexer.LONGEST_NUMBER + len(" speed  mm/s"))
    words = len("move SPLINE via ") + 2 * DEEPEST_NESTING + LONGEST_COMMENT + len("  # ")
    printed = max(map(len, print_program(spline("x")).split("\n")))
    assert printed <= names + numbers + words <= lexer.LONGEST_LINE


ROOT = Path(__file__).parents[4]
PAGE = (ROOT / "docs" / "programs.md").read_text("utf-8")


def shown(language: str) -> str:
    (found,) = re.findall(rf"```{language}\n(.*?)```", PAGE, re.DOTALL)[:1]
    return str(found)


def section(title: str) -> str:
    return PAGE.partition(f"### {title}\n")[2].partition("\n##")[0]


def test_the_program_on_the_page_is_in_its_canonical_layout() -> None:
    text = shown("")
    assert print_program(parse(text)) == text


def test_the_json_on_the_page_is_a_program() -> None:
    program = program_from_json(shown("json"))
    kinds = [type(statement).__name__ for statement in program.statements]
    assert kinds == ["Loop", "Move", "WaitInput", "End"]


def test_every_statement_in_the_table_is_taken() -> None:
    names = {"P": "a", "Q": "b", "R": "c", "FLAG": "f", "OBJECT": "o", "PROGRAM": "other"}
    rows = [row.split(" | ")[0] for row in section("Statements").splitlines() if row[:3] == "| `"]
    seen = set()
    for row in rows:
        lines = re.findall(r"`([^`]+)`", row)
        if "`attach" in row:
            for line in lines:
                parse(HEAD + " ".join(names.get(word, word) for word in line.split()))
        else:
            text = "\n".join(lines).replace(" …", "")
            parse(HEAD + " ".join(names.get(w, w) for w in re.split(r"( |\n)", text) if w != " "))
        seen |= {line.split()[0] for line in lines}
    assert seen == set(STATEMENTS)


@pytest.mark.parametrize("word", sorted({*STATEMENTS, "joints", "pose", "config", "point"}))
def test_the_grammar_has_every_keyword(word: str) -> None:
    assert f'"{word}"' in shown("ebnf")


@pytest.mark.parametrize("unit", lexer.UNITS)
def test_the_page_has_every_unit(unit: str) -> None:
    assert f"`{unit}`" in PAGE.partition("### Header")[0]


def test_the_error_on_the_page_is_the_parsers() -> None:
    with pytest.raises(ProgramSyntaxError) as caught:
        parse(HEAD + "move PTP a spede 50 %", "pick.program")
    assert str(caught.value) == shown("text").strip()


def test_the_limits_on_the_page_are_those_of_the_code() -> None:
    assert lexer.MOST_BYTES == 1 << 20
    most = (MOST_POINTS, MOST_STATEMENTS, linking.MOST_PARTS)
    for limit in (lexer.LONGEST_LINE, DEEPEST_NESTING, *most):
        assert f"{limit:,}" in section("Errors")
    for limit in (linking.DEEPEST_CALL, linking.MOST_PROGRAMS, LONGEST_COMMENT):
        assert f"{limit} " in section("Errors")
