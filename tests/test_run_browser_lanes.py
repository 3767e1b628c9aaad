"""`make browser` runs every test of a browser once."""

from pathlib import Path

import pytest
from run_browser_lanes import lane_commands

ROOT = Path(__file__).parent.parent


def test_the_files_of_hold_tests_run_in_a_lane_of_their_own_and_in_no_other(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(ROOT)
    showing, timed = (
        {word for word in command if word.endswith(".py")} for _, command in lane_commands([])
    )
    everything = {str(file.relative_to(ROOT)) for file in ROOT.glob("tests/browser/test_*.py")}
    assert timed == {file for file in everything if "test_holding" in file}
    assert len(timed) > 2
    assert showing == everything - timed


def test_arguments_of_pytest_reach_both_lanes() -> None:
    assert all(command[-2:] == ["-k", "stop"] for _, command in lane_commands(["-k", "stop"]))
