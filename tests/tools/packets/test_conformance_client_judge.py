"""The judge of clients: the real ones, as recorded, and such as break one rule each."""

import tomllib
from functools import cache
from pathlib import Path

import pytest
from rigs.faults.faulty_clients import FAULTS, Fault, Form
from rigs.processes.judged_client import findings_of_correct, judge, judge_by_its_check

from openpendant.simplemsg import MOTOMAN, STANDARD, ByteOrder
from openpendant.simplemsg.motoman import MotomanSelectTool
from openpendant.tools.packets.conformance.check import CheckFinding, CheckVerdict
from openpendant.tools.packets.conformance.client.judge import CHECKS, judge_scenario, scenarios_of
from openpendant.tools.packets.conformance.client.setup import SCENARIOS, Mutation, Scenario, Setup
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


NOT_FOUND: dict[str, str] = {}
"""Faults that the judge misses, with the reason; at most one in twenty."""

CASES = [
    (scenario, form)
    for scenario in SCENARIOS
    for form in Form
    if form.is_motoman or not scenario.is_motoman
]

NEEDS_A_SECOND_TRAJECTORY = {"QC03", "YC15"}
"""Checks of what begins after something else: the correct client begins nothing more."""


def numbers(findings: dict[str, CheckFinding], *verdicts: CheckVerdict) -> set[str]:
    return {number for number, finding in findings.items() if finding.verdict in verdicts}


@pytest.mark.parametrize(
    ("scenario", "form"),
    CASES,
    ids=[f"{scenario.name}, {form.name.lower()}" for scenario, form in CASES],
)
def test_a_correct_client_has_no_finding(scenario: Scenario, form: Form) -> None:
    findings = findings_of_correct(scenario.mutation, form)
    assert numbers(findings, CheckVerdict.FAILED, CheckVerdict.DEVIATES) == set()


@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault.name)
def test_a_client_with_one_fault_is_found_by_the_right_check(fault: Fault) -> None:
    finding = judge_by_its_check(fault)
    if fault.name in NOT_FOUND:
        assert finding.verdict not in (CheckVerdict.FAILED, CheckVerdict.DEVIATES)
        return
    assert finding.verdict is (CheckVerdict.DEVIATES if fault.is_habit else CheckVerdict.FAILED)
    assert finding.detail
    assert bool(finding.habit) is fault.is_habit


def test_there_are_faults_enough_and_hardly_any_is_missed() -> None:
    assert len(FAULTS) >= 60
    assert len({fault.name for fault in FAULTS}) == len(FAULTS)
    assert len(NOT_FOUND) <= len(FAULTS) * 0.05


def test_every_check_has_a_client_that_breaks_it() -> None:
    assert {check.number for check in CHECKS} - {fault.check for fault in FAULTS} == set()


def test_every_check_passes_a_correct_client_in_some_scenario() -> None:
    correct = [
        *(findings_of_correct(scenario.mutation, form) for scenario, form in CASES),
        judge(Fault("leaves with STOP", "", stops_at=5)),
        judge(Fault("selects tool 1", "", form=Form.MOTOMAN, extra=MotomanSelectTool(0, 1, 0))),
    ]
    passed = set().union(*(numbers(findings, CheckVerdict.PASSED) for findings in correct))
    assert {check.number for check in CHECKS} - passed == NEEDS_A_SECOND_TRAJECTORY


def test_the_correct_client_sends_its_whole_trajectory() -> None:
    findings = findings_of_correct(Mutation.NONE, Form.FULL)
    assert findings["MC02"].verdict is CheckVerdict.PASSED
    assert findings["MC17"].verdict is CheckVerdict.NOT_APPLICABLE
    assert len(numbers(findings, CheckVerdict.PASSED)) >= 35
