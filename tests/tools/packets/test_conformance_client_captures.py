"""The real ROS-I clients, as recorded: nothing fails, and every habit is found where it shows."""

import tomllib
from functools import cache
from pathlib import Path

import pytest

from openpendant.simplemsg import MOTOMAN, STANDARD, ByteOrder
from openpendant.tools.packets.conformance.check import CheckFinding, CheckVerdict
from openpendant.tools.packets.conformance.client.judge import CHECKS, judge_scenario, scenarios_of
from openpendant.tools.packets.conformance.client.setup import Setup
from openpendant.tools.packets.reading.trace_files import read_trace

VECTORS = Path(__file__).parents[2] / "vectors"
GENERIC = VECTORS / "capture-industrial-robot-client.json"
DRIVER = VECTORS / "capture-motoman-driver.json"


FINDINGS = tomllib.loads((Path(__file__).parent / "client_findings.toml").read_text("utf-8"))
HABITS: dict[str, list[str]] = FINDINGS["habits"]


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
def test_habits_are_found_where_they_show(scenario: str, habits: list[str]) -> None:
    findings = judged()[scenario]
    deviating = {n for n, finding in findings.items() if finding.verdict is CheckVerdict.DEVIATES}
    assert deviating == set(habits)
    assert all(findings[number].habit and findings[number].detail for number in habits)


@pytest.mark.parametrize(("scenario", "numbers"), FINDINGS["looked_at"].items())
def test_what_happens_is_looked_at(scenario: str, numbers: list[str]) -> None:
    passed = {n for n, item in judged()[scenario].items() if item.verdict is CheckVerdict.PASSED}
    assert set(numbers) <= passed


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
