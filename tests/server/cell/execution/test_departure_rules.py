"""Each rule of the last look alone: a motion that breaks just this one, and one that just keeps it.

The numbers are worked out by hand from the limits below; nothing here is compared with the code.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import pytest

from openpendant.motion.description.limits import JointLimits
from openpendant.motion.trajectory.trajectory import Row
from openpendant.server.cell.execution.setpoint_guard import SetpointGuard
from openpendant.server.refusal import Refusal
from openpendant.simplemsg.verdicts import VerdictCode as V

# No two joints, and no two sides, are alike: a rule that reads the wrong one shows.
LIMITS = JointLimits(
    names=("turn", "tilt"),
    lower=(-3.0, -1.0),
    upper=(2.0, 1.5),
    velocity=(2.0, 1.0),
    acceleration=(4.0, 2.0),
    prismatic=(False, False),
)
STEP = 0.1
"""s: a tilt at most 0.2 rad/s faster, and 0.005005 rad beside the way of its mean velocity."""


def motion(*speeds: float, joint: int = 1, at: Sequence[float] = (0.0, 0.0)) -> list[Row]:
    rows = [Row(0.0, list(at), [0.0, 0.0], [])]
    for index, speed in enumerate(speeds):
        position, velocity = list(rows[-1].position), [0.0, 0.0]
        position[joint] += 0.5 * STEP * (rows[-1].velocity[joint] + speed)
        velocity[joint] = speed
        rows.append(Row((index + 1) * STEP, position, velocity, []))
    return rows


def shifted(rows: list[Row], shift: float, joint: int = 1) -> list[Row]:
    position = list(rows[-1].position)
    position[joint] += shift
    return [*rows[:-1], Row(rows[-1].time, position, rows[-1].velocity, [])]


def timed(rows: list[Row], time: float) -> list[Row]:
    return [*rows[:-1], Row(time, rows[-1].position, rows[-1].velocity, [])]


def judged(rows: list[Row], start: Sequence[float] | None = None) -> tuple[int, Refusal | None]:
    check = SetpointGuard(LIMITS, start)
    for index, row in enumerate(rows):
        if (refusal := check.check(row)) is not None:
            return index, refusal
    return len(rows), None


FASTER, SLOWER = (0.2, 0.4, 0.6, 0.8, 1.0), (0.8, 0.6, 0.4, 0.2, 0.0)


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("joint", [0, 1])
def test_what_just_keeps_every_limit_leaves(joint: int, sign: float) -> None:
    most = sign * LIMITS.velocity[joint]
    rows = motion(*(most * share for share in (*FASTER, 1.0, *SLOWER)), joint=joint)
    assert judged(rows) == (12, None)


def test_a_speed_above_its_limit_by_rounding_leaves() -> None:
    assert judged(motion(*FASTER, 1.0 + 9e-7)) == (7, None)


SLOWLY = (0.2, 0.4, 0.6, *(0.8 for _ in range(20)))
"""To 0.01, 0.04, 0.09, 0.16 rad, and from there on 0.08 rad more with each sample."""


@pytest.mark.parametrize(
    ("rows", "leave", "what", "joint", "limit"),
    [
        (motion(*(-each for each in SLOWLY)), 15, "is out of range", 1, -1.0),
        (motion(*SLOWLY), 21, "is out of range", 1, 1.5),
        (motion(*(-each for each in SLOWLY), at=(0.0, 0.25)), 18, "is out of range", 1, -1.0),
        (motion(at=(2.01, 0.0)), 0, "is out of range", 0, 2.0),
        (motion(at=(-3.01, 0.0)), 0, "is out of range", 0, -3.0),
        (motion(*FASTER, 1.2), 6, "is too fast", 1, 1.0),
        (motion(*(-each for each in FASTER), -1.2), 6, "is too fast", 1, 1.0),
        (motion(*FASTER, 1.0 + 2e-6), 6, "is too fast", 1, 1.0),
        (motion(0.201), 1, "changes its velocity too fast", 1, 0.2002),
        (motion(-0.201), 1, "changes its velocity too fast", 1, 0.2002),
        (motion(0.2, 0.2, -0.01), 3, "changes its velocity too fast", 1, 0.2002),
        (motion(0.39), 1, "changes its velocity too fast", 1, 0.2002),
        (shifted(motion(0.0), 0.0051), 1, "jumps", 1, 0.0),
        (shifted(motion(0.0), -0.0051), 1, "jumps", 1, 0.0),
        (shifted(motion(0.2, 0.2), 0.0051), 2, "jumps", 1, 0.01),
        (shifted(motion(0.2, 0.2), -0.0101, joint=0), 2, "jumps", 0, 0.0),
    ],
)
def test_what_breaks_one_limit_does_not_leave(
    rows: list[Row], leave: int, what: str, joint: int, limit: float
) -> None:
    count, refusal = judged(rows)
    assert refusal is not None
    assert (count, refusal.joint, refusal.code) == (leave, joint, V.CERTIFICATE_REFUSED)
    assert f"joint {joint + 1} {what}:" in refusal.text
    assert "not sent" in refusal.text
    assert refusal.limit == pytest.approx(limit)


@pytest.mark.parametrize("shift", [0.005, -0.005])
def test_a_way_that_the_acceleration_explains_leaves(shift: float) -> None:
    assert judged(shifted(motion(0.0), shift)) == (2, None)
    assert judged(shifted(motion(0.2, 0.2), 2.0 * shift, joint=0)) == (3, None)


def test_the_first_sample_is_at_rest() -> None:
    row = Row(0.0, [0.0, 0.0], [0.0, 1e-6], [])
    count, refusal = judged([row])
    assert refusal is not None
    assert (count, refusal.joint, refusal.limit) == (0, 1, 0.0)
    assert "changes its velocity too fast" in refusal.text


@pytest.mark.parametrize("time", [0.2, 0.2 + 5e-10, 0.1, -1.0, math.nan])
def test_time_advances_from_sample_to_sample(time: float) -> None:
    count, refusal = judged(timed(motion(0.0, 0.0, 0.0), time))
    assert refusal is not None
    assert count == 3
    assert "does not advance in time" in refusal.text


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("field", ["position", "velocity"])
def test_what_is_no_number_does_not_leave(field: str, value: float) -> None:
    row = Row(0.1, [0.0, 0.0], [0.0, 0.0], [])
    getattr(row, field)[1] = value
    count, refusal = judged([*motion(), row])
    assert refusal is not None
    assert (count, refusal.joint) == (1, 1)


def test_a_sample_that_was_held_is_not_the_one_that_the_next_is_compared_with() -> None:
    check = SetpointGuard(LIMITS)
    first, second = motion(0.2)
    jump = Row(0.1, [1.0, 0.0], [0.0, 0.0], [])
    assert check.check(first) is None
    assert check.check(jump) is not None
    assert check.check(second) is None


BACK_AND_OUT = (0.2, 0.4, 0.4, 0.2, 0.0, -0.2)
"""By 0.12 rad in five samples, and then back again by 0.01."""


@pytest.mark.parametrize(("outside", "inward"), [(1.8, -1.0), (-1.3, 1.0)])
def test_a_jog_from_beyond_a_limit_comes_back_and_goes_out_no_more(
    outside: float, inward: float
) -> None:
    rows = motion(*(inward * speed for speed in BACK_AND_OUT), at=(0.0, outside))
    count, refusal = judged(rows, (0.0, outside))
    assert refusal is not None
    assert (count, refusal.joint) == (6, 1)
    assert refusal.limit == pytest.approx(outside + inward * 0.12)
    assert judged(rows) == (0, judged(rows)[1])


@pytest.mark.parametrize(("outside", "outward"), [(1.8, 1.0), (-1.3, -1.0)])
def test_a_jog_from_beyond_a_limit_goes_no_farther(outside: float, outward: float) -> None:
    count, refusal = judged(motion(0.02 * outward, at=(0.0, outside)), (0.0, outside))
    assert refusal is not None
    assert (count, refusal.joint, refusal.limit) == (1, 1, outside)


@pytest.mark.parametrize("outside", [1.8, -1.3])
def test_a_jog_begins_no_farther_out_than_where_the_robot_stands(outside: float) -> None:
    count, refusal = judged(
        motion(at=(0.0, outside + math.copysign(1e-6, outside))), (0.0, outside)
    )
    assert refusal is not None
    assert (count, refusal.joint, refusal.limit) == (0, 1, outside)


@pytest.mark.parametrize(("outside", "inward"), [(1.55, -1.0), (-1.05, 1.0)])
def test_a_joint_that_came_back_inside_has_its_whole_range(outside: float, inward: float) -> None:
    back = motion(*(inward * speed for speed in BACK_AND_OUT), at=(0.0, outside))
    assert judged(back, (0.0, outside)) == (7, None)
    out = (*BACK_AND_OUT, -0.4, -0.4, -0.4)  # to 0.07, 0.03 and 0.01 rad beyond the limit's place
    count, refusal = judged(
        motion(*(inward * speed for speed in out), at=(0.0, outside)), (0.0, outside)
    )
    assert refusal is not None
    assert (count, refusal.limit) == (8, 1.5 if outside > 0.0 else -1.0)
