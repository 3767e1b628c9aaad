"""Planted faults of a server: each is found by the checks made for it, or listed as not found."""

import pytest
from rigs.faults.faulty_servers import Fault, checks_named, judged, words_of
from rigs.faults.server_faults import SERVER_FAULTS, UNFOUND
from rigs.peers.scripted_motoman import MOTOMAN_FAULTS, judged_motoman

from openpendant.tools.packets.conformance.check import CheckVerdict

pytestmark = pytest.mark.virtual_clock


@pytest.mark.parametrize("fault", SERVER_FAULTS, ids=lambda fault: fault.name.replace(" ", "-"))
async def test_a_planted_fault_is_found(fault: Fault) -> None:
    judgement = await judged(fault, checks_named(fault.found_by))
    assert [result.finding.verdict for result in judgement.results] == [
        fault.verdict for _ in fault.found_by
    ], words_of(judgement, *CheckVerdict)


@pytest.mark.conformance
@pytest.mark.parametrize(("fault", "reason"), UNFOUND, ids=lambda value: getattr(value, "name", ""))
async def test_a_fault_that_is_listed_as_not_found_is_not(fault: Fault, reason: str) -> None:
    judgement = await judged(fault)
    assert reason
    assert words_of(judgement, CheckVerdict.FAILED, CheckVerdict.DEVIATES) == []


async def test_at_least_ninety_five_of_a_hundred_faults_are_found() -> None:
    assert len(SERVER_FAULTS) + len(MOTOMAN_FAULTS) >= 45
    assert len(UNFOUND) <= 0.05 * len(SERVER_FAULTS)


async def test_a_sound_motoman_controller_passes() -> None:
    judgement = await judged_motoman()
    assert words_of(judgement, CheckVerdict.FAILED, CheckVerdict.DEVIATES) == []
    assert judgement.count(CheckVerdict.PASSED) > 30


@pytest.mark.parametrize("fault", MOTOMAN_FAULTS)
async def test_a_fault_of_a_motoman_controller_is_found(fault: str) -> None:
    number, verdict = MOTOMAN_FAULTS[fault]
    judgement = await judged_motoman(fault, number)
    assert [result.finding.verdict for result in judgement.results] == [verdict]
