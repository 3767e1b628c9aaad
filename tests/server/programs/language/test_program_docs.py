from __future__ import annotations

import re
from pathlib import Path

import pytest
from rigs.data.program_samples import HEAD

from openpendant.server.programs.language.grammar import STATEMENTS
from openpendant.server.programs.language.lexer import LONGEST_LINE, MOST_BYTES, UNITS
from openpendant.server.programs.language.linking import DEEPEST_CALL, MOST_PARTS, MOST_PROGRAMS
from openpendant.server.programs.language.parser import parse
from openpendant.server.programs.language.printer import print_program
from openpendant.server.programs.language.program import DEEPEST_NESTING, MOST_POINTS
from openpendant.server.programs.language.program_errors import ProgramSyntaxError
from openpendant.server.programs.language.program_json import program_from_json
from openpendant.simplemsg.pendant.management.programs import MOST_STATEMENTS
from openpendant.simplemsg.pendant.management.words import LONGEST_COMMENT

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
    assert [type(statement).__name__ for statement in program.statements] == [
        *("Loop", "Move", "WaitInput", "End")
    ]


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


@pytest.mark.parametrize("unit", UNITS)
def test_the_page_has_every_unit(unit: str) -> None:
    assert f"`{unit}`" in PAGE.partition("### Header")[0]


def test_the_error_on_the_page_is_the_parsers() -> None:
    with pytest.raises(ProgramSyntaxError) as caught:
        parse(HEAD + "move PTP a spede 50 %", "pick.program")
    assert str(caught.value) == shown("text").strip()


def test_the_limits_on_the_page_are_those_of_the_code() -> None:
    assert MOST_BYTES == 1 << 20
    for limit in (LONGEST_LINE, MOST_POINTS, MOST_STATEMENTS, MOST_PARTS, DEEPEST_NESTING):
        assert f"{limit:,}" in section("Errors")
    for limit in (DEEPEST_CALL, MOST_PROGRAMS, LONGEST_COMMENT):
        assert f"{limit} " in section("Errors")
