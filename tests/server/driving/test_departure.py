"""The last look at each set-point: a fault of ours must not leave."""

from __future__ import annotations

import math

import pytest
from server_rig import LIMITS

from openpendant.motion.ptp import plan_joint_move, straight_move
from openpendant.motion.trajectory import Row
from openpendant.server.driving.departure import DepartureCheck
from openpendant.simplemsg.verdicts import VerdictCode

GOAL = (1.0, -0.5)
ROWS = [plan_joint_move((0.0, 0.0), GOAL, LIMITS).row(index) for index in range(20)]


def check_all(rows: list[Row]) -> int | None:
    """Return the place of the first row that may not leave."""
    check = DepartureCheck(LIMITS)
    for index, row in enumerate(rows):
        refusal = check.check(row)
        if refusal is not None:
            assert refusal.code is VerdictCode.CERTIFICATE_REFUSED
            assert "not sent" in refusal.text
            return index
    return None


def altered(
    time: float | None = None,
    position: list[float] | None = None,
    velocity: list[float] | None = None,
) -> list[Row]:
    """Return the rows with one value of the tenth spoilt."""
    row = ROWS[10]
    spoilt = Row(
        row.time if time is None else time,
        position or row.position,
        velocity or row.velocity,
        row.acceleration,
    )
    return [*ROWS[:10], spoilt, *ROWS[11:]]


@pytest.mark.parametrize("speed", [0.01, 0.5, 1.0])
@pytest.mark.parametrize("goal", [(1.0, -0.5), (2.0, 2.0), (1e-4, 0.0), (-2.0, 0.003)])
def test_what_was_certified_leaves(goal: tuple[float, float], speed: float) -> None:
    move = straight_move((0.0, 0.0), goal, LIMITS, speed=speed)
    assert check_all([move.row(index) for index in range(len(move))]) is None


@pytest.mark.parametrize(
    "rows",
    [
        altered(position=[math.nan, 0.0]),
        altered(position=[2.1, 0.0]),
        altered(velocity=[math.nan, 0.0]),
        altered(velocity=[math.inf, 0.0]),
        altered(velocity=[2.1, 0.0]),
        altered(velocity=[0.0, 0.0]),
        altered(position=[0.5, 0.0]),
        altered(time=ROWS[9].time),
        altered(time=math.nan),
    ],
)
def test_a_sample_that_breaks_a_limit_or_jumps_does_not_leave(rows: list[Row]) -> None:
    assert check_all(rows) == 10


def test_a_sample_that_comes_twice_does_not_leave_again() -> None:
    assert check_all([*ROWS[:10], ROWS[9], *ROWS[10:]]) == 10


def test_the_first_sample_must_be_at_rest() -> None:
    assert check_all(ROWS[5:]) == 0
