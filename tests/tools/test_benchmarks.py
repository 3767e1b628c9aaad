"""The benchmarks: their table, two commits side by side, their peers, and what some measure."""

import json
import math
import os
import shutil
import subprocess
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path

import numpy as np
import pytest
from rigs.motion.loaded_robots import serial_robot
from rigs.motion.robot_families import FAMILIES

from openpendant.motion.kinematics.serial import Kinematics
from openpendant.motion.paths.tool_curves import ToolLine
from openpendant.motion.paths.tool_paths import follow_tool_curve
from openpendant.motion.pose import Array, Pose
from openpendant.tools.bench import __main__ as program
from openpendant.tools.bench import codec, ik, path_accuracy
from openpendant.tools.bench.ik import Eaik, Toolbox
from openpendant.tools.bench.jogging_pendants import PERIOD_NS, lateness
from openpendant.tools.bench.table import (
    Benchmark,
    Bound,
    Judged,
    MissingRequirement,
    Sides,
    measure,
)
from openpendant.tools.bench.table import render as render_rows
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


def _constant(value: float) -> Callable[[], float]:
    return lambda: value


def _sides(subject: float, baseline: float | None) -> Callable[[], AbstractContextManager[Sides]]:
    base = None if baseline is None else _constant(baseline)
    return lambda: nullcontext(Sides(_constant(subject), base))


def test_a_ratio_within_its_bound_is_ok() -> None:
    row = measure(Benchmark("a", "ns", _sides(24.0, 10.0), Bound(2.5, aim=1.8)))
    assert (row.median, row.baseline, row.ratio, row.verdict) == (24.0, 10.0, 2.4, "ok")


def test_a_ratio_beyond_its_bound_is_over() -> None:
    assert measure(Benchmark("a", "ns", _sides(26.0, 10.0), Bound(2.5, aim=1.8))).verdict == "over"


def test_a_bound_may_judge_the_median_itself() -> None:
    bound = Bound(50.0, aim=15.0, judged=Judged.VALUE)
    assert measure(Benchmark("a", "ms", _sides(51.0, None), bound)).verdict == "over"
    assert measure(Benchmark("a", "ms", _sides(50.0, 1.0), bound)).verdict == "ok"


def test_a_bound_on_a_ratio_needs_a_baseline() -> None:
    with pytest.raises(ValueError, match="needs a baseline"):
        measure(Benchmark("a", "ms", _sides(1.0, None), Bound(1.0, aim=1.0)))


def test_both_sides_are_sampled_in_turn() -> None:
    order: list[str] = []

    def sample(side: str) -> float:
        order.append(side)
        return 1.0

    sides = Sides(lambda: sample("s"), lambda: sample("b"))
    measure(Benchmark("a", "ns", lambda: nullcontext(sides), repetitions=4))
    assert "".join(order) == "sb" + "sb" + "bs" + "sb" + "bs"


@pytest.mark.parametrize(("repetitions", "quick"), [(15, 5), (9, 3), (5, 3), (1, 1)])
def test_a_quick_run_takes_a_third_of_the_samples_and_never_more_than_all(
    repetitions: int, quick: int
) -> None:
    samples: list[float] = []

    def sample() -> float:
        samples.append(1.0)
        return 1.0

    sides = Sides(sample)
    measure(Benchmark("a", "ns", lambda: nullcontext(sides), repetitions=repetitions), quick=True)
    assert len(samples) == 1 + quick  # the first one warms up


def test_the_ratio_is_the_median_of_the_ratios_and_not_of_the_medians() -> None:
    subject, baseline = iter([0.0, 1.0, 20.0, 30.0]), iter([0.0, 1.0, 10.0, 40.0])
    sides = Sides(lambda: next(subject), lambda: next(baseline))
    row = measure(Benchmark("a", "ns", lambda: nullcontext(sides), repetitions=3))
    assert (row.median, row.baseline, row.ratio) == (20.0, 10.0, 1.0)


def test_the_table_has_one_line_for_each_row() -> None:
    row = measure(Benchmark("codec x", "ns", _sides(260.0, 100.0), Bound(2.5, aim=1.8)))
    free = measure(Benchmark("start", "ms", _sides(1.5, None)))
    assert render_rows([row, free]).splitlines() == [
        "name     median  unit  baseline  ratio  bound  aim",
        "codec x     260  ns         100   2.60    2.5  1.8  over",
        "start       1.5  ms",
    ]


def test_the_codec_benchmarks_cover_four_messages_both_ways() -> None:
    names = [each.name for each in codec.benchmarks() if each.name.startswith("codec ")]
    sizes = [f"({size} bytes)" for size in (60, 60, 68, 68, 148, 148, 152, 152)]
    assert [name.split(" ", 3)[-1] for name in names] == sizes


def test_the_program_prints_the_chosen_rows_as_json(capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ["--json", "--quick", "--only", "codec decode joint_position"]
    assert program.main(arguments) == 0
    (row,) = json.loads(capsys.readouterr().out)
    assert row["unit"] == "ns"
    assert row["bound"] == 2.5
    assert row["ratio"] > 1.0


def test_a_benchmark_that_crashes_is_reported_and_the_others_still_run(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def crash() -> AbstractContextManager[Sides]:
        raise OSError("no port is free")

    rows = [Benchmark("a", "ns", crash), Benchmark("b", "ns", _sides(1.0, None))]
    monkeypatch.setattr(codec, "benchmarks", lambda: rows)
    monkeypatch.setattr(program, "MODULES", ("codec",))
    assert program.main([]) == 1
    captured = capsys.readouterr()
    assert "a crashed:" in captured.err
    assert "no port is free" in captured.err
    assert captured.out.splitlines()[1].startswith("b")


MS = 1_000_000


def grid(*late: int, phase: int) -> list[int]:
    """Return the times of ticks that were so many milliseconds late."""
    return [phase + number * PERIOD_NS + each * MS for number, each in enumerate(late)]


@pytest.mark.parametrize("phase", [1, 3 * MS, 9 * MS, PERIOD_NS - 1])
def test_lateness_is_counted_from_the_grid_wherever_it_lies(phase: int) -> None:
    assert lateness(grid(0, 1, 0, 3, 0, phase=phase)) == [0, 1 * MS, 0, 3 * MS, 0]


def test_a_skipped_tick_is_as_late_as_the_next_one() -> None:
    ticks = grid(0, 0, 0, 0, 0, phase=2 * MS)
    del ticks[2]
    assert lateness(ticks) == [0, 0, 10 * MS, 0, 0]


KINEMATICS = [Kinematics(serial_robot(name)) for name in ik.FAMILIES]


@pytest.mark.parametrize("kinematics", KINEMATICS, ids=ik.FAMILIES)
def test_eaik_is_asked_what_we_are_and_chooses_as_we_do(kinematics: Kinematics) -> None:
    pytest.importorskip("eaik.IK_HP", reason="EAIK is not installed")
    peer = Eaik(kinematics)
    for question in ik.questions(kinematics, 20):
        theirs, ours = peer.answer(question), ik.answer(kinematics, question)
        assert theirs is not None
        assert ours is not None
        np.testing.assert_allclose(theirs, ours, atol=1e-6)


@pytest.mark.parametrize("kinematics", KINEMATICS, ids=ik.FAMILIES)
def test_the_toolbox_is_asked_what_we_are(kinematics: Kinematics) -> None:
    pytest.importorskip("roboticstoolbox", reason="roboticstoolbox is not installed")
    peer = Toolbox(kinematics)
    answers = [(each.pose, peer.answer(each)) for each in ik.questions(kinematics, 10)]
    reached = [(pose, kinematics.forward(found)) for pose, found in answers if found is not None]
    assert len(reached) >= 8
    for asked, found in reached:
        assert found.position_distance(asked) < 1e-5
        assert found.rotation_distance(asked) < 1e-5


@pytest.mark.parametrize("benchmark", ik.benchmarks(), ids=lambda benchmark: benchmark.name)
def test_each_row_can_be_measured(benchmark: Benchmark, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ik, "POSES", 3)
    try:
        row = measure(benchmark, quick=True)
    except MissingRequirement as missing:
        pytest.skip(str(missing))
    assert row.median > 0.0
    assert (row.baseline is not None) == ("/" in row.name)


def test_a_row_whose_peer_is_not_installed_is_left_out_aloud(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def absent(module: str) -> None:
        raise ImportError(module)

    rows = [row for row in ik.benchmarks() if row.name.endswith("all branches / EAIK")]
    monkeypatch.setattr(ik, "import_module", absent)
    monkeypatch.setattr(codec, "benchmarks", lambda: rows)
    monkeypatch.setattr(program, "MODULES", ("codec",))
    assert program.main([]) == 0
    assert "is left out: EAIK is not installed" in capsys.readouterr().err


START = [0.3, -1.4, 1.6, -1.2, -1.3, 0.4]
ORIGIN = np.zeros(3)
AHEAD = np.array([0.0, 0.1, 0.0])
CALCULATED = np.linspace(0.01, 0.09, 50)


@pytest.mark.parametrize("name", [name for name in path_accuracy.ROBOTS if name in FAMILIES])
def test_the_executed_tool_keeps_every_kind_of_path(
    name: str, record_property: Callable[[str, object], None]
) -> None:
    for kind, accuracy in path_accuracy.robot_accuracy(name, size=0.06, runs=1).items():
        record_property(kind.value, f"{accuracy.distance:.3f} mm, {accuracy.angle:.4f}°")
        assert accuracy.distance <= path_accuracy.GREATEST_DISTANCE, kind
        assert accuracy.angle <= path_accuracy.GREATEST_ANGLE, kind


@pytest.mark.soak
@pytest.mark.parametrize("name", path_accuracy.ROBOTS)
def test_the_executed_tool_keeps_many_long_paths(name: str) -> None:
    for kind, accuracy in path_accuracy.robot_accuracy(name, places=10, runs=2, seed=1).items():
        assert accuracy.distance <= path_accuracy.GREATEST_DISTANCE, kind
        assert accuracy.angle <= path_accuracy.GREATEST_ANGLE, kind


@pytest.fixture(scope="module")
def ur5() -> Kinematics:
    return Kinematics(serial_robot("ur5"))


@pytest.fixture(scope="module")
def line_run(ur5: Kinematics) -> Array:
    """Joint positions along a line of 100 mm along y, from where UR5 stands."""
    path = follow_tool_curve(ur5, START, line_beside(ur5))
    return path.evaluate(np.linspace(0.0, path.length, 101))


def line_beside(kinematics: Kinematics, shift: Array = ORIGIN, turn: Array = ORIGIN) -> ToolLine:
    """The line of 100 mm along y from a place beside where UR5 stands, the tool turned there."""
    here = kinematics.forward(START)
    turned = Pose.from_rpy(ORIGIN, turn).compose(Pose(ORIGIN, here.quaternion))
    begin = Pose(here.position + shift, turned.quaternion)
    return ToolLine(begin, Pose(begin.position + AHEAD, turned.quaternion))


@pytest.mark.parametrize("every", [[1], [1, 5, 20]])
def test_a_tool_that_is_late_on_its_path_is_not_off(
    ur5: Kinematics, line_run: Array, every: list[int]
) -> None:
    late = np.concatenate(
        [
            np.repeat(part, n, axis=0)
            for part, n in zip(np.array_split(line_run, len(every)), every, strict=True)
        ]
    )
    off = path_accuracy.deviations(ur5, line_beside(ur5), late, CALCULATED)
    assert np.abs(off[:, :3]).max() < 2e-5
    assert np.abs(off[:, 3:]).max() < math.radians(0.005)


def test_a_tool_beside_its_path_is_off_by_what_it_is_aside_and_turned(
    ur5: Kinematics, line_run: Array
) -> None:
    aside, turned = np.array([0.003, 0.0, -0.004]), np.array([0.0, 0.0, 0.02])
    off = path_accuracy.deviations(ur5, line_beside(ur5, aside, turned), line_run, CALCULATED)
    assert off[:, :3] == pytest.approx(np.tile(-aside, (50, 1)), abs=2e-5)
    assert off[:, 3:] == pytest.approx(np.tile(-turned, (50, 1)), abs=1e-4)


def test_every_robot_is_reported_in_position_and_orientation() -> None:
    rows = [(benchmark.name, benchmark.unit) for benchmark in path_accuracy.benchmarks()]
    assert len(rows) == 2 * len(path_accuracy.ROBOTS) == 46
    assert rows[:2] == [
        (f"path accuracy {path_accuracy.ROBOTS[0]}, position", "mm"),
        (f"path accuracy {path_accuracy.ROBOTS[0]}, orientation", "deg"),
    ]
