from collections import Counter

import pytest
from hypothesis import given
from hypothesis import strategies as st
from promises.promise_table import figure

from openpendant.server.kinematics.question_rates import QuestionRates
from openpendant.simplemsg.verdicts import VerdictCode as V

MS = 1_000_000
SECOND = 1_000 * MS
START = 5 * SECOND
RATE, BURST = figure(40, "rate").count, figure(40, "burst").count
OF_SERVER = figure(40, "server_rate").count
OWED = 1
"""By a question that counts as a whole burst, and came a moment early."""


@given(st.lists(st.tuples(st.integers(0, 300 * MS), st.sampled_from([1, 2, 5])), max_size=100))
def test_promise_40_no_window_has_more_of_a_connection_than_its_burst_and_its_share(
    asked: list[tuple[int, int]],
) -> None:
    rates, now, taken = QuestionRates(), START, list[tuple[int, int]]()
    for gap, weight in asked:
        now += gap
        if rates.take(7, weight, now) is None:
            taken.append((now, weight))
    for first, (begin, _) in enumerate(taken):
        total = 0
        for end, weight in taken[first:]:
            total += weight
            assert total <= BURST + OWED + (end - begin) * RATE // SECOND


@pytest.mark.parametrize("weight", [1, 2, 5])
def test_who_waits_as_long_as_the_refusal_says_is_answered_and_not_sooner(weight: int) -> None:
    rates = QuestionRates()
    for _ in range(BURST // weight):
        assert rates.take(7, weight, START) is None
    refused = rates.take(7, weight, START)
    assert refused is not None
    assert (refused.code, refused.limit) == (V.TOO_OFTEN, RATE)
    wait = round(refused.value * SECOND)
    assert 0 < wait <= weight * SECOND // RATE
    sooner = rates.take(7, weight, START + wait - 1)
    assert sooner is not None
    assert round(sooner.value * SECOND) == 1
    assert rates.take(7, weight, START + wait) is None


@given(st.lists(st.integers(-45, 45), min_size=2, max_size=60))
def test_an_arm_with_a_self_motion_is_asked_twice_a_second_though_no_clock_is_even(
    jitter: list[int],
) -> None:
    rates = QuestionRates()
    per_second = figure(40, "redundant_rate").count
    for number, off in enumerate(jitter):
        due = START + number * SECOND // per_second + off * MS
        assert rates.take(7, 5, due) is None


def test_a_refused_question_counts_nothing() -> None:
    rates = QuestionRates()
    for _ in range(1_000):
        rates.take(7, 1, START)
    assert rates.take(7, 1, START + SECOND // RATE) is None


def test_a_connection_that_asks_too_often_costs_another_nothing() -> None:
    rates = QuestionRates()
    for _ in range(1_000):
        rates.take(7, 1, START)
    assert [rates.take(8, 1, START) for _ in range(BURST)] == [None] * BURST


def test_promise_40_all_together_have_400_a_second() -> None:
    rates, taken = QuestionRates(), Counter[str]()
    for millisecond in range(0, 10_000, 10):
        for session in range(100):
            refused = rates.take(session, 1, START + millisecond * MS)
            taken["taken" if refused is None else f"of {refused.limit:g}"] += 1
    assert 0 <= taken["taken"] - 10 * OF_SERVER <= 200
    assert taken[f"of {OF_SERVER}"] > 0


def test_a_question_that_the_server_refuses_counts_nothing_of_its_connection() -> None:
    rates = QuestionRates()
    sessions = iter(range(1_000))
    while rates.take(session := next(sessions), 5, START) is None:
        pass
    soon = START + 50 * MS  # the server has some again, a connection that was counted has not
    assert rates.take(session, 5, soon) is None


def test_a_connection_that_ended_is_forgotten() -> None:
    rates = QuestionRates()
    for _ in range(BURST):
        rates.take(7, 1, START)
    rates.forget(7)
    rates.forget(8)
    assert rates.take(7, 1, START) is None
