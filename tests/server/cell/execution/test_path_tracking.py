"""Which piece of the commanded path a report is compared with (promise 52)."""

from __future__ import annotations

import pytest

from openpendant.motion.trajectory.trajectory import Row
from openpendant.server.cell.execution.tracking import PathTracking, TrackingTolerances

MS = 1_000_000
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
    found = path.deviation((0.5, 0.0111), 500 * MS)
    assert found is not None
    # The joint that stands has no more than tolerance and noise, however fast the other is.
    assert found.joint == 1
    assert found.limit == pytest.approx(0.011)
    assert path.deviation((0.585, 0.0), 500 * MS) is None
    found = path.deviation((0.595, 0.0), 500 * MS)
    assert found is not None
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
