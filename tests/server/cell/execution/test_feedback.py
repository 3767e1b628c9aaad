"""What the controller reported, how old it is, whether the robot stands (promises 5, 10 and 52)."""

import math
from random import Random

import pytest
from promises.promise_table import figure
from rigs.cells.controller_reports import joint_report, status
from rigs.cells.expectations import known
from rigs.cells.server_rig import MS

from openpendant.server.cell.execution.feedback import Feedback, lost
from openpendant.server.cell.execution.motion_watch import ReportTiming
from openpendant.server.settings.cell_settings import ControllerLink
from openpendant.simplemsg import ControllerMode, JointFeedback, JointPosition, Status, joint_array
from openpendant.simplemsg.verdicts import VerdictCode

FRESH, LOST = figure(5, "fresh").ns, figure(5, "lost").ns
FRESH_PERIODS, LOST_PERIODS = figure(5, "fresh_periods").bound, figure(5, "lost_periods").bound
GREATEST = figure(10, "greatest").bound


@pytest.fixture
def feedback() -> Feedback:
    return Feedback(2, ControllerLink())


def plain(*position: float) -> JointPosition:
    return JointPosition(0, joint_array(position))


def test_nothing_is_fresh_before_the_first_report(feedback: Feedback) -> None:
    assert feedback.age(0) is None
    assert not feedback.is_fresh(0)
    assert feedback.is_lost(0)


@pytest.mark.parametrize(
    ("period", "fresh", "lost"),
    [
        (0.01, FRESH, LOST),
        (0.04, FRESH, LOST),
        (0.1, round(FRESH_PERIODS * 0.1e9), round(LOST_PERIODS * 0.1e9)),
    ],
)
def test_promise_5_a_report_is_fresh_and_lost_by_its_age_and_by_the_period_of_reports(
    period: float, fresh: int, lost: int
) -> None:
    feedback = Feedback(2, ControllerLink(state_period=period))
    feedback.take(joint_report((0.0, 0.0), (0.0, 0.0)), 0)
    assert feedback.is_fresh(fresh)
    assert not feedback.is_fresh(fresh + 1)
    assert not feedback.is_lost(lost)
    assert feedback.is_lost(lost + 1)


@pytest.mark.parametrize(
    ("told", "at", "asked", "stands"),
    [
        (None, 0, 10, True),
        (status(moving=0), 9, 10, False),
        (status(moving=0), 9, 109, False),
        (status(moving=0), 9, 110, True),
        (status(moving=0), 10, 10, True),
        (status(moving=1), 10, 500, False),
        (status(moving=-1), 9, 10, True),
    ],
)
def test_it_stands_after_10_ms_by_what_was_told_since(
    feedback: Feedback, told: Status | None, at: int, asked: int, stands: bool
) -> None:
    if told is not None:
        feedback.take(told, at * MS)
    feedback.take(joint_report((0.0, 0.0), (0.0, 0.0)), asked * MS)
    assert feedback.stands_after(10 * MS, asked * MS) is stands


@pytest.mark.parametrize(
    "bad", [math.nan, math.inf, -math.inf, GREATEST + 1.0, -GREATEST - 1.0, 3e38]
)
def test_a_position_that_no_joint_has_is_not_taken(feedback: Feedback, bad: float) -> None:
    feedback.take(joint_report((0.1, 0.2), (0.0, 0.0)), 0)
    feedback.take(joint_report((0.1, bad), (0.0, 0.0)), 10 * MS)
    assert feedback.broken
    assert feedback.position == (0.1, 0.2)
    assert feedback.age(10 * MS) == 10 * MS


def test_a_sound_report_mends_a_broken_one(feedback: Feedback) -> None:
    feedback.take(joint_report((math.nan, 0.0)), 0)
    feedback.take(joint_report((0.0, 0.0)), 1)
    assert not feedback.broken


def test_a_value_in_a_slot_without_joint_does_not_matter(feedback: Feedback) -> None:
    feedback.take(joint_report((0.1, 0.2, math.nan)), 0)
    assert feedback.position == (0.1, 0.2)


def test_speed_is_worked_out_from_two_positions_where_it_is_not_reported(
    feedback: Feedback,
) -> None:
    feedback.take(plain(0.0, 0.0), 0)
    assert not feedback.is_standing
    feedback.take(plain(0.01, -0.02), 10 * MS)
    assert feedback.velocity == pytest.approx((1.0, -2.0))
    feedback.take(plain(0.01, -0.02), 20 * MS)
    assert feedback.is_standing


def test_the_poorer_of_two_kinds_of_report_is_left_alone(feedback: Feedback) -> None:
    feedback.take(joint_report((0.1, 0.2), (0.0, 0.0)), 0)
    feedback.take(plain(9.0, 9.0), 10 * MS)
    assert (feedback.position, feedback.received) == ((0.1, 0.2), 0)


def test_nothing_of_a_lost_connection_is_believed(feedback: Feedback) -> None:
    feedback.take(joint_report((0.0, math.nan)), 0)
    feedback.take(joint_report((0.0, 0.0), (1.0, 0.0)), 0)
    feedback.take(status(), 0)
    feedback.forget()
    assert (feedback.position, feedback.status) == (None, None)
    assert feedback.mode is ControllerMode.UNKNOWN
    assert not feedback.velocity_known
    assert not feedback.broken


@pytest.mark.parametrize(
    ("report", "complaint", "fault"),
    [
        (status(), "", ""),
        (status(e_stopped=1), "emergency stop", "emergency stop"),
        (status(error=7, possible=0), "error 7", ""),
        (status(error=7, possible=-1), "error 7", ""),
        (status(error=7, possible=1), "", ""),
        (status(powered=0), "no power", "lost their power"),
        (status(possible=0), "not possible", ""),
        (status(powered=-1, e_stopped=-1, possible=-1), "", ""),
    ],
)
def test_the_controllers_own_obstacles_are_told_apart(
    feedback: Feedback, report: Status, complaint: str, fault: str
) -> None:
    feedback.take(report, 0)
    assert complaint in feedback.complaint
    assert fault in feedback.fault
    assert bool(complaint) == bool(feedback.complaint)
    assert bool(fault) == bool(feedback.fault)


@pytest.mark.parametrize(
    ("in_error", "code", "error"), [(1, 7, 7), (1, 0, -1), (0, 7, 0), (-1, 7, 0)]
)
def test_an_error_counts_where_the_controller_says_that_it_is_in_one(
    feedback: Feedback, in_error: int, code: int, error: int
) -> None:
    feedback.take(Status(1, 0, code, in_error, 0, 2, 1), 0)
    assert feedback.error == error


def test_a_controller_without_status_is_not_trusted(feedback: Feedback) -> None:
    assert feedback.complaint


@pytest.mark.parametrize(("mode", "expected"), [(1, 1), (2, 2), (-1, -1), (0, -1), (77, -1)])
def test_an_unknown_mode_is_unknown(feedback: Feedback, mode: int, expected: int) -> None:
    report = status()
    report.mode = mode
    feedback.take(report, 0)
    assert feedback.mode == expected


def taken(*arrivals_ms: float, period: float = 0.01) -> ReportTiming:
    timing = ReportTiming(period)
    for number, at in enumerate(arrivals_ms):
        timing.take((float(number),), round(at * MS))
    return timing


def test_regular_reports_are_compared_over_50_and_250_ms() -> None:
    timing = taken(*range(0, 1_001, 10))
    assert (known(timing.joint_base).time, known(timing.point_base).time) == (950 * MS, 750 * MS)
    assert timing.elapsed(known(timing.joint_base)) == 0.05
    assert timing.is_sure


COMPARED: dict[str, tuple[list[int], float, int, float]] = {
    "slow ones with the one before": ([0, 200, 400], 0.2, 1, 0.2),
    "over a pause, which tells nothing of the rhythm": (
        *([*range(0, 1_001, 10), *range(3_000, 3_501, 10)], 0.01, 5, 0.05),
    ),
    "before the rhythm is known, as they arrived": ([*range(0, 501, 20)], 0.01, 3, 0.06),
    "by the rhythm that was learned": ([*range(0, 6_000, 4)], 0.01, 13, 0.052),
    "by a slower one that was learned": ([*range(0, 6_000, 20)], 0.01, 3, 0.06),
    "by a slower one that has just begun": (
        [*range(0, 501, 10), *range(520, 641, 20)],
        0.01,
        3,
        0.06,
    ),
    # Ten reports wait on their way, and then come 1 ms after each other.
    "bunched ones as they were measured": (
        *([*range(0, 501, 10), *range(520, 580)], 0.01, 50, 0.5),
    ),
}
"""When reports come [ms], the declared period; how many before is compared, how long ago [s]."""


@pytest.mark.parametrize(
    ("arrivals", "period", "before", "elapsed"), COMPARED.values(), ids=COMPARED
)
def test_reports_are_compared_with_one_that_was_measured_long_enough_before(
    arrivals: list[int], period: float, before: int, elapsed: float
) -> None:
    timing = taken(*arrivals, period=period)
    base = known(timing.joint_base)
    assert known(timing.newest).number - base.number == before
    assert timing.elapsed(base) == pytest.approx(elapsed)


def test_reports_of_one_turn_count_as_the_newest_of_them() -> None:
    timing = taken(0, 10, 20, 20, 20, 70)
    assert known(timing.joint_base).position == (4.0,)


def test_the_first_report_after_a_silence_is_neither_judged_nor_compared_with() -> None:
    assert not taken(*range(0, 101, 10), 126).is_sure
    timing = taken(*range(0, 101, 10), 126, 136, 146, 156, 166, 176)
    assert timing.is_sure
    assert known(timing.joint_base).time == 100 * MS


def test_a_motion_compares_with_nothing_from_before_it() -> None:
    timing = taken(*range(0, 1_001, 10))
    timing.begin()
    assert [timing.joint_base, timing.point_base] == [None, None]
    for at in range(1_010, 1_051, 10):
        timing.take((0.0,), at * MS)
    assert (known(timing.joint_base).time, timing.point_base) == (1_000 * MS, None)


@pytest.mark.parametrize("seed", range(20))
def test_no_delay_makes_the_time_seem_shorter_by_a_tenth(seed: int) -> None:
    """However the delays come and go, up to 0.2 s: the limit is exceeded by no report."""
    chance = Random(seed)
    timing = ReportTiming(0.01)
    measured: list[int] = []
    arrived = 0
    most = chance.choice((5, 50, 200))
    for number in range(1_500):
        delay = chance.choice((chance.randint(0, most), number % most, 0))
        arrived = max(arrived, number * 10 * MS + delay * MS)
        measured.append(number * 10)
        report = timing.take((0.0,), arrived)
        for base in (timing.joint_base, timing.point_base):
            if base is not None and timing.is_sure:
                true = (measured[report.number] - measured[base.number]) / 1e3
                assert timing.elapsed(base) * 1.1 >= true


@pytest.mark.parametrize(("newest", "elapsed"), [(260, 0.06), (460, 0.26)])
def test_a_report_that_waited_and_one_left_out_behind_it_are_no_speed(
    newest: int, elapsed: float
) -> None:
    """The one of 200 ms comes 9 ms late, that of 210 ms never, those from 220 ms on in time."""
    timing = taken(*range(0, 200, 10), 209, *range(220, newest + 1, 10))
    base = known(timing.joint_base if newest == 260 else timing.point_base)
    assert base.time == 209 * MS
    assert timing.elapsed(base) == pytest.approx(elapsed)


def test_lateness_is_not_added_to_what_is_counted_by_the_rhythm() -> None:
    timing = taken(*range(0, 200, 10), 214, 218, 220, 230, 240, 250, 264)
    base = known(timing.joint_base)
    assert base.time == 214 * MS  # 14 ms late, 60 ms before the newest by their number
    assert timing.elapsed(base) == pytest.approx(0.064)


@pytest.mark.parametrize(("left_out", "elapsed"), [(1, 0.06), (3, 0.065)])
def test_what_seems_late_after_reports_left_out_counts_for_less_than_a_silence(
    left_out: int, elapsed: float
) -> None:
    again = 200 + 10 * left_out
    timing = taken(*range(0, 200, 10), *range(again, again + 61, 10))
    assert known(timing.joint_base).time == (again + 10) * MS
    assert timing.elapsed(known(timing.joint_base)) == pytest.approx(elapsed)


def test_what_seems_late_after_a_report_left_out_is_forgotten() -> None:
    timing = taken(*range(0, 200, 10), *range(210, 321, 10))
    assert timing.elapsed(known(timing.joint_base)) == 0.05


@pytest.mark.parametrize("seed", range(20))
def test_no_delay_makes_the_time_seem_shorter_where_reports_are_left_out(seed: int) -> None:
    """Each twentieth report is up to 14 ms late, another missing, once ten have come in time."""
    chance = Random(seed)
    timing = ReportTiming(0.01)
    measured: list[int] = []
    arrived = 0
    for number in range(3_000):
        if number > 10 and chance.random() < 0.05:
            continue
        delay = chance.uniform(0.0, 14.0) if number > 10 and chance.random() < 0.05 else 0.0
        arrived = max(arrived, number * 10 * MS + round(delay * MS))
        measured.append(number * 10)
        report = timing.take((0.0,), arrived)
        for base in (timing.joint_base, timing.point_base):
            if base is not None and timing.is_sure:
                true = (measured[report.number] - measured[base.number]) / 1e3
                assert timing.elapsed(base) * 1.1 >= true


def test_a_lost_connection_forgets_all_of_it() -> None:
    timing = taken(*range(0, 1_001, 10))
    timing.clear()
    timing.take((0.0,), 0)
    assert timing.joint_base is None


def test_the_report_of_another_robot_is_not_taken_as_ours(feedback: Feedback) -> None:
    feedback.take(joint_report((0.5, 0.5), (0.0, 0.0)), 0)
    ours = joint_report((1.0, 1.0), (1.0, 1.0))
    parts = (ours.valid_fields, ours.time, ours.positions, ours.velocities, ours.accelerations)
    for other in (1, 7, -1):
        feedback.take(JointFeedback(other, *parts), LOST)
    assert feedback.standing_at == (0.5, 0.5)
    assert feedback.is_standing
    assert feedback.is_lost(LOST + 1)
    told = known(lost(feedback, LOST + 1))
    assert told.code is VerdictCode.FEEDBACK_STALE
    assert told.sentence.endswith("it reports robot -1, and robot 0 is ours")
