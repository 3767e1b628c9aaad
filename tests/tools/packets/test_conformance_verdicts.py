"""How observations of a client become a finding: nothing that was seen can hide a broken rule."""

import pytest

from openpendant.tools.packets.conformance.check import (
    PASSED,
    CheckFinding,
    CheckVerdict,
    deviates,
    failed,
    not_applicable,
)
from openpendant.tools.packets.conformance.client.check import Habit, Moment, Problem, finding_of
from openpendant.tools.packets.conformance.client.judge import CHECKS, results_of

HABIT = Habit("a program: what it does", "seen")


@pytest.mark.parametrize(
    ("seen", "verdict"),
    [
        ([], CheckVerdict.NOT_APPLICABLE),
        ([None], CheckVerdict.PASSED),
        ([None, HABIT], CheckVerdict.DEVIATES),
        ([HABIT, "broken"], CheckVerdict.FAILED),
        (["broken", None], CheckVerdict.FAILED),
    ],
)
def test_the_worst_of_what_was_looked_at_is_found(
    seen: list[Problem | None], verdict: CheckVerdict
) -> None:
    observations = ((Moment(number), problem) for number, problem in enumerate(seen))
    assert finding_of(observations, "nothing to look at").verdict is verdict


@pytest.mark.parametrize(
    ("findings", "verdict"),
    [
        ([PASSED, failed("there")], CheckVerdict.FAILED),
        ([deviates("a habit", "seen"), failed("there")], CheckVerdict.FAILED),
        ([PASSED, deviates("a habit", "seen")], CheckVerdict.DEVIATES),
        ([not_applicable("no"), PASSED], CheckVerdict.PASSED),
        ([not_applicable("no"), not_applicable("no")], CheckVerdict.NOT_APPLICABLE),
    ],
)
def test_the_worst_of_several_scenarios_is_the_result(
    findings: list[CheckFinding], verdict: CheckVerdict
) -> None:
    of_all = {
        f"scenario {number}": {check.number: finding for check in CHECKS}
        for number, finding in enumerate(findings)
    }
    assert {result.finding.verdict for result in results_of(of_all)} == {verdict}
