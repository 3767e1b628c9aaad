"""`make browser` runs every test of a browser once."""

import subprocess
import sys
from pathlib import Path

from run_browser_lanes import TIMED, lane_commands

ROOT = Path(__file__).parent.parent


def _collected(command: list[str]) -> set[str]:
    asked = [sys.executable, *command, "--collect-only", "-q", "-p", "no:cacheprovider"]
    told = subprocess.run(asked, cwd=ROOT, capture_output=True, text=True, check=True).stdout
    return {line.partition("::")[0] for line in told.splitlines() if "::" in line}


def test_the_files_of_hold_tests_run_in_a_lane_of_their_own_and_in_no_other() -> None:
    showing, timed = (_collected(command) for _, command in lane_commands([]))
    of_holding = {str(file.relative_to(ROOT)) for file in ROOT.glob(TIMED)}
    everything = {str(file.relative_to(ROOT)) for file in ROOT.glob("tests/browser/test_*.py")}
    soak = {"tests/browser/test_holding_soak.py"}
    assert len(of_holding) > 2
    assert (timed, showing) == (of_holding - soak, everything - of_holding)


def test_arguments_of_pytest_reach_both_lanes() -> None:
    assert all(command[-2:] == ["-k", "stop"] for _, command in lane_commands(["-k", "stop"]))
