"""How much the tests cover, counted from their data: what a change of the tests may not lose.

Owns the counts and their least values, `coverage_counts.toml`. Standard library only.
"""

import ast
import json
import re
import tomllib
from collections.abc import Mapping
from pathlib import Path

TESTS = Path(__file__).parent
ROOT = TESTS.parent

_CODE = re.compile(r"\b(?:V|VerdictCode)\.([A-Z][A-Z_0-9]*)\b")


def counts(root: Path = ROOT) -> dict[str, int]:
    """Return what is covered, by what it is."""
    tests = root / "tests"
    return {
        "planted faults": _planted_faults(tests / "mutants"),
        "golden cases": _golden_cases(tests / "vectors"),
        "promises": _promises(tests / "promises" / "table.toml"),
        "refusal codes": _refusal_codes(root),
    }


def least(file: Path = TESTS / "coverage_counts.toml") -> dict[str, int]:
    """Return what must be covered, by what it is."""
    return tomllib.loads(file.read_text(encoding="utf-8"))["least"]  # type: ignore[no-any-return]


def lost(counted: Mapping[str, int], required: Mapping[str, int]) -> list[str]:
    """Return a line for each count below its least value, or that nothing counts any more."""
    return [
        f"{counted.get(name, 0):,} {name}, there must be {number:,}: some were lost"
        for name, number in required.items()
        if counted.get(name, 0) < number
    ]


def _planted_faults(folder: Path) -> int:
    """Return how many rows of the tables can be found by tests."""
    tables = (tomllib.loads(file.read_text(encoding="utf-8")) for file in folder.glob("*.toml"))
    rows = [row for table in tables for row in table["mutant"]]
    return sum("equivalent" not in row for row in rows)


def _golden_cases(folder: Path) -> int:
    return sum(len(json.loads(file.read_text(encoding="utf-8"))) for file in folder.glob("*.json"))


def _promises(table: Path) -> int:
    """Return how many rows name a test."""
    rows = tomllib.loads(table.read_text(encoding="utf-8"))
    scales = ("virtual", "sockets", "soak")
    return sum(row.isdecimal() and any(map(entry.get, scales)) for row, entry in rows.items())


def _refusal_codes(root: Path) -> int:
    """Return how many codes of verdicts a test names."""
    declared = ast.parse((root / "simplemsg" / "verdicts.py").read_text(encoding="utf-8"))
    codes = {
        statement.targets[0].id
        for definition in declared.body
        if isinstance(definition, ast.ClassDef) and definition.name == "VerdictCode"
        for statement in definition.body
        if isinstance(statement, ast.Assign) and isinstance(statement.targets[0], ast.Name)
    }
    named: set[str] = set()
    for file in (root / "tests").rglob("test_*.py"):
        named.update(_CODE.findall(file.read_text(encoding="utf-8")))
    return len(codes & named)
