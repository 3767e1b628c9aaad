"""The real ROS-I clients, as recorded: nothing fails, and every habit is found where it shows."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import pytest

from openpendant.simplemsg import MOTOMAN, STANDARD, ByteOrder
from openpendant.tools.packets.conformance.client.judge import CHECKS, judge_scenario, scenarios_of
from openpendant.tools.packets.conformance.client.setup import Setup
from openpendant.tools.packets.conformance.findings import CheckFinding, CheckVerdict
from openpendant.tools.packets.reading.trace_files import read_trace

VECTORS = Path(__file__).parents[2] / "vectors"
GENERIC = VECTORS / "capture-industrial-robot-client.json"
DRIVER = VECTORS / "capture-motoman-driver.json"

PLACEHOLDERS = {"MC09", "MC10"}
"""Speed ratio 0.1 and a first duration of 10 s: in each trajectory of the generic client."""

HABITS: dict[str, set[str]] = {
    "stream_three_points_success": PLACEHOLDERS,
    "stream_one_point": {"MC10"},
    "stream_no_velocities": PLACEHOLDERS,
    "stream_slow_reply": PLACEHOLDERS,
    "stream_missing_reply_then_late": {*PLACEHOLDERS, "MC18"},
    "stream_missing_reply_forever_then_stop": {*PLACEHOLDERS, "MC18"},
    "stream_failure_reply": {*PLACEHOLDERS, "MC17"},
    "stream_empty_body_reply": PLACEHOLDERS,
    "stream_wrong_type_reply": {*PLACEHOLDERS, "RC12"},
    "stream_invalid_reply_header": {*PLACEHOLDERS, "MC05", "RC13"},
    "stream_reply_split_bytewise": PLACEHOLDERS,
    "stream_disconnect_mid_then_listen_again": PLACEHOLDERS,
    "stream_server_gone_then_back": PLACEHOLDERS,
    "stream_server_absent_at_start": PLACEHOLDERS,
    "stream_idle_disconnect_then_trajectory": PLACEHOLDERS,
    "stream_new_trajectory_while_streaming": PLACEHOLDERS,
    "stream_empty_trajectory_is_stop": set(),
    "stream_stop_service": set(),
    "stream_over_velocity_limit": set(),
    "stream_missing_joint": set(),
    "stream_reordered_joints": PLACEHOLDERS,
    "stream_bswap_three_points": PLACEHOLDERS,
    "download_three_points": {*PLACEHOLDERS, "MC03"},
    "download_with_replies": PLACEHOLDERS,
    "download_disconnect_then_trajectory": PLACEHOLDERS,
    "state_topics_and_requests": {"RC03"},
    "state_bad_frames": set(),
    "state_disconnect_reconnect": set(),
    "state_server_absent_at_start": set(),
    "full_stack_action": {*PLACEHOLDERS, "LC06"},
    "motoman_enable_move_stop_disable": {"YC06"},
    "motoman_busy_then_ok": {"YC06"},
    "motoman_point_rejected": {"YC06"},
    "motoman_not_ready": {"YC06"},
    "motoman_start_not_at_current_position": {"YC06"},
    "motoman_disconnect_mid": {"YC06"},
    "motoman_header_failure_reply": {"YC06", "YC12"},
    "motoman_bswap_enable_move": {"YC06"},
    "motoman_io": set(),
    "motoman_two_groups": {"LC07", "MC12", "YC06"},
}

LOOKED: dict[str, set[str]] = {
    "stream_disconnect_mid_then_listen_again": {"KC02", "KC03", "KC04", "KC06", "MC05", "MC06"},
    "stream_server_gone_then_back": {"KC02", "KC06"},
    "stream_bswap_three_points": {"BC01", "BC02", "RC01", "SC02"},
    "stream_new_trajectory_while_streaming": {"RC01", "SC01", "SC02", "SC03"},
    "state_topics_and_requests": {"RC02", "RC05", "RC07", "RC08", "RC09", "RC10", "RC11"},
    "full_stack_action": {"QC06", "RC05", "SC05"},
    "motoman_busy_then_ok": {"LC09", "MC05", "MC06", "YC01", "YC03", "YC04"},
    "motoman_point_rejected": {"MC17", "YC05"},
    "motoman_not_ready": {"YC02", "YC13"},
    "motoman_disconnect_mid": {"KC02", "MC06", "YC01"},
    "motoman_bswap_enable_move": {"BC02", "LC06", "LC07", "MC11", "YC07"},
    "motoman_io": {"RC01", "YC14"},
    "motoman_two_groups": {"LC06", "YC10", "YC11"},
}
"""Where a check that is about something rare had it to look at, and passed."""


@cache
def judged() -> dict[str, dict[str, CheckFinding]]:
    found = {}
    for file, dialect in ((GENERIC, STANDARD), (DRIVER, MOTOMAN)):
        for name, entries in scenarios_of(read_trace(file)).items():
            found[name] = judge_scenario(entries, Setup(dialect=dialect, dof=6))
    return found


def test_every_scenario_is_judged() -> None:
    assert set(judged()) == set(HABITS)


@pytest.mark.parametrize("scenario", HABITS)
def test_the_real_clients_break_no_rule(scenario: str) -> None:
    failures = {
        number: finding.detail
        for number, finding in judged()[scenario].items()
        if finding.verdict is CheckVerdict.FAILED
    }
    assert failures == {}


@pytest.mark.parametrize(("scenario", "habits"), HABITS.items())
def test_habits_are_found_where_they_show(scenario: str, habits: set[str]) -> None:
    findings = judged()[scenario]
    deviating = {n for n, finding in findings.items() if finding.verdict is CheckVerdict.DEVIATES}
    assert deviating == habits
    assert all(findings[number].habit and findings[number].detail for number in habits)


@pytest.mark.parametrize(("scenario", "numbers"), LOOKED.items())
def test_what_happens_is_looked_at(scenario: str, numbers: set[str]) -> None:
    passed = {n for n, item in judged()[scenario].items() if item.verdict is CheckVerdict.PASSED}
    assert numbers <= passed


def test_each_habit_is_named_after_its_program() -> None:
    habits = {
        habit
        for findings in judged().values()
        for finding in findings.values()
        if finding.habit
        for habit in finding.habit.split("; ")
    }
    assert len(habits) == 13
    assert all(habit.startswith(("industrial_robot_client", "motoman_driver")) for habit in habits)


def test_a_client_of_a_little_endian_robot_that_speaks_big_endian_is_found() -> None:
    entries = scenarios_of(read_trace(GENERIC))["stream_bswap_three_points"]
    findings = judge_scenario(entries, Setup(order=ByteOrder.LITTLE))
    assert findings["BC02"].verdict is CheckVerdict.FAILED


def test_check_numbers_are_unique_and_well_formed() -> None:
    numbers = [check.number for check in CHECKS]
    assert len(set(numbers)) == len(numbers) >= 40
    for check in CHECKS:
        assert check.number[0] == check.section.value
        assert check.number[1] == "C"
        assert check.number[2:].isdigit()
        assert check.title
        assert check.clause
