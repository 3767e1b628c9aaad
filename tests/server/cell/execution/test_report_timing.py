"""How much time lies between two reports, whenever they arrived (promise 52)."""

from __future__ import annotations

from random import Random

import pytest

from openpendant.server.cell.execution.motion_watch import ReportTiming

MS = 1_000_000


def taken(*arrivals_ms: float, period: float = 0.01) -> ReportTiming:
    timing = ReportTiming(period)
    for number, at in enumerate(arrivals_ms):
        timing.take((float(number),), round(at * MS))
    return timing


def test_regular_reports_are_compared_over_50_and_250_ms() -> None:
    timing = taken(*range(0, 1_001, 10))
    assert timing.joint_base is not None
    assert timing.point_base is not None
    assert timing.joint_base.time == 950 * MS
    assert timing.point_base.time == 750 * MS
    assert timing.elapsed(timing.joint_base) == 0.05
    assert timing.is_sure


def test_slow_reports_are_compared_with_the_one_before() -> None:
    timing = taken(0, 200, 400, period=0.2)
    assert timing.joint_base is not None
    assert timing.joint_base.time == 200 * MS


def test_reports_of_one_turn_count_as_the_newest_of_them() -> None:
    timing = taken(0, 10, 20, 20, 20, 70)
    assert timing.joint_base is not None
    assert timing.joint_base.position == (4.0,)


def test_bunched_reports_are_as_far_apart_as_they_were_measured() -> None:
    # Ten reports wait on their way, and then come 1 ms after each other.
    timing = taken(*range(0, 501, 10), *range(520, 580))
    assert timing.joint_base is not None
    assert timing.newest is not None
    apart = timing.newest.number - timing.joint_base.number
    assert apart == 50
    assert timing.elapsed(timing.joint_base) == 0.5


def test_the_first_report_after_a_silence_is_neither_judged_nor_compared_with() -> None:
    assert not taken(*range(0, 101, 10), 126).is_sure
    timing = taken(*range(0, 101, 10), 126, 136, 146, 156, 166, 176)
    assert timing.is_sure
    assert timing.joint_base is not None
    assert timing.joint_base.time == 100 * MS


def test_a_motion_compares_with_nothing_from_before_it() -> None:
    timing = taken(*range(0, 1_001, 10))
    timing.begin()
    assert [timing.joint_base, timing.point_base] == [None, None]
    for at in range(1_010, 1_051, 10):
        timing.take((0.0,), at * MS)
    assert timing.joint_base is not None
    assert timing.joint_base.time == 1_000 * MS
    assert timing.point_base is None


def test_a_pause_tells_nothing_of_the_rhythm() -> None:
    timing = taken(*range(0, 1_001, 10), *range(3_000, 3_501, 10))
    assert timing.joint_base is not None
    assert timing.elapsed(timing.joint_base) == 0.05


def test_slow_reports_are_as_far_apart_as_they_arrived_before_their_rhythm_is_known() -> None:
    timing = taken(*range(0, 501, 20))
    assert timing.joint_base is not None
    assert timing.elapsed(timing.joint_base) == 0.06


def test_the_rhythm_is_learned_where_it_is_not_the_declared_one() -> None:
    timing = taken(*range(0, 6_000, 4))
    assert timing.joint_base is not None
    assert timing.elapsed(timing.joint_base) == pytest.approx(0.052)


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


def test_a_lost_connection_forgets_all_of_it() -> None:
    timing = taken(*range(0, 1_001, 10))
    timing.clear()
    timing.take((0.0,), 0)
    assert timing.joint_base is None
