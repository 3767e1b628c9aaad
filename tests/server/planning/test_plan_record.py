from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest
from server_rig import LIMITS

from openpendant.motion.certificate import certify
from openpendant.motion.ptp import plan_joint_move
from openpendant.server.planning.jobs import Planned
from openpendant.server.planning.plan_record import PlanRecordError, plan_from_json, plan_to_json
from openpendant.server.refusal import Refusal
from openpendant.simplemsg.verdicts import VerdictCode

START = (0.1, -0.2)


@pytest.fixture
def planned() -> Planned:
    trajectory = plan_joint_move(START, (0.9, 0.3), LIMITS)
    return Planned(4, (trajectory, certify(trajectory, LIMITS, start=START)), 0.012345678901)


def _through_text(planned: Planned) -> dict[str, Any]:
    record: dict[str, Any] = json.loads(json.dumps(plan_to_json(planned)))
    return record


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
