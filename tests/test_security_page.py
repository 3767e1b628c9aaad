"""`docs/security.md`: every line names tests that exist, and nothing of it is missing."""

import ast
import re
from functools import cache
from pathlib import Path

import pytest

TESTS = Path(__file__).parent
PAGE = TESTS.parent / "docs" / "security.md"

REQUIREMENTS = (
    "identification and authentication control",
    "use control",
    "system integrity",
    "data confidentiality",
    "restricted data flow",
    "timely response to events",
    "resource availability",
)


def rows(page: str) -> list[tuple[str, list[str]]]:
    """Return the rows of all tables of a page, each with the section that it is in."""
    found: list[tuple[str, list[str]]] = []
    section = ""
    lines = page.splitlines()
    for line, next_line in zip(lines, [*lines[1:], ""], strict=True):
        if line.startswith("#"):
            section = line.lstrip("# ")
        is_head = next_line.startswith("|---")
        if line.startswith("| ") and not is_head:
            found.append((section, [cell.strip() for cell in line.strip("| ").split(" | ")]))
    return found


PAGE_ROWS = rows(PAGE.read_text(encoding="utf-8"))


@cache
def functions_in(file: str) -> frozenset[str]:
    tree = ast.parse((TESTS / file).read_text(encoding="utf-8"))
    kinds = (ast.FunctionDef, ast.AsyncFunctionDef)
    return frozenset(node.name for node in tree.body if isinstance(node, kinds))


def problems(cells: list[str]) -> list[str]:
    """Return what is wrong with the tests that a row names."""
    named = re.findall(r"`([^`]+)`", cells[-1])
    if not named or re.sub(r"`[^`]+`|[, ]", "", cells[-1]):
        return ["the last column names no tests, or something besides"]
    wrong = []
    for test in named:
        file, _, name = test.partition("::")
        if not (TESTS / file).is_file():
            wrong.append(f"{file} is not there")
        elif not name.startswith("test_") or name not in functions_in(file):
            wrong.append(f"no {name} in {file}")
    return wrong


@pytest.mark.parametrize(
    ("section", "cells"), PAGE_ROWS, ids=[cells[0][:40] for _, cells in PAGE_ROWS]
)
def test_every_line_names_tests_that_exist(section: str, cells: list[str]) -> None:
    wanted = 4 if section.startswith("By the seven requirements") else 3
    assert len(cells) == wanted
    assert problems(cells) == []


@pytest.mark.parametrize(
    ("last", "said"),
    [
        ("", "names no tests"),
        ("by nobody", "names no tests"),
        ("`test_security_page.py`", "no  in test_security_page.py"),
        ("`nowhere.py::test_x`", "nowhere.py is not there"),
        ("`test_security_page.py::test_gone`", "no test_gone in test_security_page.py"),
        ("`test_security_page.py::rows`", "no rows in test_security_page.py"),
    ],
)
def test_a_line_whose_test_is_gone_is_told(last: str, said: str) -> None:
    (told,) = problems(["a stranger", "a login", last])
    assert said in told


def test_both_what_is_protected_and_what_is_not_stand_there() -> None:
    sections = {section for section, _ in PAGE_ROWS}
    assert {"Who comes in", "What passes on the network", "What moves the robot"} <= sections
    assert {"Room for everybody", "What is written and shown", "What is not protected"} <= sections


def test_the_seven_requirements_stand_there_in_their_order() -> None:
    told = [cells[0] for section, cells in PAGE_ROWS if section.startswith("By the seven")]
    assert told == [f"FR {number} {name}" for number, name in enumerate(REQUIREMENTS, start=1)]


@pytest.mark.parametrize(
    "sentence",
    [
        "**no safety device**",
        "**Who shares the attacker's address shares its rate**",
        "private vulnerability report",
        "no security level is claimed",
        "`make audit`",
    ],
)
def test_the_page_says_what_nobody_should_miss(sentence: str) -> None:
    assert sentence in PAGE.read_text(encoding="utf-8")


def test_the_page_names_no_address_to_write_to() -> None:
    assert not re.search(r"[\w.]+@[\w.]+\.\w+|mailto:", PAGE.read_text(encoding="utf-8"))


def test_the_pages_that_lead_there_do() -> None:
    for page in ("index.md", "access.md", "safety.md"):
        assert "(security.md)" in (PAGE.parent / page).read_text(encoding="utf-8"), page
