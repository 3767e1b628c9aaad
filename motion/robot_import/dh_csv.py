"""The CSV form of a Denavit–Hartenberg table, as the mapping that its YAML form holds.

Owns that form only: declarations stand in comments (`# convention: standard`), then one line names
the columns, then there is a line per joint. What the cells mean is `dh_file`'s.
"""

from __future__ import annotations

import csv
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from ..bounded_file import read_text
from ..errors import RobotFileError
from ..robot_file import MAX_FILE_BYTES

_NUMBER_COLUMNS = frozenset(
    {"theta", "d", "a", "alpha", "lower", "upper", "velocity", "acceleration"}
)


def read_dh_csv(path: Path) -> dict[str, Any]:
    """Read what a table's YAML form would hold: declarations, and `joints` as a list of rows.

    Raises:
        RobotFileError: the file cannot be read or is no table of cells.
    """
    file = str(path)
    text = read_text(path, MAX_FILE_BYTES, RobotFileError, "utf-8-sig")
    lines = text.splitlines()
    content: dict[str, Any] = {}
    for line in lines:
        key, colon, value = line.strip().removeprefix("#").partition(":")
        if line.strip().startswith("#") and colon:
            _declare(content, key.strip(), value.strip(), file)
    rows = [line for line in lines if line.strip() and not line.strip().startswith("#")]
    try:
        reader = csv.DictReader(rows, strict=True, skipinitialspace=True)
        columns = [name.strip() for name in reader.fieldnames or ()]
        _refuse_repeated(columns, file)
        content["joints"] = [
            _csv_row(row, number, columns, file) for number, row in enumerate(reader, start=1)
        ]
    except csv.Error as error:
        raise RobotFileError(file, "", f"is not valid CSV: {error}") from error
    return content


def _declare(content: dict[str, Any], key: str, value: str, file: str) -> None:
    # Of two that differ neither may win in silence: they make different robots.
    said = content.setdefault(key, value)
    if said != value:
        problem = f"is declared twice, as {said[:40]!r} and {value[:40]!r}; accepted: one of them"
        raise RobotFileError(file, key, problem)


def _refuse_repeated(columns: Sequence[str], file: str) -> None:
    for name, count in Counter(columns).items():
        if count > 1:
            problem = f"are {count} of the name {name[:40]!r}; accepted: each name once"
            raise RobotFileError(file, "columns", problem)


def _csv_row(
    row: Mapping[str | None, Any], number: int, columns: Sequence[str], file: str
) -> dict[str, Any]:
    where = f"row {number}"
    cells = sum(cell is not None for name, cell in row.items() if name is not None)
    cells += len(row.get(None, ()))
    if cells != len(columns):
        accepted = f"{len(columns)}, one per column ({', '.join(columns)[:80]})"
        raise RobotFileError(file, where, f"has {cells} cells; accepted: {accepted}")
    found: dict[str, Any] = {}
    for column, cell in row.items():
        name, text = str(column).strip(), str(cell).strip()
        if not text:
            continue
        try:
            found[name] = float(text) if name in _NUMBER_COLUMNS else text
        except ValueError:
            problem = f"is {text[:40]!r}; accepted: a number"
            raise RobotFileError(file, f"{where}.{name}", problem) from None
    return found
