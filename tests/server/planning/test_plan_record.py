from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from journal_records import read_back
from server_rig import LIMITS

from openpendant.motion.certificate import certify
from openpendant.motion.ptp import plan_joint_move
from openpendant.motion.trajectory import Trajectory
from openpendant.server.planning.jobs import Planned
from openpendant.server.planning.plan_record import PlanRecordError, plan_from_json, plan_to_json
from openpendant.server.programs.work import BodyPrinted, BodyUnpacked
from openpendant.server.refusal import Refusal
from openpendant.simplemsg.journal_text import LongValue, json_parts
from openpendant.simplemsg.verdicts import VerdictCode

START = (0.1, -0.2)


@pytest.fixture
def planned() -> Planned:
    trajectory = plan_joint_move(START, (0.9, 0.3), LIMITS)
    return Planned(4, (trajectory, certify(trajectory, LIMITS, start=START)), 0.012345678901)


def _through_text(planned: Planned) -> dict[str, Any]:
    return read_back(plan_to_json(planned))


def test_a_trajectory_comes_back_with_every_bit(planned: Planned) -> None:
    again = plan_from_json(4, _through_text(planned), LIMITS, START)
    assert isinstance(planned.result, tuple)
    assert isinstance(again.result, tuple)
    for name in ("times", "position", "velocity", "acceleration", "waypoint_times"):
        then, now = getattr(planned.result[0], name), getattr(again.result[0], name)
        assert np.array_equal(then, now)
    assert again.plan_time == planned.plan_time
    assert again.result[1].as_dict() == planned.result[1].as_dict()


def test_a_refusal_comes_back_with_its_numbers() -> None:
    refusal = Refusal(VerdictCode.OUT_OF_RANGE, "too far", joint=1, value=2.5, limit=2.0)
    again = plan_from_json(7, _through_text(Planned(7, refusal, 0.5)), LIMITS, START)
    assert again == Planned(7, refusal, 0.5)


def test_a_tampered_trajectory_is_certified_anew_and_refused(planned: Planned) -> None:
    record = _through_text(planned)
    record["samples"]["position"] = record["samples"]["velocity"]
    with pytest.raises(PlanRecordError):
        plan_from_json(4, record, LIMITS, START)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"samples": None}, "neither"),
        ({"samples": {}}, "times"),
        ({"plan_time": "soon"}, "plan_time"),
        ({"joints": 0}, "reshape|one row"),
        ({"samples": {"times": "?"}}, "base64|Only|Non|padding"),
        ({"refused": {"code": 9999}}, "refused"),
    ],
)
def test_a_damaged_record_is_refused(planned: Planned, change: dict[str, Any], words: str) -> None:
    with pytest.raises(PlanRecordError, match=words):
        plan_from_json(4, _through_text(planned) | change, LIMITS, START)


def test_samples_and_programs_are_not_spelled_out_on_the_event_loop(planned: Planned) -> None:
    """What is left for the journal's writer is all but a few of the characters."""
    many = np.zeros((60_001, 2))
    still = Trajectory(np.arange(60_001) / 100.0, many, many, many, np.array([0.0, 600.0]))
    pieces = tuple("[1.5]" * 1_000 for _ in range(120))
    assert isinstance(planned.result, tuple)
    for result in (
        (still, planned.result[1]),
        BodyPrinted("move PTP p1\n" * 80_000),
        BodyUnpacked("{}", pieces, pieces, 6_000, ()),
    ):
        parts = list(json_parts(plan_to_json(Planned(1, result, 0.5))))
        at_once = sum(len(part) for part in parts if isinstance(part, str))
        later = sum(len(part) for part in parts if isinstance(part, LongValue))
        assert at_once < 4_000
        assert later > 900_000
