from __future__ import annotations

from random import Random

import pytest

from openpendant.motion.trajectory.trajectory import Row
from openpendant.server.cell.execution.feedback import Feedback
from openpendant.server.cell.execution.tracking import SAME_PLACE, JogPace, TrackingMonitor
from openpendant.server.settings.cell_settings import ControllerLink
from openpendant.simplemsg import JointFeedback, ValidField, joint_array

MS = 1_000_000
SPEED = 1.0


def row(index: int) -> Row:
    return Row(0.01 * index, [0.01 * index * SPEED], [SPEED], [0.0])


def report(position: float, at: int) -> Feedback:
    feedback = Feedback(1, ControllerLink())
    none = joint_array(())
    fields = ValidField.POSITION | ValidField.VELOCITY
    feedback.take(JointFeedback(0, fields, 0.0, joint_array((position,)), none, none), at)
    return feedback


@pytest.fixture
def following() -> TrackingMonitor:
    started = TrackingMonitor(0)
    for index in range(10):
        started.sent(row(index))
    return started


def test_a_robot_on_time_has_no_lag(following: TrackingMonitor) -> None:
    following.update(report(0.05, 50 * MS))
    assert following.lag == 0


def test_a_robot_that_started_late_lags_by_its_delay(following: TrackingMonitor) -> None:
    following.update(report(0.03, 50 * MS))
    assert following.lag == pytest.approx(0.02)


def test_a_robot_that_stands_falls_behind_as_time_goes_on(following: TrackingMonitor) -> None:
    for at in (50, 100, 400):
        following.update(report(0.0, at * MS))
    assert following.lag == pytest.approx(0.4)


def test_a_robot_that_catches_up_lags_no_more(following: TrackingMonitor) -> None:
    following.update(report(0.01, 60 * MS))
    assert following.lag == pytest.approx(0.05)
    following.update(report(0.07, 70 * MS))
    assert following.lag == 0


def test_a_report_from_before_the_start_says_nothing() -> None:
    following = TrackingMonitor(100 * MS)
    following.sent(row(0))
    following.update(report(0.0, 90 * MS))
    assert following.lag == 0


def test_where_several_samples_fit_the_latest_counts() -> None:
    following = TrackingMonitor(0)
    for index in range(10):
        following.sent(Row(0.01 * index, [0.0], [0.0], [0.0]))
    following.update(report(0.0, 90 * MS))
    assert following.lag == 0


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
    following = TrackingMonitor(0)
    for each in rows:
        following.sent(each)
    feedback = Feedback(6, ControllerLink())
    feedback.position, feedback.received = seen, 1_000 * MS
    following.update(feedback)
    gaps = [max(abs(a - b) for a, b in zip(each.position, seen, strict=True)) for each in rows]
    place = max(index for index, gap in enumerate(gaps) if gap <= min(gaps) + SAME_PLACE)
    # At the last sample nobody can see how far behind it is.
    behind = 0 if place == len(rows) - 1 else 1_000 * MS - round(rows[place].time * 1e9)
    assert following.base == behind


def jogged(lag: float = 0.0, unseen: float = 1.0) -> TrackingMonitor:
    """Return the progress of a jog, 3 s of which were sent."""
    made = TrackingMonitor(0, JogPace(lag, unseen))
    for index in range(300):
        made.sent(row(index))
    return made


def seen(following: TrackingMonitor, *reports: tuple[int, float]) -> TrackingMonitor:
    for at, place in reports:
        following.update(report(place, at * MS))
    return following


def test_a_jogged_robot_that_stands_is_behind_by_as_long_as_it_stands() -> None:
    following = seen(jogged(), *((at, 0.5) for at in range(500, 1_001, 10)))
    assert following.lag == pytest.approx(0.5)


def test_one_that_stood_and_goes_on_is_forgiven_after_a_second() -> None:
    stood = [(at, max(at - 200, 500) / 1e3) for at in range(500, 1_701, 10)]
    following = seen(jogged(), *stood[:-20])
    assert following.lag == pytest.approx(0.2)
    assert seen(following, *stood[-20:]).lag == 0
    assert following.base == 200 * MS


@pytest.mark.parametrize(("pace", "behind"), [(0.9, 0.1), (0.5, 0.5), (0.4, 0.6)])
def test_a_slow_one_is_behind_by_what_it_loses_in_a_second(pace: float, behind: float) -> None:
    following = seen(jogged(), *((at, at * pace / 1e3) for at in range(0, 2_001, 10)))
    assert following.lag == pytest.approx(behind, abs=0.02)


def test_a_planned_motion_forgives_nothing() -> None:
    following = TrackingMonitor(0)
    for index in range(300):
        following.sent(row(index))
    stood = [(at, max(at - 200, 500) / 1e3) for at in range(500, 2_501, 10)]
    assert seen(following, *stood).lag == pytest.approx(0.2)


def test_a_new_press_after_a_rest_starts_with_no_lag() -> None:
    following = seen(jogged(), *((at, 0.5) for at in range(500, 801, 10)))
    following.go_on(3.0, 5_000 * MS)
    assert following.lag == 0
    assert following.time(5_000 * MS) == 3_000 * MS


@pytest.mark.parametrize(("behind", "expected"), [(0, 0), (50, 0), (80, 0), (130, 50)])
def test_a_jog_is_paced_by_a_controller_whose_robot_lags(behind: int, expected: int) -> None:
    following = seen(jogged(lag=0.08), (500, (500 - behind) / 1e3))
    assert following.clock == expected * MS


def test_the_clock_of_a_jog_stands_where_no_report_comes() -> None:
    following = seen(jogged(unseen=0.05), (500, 0.5))
    times = [following.time(at * MS) // MS for at in (500, 549, 550, 551, 700)]
    assert times == [500, 549, 550, 550, 550]


def test_that_of_a_planned_motion_runs_on(following: TrackingMonitor) -> None:
    following.update(report(0.05, 50 * MS))
    assert following.time(700 * MS) == 700 * MS
