"""When a silent server is stopped for, as pure rules (promise 26)."""

import math

import pytest
from promises.promise_table import figure

from openpendant.server.core.cell_core import LoopMonitor, late_refusal
from openpendant.server.watchdog.watchdog_protocol import AnswerWatch, BeatWatch
from openpendant.simplemsg.verdicts import VerdictCode as V

MS = 1_000_000
DEADLINE, EMULATED = figure(26, "stop").ns, figure(26, "emulated").ns
FIRST, THIRD = 0b001, 0b100


@pytest.fixture
def beats() -> BeatWatch:
    return BeatWatch(DEADLINE, EMULATED, 0)


def test_promise_26_a_silence_of_100_ms_stops_what_may_move(beats: BeatWatch) -> None:
    beats.beat(FIRST | THIRD, 0, 0)
    assert beats.overdue(DEADLINE - 1) == 0
    assert beats.overdue(DEADLINE) == FIRST | THIRD


def test_a_silence_is_stopped_for_once(beats: BeatWatch) -> None:
    beats.beat(FIRST, 0, 0)
    beats.overdue(DEADLINE)
    assert beats.overdue(2 * DEADLINE) == 0
    assert beats.lost() == 0


def test_nothing_is_stopped_where_nothing_may_move(beats: BeatWatch) -> None:
    assert beats.overdue(10 * DEADLINE) == 0
    beats.beat(FIRST, 0, 11 * DEADLINE)
    beats.beat(0, 0, 11 * DEADLINE)
    assert beats.overdue(20 * DEADLINE) == 0
    assert beats.lost() == 0


def test_the_server_that_comes_back_is_told_of_and_watched_again(beats: BeatWatch) -> None:
    beats.beat(FIRST, 0, 0)
    beats.overdue(DEADLINE)
    assert beats.beat(FIRST, 0, 3 * DEADLINE) == 3 * DEADLINE
    assert beats.beat(FIRST, 0, 3 * DEADLINE + MS) is None
    assert beats.overdue(4 * DEADLINE + MS) == FIRST


def test_news_of_what_moves_is_no_beat(beats: BeatWatch) -> None:
    beats.beat(FIRST, 0, 0)
    beats.update(FIRST | THIRD, 0)
    assert beats.overdue(DEADLINE - 1) == 0
    assert beats.overdue(DEADLINE) == FIRST | THIRD
    beats.update(FIRST, 0)
    assert beats.overdue(2 * DEADLINE) == 0


# A deadline of each cell's own.


def test_promise_26_a_controller_that_says_it_is_emulated_is_given_400_ms(beats: BeatWatch) -> None:
    beats.beat(FIRST | THIRD, THIRD, 0)
    assert beats.overdue(DEADLINE) == FIRST
    assert beats.overdue(EMULATED - 1) == 0
    assert beats.overdue(EMULATED) == THIRD
    assert beats.overdue(2 * EMULATED) == 0
    assert beats.beat(FIRST | THIRD, THIRD, 2 * EMULATED) == 2 * EMULATED


def test_promise_26_one_that_says_so_no_more_is_a_real_one_at_once(beats: BeatWatch) -> None:
    beats.beat(FIRST | THIRD, FIRST | THIRD, 0)
    assert beats.overdue(2 * DEADLINE) == 0
    beats.update(FIRST | THIRD, FIRST)
    assert beats.overdue(2 * DEADLINE) == THIRD


def test_a_server_that_is_gone_is_stopped_for_at_once_whatever_is_emulated(
    beats: BeatWatch,
) -> None:
    beats.beat(FIRST | THIRD, THIRD, 0)
    assert beats.overdue(DEADLINE) == FIRST
    assert beats.lost() == THIRD


def test_the_watchdog_sleeps_to_the_deadline_that_comes_first(beats: BeatWatch) -> None:
    assert beats.remaining(0) is None
    beats.beat(THIRD, THIRD, 0)
    assert beats.remaining(0) == pytest.approx(0.4)
    beats.beat(FIRST | THIRD, THIRD, 0)
    assert beats.remaining(0) == pytest.approx(0.1)
    assert beats.remaining(2 * DEADLINE) == 0.0
    beats.overdue(DEADLINE)
    assert beats.remaining(DEADLINE) == pytest.approx(0.3)
    beats.overdue(EMULATED)
    assert beats.remaining(EMULATED) is None


# The server's look at its watchdog.


@pytest.fixture
def answers() -> AnswerWatch:
    """The watch of a process that answered at 0."""
    watch = AnswerWatch(10 * MS)
    watch.begin(0)
    assert not watch.tick(0, has_reported=True)
    return watch


def test_a_watchdog_that_says_nothing_for_half_a_second_is_found_out(answers: AnswerWatch) -> None:
    late = [answers.tick(at * 10 * MS, has_reported=False) for at in range(1, 51)]
    assert late == [False] * 49 + [True]


def test_a_watchdog_that_answers_now_and_then_is_left_alone(answers: AnswerWatch) -> None:
    assert not any(answers.tick(at * 10 * MS, has_reported=at % 40 == 0) for at in range(1, 500))


def test_a_frozen_loop_does_not_blame_its_watchdog(answers: AnswerWatch) -> None:
    assert not answers.tick(60_000 * MS, has_reported=False)
    assert not answers.tick(60_010 * MS, has_reported=True)


def test_a_watchdog_that_starts_is_given_three_seconds() -> None:
    answers = AnswerWatch(10 * MS)
    answers.begin(0)
    late = [answers.tick(at * 10 * MS, has_reported=False) for at in range(1, 301)]
    assert late == [False] * 299 + [True]


# The server's own look.


def test_a_late_tick_is_found_once_by_whatever_event_comes_first() -> None:
    ticks = LoopMonitor(DEADLINE, EMULATED)
    assert ticks.late_from == math.inf
    ticks.tick(0, says_emulated=False)
    assert ticks.late_from == DEADLINE
    assert ticks.lateness(3 * DEADLINE) == 3 * DEADLINE
    assert ticks.late_from == 4 * DEADLINE


def test_the_refusal_says_for_how_long() -> None:
    refusal = late_refusal(312 * MS)
    assert refusal.code is V.SERVER_LATE
    assert "312 ms" in refusal.text
