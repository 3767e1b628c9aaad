"""The judge of clients against clients that break one rule each: it must find and name it."""

import pytest
from rigs.faults.client_fault import Fault, Form
from rigs.faults.faulty_clients import FAULTS
from rigs.processes.judged_client import findings_of_correct, judge, judge_by_its_check

from openpendant.simplemsg.motoman import MotomanSelectTool
from openpendant.tools.packets.conformance.check import CheckFinding, CheckVerdict
from openpendant.tools.packets.conformance.client.judge import CHECKS
from openpendant.tools.packets.conformance.client.setup import SCENARIOS, Mutation, Scenario

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
