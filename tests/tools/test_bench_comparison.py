"""Two commits side by side: how a row is judged, and that each side runs its own sources."""

import json
import math
import os
import shutil
import subprocess
from pathlib import Path

import pytest

from openpendant.tools.bench import __main__ as program
from openpendant.tools.bench.two_commits import (
    Quartiles,
    RowVerdict,
    as_json,
    compare,
    judge,
    quartiles,
    render,
)

TEN = [10.0] * 10


def test_quartiles_are_interpolated() -> None:
    assert quartiles([4.0, 1.0, 3.0, 2.0]) == Quartiles(1.75, 2.5, 3.25)
    assert quartiles([3.0, 1.0, 2.0]) == Quartiles(1.5, 2.0, 2.5)
    assert quartiles([7.0]) == Quartiles(7.0, 7.0, 7.0)


@pytest.mark.parametrize(
    ("ratio", "verdict"),
    [
        (Quartiles(1.03, 1.04, 1.05), RowVerdict.WORSE),
        (Quartiles(1.015, 1.02, 1.02), RowVerdict.SAME),  # by less than 3 %
        (Quartiles(1.00, 1.04, 1.05), RowVerdict.SAME),  # by less than the spread of 5 %
        (Quartiles(1.07, 1.10, 1.16), RowVerdict.WORSE),  # by more than the spread of 9 %
        (Quartiles(0.95, 0.96, 0.97), RowVerdict.BETTER),
        (Quartiles(0.98, 0.98, 0.98), RowVerdict.SAME),
        (Quartiles(0.93, 0.96, 0.98), RowVerdict.SAME),
        (Quartiles(math.inf, math.inf, math.inf), RowVerdict.WORSE),
    ],
)
def test_a_row_is_worse_by_its_share_and_by_its_spread(
    ratio: Quartiles, verdict: RowVerdict
) -> None:
    assert judge(ratio) is verdict


def test_turns_are_compared_and_not_medians() -> None:
    # The machine was slower from turn to turn; the later commit took a tenth more in each.
    base = [10.0 * (1 + turn) for turn in range(10)]
    row = compare("a", "us", base, [1.1 * value for value in base])
    assert row.ratio is not None
    assert row.ratio.median == pytest.approx(1.1)
    assert row.ratio.spread == pytest.approx(0.0)
    assert row.verdict is RowVerdict.WORSE
    assert row.base == Quartiles(32.5, 55.0, 77.5)


def test_a_row_that_wavers_by_more_than_it_differs_is_the_same() -> None:
    row = compare("a", "us", TEN, [10.0, 12.5] * 5)
    assert row.ratio == Quartiles(1.0, 1.125, 1.25)
    assert row.verdict is RowVerdict.SAME


def test_a_figure_that_was_nothing_before_is_worse() -> None:
    row = compare("a", "mm", [0.0] * 10, [0.0] * 2 + [0.1] * 8)
    assert row.verdict is RowVerdict.WORSE
    assert as_json([row])[0]["ratio"] == {"first": None, "median": None, "third": None}
    assert compare("a", "mm", [0.0] * 10, [0.0] * 10).verdict is RowVerdict.SAME


def test_a_row_that_was_not_measured_in_each_turn_is_not_passed_over() -> None:
    nothing = [None] * 10
    assert compare("a", "us", TEN, nothing).verdict is RowVerdict.FAILED
    assert compare("a", "us", TEN, [*TEN[1:], None]).verdict is RowVerdict.FAILED
    assert compare("a", "us", [*TEN[1:], None], TEN).verdict is RowVerdict.FAILED


def test_a_new_row_and_one_that_nobody_can_measure_are_no_failures() -> None:
    nothing = [None] * 10
    assert compare("a", "us", nothing, TEN).verdict is RowVerdict.NEW
    assert compare("a", "us", nothing, nothing).verdict is RowVerdict.LEFT_OUT
    failures = {verdict for verdict in RowVerdict if verdict.is_failure}
    assert failures == {RowVerdict.WORSE, RowVerdict.FAILED}


def test_the_table_shows_medians_quartiles_and_ratio() -> None:
    rows = [
        compare("codec", "ns", [100.0, 110.0, 120.0], [200.0, 220.0, 240.0]),
        compare("idle", "us", [1.0], [1.0]),
        compare("other", "us", [None], [3.0]),
    ]
    assert render(rows).splitlines() == [
        "name   unit  base  quartiles  now  quartiles  ratio    quartiles",
        "codec  ns     110    105-115  220    210-230  2.000  2.000-2.000  worse",
        "idle   us       1        1-1    1        1-1  1.000  1.000-1.000",
        "other  us                       3        3-3                        new",
    ]


# The command, on a project that consists of a benchmark.

BENCHMARKS = """
import json, sys
from openpendant.motion import FIGURE
import openpendant.tools as tools
names = sys.argv[sys.argv.index("--only") + 1 :]
rows = {"same": 5.0, "slower": FIGURE, **({"new": 1.0} if FIGURE > 10 else {})}
print(json.dumps([{"name": n, "median": rows[n], "unit": "us"} for n in names if n in rows]))
"""


@pytest.fixture
def project(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A repository whose last commit made a benchmark slower; and it is edited again since."""
    if shutil.which("git") is None:
        pytest.skip("git is not here")
    for name in [name for name in os.environ if name.startswith("GIT_")]:
        monkeypatch.delenv(name)
    monkeypatch.setenv("GIT_CONFIG_GLOBAL", os.devnull)
    root = tmp_path / "project"
    for room in ("motion", "tools/bench"):
        (root / room).mkdir(parents=True)
        (root / room / "__init__.py").write_text("")
    (root / "tools" / "__init__.py").write_text("")
    (root / "tools" / "bench" / "__main__.py").write_text(BENCHMARKS)
    (root / ".gitignore").write_text("__pycache__/\n")
    sources = '"tools" = "openpendant/tools"\n"motion" = "openpendant/motion"\n'
    (root / "pyproject.toml").write_text(f"[tool.hatch.build.targets.wheel.sources]\n{sources}")
    git(root, "init", "--quiet")
    for figure in (10.0, 11.0):
        (root / "motion" / "__init__.py").write_text(f"FIGURE = {figure}\n")
        git(root, "add", ".")
        git(root, "commit", "--quiet", "--message", f"Take {figure} us")
    (root / "motion" / "__init__.py").write_text("FIGURE = 12.0\n")
    return root


def git(root: Path, *arguments: str) -> str:
    author = ("-c", "user.name=a", "-c", "user.email=a@b.invalid")
    command = ["git", *author, *arguments]
    return subprocess.run(command, cwd=root, capture_output=True, text=True, check=True).stdout


def test_each_side_runs_its_own_sources(project: Path, capsys: pytest.CaptureFixture[str]) -> None:
    groups = {"all": ["same", "slower", "new"]}
    assert program.compared("HEAD~1", groups, 2, as_json=True, root=project) == 1
    shown = capsys.readouterr()
    rows = {row["name"]: row for row in json.loads(shown.out)}
    assert {name: row["verdict"] for name, row in rows.items()} == {
        "same": "same",
        "slower": "worse",
        "new": "new",
    }
    slower = rows["slower"]
    assert (slower["base"]["median"], slower["head"]["median"]) == (10.0, 12.0)
    assert slower["ratio"]["median"] == pytest.approx(1.2)
    base = git(project, "rev-parse", "--short=9", "HEAD~1").strip()
    assert [line.partition(" s  ")[2] for line in shown.err.splitlines()] == [
        f"all (1 of 1, turn 1 of 2): base {base}",
        "all (1 of 1, turn 1 of 2): now",
        "all (1 of 1, turn 2 of 2): now",
        f"all (1 of 1, turn 2 of 2): base {base}",
        "worse: slower",
    ]


def test_nothing_is_left_of_the_commit_that_was_checked_out(project: Path) -> None:
    assert program.compared("HEAD~1", {"all": ["same"]}, 1, root=project) == 0
    (project / "tools" / "bench" / "__main__.py").write_text("raise SystemExit('broken')")
    assert program.compared("HEAD~1", {"all": ["same"]}, 1, root=project) == 2
    assert git(project, "worktree", "list").count("\n") == 1
    changed = git(project, "status", "--short").split()[1::2]
    assert changed == ["motion/__init__.py", "tools/bench/__main__.py"]


def test_what_cannot_be_compared_is_said_in_one_line(
    project: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert program.compared("no-such-commit", {"all": ["same"]}, 1, root=project) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("bench: ")


def test_rows_are_chosen_by_their_beginning_or_by_a_pattern(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(program, "MODULES", ("codec", "startup", "rerun"))
    chosen = program._chosen(["codec decode joint_p", "*of coalesced*", "*emulator memory"])
    assert {module: [each.name for each in rows] for module, rows in chosen.items()} == {
        "codec": ["codec decode joint_position (60 bytes)", "stream of coalesced 152-byte frames"],
        "startup": ["startup emulator memory"],
    }


def test_a_row_that_is_not_there_is_refused(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(program, "MODULES", ("codec",))
    assert program.main(["--only", "nothing"]) == 2
    assert "no row is called nothing" in capsys.readouterr().err
