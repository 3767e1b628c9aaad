"""The table of promises, `tests/promises/table.toml`: what tests and the page for users read.

Owns how a figure is looked up. A number that is promised stands in that file once: the page prints
it from there (`promise_page.py`), and the tests assert what they read here.
"""

import tomllib
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

TABLE = Path(__file__).parent / "table.toml"

COMMON = "common"
"""The entry for figures of the page that belong to no row."""

_NANOSECONDS = {"ms": 1e6, "s": 1e9, "min": 60e9}
_BYTES = {"KiB": 2**10, "MiB": 2**20}


@dataclass(frozen=True, slots=True)
class Figure:
    """A number that is promised.

    Attributes:
        bound: the number.
        unit: its unit; empty for a count.
        trials: so many decide whether it is kept on sockets, in `make soak`; 0 where it is exact.
    """

    bound: float
    unit: str = ""
    trials: int = 0

    @property
    def count(self) -> int:
        """The bound as a whole number."""
        assert self.bound == int(self.bound), self
        return int(self.bound)

    @property
    def ns(self) -> int:
        """The bound in nanoseconds; only of a time."""
        return round(self.bound * _NANOSECONDS[self.unit])

    @property
    def ms(self) -> float:
        """The bound in milliseconds; only of a time."""
        return self.ns / 1e6

    @property
    def seconds(self) -> float:
        """The bound in seconds; only of a time."""
        return self.ns / 1e9

    @property
    def bytes(self) -> int:
        """The bound in bytes; only of a size."""
        return round(self.bound * _BYTES[self.unit])


@cache
def table() -> dict[str, dict[str, Any]]:
    """Return the whole file: an entry for each row of the page, by its number, and `COMMON`."""
    return tomllib.loads(TABLE.read_text(encoding="utf-8"))


def figures(row: int | str) -> dict[str, Figure]:
    """Return the figures of a row, by name."""
    given = table()[str(row)].get("figures", {})
    return {name: Figure(**each) for name, each in given.items()}


def figure(row: int | str, name: str) -> Figure:
    """Return a figure of a row.

    Raises:
        KeyError: there is none of that name.
    """
    return figures(row)[name]


def tests_of_promises() -> frozenset[str]:
    """Return all tests that the table names: files, and `file::name`."""
    scales = ("virtual", "sockets", "soak")
    return frozenset(
        test for entry in table().values() for scale in scales for test in entry.get(scale, ())
    )
