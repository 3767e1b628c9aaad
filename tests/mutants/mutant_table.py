"""The table of faults that the tests must find, and whether it can be trusted.

Owns the rows' format and the rules that a row keeps. A row names a fault in one file: the text to
change, which stands there exactly once, the text that takes its place, and the few tests that must
find it. One file of rows for each room, `tests/mutants/<room>.toml`.

Here too: which rows are run, all, those of a name or file, or those that a change may have broken:
`MUTANTS=changed` asks git for the files that differ from a base, uncommitted and new ones included.
"""

import ast
import re
import subprocess
import tomllib
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from fnmatch import fnmatch
from functools import cache
from pathlib import Path
from textwrap import dedent
from typing import Any

FOLDER = Path(__file__).parent
ROOT = FOLDER.parent.parent

_FUNCTIONS = (ast.FunctionDef, ast.AsyncFunctionDef)
_Function = ast.FunctionDef | ast.AsyncFunctionDef
_NAME = re.compile(r"[a-z0-9]+(-[a-z0-9]+)*")


class BadTable(ValueError):
    """A file of rows is not one: which, and what is wrong with it."""


@dataclass(frozen=True, slots=True)
class Mutant:
    """One row.

    Attributes:
        name: says the fault, in words joined by hyphens; unique in all rooms.
        file: that it changes, relative to the root of the project.
        before: text that stands in the file exactly once.
        after: what takes its place.
        tests: ids of the tests that must find it, as pytest takes them.
        room: the name of the table's file.
        equivalent: why no test can tell it from the original; None for all others.
    """

    name: str
    file: str
    before: str
    after: str
    tests: tuple[str, ...]
    room: str
    equivalent: str | None = None

    def changed(self, text: str) -> str:
        """Return the file's text with the fault in it.

        Raises:
            ValueError: the text to change is not there exactly once.
        """
        if (times := text.count(self.before)) != 1:
            raise ValueError(f"the text to change stands {times} times in {self.file}, not once")
        return text.replace(self.before, self.after)


def read_rows(folder: Path = FOLDER) -> list[Mutant]:
    """Return the rows of every `*.toml` in a folder, room by room.

    Raises:
        BadTable: a file is no table of rows.
    """
    return [
        row
        for path in sorted(folder.glob("*.toml"))
        for row in parse_rows(path.read_text(encoding="utf-8"), path.stem)
    ]


def parse_rows(text: str, room: str) -> list[Mutant]:
    """Return the rows of one room.

    Args:
        text: of its file.
        room: its name.

    Raises:
        BadTable: the text is no table of rows.
    """
    try:
        data = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise BadTable(f"{room}.toml: {error}") from error
    if set(data) - {"mutant"}:
        raise BadTable(f"{room}.toml: only [[mutant]] may stand here, not {sorted(data)}")
    return [_row(entry, room) for entry in data.get("mutant", [])]


def _row(entry: Mapping[str, Any], room: str) -> Mutant:
    where = f"{room}.toml, {entry.get('name', 'a row without a name')}"
    wanted = {"name": str, "file": str, "before": str, "after": str, "tests": list}
    for key, kind in wanted.items():
        if not isinstance(entry.get(key), kind):
            raise BadTable(f"{where}: {key} must be a {kind.__name__}")
    if unknown := set(entry) - set(wanted) - {"equivalent"}:
        raise BadTable(f"{where}: unknown {', '.join(sorted(unknown))}")
    if not isinstance(entry.get("equivalent", ""), str):
        raise BadTable(f"{where}: equivalent must be the reason, as text")
    return Mutant(
        name=entry["name"],
        file=entry["file"],
        before=entry["before"],
        after=entry["after"],
        tests=tuple(str(test) for test in entry["tests"]),
        room=room,
        equivalent=entry.get("equivalent"),
    )


def problems(rows: Iterable[Mutant], root: Path = ROOT) -> list[str]:
    """Return what is wrong with rows, each as `room/name: what`; nothing is planted or run."""
    rows = list(rows)
    found = [f"{row.room}/{row.name}: {said}" for row in rows for said in _problems(row, root)]
    names = Counter(row.name for row in rows)
    found += [f"{name}: stands {times} times" for name, times in names.items() if times > 1]
    return found


def _problems(row: Mutant, root: Path) -> Iterator[str]:
    if not _NAME.fullmatch(row.name):
        yield "the name is not in small letters joined by hyphens"
    if row.equivalent is not None and len(row.equivalent.split()) < 4:
        yield "the reason why it is equivalent is missing"
    yield from _fault_problems(row, root)
    if not row.tests and row.equivalent is None:
        yield "no test is named"
    for test in row.tests:
        path, _, inside = test.partition("::")
        if not (root / path).exists():
            yield f"{path} is not there"
        elif inside and inside.partition("[")[0] not in _test_names(root / path):
            yield f"no {inside} in {path}"


def _fault_problems(row: Mutant, root: Path) -> Iterator[str]:
    path = root / row.file
    if not (path.is_file() and path.suffix == ".py"):
        yield f"{row.file} is no Python file of the project"
        return
    text = _text(path)
    try:
        changed = row.changed(text)
    except ValueError as error:
        yield str(error)
        return
    first, last = _place(path, text, row.before)
    lines = slice(first, last + changed.count("\n") - text.count("\n"))
    try:
        if _is_same(_meaning(changed, lines), _meaning(text, slice(first, last))):
            yield "the change means nothing"
    except SyntaxError as error:
        where = first + (error.lineno or 0)
        yield f"the changed file does not compile: {error.msg}, line {where}"


def _place(path: Path, text: str, part: str) -> tuple[int, int]:
    """Return the lines of the innermost function or statement of a file that holds a part of it.

    So that only these are parsed: hundreds of rows times the whole file would take seconds.

    Returns:
        The first line and the one after the last, from 0; those of the file where none holds it.
    """
    begins = text.count("\n", 0, text.index(part)) + 1
    ends = begins + part.rstrip("\n").count("\n")
    lines = [bounds for bounds in _statements(path) if bounds[0] <= begins and ends <= bounds[1]]
    first, last = max(lines, default=(1, text.count("\n") + 1))
    return first - 1, last


def _meaning(text: str, lines: slice) -> ast.Module:
    """Return what lines mean, whatever their indentation."""
    return ast.parse(dedent("".join(text.splitlines(keepends=True)[lines])))


def _is_same(one: object, other: object) -> bool:
    """Return True if two trees differ in line numbers at most."""
    if type(one) is not type(other):
        return False
    if isinstance(one, ast.AST):
        return all(
            _is_same(getattr(one, name, None), getattr(other, name, None)) for name in one._fields
        )
    if isinstance(one, list) and isinstance(other, list):
        return len(one) == len(other) and all(map(_is_same, one, other))
    return repr(one) == repr(other)  # 0.0 is not -0.0


@cache
def _text(path: Path) -> str:
    return path.read_text(encoding="utf-8")


@cache
def _statements(path: Path) -> tuple[tuple[int, int], ...]:
    """Return first and last line of each statement of a file and each function, decorators too."""
    module = _parsed(path)
    nodes = [*module.body, *_functions(module)]
    bounds = set()
    for node in nodes:
        decorated = getattr(node, "decorator_list", [])
        first = min([node.lineno, *(each.lineno for each in decorated)])
        bounds.add((first, node.end_lineno or first))
    return tuple(bounds)


def _functions(module: ast.Module) -> Iterator[_Function]:
    blocks: list[ast.AST] = [module]
    while blocks:
        block = blocks.pop()
        for name in ("body", "orelse", "finalbody", "handlers", "cases"):
            inside = getattr(block, name, ())
            blocks.extend(inside if isinstance(inside, list) else ())
        if isinstance(block, _FUNCTIONS):
            yield block


def _parsed(path: Path) -> ast.Module:  # not kept: the trees of all files burden the collector
    return ast.parse(_text(path))


@cache
def _test_names(path: Path) -> frozenset[str]:
    names: set[str] = set()
    for node in _parsed(path).body:
        if isinstance(node, _FUNCTIONS):
            names.add(node.name)
        elif isinstance(node, ast.ClassDef):
            names.add(node.name)
            names |= {f"{node.name}::{n.name}" for n in node.body if isinstance(n, _FUNCTIONS)}
        elif isinstance(node, ast.Assign):  # a state machine of hypothesis: `Test = X.TestCase`
            names |= {target.id for target in node.targets if isinstance(target, ast.Name)}
    return frozenset(names)


class NoSuchBase(ValueError):
    """Git does not know what the rows shall be compared with."""


def matching(rows: Sequence[Mutant], pattern: str) -> list[Mutant]:
    """Return the rows whose name, room, file or a test holds the pattern, or matches it with *."""
    return [
        row
        for row in rows
        if any(
            pattern in text or fnmatch(text, pattern)
            for text in (row.name, row.room, row.file, *row.tests)
        )
    ]


def changed_since(rows: Sequence[Mutant], base: str, root: Path = ROOT) -> list[Mutant]:
    """Return the rows whose file, tests or row itself differ from a commit.

    Args:
        rows: all of them.
        base: the commit, as git names it.
        root: of the work tree.

    Raises:
        NoSuchBase: git does not know it, or this is no work tree of git.
    """
    differing = set(_git(root, "diff", "--name-only", "--no-renames", base).splitlines())
    differing |= set(_git(root, "ls-files", "--others", "--exclude-standard").splitlines())
    known = _rows_at(base, {row.room for row in rows}, differing, root)
    return [
        row
        for row in rows
        if row.file in differing
        or any(_holds(test.partition("::")[0], differing) for test in row.tests)
        or (row.room in known and row not in known[row.room])
    ]


def _holds(path: str, differing: set[str]) -> bool:
    """Tell whether a file, or a folder of tests, differs."""
    return path in differing or any(name.startswith(f"{path.rstrip('/')}/") for name in differing)


def _rows_at(
    base: str, rooms: set[str], differing: set[str], root: Path
) -> dict[str, list[Mutant]]:
    """Return the rows at a commit of the rooms whose table differs from it."""
    folder = FOLDER.relative_to(ROOT).as_posix()
    known: dict[str, list[Mutant]] = {}
    for room in rooms:
        if (path := f"{folder}/{room}.toml") in differing:
            try:
                known[room] = parse_rows(_git(root, "show", f"{base}:./{path}"), room)
            except (NoSuchBase, BadTable):  # the table is new, or was none
                known[room] = []
    return known


def _git(root: Path, *arguments: str) -> str:
    ran = subprocess.run(["git", *arguments], cwd=root, capture_output=True, text=True, check=False)
    if ran.returncode:
        raise NoSuchBase(ran.stderr.strip())
    return ran.stdout
