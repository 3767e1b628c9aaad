"""Every promise has its tests, they exist, and they say which promise they show."""

from __future__ import annotations

import ast
import re
import tomllib
from functools import cache
from pathlib import Path

import pytest

TESTS = Path(__file__).parent.parent
PAGE = TESTS.parent / "docs" / "promises.md"
TABLE: dict[str, dict[str, list[str]]] = tomllib.loads(
    (Path(__file__).parent / "table.toml").read_text(encoding="utf-8")
)

PROMISED = {*range(1, 5), *range(11, 25), *range(26, 33), 52, 55}
"""Those that are kept by what there is now; 5 to 10 and 25 belong to links and serial lines."""

SCALES = {"virtual", "sockets", "soak"}

NAMED = [
    pytest.param(int(number), test, id=f"{number}: {test.rpartition('::')[2]}")
    for number, scales in TABLE.items()
    for tests in scales.values()
    for test in tests
]


@cache
def parsed(file: str) -> ast.Module:
    return ast.parse((TESTS / file).read_text(encoding="utf-8"))


def defined(tree: ast.Module) -> dict[str, ast.AST]:
    """Return what a test file defines at its top, by name."""
    found: dict[str, ast.AST] = {}
    for node in tree.body:
        match node:
            case ast.FunctionDef() | ast.AsyncFunctionDef() | ast.ClassDef():
                found[node.name] = node
            case ast.Assign(targets=[ast.Name(id=name)]):
                found[name] = node
    return found


def says(text: str, number: int) -> bool:
    """Tell whether a name or a sentence names a promise: promise_1_, promises 11 and 14."""
    for listing in re.findall(r"promises?[ _]([\d_, ]*(?:(?:and|to)[ _]\d+)?)", text.lower()):
        numbers = [int(each) for each in re.findall(r"\d+", listing)]
        if number in numbers:
            return True
        if "to" in listing and min(numbers) <= number <= max(numbers):
            return True
    return False


def test_each_promise_has_tests_at_exact_scale_and_no_other_row_is_there() -> None:
    assert {int(number) for number in TABLE} == PROMISED
    for number, scales in TABLE.items():
        assert set(scales) <= SCALES, number
        assert scales["virtual"], number


@pytest.mark.parametrize(("number", "test"), NAMED)
def test_a_test_that_is_named_exists_and_names_its_promise(number: int, test: str) -> None:
    file, _, name = test.partition("::")
    tree = parsed(file)
    about_file = ast.get_docstring(tree) or ""
    if not name:
        source = (TESTS / file).read_text(encoding="utf-8")
        assert says(source, number), f"{file} does not name promise {number}"
        return
    found = defined(tree).get(name)
    assert found is not None, f"{file} has no {name}"
    about = ""
    if isinstance(found, ast.FunctionDef | ast.AsyncFunctionDef):
        about = ast.get_docstring(found) or ""
    assert any(says(text, number) for text in (name, about, about_file)), test


@pytest.mark.parametrize("number", sorted(PROMISED))
def test_the_page_for_users_has_a_row_for_each(number: int) -> None:
    page = PAGE.read_text(encoding="utf-8")
    assert re.search(rf"^\| {number} \|", page, re.MULTILINE), number


@pytest.mark.parametrize(
    ("text", "number", "is_named"),
    [
        ("test_promise_1_the_ramp", 1, True),
        ("test_promise_11_holds", 1, False),
        ("test_promises_11_and_15_hold", 15, True),
        ("Promises 1, 2, 18 to 21, and the press", 20, True),
        ("Promises 11 and 14: into limits", 12, False),
        ("(promises 18, 19, 26)", 26, True),
    ],
)
def test_a_promise_is_named_by_its_number_and_by_no_part_of_it(
    text: str, number: int, is_named: bool
) -> None:
    assert says(text, number) == is_named
