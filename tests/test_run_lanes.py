"""`make test` runs two lanes, one after the other, tells what came of both, and leaves nothing."""

import json
import os
import re
import shlex
import signal
import subprocess
import sys
import time
from pathlib import Path
from xml.etree import ElementTree

import lanes
import pytest
from lanes import Lane, OneLane
from run_lanes import EMPTY, FAILED, PASSED, Part, exit_code, junit_taken_out, lane_commands

TESTS = Path(__file__).parent
pytestmark = pytest.mark.harness

COMMAND = [sys.executable, str(TESTS / "run_lanes.py")]

CONFTEST = """
import lanes
import workers

def pytest_addoption(parser):
    lanes.add_option(parser)
    workers.add_options(parser)

def pytest_configure(config):
    config.addinivalue_line("markers", "realtime: .")
    workers.configure(config)
    if lane := config.getoption("--lane"):
        config.pluginmanager.register(lanes.OneLane(lanes.Lane(lane)))
"""

COMPUTING = """
import pytest

def test_adds(): assert 1 + 1 == 2
def test_is_left_out(): pytest.skip("no reason")
"""

MIXED = """
import pathlib
import pytest

def test_fails():
    pathlib.Path("begun").touch()
    assert 1 + 1 == 3

@pytest.mark.realtime
def test_begins_when_lint_has_ended():
    assert pathlib.Path("lint ended").exists()
"""

UNNAMED = """
import marks
import pytest

pytestmark = marks.HIDDEN

def test_would_run_in_no_lane(): pass
"""


@pytest.fixture
def project(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    # Of the plugins that are installed, a run of this one file each needs no other.
    monkeypatch.setenv("PYTEST_DISABLE_PLUGIN_AUTOLOAD", "1")
    ini = f"[pytest]\npythonpath = {TESTS} .\naddopts = -p no:cacheprovider\n"
    for name, text in {"conftest.py": CONFTEST, "pytest.ini": ini}.items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    return tmp_path


def run(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [*COMMAND, *arguments], cwd=folder, capture_output=True, text=True, check=False
    )


def test_all_lanes_run_with_lint_beside_the_first_and_all_is_told(project: Path) -> None:
    (project / "test_computing.py").write_text(COMPUTING, encoding="utf-8")
    (project / "test_mixed.py").write_text(MIXED, encoding="utf-8")
    (project / "test_not_on_the_real_clock.py").write_text(COMPUTING, encoding="utf-8")
    begun = "until test -e begun; do sleep 0.1; done; sleep 1"
    lint = f"sh -c '{begun}; echo 12 problems; touch \"lint ended\"; exit 1'"
    done = run(project, "--workers=0", f"--beside={lint}", "--beside=true", "--", "--junitxml=both")
    assert done.returncode == FAILED, done.stdout + done.stderr
    assert f"\n{lint}:\n12 problems\n" in done.stdout
    told = {
        line[: len(lint)].strip(): line[len(lint) :].split() for line in done.stdout.splitlines()
    }
    assert told["computing"][:3] == ["2", "1", "2"]
    assert told["processes"][:3] == ["0", "0", "0"]
    assert told["real-time"][:3] == ["1", "0", "0"]
    assert (told[lint][0], told["true"][0]) == ("failed", "passed")
    assert f"ERROR: {lint} ended with exit code 1\n" in done.stdout
    assert re.search(r"\ncovered: [\d,]+ planted faults, .* refusal codes\n", done.stdout)
    cases = ElementTree.parse(project / "both").getroot().iter("testcase")
    names = [case.get("name") for case in cases]
    assert len(names) == 6
    assert names[-1] == "test_begins_when_lint_has_ended"


def test_a_file_that_hides_its_mark_is_refused(project: Path) -> None:
    (project / "marks.py").write_text(
        "import pytest\nHIDDEN = pytest.mark.realtime\n", encoding="utf-8"
    )
    (project / "test_unnamed.py").write_text(UNNAMED, encoding="utf-8")
    done = run(project, "--workers=0")
    assert done.returncode == FAILED
    assert "test_unnamed.py must name the mark realtime" in done.stdout + done.stderr
    assert "real-time" not in done.stdout  # the run ends with the lane that did not


HANGING = """
import json, os, pathlib, signal, subprocess, sys, time
import pytest

@pytest.fixture
def pids():
    apart = subprocess.Popen(["sleep", "600"], start_new_session=True)
    deaf = subprocess.Popen(["sh", "-c", "trap '' INT HUP TERM; sleep 600; sleep 600"])
    yield [os.getpid(), os.getppid(), apart.pid, deaf.pid]
    pathlib.Path("taken down").touch()

def test_hangs(pids):
    new = pathlib.Path("new")
    new.write_text(json.dumps(pids))
    new.rename("pids")
    time.sleep(600)
"""


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_who_ends_it_ends_all_of_it(project: Path, number: signal.Signals) -> None:
    """Tests take down what they began, and what is left of them is killed."""
    (project / "test_hanging.py").write_text(HANGING, encoding="utf-8")
    beside = shlex.join([sys.executable, "-c", "import time; time.sleep(600)"])
    with subprocess.Popen(
        [*COMMAND, "--workers=1", f"--beside={beside}"], cwd=project, stdout=subprocess.DEVNULL
    ) as running:
        while not (project / "pids").exists():
            assert running.poll() is None
            time.sleep(0.05)
        pids = json.loads((project / "pids").read_text(encoding="utf-8"))
        pids += children(running.pid)
        running.send_signal(number)
        assert running.wait(100) == 128 + number
    assert (project / "taken down").exists()
    assert len(pids) == 6
    assert [pid for pid in pids if Path(f"/proc/{pid}").exists()] == []


def children(pid: int) -> list[int]:
    return [int(each) for each in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]


def part(exit_code: int, *, kept: bool = False) -> Part:
    with subprocess.Popen(["true"]) as process, open(os.devnull, "rb") as output:
        return Part("part", process, output if kept else None, exit_code=exit_code)


@pytest.mark.parametrize(
    ("lanes", "beside", "expected"),
    [
        ([0, 0], [0, 0], PASSED),
        ([0, 5], [0], PASSED),
        ([5, 0], [], PASSED),
        ([5, 5], [0], EMPTY),
        ([1, 0], [0], FAILED),
        ([0, 1], [0], FAILED),
        ([5, 1], [], FAILED),
        ([2], [], FAILED),
        ([0, -9], [], FAILED),
        ([0, 0], [0, 2], FAILED),
        ([5, 5], [1], FAILED),
    ],
)
def test_one_lane_may_be_empty_and_nothing_may_fail(
    lanes: list[int], beside: list[int], expected: int
) -> None:
    parts = [part(code) for code in lanes] + [part(code, kept=True) for code in beside]
    assert exit_code(parts) == expected


@pytest.mark.parametrize(
    ("given", "rest", "file"),
    [
        (["-k", "limits"], ["-k", "limits"], None),
        (["-q", "--junitxml=a.xml", "tests"], ["-q", "tests"], Path("a.xml")),
        (["--junit-xml", "a.xml", "-x"], ["-x"], Path("a.xml")),
    ],
)
def test_the_file_of_results_is_taken_out(
    given: list[str], rest: list[str], file: Path | None
) -> None:
    assert junit_taken_out(given) == (rest, file)


WHOLE = "import pytest\n\npytestmark = [pytest.mark.realtime, pytest.mark.soak]\n"
PART = "import pytest\n\n@pytest.mark.realtime\ndef test_waits(): pass\n"
NONE = "def test_adds(): pass\n"


@pytest.mark.parametrize(
    ("text", "left_out_by"),
    [
        (WHOLE, [Lane.COMPUTING, Lane.PROCESSES]),
        (PART, [Lane.PROCESSES]),
        (NONE, [Lane.PROCESSES, Lane.REAL_TIME]),
    ],
    ids=["all of it on the real clock", "some of it", "nothing of it"],
)
def test_a_lane_imports_no_file_without_a_test_of_its_own(
    tmp_path: Path, text: str, left_out_by: list[Lane]
) -> None:
    file = tmp_path / "test_it.py"
    file.write_text(text)
    assert [lane for lane in Lane if OneLane(lane).pytest_ignore_collect(file)] == left_out_by


def test_tests_on_the_real_clock_come_last_in_many_workers() -> None:
    told = lane_commands(4, ["-x"], soak=False)
    assert [name for name, _ in told] == ["computing", "processes", "real-time"]
    crowds = ("--workers=4", "--workers=3", "--workers=2")
    assert all(crowd in command for crowd, (_, command) in zip(crowds, told, strict=True))
    assert {command[-1] for _, command in told} == {"-x"}


@pytest.mark.parametrize(
    ("name", "left_out_by"),
    [
        ("system/test_it.py", [Lane.COMPUTING, Lane.REAL_TIME]),
        ("server/system/test_it.py", [Lane.COMPUTING, Lane.PROCESSES]),
    ],
)
def test_a_file_of_processes_has_a_lane_of_its_own(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str, left_out_by: list[Lane]
) -> None:
    monkeypatch.setattr(lanes, "TESTS", tmp_path)
    file = tmp_path / name
    file.parent.mkdir(parents=True)
    file.write_text(WHOLE)
    assert [lane for lane in Lane if OneLane(lane).pytest_ignore_collect(file)] == left_out_by


def test_it_explains_itself() -> None:
    done = run(TESTS, "--help")
    assert done.returncode == 0
    assert "Exit codes: 0 all passed" in done.stdout
