"""Each rule of the last look alone: a motion that breaks just this one, and one that just keeps it.

The numbers are worked out by hand from the limits below; nothing here is compared with the code.
"""

import bisect
import math
import random
from collections import Counter
from collections.abc import Sequence
from heapq import heappop, heappush
from random import Random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rigs.cells.controller_reports import joint_report, status
from rigs.cells.expectations import refusal_from
from rigs.cells.server_rig import LIMITS, MS
from rigs.data.example_counts import examples

from openpendant.motion.description.limits import JointLimits
from openpendant.motion.trajectory.ptp import plan_joint_move, straight_move
from openpendant.motion.trajectory.trajectory import Row
from openpendant.server.cell.execution.feedback import Feedback
from openpendant.server.cell.execution.point_stream import PointStream
from openpendant.server.cell.execution.setpoint_guard import SetpointGuard
from openpendant.server.cell.execution.setpoint_sources import StoredRows
from openpendant.server.refusal import Refusal
from openpendant.server.settings.cell_settings import ControllerLink
from openpendant.server.uplinks.generic import GenericUplink
from openpendant.simplemsg import HeaderOnly, MsgType
from openpendant.simplemsg.verdicts import VerdictCode as V

# No two joints, and no two sides, are alike: a rule that reads the wrong one shows.
UNEVEN = JointLimits(
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


def judged(
    rows: list[Row], start: Sequence[float] | None = None, limits: JointLimits = UNEVEN
) -> tuple[int, Refusal | None]:
    check = SetpointGuard(limits, start)
    for index, row in enumerate(rows):
        if (refusal := check.check(row)) is not None:
            return index, refusal
    return len(rows), None


def held(rows: list[Row], start: Sequence[float] | None = None) -> tuple[int, Refusal]:
    count, refusal = judged(rows, start)
    return count, refusal_from(refusal)


FASTER, SLOWER = (0.2, 0.4, 0.6, 0.8, 1.0), (0.8, 0.6, 0.4, 0.2, 0.0)


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("joint", [0, 1])
def test_what_just_keeps_every_limit_leaves(joint: int, sign: float) -> None:
    most = sign * UNEVEN.velocity[joint]
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
    count, refusal = held(rows)
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
    count, refusal = held([row])
    assert (count, refusal.joint, refusal.limit) == (0, 1, 0.0)
    assert "changes its velocity too fast" in refusal.text


@pytest.mark.parametrize("time", [0.2, 0.2 + 5e-10, 0.1, -1.0, math.nan])
def test_time_advances_from_sample_to_sample(time: float) -> None:
    count, refusal = held(timed(motion(0.0, 0.0, 0.0), time))
    assert count == 3
    assert "does not advance in time" in refusal.text


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("field", ["position", "velocity"])
def test_what_is_no_number_does_not_leave(field: str, value: float) -> None:
    row = Row(0.1, [0.0, 0.0], [0.0, 0.0], [])
    getattr(row, field)[1] = value
    count, refusal = held([*motion(), row])
    assert (count, refusal.joint) == (1, 1)


def test_a_sample_that_was_held_is_not_the_one_that_the_next_is_compared_with() -> None:
    check = SetpointGuard(UNEVEN)
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
    count, refusal = held(rows, (0.0, outside))
    assert (count, refusal.joint) == (6, 1)
    assert refusal.limit == pytest.approx(outside + inward * 0.12)
    assert judged(rows) == (0, judged(rows)[1])


@pytest.mark.parametrize(("outside", "outward"), [(1.8, 1.0), (-1.3, -1.0)])
def test_a_jog_from_beyond_a_limit_goes_no_farther(outside: float, outward: float) -> None:
    count, refusal = held(motion(0.02 * outward, at=(0.0, outside)), (0.0, outside))
    assert (count, refusal.joint, refusal.limit) == (1, 1, outside)


@pytest.mark.parametrize("outside", [1.8, -1.3])
def test_a_jog_begins_no_farther_out_than_where_the_robot_stands(outside: float) -> None:
    count, refusal = held(motion(at=(0.0, outside + math.copysign(1e-6, outside))), (0.0, outside))
    assert (count, refusal.joint, refusal.limit) == (0, 1, outside)


@pytest.mark.parametrize(("outside", "inward"), [(1.55, -1.0), (-1.05, 1.0)])
def test_a_joint_that_came_back_inside_has_its_whole_range(outside: float, inward: float) -> None:
    back = motion(*(inward * speed for speed in BACK_AND_OUT), at=(0.0, outside))
    assert judged(back, (0.0, outside)) == (7, None)
    out = (*BACK_AND_OUT, -0.4, -0.4, -0.4)  # to 0.07, 0.03 and 0.01 rad beyond the limit's place
    count, refusal = held(
        motion(*(inward * speed for speed in out), at=(0.0, outside)), (0.0, outside)
    )
    assert (count, refusal.limit) == (8, 1.5 if outside > 0.0 else -1.0)


@pytest.mark.parametrize("speed", [0.01, 0.5, 1.0])
@pytest.mark.parametrize("goal", [(1.0, -0.5), (2.0, 2.0), (1e-4, 0.0), (-2.0, 0.003)])
def test_what_was_certified_leaves(goal: tuple[float, float], speed: float) -> None:
    move = straight_move((0.0, 0.0), goal, LIMITS, speed=speed)
    rows = [move.row(index) for index in range(len(move))]
    assert judged(rows, limits=LIMITS) == (len(rows), None)


def walk(chance: Random) -> list[Row]:
    step = chance.choice((0.004, 0.01, 0.02))
    push = [
        chance.choice((0.01, 0.1, 0.5, 0.999, 1.0015)) * chance.choice((-1, 0, 1)) for _ in "ab"
    ]
    gains = [share * most * step for share, most in zip(push, LIMITS.acceleration, strict=True)]
    row = Row(0.0, [chance.uniform(-1.9, 1.9) for _ in push], [0.0, 0.0], [])
    rows, jumps_at = [row], chance.randrange(200)
    for index in range(200):
        velocity = [speed + gain for speed, gain in zip(row.velocity, gains, strict=True)]
        shift = chance.choice((0.24, 0.26)) * LIMITS.acceleration[0] * step**2
        means = zip(row.position, row.velocity, velocity, strict=True)
        position = [at + 0.5 * (a + b) * step for at, a, b in means]
        if index == jumps_at:
            position[chance.randrange(2)] += shift
        row = Row(row.time + step, position, velocity, [])
        rows.append(row)
    return rows


@pytest.mark.parametrize("start", [None, (2.2, 0.0)])
@pytest.mark.parametrize("seed", range(60))
def test_a_glance_lets_nothing_leave_that_a_look_at_each_joint_would_hold(
    seed: int, start: tuple[float, float] | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The same verdict on each sample, word for word, up to the first that is held."""
    rows = walk(Random(seed))

    at_a_glance = judged(rows, start, LIMITS)
    monkeypatch.setattr(SetpointGuard, "_is_surely_sound", lambda *_: False)
    assert at_a_glance == judged(rows, start, LIMITS)


def test_a_glance_is_enough_for_nearly_all_of_a_slow_motion(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    move = straight_move((0.0, 0.0), (1.0, -0.5), LIMITS, speed=0.3)
    look, looks = SetpointGuard._fault, 0

    def counted(check: SetpointGuard, row: Row, last: Row, step: float) -> Refusal | None:
        nonlocal looks
        looks += 1
        return look(check, row, last, step)

    monkeypatch.setattr(SetpointGuard, "_fault", counted)
    rows = [move.row(index) for index in range(len(move))]
    assert judged(rows, limits=LIMITS) == (len(rows), None)
    assert looks < 0.3 * len(move)


TICK = 10 * MS
TRAJECTORY = plan_joint_move((0.0, 0.0), (1.8, -1.8), LIMITS)
TIMES = TRAJECTORY.times.tolist()
DONE = HeaderOnly(MsgType.JOINT_TRAJ_PT_FULL)

BEGUN, ENDING = 20, 36
"""Ticks until the robot moves fast enough to be found on its way; and those at the end, in 25 of
which all has left ahead."""

SETTLING = 2
"""Ticks with no set-point or with two, where the rhythm happens to begin at its edge."""


def position_at(time: float) -> tuple[float, float]:
    """Return where a robot is that follows the trajectory exactly [rad]."""
    place = min(max(bisect.bisect_left(TIMES, time), 1), len(TIMES) - 1)
    share = min(max((time - TIMES[place - 1]) / (TIMES[place] - TIMES[place - 1]), 0.0), 1.0)
    before, after = TRAJECTORY.position[place - 1], TRAJECTORY.position[place]
    first, second = (before + share * (after - before)).tolist()
    return first, second


class Way:
    """A motion through links that take their time; events in the order of their times.

    Attributes:
        sent_in: how many set-points left from each tick until the next one.
    """

    def __init__(self, chance: random.Random, answered_after: int, seen_at: int) -> None:
        """Begin; the first tick and the first report come when chance has it.

        Args:
            chance: decides by how much less than 1 ms answers and reports are irregular.
            answered_after: so long after a set-point its answer comes [ns].
            seen_at: where between two samples a report sees the robot [ns].
        """
        link = ControllerLink()
        self.sent_in = Counter[int]()
        self._feedback = Feedback(2, link)
        self._uplink = GenericUplink(link, LIMITS.velocity)
        self._execution = PointStream(StoredRows(TRAJECTORY, LIMITS), LIMITS, self._uplink, link, 0)
        self._chance, self._answered_after, self._seen_at = chance, answered_after, seen_at
        self._events: list[tuple[int, str]] = []
        self._ticks = self._reports = 0
        self._report(0)
        self._send(0)
        heappush(self._events, (chance.randrange(1, TICK), "tick"))
        heappush(self._events, (seen_at + chance.randrange(TICK), "report"))

    def run(self, until: int) -> None:
        """Go on until a time [ns]."""
        while self._events[0][0] < until:
            now, what = heappop(self._events)
            match what:
                case "tick":
                    self._ticks += 1
                    assert self._execution.advance(self._feedback, now) is None
                    self._send(now)
                    heappush(self._events, (now + TICK, "tick"))
                case "answer":
                    self._uplink.answer(DONE, 0)
                    self._send(now)
                case _:
                    self._report(now + self._chance.randrange(MS))
                    heappush(self._events, (now + TICK, "report"))

    def _send(self, now: int) -> None:
        if self._execution.next_point(now) is not None:
            self.sent_in[self._ticks] += 1
            after = self._answered_after + self._chance.randrange(MS)
            heappush(self._events, (now + after, "answer"))

    def _report(self, now: int) -> None:
        at = position_at((self._reports * TICK + self._seen_at) / 1e9)
        self._reports += 1
        self._feedback.take(joint_report(at, (1.0, 1.0)), now)
        self._feedback.take(status(moving=1), now)


@settings(max_examples=examples(10, in_soak=5_000))
@given(
    chance=st.randoms(use_true_random=False),
    answered_after=st.integers(0, 4 * MS),
    seen_at=st.integers(0, 4 * MS) | st.integers(6 * MS, TICK),
)
def test_each_tick_sends_one_set_point(
    chance: random.Random, answered_after: int, seen_at: int
) -> None:
    """Seen midway between two samples a robot may count as at either, which may cost a tick."""
    way = Way(chance, answered_after, seen_at)
    way.run(round(TIMES[-1] * 1e9))
    sent = [way.sent_in[tick] for tick in range(BEGUN, len(TIMES) - ENDING)]
    held_up = [tick for tick, count in enumerate(sent, BEGUN) if count != 1]
    assert len(held_up) <= SETTLING, held_up
