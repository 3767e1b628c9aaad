"""The command behind `make walk`: the table of the walks, or one of them file by file."""

import argparse
import ast
import json
import sys
import textwrap
import tomllib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any

from walks.tracer import Walk
from walks.walk_table import ROUTES, gone

FILE = Path(__file__).parent / "bounds.toml"

SLACK = 0.1
"""Share of a bound by which a count may lie below it before the bound has to be lowered."""


@dataclass(frozen=True, slots=True)
class Bounds:
    """What a walk may cost.

    Attributes:
        calls: most calls.
        files: most files.
        budget_calls: calls that it is to come down to.
        budget_files: files that it is to come down to.
    """

    calls: int
    files: int
    budget_calls: int
    budget_files: int


@cache
def bounds() -> dict[str, Bounds]:
    """Return the bounds of all walks by name."""
    tables = tomllib.loads(FILE.read_text(encoding="utf-8"))
    return {name: Bounds(**table) for name, table in tables.items()}


def problems(walk: Walk, allowed: Bounds) -> list[str]:
    """Return in words what is wrong between a walk and its bounds; nothing where they fit."""
    counts = (("calls", walk.calls, allowed.calls), ("files", len(walk.files), allowed.files))
    found = []
    for what, count, most in counts:
        if count > most:
            found.append(f"{count} {what}, more than the bound of {most}")
        elif count < most * (1 - SLACK):
            found.append(f"{count} {what}: lower the bound of {most} in {FILE.name} to that")
    return found


_EXPLAINED = """\
A walk is one event through a running cell, counted, not timed: every call of a function of
simplemsg, motion and server on the loop's thread between the first and the last frame. `hops` are
calls into another file, `depth` is the most frames of ours on the stack. The server runs with an
emulated robot on a virtual clock, so the counts are the same in every run of the same code.
"""

_RIG = """\
rig: one server with one cell, an emulated UR5 at 100 reports a second; 100 ticks a second; one
pendant, told the state with each tick in b1, b2, c and d2, connected but not told in the others;
no ROS-Industrial client; surroundings with an empty scene, no signals and no recording; a store in
memory and a planner, each of which answers when told to; no accounts, audit log, journal, watchdog
"""

_HEADING = ("walk", "calls", "files", "hops", "depth", "bound", "budget", "event")
_ROW = "{:7}{:>6}{:>6}{:>6}{:>6}  {:>9} {:>9}  {}"
_WIDTH = 100


def main(arguments: Sequence[str] | None = None) -> int:
    """Go walks and print what they cost; return the exit code."""
    asked = _parser().parse_args(arguments)
    if asked.walk:
        if asked.walk not in ROUTES:
            sys.stderr.write(f"walk: no walk {asked.walk!r}; there are {', '.join(ROUTES)}\n")
            return 2
        walk = gone(asked.walk)
        _tell(_json(as_data(asked.walk, walk)) if asked.json else path(asked.walk, walk))
        return 0
    if asked.json:
        _tell(_json([as_data(name, gone(name)) for name in ROUTES]))
        return 0
    _tell(_ROW.format(*_HEADING))
    for name in ROUTES:
        _tell(table_row(name, gone(name)))
    _tell("bound and budget are calls/files of tests/walks/bounds.toml")
    _tell(_RIG.rstrip())
    return 0


def table_row(name: str, walk: Walk) -> str:
    """Return the line of the table for a walk."""
    allowed = bounds()[name]
    return _ROW.format(
        name,
        walk.calls,
        len(walk.files),
        walk.hops,
        walk.depth,
        f"{allowed.calls}/{allowed.files}",
        f"{allowed.budget_calls}/{allowed.budget_files}",
        ROUTES[name].title,
    )


def path(name: str, walk: Walk) -> str:
    """Return a walk's files in order, each with its calls, its subject and its functions."""
    lines = [
        f"{name}  {ROUTES[name].title}",
        f"{walk.calls} calls of {len(walk.functions)} functions in {len(walk.files)} files, "
        f"{walk.hops} from file to file, {walk.depth} deep",
    ]
    for file, calls in walk.files.items():
        lines += ["", f"{calls:4}  {file}: {subject(file)}"]
        listed = ", ".join(
            name if count == 1 else f"{name} ×{count}" for name, count in _functions_of(walk, file)
        )
        lines += textwrap.wrap(
            listed,
            _WIDTH,
            initial_indent=" " * 6,
            subsequent_indent=" " * 6,
            break_on_hyphens=False,
            break_long_words=False,
        )
    return "\n".join(lines)


def subject(file: str) -> str:
    """Return the first line of a product file's docstring."""
    return (ast.get_docstring(source_of(file)) or "").partition("\n")[0]


def source_of(file: str) -> ast.Module:
    """Return the syntax tree of a product file, such as server/shell/app.py."""
    room, _, name = file.partition("/")
    folder = Path(next(iter(import_module(f"openpendant.{room}").__path__)))
    return ast.parse((folder / name).read_text(encoding="utf-8"))


def as_data(name: str, walk: Walk) -> dict[str, Any]:
    """Return a walk as plain data for JSON."""
    allowed = bounds()[name]
    return {
        "walk": name,
        "event": ROUTES[name].title,
        "calls": walk.calls,
        "files": len(walk.files),
        "functions": len(walk.functions),
        "hops": walk.hops,
        "depth": walk.depth,
        "bound": {"calls": allowed.calls, "files": allowed.files},
        "budget": {"calls": allowed.budget_calls, "files": allowed.budget_files},
        "path": [
            {"file": file, "calls": calls, "functions": dict(_functions_of(walk, file))}
            for file, calls in walk.files.items()
        ],
    }


def _functions_of(walk: Walk, file: str) -> Iterator[tuple[str, int]]:
    for (owner, name), count in walk.functions.items():
        if owner == file:
            yield name, count


def _tell(text: str) -> None:
    sys.stdout.write(f"{text}\n")
    sys.stdout.flush()


def _json(data: object) -> str:
    return json.dumps(data, indent=1, ensure_ascii=False)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="make walk WALK_ARGS=...",
        description="Counts what an event costs on its way through the server.",
        epilog=_EXPLAINED,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("walk", nargs="?", default="", help=f"one of {', '.join(ROUTES)}; or all")
    parser.add_argument("--json", action="store_true", help="print JSON instead of a table")
    return parser
