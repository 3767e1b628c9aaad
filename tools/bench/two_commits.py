"""Two commits of the project, measured in turns by their own benchmarks and compared row by row.

Owns when a row counts as worse; and the place of each side's sources and their import: the earlier
commit is checked out into a temporary folder, and the first entry of each process's path is a
folder in which the import name `openpendant` leads to that side's rooms. Interpreter and libraries
are those of this process.
"""

from __future__ import annotations

import json
import math
import os
import signal
import subprocess
import sys
import tempfile
import tomllib
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass
from enum import Enum
from pathlib import Path
from typing import Any

from .table import aligned, figure

TOLERANCE = 0.03
"""A row that is worse by no more than this share is as good."""


class RowVerdict(Enum):
    """Result of comparing a row."""

    WORSE = "worse"
    SAME = "same"
    BETTER = "better"
    NEW = "new"
    LEFT_OUT = "left out"
    FAILED = "not measured"

    @property
    def is_failure(self) -> bool:
        """True if such a row makes the comparison fail."""
        return self in (RowVerdict.WORSE, RowVerdict.FAILED)


@dataclass(frozen=True, slots=True)
class Quartiles:
    """The quartiles of some figures."""

    first: float
    median: float
    third: float

    @property
    def spread(self) -> float:
        """From the first to the third."""
        return 0.0 if self.first == self.third else self.third - self.first


@dataclass(frozen=True, slots=True)
class Comparison:
    """A row of both commits.

    Attributes:
        base: of the earlier commit; None where it has no such row.
        head: of the later one; None where it was not measured.
        ratio: of the later figure to the earlier one, in each turn; None where one is missing.
    """

    name: str
    unit: str
    base: Quartiles | None
    head: Quartiles | None
    ratio: Quartiles | None
    verdict: RowVerdict


def compare(
    name: str, unit: str, base: Sequence[float | None], head: Sequence[float | None]
) -> Comparison:
    """Judge a row of figures, one a turn, of which smaller ones are better; None where missing.

    It is worse where the median of the turns' ratios is above 1 by more than `TOLERANCE`, and by
    more than the spread between the ratios' quartiles. Ratios within a turn are judged, not medians
    over all turns, because what else the machine does changes from turn to turn.
    """
    before = [value for value in base if value is not None]
    after = [value for value in head if value is not None]
    ratio = None
    if len(before) == len(base) and len(after) == len(head):
        ratio = quartiles([_ratio(*pair) for pair in zip(after, before, strict=True)])
        verdict = judge(ratio)
    elif not before:
        # Neither has it where a library that it needs is not installed.
        verdict = RowVerdict.NEW if after else RowVerdict.LEFT_OUT
    else:
        verdict = RowVerdict.FAILED
    return Comparison(
        name=name,
        unit=unit,
        base=quartiles(before) if before else None,
        head=quartiles(after) if after else None,
        ratio=ratio,
        verdict=verdict,
    )


def judge(ratio: Quartiles) -> RowVerdict:
    """Return the verdict on the ratios of the later figures to the earlier ones."""
    least = max(TOLERANCE, ratio.spread)
    if ratio.median - 1 > least:
        return RowVerdict.WORSE
    return RowVerdict.BETTER if 1 - ratio.median > least else RowVerdict.SAME


def quartiles(figures: Sequence[float]) -> Quartiles:
    """Return the quartiles of one figure or more, interpolated between those that there are."""
    ordered = sorted(figures)
    return Quartiles(_at(ordered, 0.25), _at(ordered, 0.5), _at(ordered, 0.75))


def _at(ordered: Sequence[float], share: float) -> float:
    place = share * (len(ordered) - 1)
    below, above = ordered[math.floor(place)], ordered[math.ceil(place)]
    return below if below == above else below + (above - below) * (place - math.floor(place))


def _ratio(later: float, earlier: float) -> float:
    if earlier:
        return later / earlier
    return math.inf if later else 1.0


def render(comparisons: Sequence[Comparison]) -> str:
    """Return the comparisons as a table of plain text."""
    heading = ("name", "unit", "base", "quartiles", "now", "quartiles", "ratio", "quartiles", "")
    rows = [heading, *(_cells(each) for each in comparisons)]
    return aligned(rows, left=(0, 1))


def _cells(row: Comparison) -> tuple[str, ...]:
    ratio = ("", "")
    if row.ratio is not None:
        ratio = f"{row.ratio.median:.3f}", f"{row.ratio.first:.3f}-{row.ratio.third:.3f}"
    shown = row.verdict.value if row.verdict is not RowVerdict.SAME else ""
    return (row.name, row.unit, *_figures(row.base), *_figures(row.head), *ratio, shown)


def _figures(found: Quartiles | None) -> tuple[str, str]:
    if found is None:
        return "", ""
    return figure(found.median), f"{figure(found.first)}-{figure(found.third)}"


def as_json(comparisons: Sequence[Comparison]) -> list[dict[str, Any]]:
    """Return the comparisons as JSON objects; an infinite ratio is null."""
    rows = [asdict(each) for each in comparisons]
    for row in rows:
        row["verdict"] = row["verdict"].value
        if row["ratio"] is not None:
            row["ratio"] = {
                name: value if math.isfinite(value) else None
                for name, value in row["ratio"].items()
            }
    return rows


ROOT = Path(__file__).resolve().parents[2]
"""The sources that this process was started from."""

TURNS = 10

LEAST_TURNS = 3
"""Of fewer turns quartiles say nothing."""

_FAREWELL = 15.0
"""Time for an interrupted benchmark to end [s]."""

_PROGRAM = "openpendant.tools.bench"


class NotComparable(Exception):
    """The earlier commit does not exist, or one of the sides cannot be measured at all."""


@dataclass(frozen=True, slots=True)
class Figure:
    """Figure of a row from one side in one turn."""

    value: float
    unit: str


class MeasuredCommit:
    """The sources of one commit, and the processes that measure them."""

    def __init__(self, name: str, root: Path, folder: Path) -> None:
        """Link the import name to the sources."""
        self.name = name
        self._root = root
        path = [str(folder), *filter(None, [os.environ.get("PYTHONPATH")])]
        self._environment = {**os.environ, "PYTHONPATH": os.pathsep.join(path)}
        # Else each process would compile what it imports, on the side that was just checked out.
        self._environment.pop("PYTHONDONTWRITEBYTECODE", None)
        for source, target in _rooms(root).items():
            link = folder / target
            link.parent.mkdir(parents=True, exist_ok=True)
            link.symlink_to(root / source, target_is_directory=True)

    def measure(self, names: Sequence[str], *, quick: bool = False) -> dict[str, Figure]:
        """Measure rows in one process, missing ones left out; NotComparable where it fails."""
        options = ["--json", "--quick"] if quick else ["--json"]
        command = [sys.executable, "-m", _PROGRAM, *options, "--only", *names]
        said, complained = self._run(command)
        try:
            rows = json.loads(said)
        except ValueError:
            raise NotComparable(f"{self.name}: {_last_line(complained)}") from None
        measured = {row["name"]: Figure(row["median"], row["unit"]) for row in rows}
        return {name: measured[name] for name in names if name in measured}

    def _run(self, command: Sequence[str]) -> tuple[str, str]:
        """Return what a process wrote to its standard output and to its error output."""
        with subprocess.Popen(
            command,
            cwd=self._root,
            env=self._environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,
        ) as child:
            try:
                return child.communicate()
            except BaseException:
                # It has servers of its own, all in its session; they must not outlive the sources.
                for farewell in (signal.SIGINT, signal.SIGKILL):
                    with suppress(ProcessLookupError, subprocess.TimeoutExpired):
                        os.killpg(child.pid, farewell)
                        child.communicate(timeout=_FAREWELL)
                raise


def _rooms(root: Path) -> Mapping[str, str]:
    """Return where the import name leads: folders of the sources by their places under it."""
    project = tomllib.loads((root / "pyproject.toml").read_text(encoding="utf-8"))
    rooms: dict[str, str] = project["tool"]["hatch"]["build"]["targets"]["wheel"]["sources"]
    return rooms


def _last_line(text: str) -> str:
    lines = text.strip().splitlines()
    return lines[-1] if lines else "it said nothing"


@contextmanager
def two_sides(base: str, root: Path = ROOT) -> Iterator[tuple[MeasuredCommit, MeasuredCommit]]:
    """Check an earlier commit out for as long as the context lasts.

    Raises:
        NotComparable: git does not know the commit, or this is no work tree.
    """
    commit = _git(root, "rev-parse", "--verify", f"{base}^{{commit}}")
    with tempfile.TemporaryDirectory(prefix="openpendant-bench-") as name:
        folder = Path(name)
        tree = folder / "tree"
        # By an index of its own: the repository then knows nothing of it, whatever ends this.
        index = str(folder / "index")
        _git(root, "read-tree", commit, index=index)
        _git(root, "checkout-index", "--all", f"--prefix={tree}/", index=index)
        yield (
            MeasuredCommit(f"base {commit[:9]}", tree, folder / "base"),
            MeasuredCommit("now", root, folder / "now"),
        )


def _git(root: Path, *arguments: str, index: str | None = None) -> str:
    environment = os.environ if index is None else {**os.environ, "GIT_INDEX_FILE": index}
    try:
        ran = subprocess.run(
            ["git", *arguments],
            cwd=root,
            env=environment,
            capture_output=True,
            text=True,
            check=False,
        )
    except OSError as error:
        raise NotComparable(f"git cannot be run: {error}") from None
    if ran.returncode:
        raise NotComparable(_last_line(ran.stderr))
    return ran.stdout.strip()


def measure_in_turns(
    sides: tuple[MeasuredCommit, MeasuredCommit],
    groups: Mapping[str, Sequence[str]],
    progress: Callable[[str], None],
    turns: int = TURNS,
    *,
    quick: bool = False,
) -> Iterator[Comparison]:
    """Measure groups of rows, both sides in each turn; the side that begins changes.

    Raises:
        NotComparable: a side cannot be measured at all.
    """
    for number, (group, names) in enumerate(groups.items(), 1):
        found: tuple[list[dict[str, Figure]], list[dict[str, Figure]]] = ([], [])
        for turn in range(turns):
            for at in (0, 1) if turn % 2 == 0 else (1, 0):
                of_all = f"{number} of {len(groups)}, turn {turn + 1} of {turns}"
                progress(f"{group} ({of_all}): {sides[at].name}")
                found[at].append(sides[at].measure(names, quick=quick))
        for name in names:
            base, head = ([turn.get(name) for turn in side] for side in found)
            unit = next((each.unit for each in (*head, *base) if each is not None), "")
            yield compare(name, unit, _values(base), _values(head))


def _values(figures: Sequence[Figure | None]) -> list[float | None]:
    return [None if each is None else each.value for each in figures]
