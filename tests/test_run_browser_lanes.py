"""`make browser` runs every test of a browser once."""

from pathlib import Path

from run_browser_lanes import TIMED, lane_commands

ROOT = Path(__file__).parent.parent


def test_the_files_of_hold_tests_run_in_a_lane_of_their_own_and_in_no_other() -> None:
    (_, showing), (_, timed) = lane_commands([])
    of_holding = sorted(str(file.relative_to(ROOT)) for file in ROOT.glob(TIMED))
    assert len(of_holding) > 1
    assert [each for each in timed if each.endswith(".py")] == of_holding
    assert f"--ignore-glob=*/{TIMED}" in showing


def test_arguments_of_pytest_reach_both_lanes() -> None:
    assert all(command[-2:] == ["-k", "stop"] for _, command in lane_commands(["-k", "stop"]))
