"""Tests on the real clock are tried again, openly, and nothing else is."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

CONFTEST = """
from busy_machine import Attempts

def pytest_configure(config):
    config.addinivalue_line("markers", "realtime: .")
    config.pluginmanager.register(Attempts())
"""

TESTS = """
import time
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

def test_ordinary():
    assert attempt("ordinary") > 1

def test_how_often_each_ran():
    counts = {name: ran.count(name) for name in ran}
    assert counts == {"late once": 2, "always": 3, "violates": 1, "ordinary": 1}
"""


@pytest.fixture(scope="module")
def told(tmp_path_factory: pytest.TempPathFactory) -> list[str]:
    """What pytest says of a file with such tests."""
    folder = tmp_path_factory.mktemp("attempts")
    (folder / "conftest.py").write_text(CONFTEST, encoding="utf-8")
    (folder / "test_attempts.py").write_text(TESTS, encoding="utf-8")
    here = Path(__file__).parent
    options = ("-p", "no:cacheprovider", "-rA", "-q", "-o", f"pythonpath={here}", "--rootdir=.")
    done = subprocess.run(
        [sys.executable, "-m", "pytest", *options, "test_attempts.py"],
        capture_output=True,
        text=True,
        check=False,
        cwd=folder,
    )
    assert done.returncode == 1, done.stderr
    return done.stdout.splitlines()


def outcomes(told: list[str], word: str) -> list[str]:
    return [line.split("::")[1].split()[0] for line in told if line.startswith(f"{word} ")]


def test_what_passes_an_attempt_passes(told: list[str]) -> None:
    assert outcomes(told, "PASSED") == [
        "test_late_once",
        "test_cell_is_new",
        "test_how_often_each_ran",
    ]


def test_what_fails_each_time_or_violates_or_is_not_on_the_real_clock_fails(
    told: list[str],
) -> None:
    assert outcomes(told, "FAILED") == ["test_always_fails", "test_violates", "test_ordinary"]


def test_each_attempt_that_failed_is_told_with_what_failed(told: list[str]) -> None:
    anew = [line for line in told if "begun anew" in line]
    assert len(anew) == 3
    assert "test_late_once: AssertionError: came late" in anew[0]
    assert all("an idle process waited for" in line for line in anew)
