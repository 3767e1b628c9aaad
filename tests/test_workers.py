"""Tests that workers run are told as if the process that began them had run them."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree

import pytest

pytestmark = pytest.mark.harness

CONFTEST = """
import os
import pathlib
import pytest
import workers

def pytest_addoption(parser):
    workers.add_options(parser)

def pytest_configure(config):
    workers.configure(config)

@pytest.fixture(autouse=True, scope="session")
def shared():
    yield
    with open("taken down", "a") as file:
        print(os.getpid(), file=file)

@pytest.fixture(autouse=True)
def who(request):
    with open("ran", "a") as file:
        print(request.node.name, os.getpid(), file=file)
"""

OUTCOMES = """
import pytest

@pytest.fixture
def broken():
    raise RuntimeError("cannot begin")

def test_passes():
    print("said by what passes")

def test_fails():
    print("said by what fails")
    assert [1, 2, 3] == [1, 2, 4]

def test_is_skipped(): pytest.skip("no reason")

@pytest.mark.xfail(reason="known")
def test_is_known_to_fail(): assert False

def test_cannot_begin(broken): pass
"""

MANY = """
import time
import pytest

@pytest.mark.parametrize("number", range(4))
def test_{name}(number):
    time.sleep(0.02)
"""

DYING = """
import os

def test_before(): pass
def test_dies(): os._exit(7)
def test_after(): pass
"""


@pytest.fixture
def project(tmp_path: Path) -> Path:
    files = {
        "conftest.py": CONFTEST,
        "pytest.ini": f"[pytest]\npythonpath = {Path(__file__).parent}\n",
    }
    for name, text in files.items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    return tmp_path


def run(folder: Path, tests: dict[str, str], *options: str) -> subprocess.CompletedProcess[str]:
    for name, text in tests.items():
        (folder / f"test_{name}.py").write_text(text, encoding="utf-8")
    return subprocess.run(
        [sys.executable, "-m", "pytest", "-rA", *options],
        capture_output=True,
        text=True,
        check=False,
        cwd=folder,
        env=os.environ | {"PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1"},
        stdin=subprocess.DEVNULL,
    )


def ran(folder: Path) -> list[tuple[str, str]]:
    """Return which tests ran, and the process that each ran in."""
    told = [line.split() for line in (folder / "ran").read_text(encoding="utf-8").splitlines()]
    return [(name, pid) for name, pid in told]


def untimed(output: str) -> str:
    return re.sub(r"in \d+\.\d+s|[=_-]{4,}", "", output)


def test_what_two_workers_run_is_told_as_if_one_process_had(project: Path) -> None:
    tests = {"outcomes": OUTCOMES}
    done = run(project, tests, "--workers=2", "--junitxml=told")
    (project / "told").rename(project / "by workers")
    kept = project / ".pytest_cache/v/cache/lastfailed"
    failed = json.loads(kept.read_text(encoding="utf-8"))
    kept.unlink()
    alone = run(project, tests, "--junitxml=told")
    assert done.returncode == alone.returncode == 1
    # Alone the files are named beside the dots.
    shown = [untimed(each.stdout).partition("ERRORS")[2] for each in (done, alone)]
    assert "said by what fails" in shown[0]
    assert "At index 2 diff: 3 != 4" in shown[0]
    assert shown[0] == shown[1]
    assert failed == json.loads(kept.read_text(encoding="utf-8"))
    cases = [
        [(case.get("name"), [child.tag for child in case]) for case in tree.iter("testcase")]
        for tree in map(ElementTree.parse, (project / "by workers", project / "told"))
    ]
    assert len(cases[0]) == 5
    assert cases[0] == cases[1]


def test_a_file_is_run_by_one_worker_in_its_order(project: Path) -> None:
    tests = {name: MANY.format(name=name) for name in "abcdef"}
    done = run(project, tests, "--workers=2")
    assert done.returncode == 0, done.stdout
    for name in tests:
        of_file = [each for each in ran(project) if each[0].startswith(f"test_{name}[")]
        assert [test for test, _ in of_file] == [f"test_{name}[{number}]" for number in range(4)]
        assert len({pid for _, pid in of_file}) == 1
    assert len({pid for _, pid in ran(project)}) == 2


def test_single_tests_are_dealt_out_where_that_is_asked_for(project: Path) -> None:
    done = run(project, {"a": MANY.format(name="a")}, "--workers=2", "--deal-tests")
    assert done.returncode == 0, done.stdout
    assert len(ran(project)) == 4
    assert len({pid for _, pid in ran(project)}) == 2


def test_what_all_tests_share_is_taken_down_once_by_each_worker(project: Path) -> None:
    run(project, {name: MANY.format(name=name) for name in "abc"}, "--workers=2")
    taken_down = (project / "taken down").read_text(encoding="utf-8").split()
    assert sorted(taken_down) == sorted({pid for _, pid in ran(project)})


def test_a_test_that_ends_its_worker_fails_and_the_others_run(project: Path) -> None:
    done = run(project, {"dying": DYING, "a": MANY.format(name="a")}, "--workers=1")
    assert done.returncode == 1
    assert "6 passed" in done.stdout.splitlines()[-1]
    assert "1 failed" in done.stdout.splitlines()[-1]
    assert "the worker ended with exit code 7 in this test" in done.stdout
    assert "FAILED test_dying.py::test_dies" in done.stdout


def test_the_first_failure_ends_the_run_where_that_is_asked_for(project: Path) -> None:
    slow = "import time\ndef test_slow(): time.sleep(60)\n"
    files = {"a": "def test_fails(): assert False\n", "b": slow, "c": slow}
    done = run(project, files, "--workers=2", "-x")
    assert done.returncode == 1
    assert "stopping after 1 failures" in done.stdout
    assert len(ran(project)) <= 2
    assert (project / "taken down").read_text(encoding="utf-8").split()


def test_a_file_that_cannot_be_imported_is_told_and_nothing_runs(project: Path) -> None:
    done = run(project, {"a": "import nowhere\n", "b": MANY.format(name="b")}, "--workers=2")
    assert done.returncode == 2
    assert "No module named 'nowhere'" in done.stdout
    assert not (project / "ran").exists()
