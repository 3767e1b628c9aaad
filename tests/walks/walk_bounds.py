"""Bounds of the walks: what each may cost today, and its budget. Read from `bounds.toml`."""

import tomllib
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from walks.tracer import Walk

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
