"""Every promise has its tests, they exist and say which; page, table and tests have one number."""

import ast
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest
from promises import promise_page
from promises.promise_table import COMMON, Figure, figures, table
from run_lanes import SOAK, lane_commands

TESTS = Path(__file__).parent.parent

PROMISED = {*range(1, 45), 52, 53, 54, 55}
"""Those that are kept by what there is now."""

SCALES = ("virtual", "sockets", "soak")
TEXTS = ("when", "then", "exact_bound", "socket_bound")

NAMED = [
    pytest.param(row, test, id=f"{row}: {test.rpartition('::')[2]}")
    for row, entry in table().items()
    for scale in SCALES
    for test in entry.get(scale, ())
]
NAMED_ON_SOCKETS = [
    pytest.param(row, test, id=f"{row}: {test.rpartition('::')[2]}")
    for row, entry in table().items()
    for test in entry.get("sockets", ())
]
FIGURES = [
    pytest.param(row, name, promised, id=f"{row}: {name}")
    for row in table()
    for name, promised in figures(row).items()
]


@cache
def parsed(file: str) -> ast.Module:
    return ast.parse((TESTS / file).read_text(encoding="utf-8"))


def defined(tree: ast.Module) -> dict[str, ast.AST]:
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


def texts(row: str) -> list[str]:
    entry = table()[row]
    names = ("method", "besides") if row == COMMON else TEXTS
    return [*(entry.get(name, "") for name in names), *entry.get("notes", ())]


def reads(tree: ast.Module) -> Iterator[tuple[str, str]]:
    for node in ast.walk(tree):
        match node:
            case ast.Call(func=ast.Name(id="figure"), args=[ast.Constant(row), ast.Constant(name)]):
                yield str(row), str(name)
            case ast.Call(func=ast.Name(id="figure"), args=[ast.Name(), ast.Constant(name)]):
                yield COMMON, str(name)


@cache
def readers() -> dict[tuple[str, str], set[str]]:
    found: dict[tuple[str, str], set[str]] = {}
    for path in sorted(TESTS.rglob("*.py")):
        # To parse all files of the tests would take longer than to collect their tests.
        if "figure(" in path.read_text(encoding="utf-8"):
            file = path.relative_to(TESTS).as_posix()
            for read in reads(parsed(file)):
                found.setdefault(read, set()).add(file)
    return found


def test_each_promise_has_tests_at_exact_scale() -> None:
    assert set(promise_page.rows()) >= PROMISED
    for row in promise_page.rows():
        assert table()[str(row)]["virtual"], row


@pytest.mark.parametrize("row", list(table()))
def test_an_entry_holds_nothing_that_nobody_reads(row: str) -> None:
    known = {*TEXTS, *SCALES, "notes", "figures"}
    assert set(table()[row]) <= (known | {"method", "besides"} if row == COMMON else known)


@pytest.mark.parametrize("row", list(table()))
def test_the_page_says_no_number_that_is_not_a_figure(row: str) -> None:
    """But for the length of a tick at the default rate, and words such as T1."""
    for text in texts(row):
        allowed = r"\{\w+\}|\bT1\b|99th|10 ms at the default 100 Hz|row \d+"
        without = re.sub(allowed, "", text)
        assert not re.search(r"\d", without), text


@pytest.mark.parametrize(("row", "name", "promised"), FIGURES)
def test_a_figure_is_on_the_page_and_asserted_by_a_test_of_its_row(
    row: str, name: str, promised: Figure
) -> None:
    assert any(f"{{{name}}}" in text for text in texts(row)), "the page does not say it"
    files = readers().get((row, name), set())
    helpers = {file for file in files if not Path(file).name.startswith("test_")}
    named = {test.partition("::")[0] for scale in SCALES for test in table()[row].get(scale, ())}
    assert files & (named | helpers), f"no test of row {row} reads it; {sorted(files)} do"
    assert promised.trials >= 0


def test_what_a_test_reads_is_a_figure() -> None:
    assert [(row, name) for row, name in sorted(readers()) if name not in figures(row)] == []


def test_the_page_is_what_the_table_says() -> None:
    page = promise_page.PAGE.read_text(encoding="utf-8")
    assert page == promise_page.written_anew(page), "write it anew: make reference"


@pytest.mark.parametrize(
    ("promised", "text"),
    [
        (Figure(20, "ms"), "20 ms"),
        (Figure(1_024), "1,024"),
        (Figure(2.5), "2.5"),
        (Figure(1e-6), "10⁻⁶"),
        (Figure(1, "tick"), "1 tick"),
        (Figure(2, "tick"), "2 ticks"),
        (Figure(250, "mm/s"), "250 mm/s"),
    ],
)
def test_a_figure_is_printed_with_its_unit(promised: Figure, text: str) -> None:
    assert promise_page.printed(promised) == text


def test_the_soak_runs_every_test_of_the_table_and_those_with_a_time_one_after_the_other() -> None:
    lanes = dict(lane_commands(8, (), soak=True))
    chosen = " ".join(SOAK)
    assert chosen.startswith(
        "-m soak or conformance or hypothesis or promise --hypothesis-profile=soak "
    )
    assert all(" ".join(command).endswith(chosen) for command in lanes.values())
    assert "--workers=0" in lanes["real-time"]


@pytest.mark.parametrize(("row", "test"), NAMED_ON_SOCKETS)
def test_what_is_measured_on_sockets_has_the_machine_for_itself(row: str, test: str) -> None:
    """Where nothing with a unit is promised, a test of processes may run beside others."""
    file, _, name = test.partition("::")
    tree = parsed(file)
    marks = [node for node in tree.body if "pytestmark" in ast.unparse(node)]
    if name:
        marks += getattr(defined(tree)[name], "decorator_list", [])
    on_real_clock = any("realtime" in ast.unparse(node) for node in marks)
    assert on_real_clock or not any(figure.unit for figure in figures(row).values())


@pytest.mark.parametrize(("row", "test"), NAMED)
def test_a_test_that_is_named_exists_and_names_its_promise(row: str, test: str) -> None:
    file, _, name = test.partition("::")
    tree = parsed(file)
    about_file = ast.get_docstring(tree) or ""
    found = defined(tree).get(name)
    assert found is not None or not name, f"{file} has no {name}"
    if row == COMMON:
        return
    number = int(row)
    if not name:
        source = (TESTS / file).read_text(encoding="utf-8")
        assert says(source, number), f"{file} does not name promise {number}"
        return
    about = ""
    if isinstance(found, ast.FunctionDef | ast.AsyncFunctionDef):
        about = ast.get_docstring(found) or ""
    assert any(says(text, number) for text in (name, about, about_file)), test


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
