"""Which piece of the commanded path a report is compared with (promise 52)."""

from random import Random

import pytest
from rigs.cells.controller_reports import joint_report
from rigs.cells.expectations import known
from rigs.cells.server_rig import MS

from openpendant.motion.trajectory.trajectory import Row
from openpendant.server.cell.execution.feedback import Feedback
from openpendant.server.cell.execution.tracking import (
    SAME_PLACE,
    JogPace,
    PathTracking,
    TrackingMonitor,
    TrackingTolerances,
)
from openpendant.server.settings.cell_settings import ControllerLink

FLAT = TrackingTolerances((0.01, 0.01), 0.0, 0.0, (0.02, 0.02))
LAGGING = TrackingTolerances((0.01, 0.01), 0.08, 0.001, (0.02, 0.02))


def line(tolerances: TrackingTolerances, seconds: float = 1.0, ahead_ms: int = 100) -> PathTracking:
    """Return a path of joint 1 at 1 rad/s, joint 2 standing; its points left that far ahead."""
    path = PathTracking(tolerances)
    for index in range(int((seconds + ahead_ms / 1e3) * 100) + 1):
        path.commanded(index * 10 * MS, Row(index / 100, [index / 100, 0.0], [1.0, 0.0], [0.0] * 2))
    return path


def follow(path: PathTracking, milliseconds: int, behind: float = 0.0) -> None:
    """Report it on time, or so far behind [s], every 10 ms."""
    for at in range(0, milliseconds + 1, 10):
        place = max(at / 1e3 - behind, 0.0)
        assert path.deviation((place, 0.0), at * MS) is None, at


@pytest.mark.parametrize(
    ("reported", "fits"),
    [
        ((0.5, 0.0), True),
        ((0.5099, 0.0), True),
        ((0.512, 0.0), False),  # ahead of what is due, though it has left already
        ((0.59, 0.0), False),
        ((0.5, 0.0101), False),
        ((0.5, -0.0099), True),
        ((0.3, 0.0), True),  # 200 ms late
        ((0.28, 0.0), False),
    ],
)
def test_a_report_fits_what_was_due_in_the_time_that_it_may_be_late(
    reported: tuple[float, float], fits: bool
) -> None:
    path = line(FLAT)
    follow(path, 490)
    assert (path.deviation(reported, 500 * MS) is None) is fits


def test_between_two_samples_the_straight_way_counts() -> None:
    path = PathTracking(FLAT)
    for index in range(3):
        path.commanded(index * 100 * MS, Row(index / 10, [index / 10, index / 10], [1.0] * 2, []))
    assert path.deviation((0.05, 0.05), 90 * MS) is None
    assert path.deviation((0.05, 0.071), 90 * MS) is not None
    # Of the way to the next sample only that part is due which is.
    assert path.deviation((0.09, 0.09), 50 * MS) is not None


def test_between_two_samples_the_way_back_counts_as_the_way_there() -> None:
    path = PathTracking(FLAT)
    for index in range(3):
        place = 0.2 - index / 10
        path.commanded(index * 100 * MS, Row(index / 10, [place, place], [-1.0] * 2, []))
    assert path.deviation((0.15, 0.15), 90 * MS) is None
    assert path.deviation((0.11, 0.11), 50 * MS) is not None


def test_each_joint_may_lag_by_its_own_greatest_speed() -> None:
    path = line(LAGGING)
    follow(path, 490)
    found = known(path.deviation((0.5, 0.0111), 500 * MS))
    # The joint that stands has no more than tolerance and noise, however fast the other is.
    assert found.joint == 1
    assert found.limit == pytest.approx(0.011)
    assert path.deviation((0.585, 0.0), 500 * MS) is None
    found = known(path.deviation((0.595, 0.0), 500 * MS))
    assert (found.joint, found.speed) == (0, 1.0)
    assert found.limit == pytest.approx(0.091)


def test_a_joint_that_stands_by_now_may_still_lag_by_the_speed_that_it_had() -> None:
    path = PathTracking(LAGGING)
    for index in range(60):
        place = [index / 100, min(index, 40) / 100]
        speeds = [1.0, 1.0 if index < 40 else 0.0]
        path.commanded(index * 10 * MS, Row(index / 100, place, speeds, []))
    for at in range(41):
        assert path.deviation((at / 100, at / 100), at * 10 * MS) is None
    # 50 ms behind, 30 ms after it was to stand: its own lag explains that, no place on the path.
    assert path.deviation((0.43, 0.35), 430 * MS) is None
    assert path.deviation((0.44, 0.2), 440 * MS) is not None


def test_the_clock_of_a_controller_may_be_a_little_faster() -> None:
    path = line(FLAT, seconds=61.0)
    for at in range(0, 60_000, 100):  # faster by 4e-4
        assert path.deviation((at * 1.0004 / 1e3, 0.0), at * MS) is None, at
    assert path.deviation((60.0 * 1.0008, 0.0), 60_000 * MS) is not None


def test_one_that_falls_behind_on_its_path_is_on_it() -> None:
    path = line(FLAT, seconds=2.0)
    follow(path, 500)
    for at in range(510, 1_800, 10):  # it stands where it is
        assert path.deviation((0.5, 0.0), at * MS) is None
    for at in range(1_800, 2_100, 10):
        assert path.deviation((0.5 + (at - 1_800) / 1e3, 0.0), at * MS) is None
    assert path.deviation((0.5, 0.02), 2_100 * MS) is not None


def test_one_that_goes_back_on_its_path_leaves_it_once_no_late_report_explains_it() -> None:
    path = line(FLAT)
    follow(path, 500)
    gone = [
        at for at in range(510, 800, 10) if path.deviation((1.0 - at / 1e3, 0.0), at * MS) is None
    ]
    # Both go apart at 2 m/s: 0.2 s late explain 0.2 rad, and the tolerance 0.01 more.
    assert max(gone) == 600


def test_a_late_report_fits_and_so_does_the_one_after_it_that_is_not() -> None:
    path = line(FLAT)
    follow(path, 500)
    assert path.deviation((0.5, 0.0), 700 * MS) is None
    assert path.deviation((0.71, 0.0), 710 * MS) is None


def test_a_way_there_and_back_is_followed_though_its_places_come_twice() -> None:
    path = PathTracking(FLAT)
    places = [index / 100 if index <= 50 else 1.0 - index / 100 for index in range(101)]
    for index, place in enumerate(places):
        path.commanded(index * 10 * MS, Row(index / 100, [place, 0.0], [1.0, 0.0], []))
    # It set off 0.3 s late, so that what is due is on its way back where it is still going there.
    for at in range(300, 1_000, 10):
        assert path.deviation((places[(at - 300) // 10], 0.0), at * MS) is None, at
    assert path.deviation((0.52, 0.0), 1_000 * MS) is not None


def test_a_robot_that_has_come_to_the_end_of_what_left_in_time_is_owed_the_rest() -> None:
    path = line(FLAT, seconds=0.2, ahead_ms=0)
    follow(path, 200)
    assert path.deviation((0.25, 0.0), 250 * MS) is None
    path.commanded(250 * MS, Row(0.25, [0.2, 0.0], [0.0, 0.0], []))
    assert path.deviation((0.25, 0.0), 260 * MS) is not None


def test_before_the_first_set_point_left_any_report_fits() -> None:
    assert PathTracking(FLAT).deviation((3.0, 3.0), 0) is None


@pytest.mark.parametrize("joint", [0, 1])
def test_a_value_that_is_no_number_does_not_fit(joint: int) -> None:
    path = line(FLAT)
    reported = (float("nan"), 0.0) if joint == 0 else (0.0, float("nan"))
    assert path.deviation(reported, 0) is not None


def following(started: int = 0, count: int = 10, pace: JogPace | None = None) -> TrackingMonitor:
    """Return the progress on samples of 0.01 rad each, 10 ms apart."""
    made = TrackingMonitor(started) if pace is None else TrackingMonitor(started, pace)
    for index in range(count):
        made.sent(Row(0.01 * index, [0.01 * index], [1.0], [0.0]))
    return made


def report(position: float, at: int) -> Feedback:
    feedback = Feedback(1, ControllerLink())
    feedback.take(joint_report((position,), (0.0,)), at)
    return feedback


def seen(progress: TrackingMonitor, *reports: tuple[int, float]) -> TrackingMonitor:
    for at, place in reports:
        progress.update(report(place, at * MS))
    return progress


@pytest.mark.parametrize(
    ("position", "at", "base"),
    [
        (0.05, 150, 100),  # on time
        (0.05, 170, 120),  # 20 ms late
        (0.05, 130, 100),  # ahead, which it never is
        (0.0, 400, 400),  # it stands
        (0.02, 99, 100),  # from before it began
        (0.09, 900, 100),  # at the end of what was sent, whenever that was
    ],
)
def test_a_robot_began_when_its_place_says_and_lags_by_what_is_later_than_it_was_told_to(
    position: float, at: int, base: int
) -> None:
    progress = seen(following(100 * MS), (at, position))
    assert progress.base == base * MS
    assert progress.lag == pytest.approx((base - 100) / 1e3)


def test_a_robot_that_stands_falls_behind_as_time_goes_on() -> None:
    progress = following()
    assert [seen(progress, (at, 0.0)).lag for at in (50, 100, 400)] == [0.05, 0.1, 0.4]


def test_a_robot_that_catches_up_lags_no_more() -> None:
    progress = seen(following(), (60, 0.01))
    assert progress.lag == pytest.approx(0.05)
    assert seen(progress, (70, 0.07)).lag == 0


@pytest.mark.parametrize(
    ("reports", "bases"),
    [
        ([(99, 0.08), (150, 0.03)], [100, 120]),  # one from before the start moves nothing on
        ([(160, 0.06), (170, 0.02)], [100, 110]),  # none goes back: it stands at what it reached
        ([(190, 0.07), (600, 0.09)], [120, 120]),  # at the last sample the known time stays
    ],
    ids=["before the start", "never back", "at the last sample"],
)
def test_a_robot_goes_on_by_what_it_is_seen_to_have_reached(
    reports: list[tuple[int, float]], bases: list[int]
) -> None:
    progress = following(100 * MS)
    assert [seen(progress, each).base // MS for each in reports] == bases


def test_where_several_samples_fit_the_latest_counts() -> None:
    progress = TrackingMonitor(0)
    for index in range(10):
        progress.sent(Row(0.01 * index, [0.0], [0.0], [0.0]))
    progress.update(report(0.0, 90 * MS))
    assert progress.lag == 0


@pytest.mark.parametrize("seed", range(80))
def test_the_place_is_the_last_sample_nearly_as_near_as_the_nearest(seed: int) -> None:
    """Whatever the way: slow, fast, there and back, with one joint or with all."""
    chance = Random(seed)
    speeds = [chance.choice((0.0, 1e-4, 1e-3, 1e-2)) for _ in range(6)]
    if seed % 4 == 0:
        speeds = [speeds[0]] * 6
    rows, at = [], [0.0] * 6
    for index in range(20):
        rows.append(Row(0.01 * (index + 1), at, speeds, speeds))
        at = [
            place + chance.choice((-1.0, 1.0, 1.0)) * speed
            for place, speed in zip(at, speeds, strict=True)
        ]
    seen = tuple(place + chance.uniform(-1.0, 1.0) * 1e-3 for place in chance.choice(rows).position)
    progress = TrackingMonitor(0)
    for each in rows:
        progress.sent(each)
    feedback = Feedback(6, ControllerLink())
    feedback.position, feedback.received = seen, 1_000 * MS
    progress.update(feedback)
    gaps = [max(abs(a - b) for a, b in zip(each.position, seen, strict=True)) for each in rows]
    place = max(index for index, gap in enumerate(gaps) if gap <= min(gaps) + SAME_PLACE)
    # At the last sample nobody can see how far behind it is.
    behind = 0 if place == len(rows) - 1 else 1_000 * MS - round(rows[place].time * 1e9)
    assert progress.base == behind


def jogged(lag: float = 0.0, unseen: float = 1.0) -> TrackingMonitor:
    """Return the progress of a jog, 3 s of which were sent."""
    return following(0, 300, JogPace(lag, unseen))


def test_a_jogged_robot_that_stands_is_behind_by_as_long_as_it_stands() -> None:
    progress = seen(jogged(), *((at, 0.5) for at in range(500, 1_001, 10)))
    assert progress.lag == pytest.approx(0.5)


def test_one_that_stood_and_goes_on_is_forgiven_after_a_second() -> None:
    stood = [(at, max(at - 200, 500) / 1e3) for at in range(500, 1_701, 10)]
    progress = seen(jogged(), *stood[:-20])
    assert progress.lag == pytest.approx(0.2)
    assert seen(progress, *stood[-20:]).lag == 0
    assert progress.base == 200 * MS


@pytest.mark.parametrize(("pace", "behind"), [(0.9, 0.1), (0.5, 0.5), (0.4, 0.6)])
def test_a_slow_one_is_behind_by_what_it_loses_in_a_second(pace: float, behind: float) -> None:
    progress = seen(jogged(), *((at, at * pace / 1e3) for at in range(0, 2_001, 10)))
    assert progress.lag == pytest.approx(behind, abs=0.02)


def test_a_planned_motion_forgives_nothing() -> None:
    stood = [(at, max(at - 200, 500) / 1e3) for at in range(500, 2_501, 10)]
    assert seen(following(0, 300), *stood).lag == pytest.approx(0.2)


def test_a_new_press_after_a_rest_starts_with_no_lag() -> None:
    progress = seen(jogged(), *((at, 0.5) for at in range(500, 801, 10)))
    progress.go_on(3.0, 5_000 * MS)
    assert progress.lag == 0
    assert progress.time(5_000 * MS) == 3_000 * MS


@pytest.mark.parametrize(("behind", "expected"), [(0, 0), (50, 0), (80, 0), (130, 50)])
def test_a_jog_is_paced_by_a_controller_whose_robot_lags(behind: int, expected: int) -> None:
    progress = seen(jogged(lag=0.08), (500, (500 - behind) / 1e3))
    assert progress.clock == expected * MS


def test_the_clock_of_a_jog_stands_where_no_report_comes() -> None:
    progress = seen(jogged(unseen=0.05), (500, 0.5))
    times = [progress.time(at * MS) // MS for at in (500, 549, 550, 551, 700)]
    assert times == [500, 549, 550, 550, 550]


def test_that_of_a_planned_motion_runs_on() -> None:
    assert seen(following(), (50, 0.05)).time(700 * MS) == 700 * MS
