"""Which rows are run: all, those of a name or file, or those that a change may have broken.

Owns what `MUTANTS=` means. `changed` asks git for the files that differ from a base, uncommitted
changes and new files included.
"""

import subprocess
from collections.abc import Sequence
from fnmatch import fnmatch
from pathlib import Path

from mutants.mutant_table import FOLDER, ROOT, BadTable, Mutant, parse_rows


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
