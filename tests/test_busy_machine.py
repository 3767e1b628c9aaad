"""Tests on the real clock are tried again where the machine was late, openly; no other is."""

import os
import signal
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import pytest
from rigs.clock.busy_machine import MOST_DOUBTFUL, Attempts
from rigs.clock.stall_watch import StallWatch

CONFTEST = """
import workers
from rigs.clock import busy_machine

class Idle:
    \"\"\"An idle process that is late when the test says so.\"\"\"

    def worst_since(self, began):
        import lateness
        return lateness.NOW

    def end(self):
        pass

busy_machine.StallWatch = Idle

def pytest_addoption(parser):
    workers.add_options(parser)

def pytest_configure(config):
    config.addinivalue_line("markers", "realtime: .")
    config.pluginmanager.register(busy_machine.Attempts())
    workers.configure(config)
"""

LATENESS = "NOW = 0.2\n"

TESTS = """
import lateness
import pytest

ran = []
cells = []

@pytest.fixture(scope="module")
def cell():
    cells.append("made")
    yield cells
    cells.append("ended")

def attempt(name):
    ran.append(name)
    return ran.count(name)

@pytest.mark.realtime
def test_late_once(cell):
    assert attempt("late once") > 1, "came late"

@pytest.mark.realtime
def test_cell_is_new(cell):
    assert cell == ["made", "ended", "made"]

@pytest.mark.realtime
def test_always_fails():
    assert attempt("always") < 0

@pytest.mark.realtime
def test_violates():
    assert attempt("violates") < 0, "1 violations"

@pytest.mark.realtime
def test_fails_beside_a_quiet_watch(monkeypatch):
    lateness.NOW = 0.0
    assert attempt("quiet") < 0

@pytest.mark.realtime
def test_machine_is_late_again():
    lateness.NOW = 0.2

def test_ordinary():
    assert attempt("ordinary") > 1

def test_how_often_each_ran():
    counts = {name: ran.count(name) for name in ran}
    assert counts == {"late once": 2, "always": 3, "violates": 1, "quiet": 1, "ordinary": 1}
"""


def run(folder: Path, tests: dict[str, str], *options: str) -> subprocess.CompletedProcess[str]:
    for name, text in {"conftest.py": CONFTEST, "lateness.py": LATENESS, **tests}.items():
        (folder / name).write_text(text, encoding="utf-8")
    here = Path(__file__).parent
    fixed = ("-p", "no:cacheprovider", "-rA", "-q", "-o", f"pythonpath={here} .", "--rootdir=.")
    return subprocess.run(
        [sys.executable, "-m", "pytest", *fixed, *options],
        capture_output=True,
        text=True,
        check=False,
        cwd=folder,
        env=os.environ | {"PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1"},
    )


@pytest.fixture(scope="module")
def told(tmp_path_factory: pytest.TempPathFactory) -> list[str]:
    folder = tmp_path_factory.mktemp("attempts")
    done = run(folder, {"test_attempts.py": TESTS})
    assert done.returncode == 1, done.stderr
    return done.stdout.splitlines()


def outcomes(told: list[str], word: str) -> list[str]:
    return [line.split("::")[1].split()[0] for line in told if line.startswith(f"{word} ")]


@pytest.mark.parametrize(
    ("word", "tests"),
    [
        ("PASSED", "late_once cell_is_new machine_is_late_again how_often_each_ran"),
        ("FAILED", "always_fails violates fails_beside_a_quiet_watch ordinary"),
    ],
)
def test_what_passes_an_attempt_passes_and_only_what_was_late_on_the_real_clock_has_another(
    told: list[str], word: str, tests: str
) -> None:
    assert outcomes(told, word) == [f"test_{name}" for name in tests.split()]


def test_each_attempt_that_failed_is_told_with_what_failed(told: list[str]) -> None:
    anew = [line for line in told if "begun anew" in line]
    assert len(anew) == 3
    assert "test_late_once: AssertionError: came late" in anew[0]
    assert all("an idle process was 200 ms late" in line for line in anew)


OFTEN = """
import lateness
import pytest

ran = []

@pytest.mark.realtime
@pytest.mark.parametrize("number", range({count}))
def test_late_once(number):
    lateness.NOW = {lateness}
    ran.append(number)
    assert ran.count(number) > 1, "came late"
"""


def test_more_than_five_second_tries_of_a_machine_that_was_hardly_late_fail_the_run(
    tmp_path: Path,
) -> None:
    """Three in each of two workers, though each test has passed; those well explained are free."""
    often = [(3, 0.03), (3, 0.049), (4, 0.05)]
    tests = {
        f"test_often_{number}.py": OFTEN.format(count=count, lateness=lateness)
        for number, (count, lateness) in enumerate(often)
    }
    done = run(tmp_path, tests, "--workers=2")
    assert done.returncode == 1, done.stdout + done.stderr
    assert len(outcomes(done.stdout.splitlines(), "PASSED")) == 10
    assert "6 second tries" in done.stdout


@dataclass
class Ended:
    exitstatus: int = 0
    config: object = None


@pytest.mark.parametrize(("doubtful", "exit_status"), [(MOST_DOUBTFUL, 0), (MOST_DOUBTFUL + 1, 1)])
def test_five_of_them_are_taken(doubtful: int, exit_status: int) -> None:
    attempts, session = Attempts(), Ended()
    attempts.doubtful = doubtful
    attempts.pytest_sessionfinish(session)  # type: ignore[arg-type]  # has what is asked for
    assert session.exitstatus == exit_status


def test_the_idle_process_tells_how_late_it_was_and_when() -> None:
    watch = StallWatch()
    try:
        time.sleep(0.2)
        began = watch.now()
        os.kill(watch.pid, signal.SIGSTOP)
        time.sleep(0.1)
        os.kill(watch.pid, signal.SIGCONT)
        assert watch.worst_since(began) >= 0.06
        time.sleep(0.05)
        assert any(due <= began + 0.05 and woke >= began + 0.09 for due, woke in watch.stalls(0.05))
        assert watch.worst_since(watch.now() + 1.0) == 0.0
    finally:
        watch.end()


def test_the_idle_process_has_the_priority_of_the_tests() -> None:
    watch = StallWatch()
    try:
        assert os.getpriority(os.PRIO_PROCESS, watch.pid) == os.getpriority(os.PRIO_PROCESS, 0)
    finally:
        watch.end()


def test_what_tests_start_can_be_interrupted_whoever_started_the_tests() -> None:
    assert signal.getsignal(signal.SIGINT) is not signal.SIG_IGN
