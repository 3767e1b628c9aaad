"""Arrivals: the rate of an address, and in which turn those within it are let in."""

from collections import Counter

import pytest
from hypothesis import given
from hypothesis import strategies as st
from promises.promise_table import figure

from openpendant.server.access import arrivals
from openpendant.server.access.arrivals import (
    MOST_WAITING,
    SPARE,
    AddressRates,
    FairQueue,
)
from openpendant.server.access.token_bucket import TokenBucket

MS = 1_000_000
SECOND = 1_000 * MS
START = 5 * SECOND
BURST = figure(54, "address_burst").count
INTERVAL = SECOND // figure(54, "address_rate").count


@given(st.lists(st.integers(0, 300 * MS), min_size=1, max_size=200))
def test_promise_54_no_window_has_more_of_an_address_than_its_burst_and_its_share(
    gaps: list[int],
) -> None:
    rates, now, within = AddressRates(), START, list[int]()
    for gap in gaps:
        now += gap
        if rates.is_within("192.0.2.7", now):
            within.append(now)
    for first, begin in enumerate(within):
        for last, end in enumerate(within[first:], first):
            assert last - first + 1 <= BURST + (end - begin) // INTERVAL


def test_promise_54_of_1000_a_second_an_address_has_10_and_another_notices_nothing() -> None:
    rates, within = AddressRates(), Counter[str]()
    for millisecond in range(10_000):
        now = START + millisecond * MS
        within["192.0.2.7"] += rates.is_within("192.0.2.7", now)
        if millisecond % 100 == 0:
            within["192.0.2.8"] += rates.is_within("192.0.2.8", now)
    assert within == {"192.0.2.7": BURST + 99, "192.0.2.8": 100}


def test_memory_for_addresses_is_bounded_and_who_came_last_is_remembered() -> None:
    rates = AddressRates(most_addresses=3)
    for _ in range(BURST):
        assert rates.is_within("10.0.0.0", START)
    for number in range(2):
        rates.is_within(f"10.0.1.{number}", START)
    assert not rates.is_within("10.0.0.0", START)
    rates.is_within("10.0.1.2", START)
    assert not rates.is_within("10.0.0.0", START)
    assert len(rates) == 3
    for number in range(3, 6):
        rates.is_within(f"10.0.1.{number}", START)
    assert len(rates) == 3
    assert rates.is_within("10.0.0.0", START)


def test_the_address_that_was_let_in_longest_ago_is_next() -> None:
    queue = FairQueue[str]()
    for number in range(3):
        queue.add("a", f"a{number}", START)
        queue.add("b", f"b{number}", START)
    taken = [queue.take(START + each * MS) for each in range(3)]
    queue.add("c", "c0", START + 3 * MS)
    taken += [queue.take(START + each * MS) for each in range(3, 7)]
    assert taken == ["a0", "b0", "a1", "c0", "b1", "a2", "b2"]
    assert len(queue) == 0


def test_ever_new_addresses_keep_one_that_waits_out_for_a_second_only() -> None:
    queue, now = FairQueue[str](), START
    queue.add("busy", "before", now)
    assert queue.take(now) == "before"
    queue.add("busy", "waits", now)
    waited = 0
    for number in range(200):
        queue.add(f"new {number}", "new", now)
        if queue.take(now) == "waits":
            break
        now += 20 * MS
        waited += 20 * MS
    assert waited == SECOND


def test_of_too_many_that_wait_the_address_with_most_loses_its_last() -> None:
    queue = FairQueue[str](most=4)
    for number in range(3):
        assert queue.add("192.0.2.7", f"many {number}", START) is None
    assert queue.add("192.0.2.8", "one", START) is None
    assert queue.add("192.0.2.9", "newcomer", START) == "many 2"
    assert queue.add("192.0.2.7", "once more", START) == "once more"
    assert [queue.take(START) for _ in range(4)] == ["many 0", "one", "newcomer", "many 1"]


def test_who_is_on_this_machine_waits_beside_the_others_and_loses_nothing() -> None:
    queue = FairQueue[str](most=2)
    for number in range(5):
        assert queue.add("127.0.0.1", f"own {number}", START) is None
    assert queue.add("192.0.2.7", "a", START) is None
    assert queue.add("192.0.2.7", "b", START) is None
    assert queue.add("192.0.2.7", "c", START) == "c"
    assert (queue.own, len(queue)) == (5, 7)
    assert len(queue.clear()) == 7
    assert (queue.own, len(queue)) == (0, 0)


@pytest.mark.parametrize(("period", "longest"), [(1_000, 0), (500, 40)])
@pytest.mark.parametrize("hosts", [1, 5])
def test_promise_54_a_newcomer_waits_for_nobody_beside_hosts_that_come_all_the_time(
    hosts: int, period: int, longest: int
) -> None:
    """The listener's order, on a clock: 1,000 connects a second of each host for 10 s [ms].

    A teacher and a stranger come in the same millisecond; within a second of their last time they
    wait for the rate of all, but for nobody else.
    """
    rates, rate, queue = (
        AddressRates(),
        TokenBucket(arrivals.PER_SECOND, arrivals.BURST),
        FairQueue[tuple[str, int]](),
    )
    waited = list[int]()
    let_in = Counter[str]()
    for millisecond in range(10_000):
        now = START + millisecond * MS
        for host in range(hosts):
            if rates.is_within(f"192.0.2.{host}", now):
                queue.add(f"192.0.2.{host}", ("host", now), now)
        if millisecond % period == 250:
            queue.add("198.51.100.1", ("teacher", now), now)
            queue.add("198.51.100.2", ("stranger", now), now)
        while len(queue) and not rate.take(now, queue.next_spare(now)):
            who, came = queue.take(now)
            let_in[who] += 1
            if who != "host":
                waited.append(now - came)
    assert len(waited) == 2 * 10_000 // period
    assert max(waited) <= longest * MS
    assert let_in.total() <= 20 + 500
    assert len(queue) <= MOST_WAITING


def test_promise_54_the_last_of_a_burst_are_left_to_addresses_that_come_seldom() -> None:
    rate = TokenBucket(arrivals.PER_SECOND, arrivals.BURST)
    taken = 0
    while not rate.take(START, SPARE):
        taken += 1
    assert taken == 20 - SPARE
    assert [rate.take(START) for _ in range(SPARE)] == [0] * SPARE
    assert rate.take(START) > 0
