"""The lock-out, with numbers for time (promise 29)."""

import pytest
from hypothesis import given
from hypothesis import strategies as st
from promises.promise_table import figure
from rigs.cells.expectations import expect

from openpendant.server.access.lockout import (
    FORGET_NS,
    LONGEST_LOCK_NS,
    MOST_RECORDS,
    PAIR_FAILURES,
    SECOND_NS,
    SOURCE_FAILURES,
    Charge,
    Lockout,
    source_of,
)

START = 1_000 * SECOND_NS
MINUTE = 60 * SECOND_NS


@pytest.fixture
def lockout() -> Lockout:
    return Lockout()


def fail(lockout: Lockout, now: int, address: str = "192.0.2.1", name: str = "ann") -> int:
    """Fail once; return 0, or how long the attempt is refused [ns]."""
    charge = lockout.attempt(address, name, now)
    if isinstance(charge, Charge):
        lockout.failed(charge, now)
        return 0
    return charge


def lock(lockout: Lockout, now: int) -> int:
    for _ in range(PAIR_FAILURES):
        assert fail(lockout, now) == 0
    return fail(lockout, now)


def test_promise_29_five_failures_within_a_minute_lock_for_a_minute(lockout: Lockout) -> None:
    failures, lock = figure(29, "failures").count, figure(29, "lock").ns
    within = (figure(29, "window").ns - SECOND_NS) // (failures - 1)
    assert [fail(lockout, START + n * within) for n in range(failures)] == [0] * failures
    last = START + (failures - 1) * within
    assert fail(lockout, last + SECOND_NS) == lock - SECOND_NS
    assert fail(lockout, last + lock - 1) == 1
    assert fail(lockout, last + lock) == 0


def test_failures_that_are_far_apart_lock_nobody(lockout: Lockout) -> None:
    assert {fail(lockout, START + n * MINUTE // 4) for n in range(100)} == {0}


def test_each_lock_doubles_the_next_up_to_15_minutes(lockout: Lockout) -> None:
    now, locks = START, []
    for _ in range(7):
        locks.append(lock(lockout, now))
        now += locks[-1]
    assert [lasts // MINUTE for lasts in locks] == [1, 2, 4, 8, 15, 15, 15]
    assert locks[-1] == LONGEST_LOCK_NS


def test_a_lock_is_forgotten_after_a_quiet_quarter_of_an_hour(lockout: Lockout) -> None:
    first = lock(lockout, START)
    later = START + first + FORGET_NS
    assert lock(lockout, later) == MINUTE
    assert lock(lockout, later + MINUTE + FORGET_NS - SECOND_NS) == 2 * MINUTE


def test_another_source_and_another_account_are_not_locked(lockout: Lockout) -> None:
    lock(lockout, START)
    assert fail(lockout, START, address="192.0.2.2") == 0
    assert fail(lockout, START, name="bob") == 0


def test_success_starts_the_pair_afresh(lockout: Lockout) -> None:
    for _ in range(4):
        fail(lockout, START)
    lockout.succeeded(expect(Charge, lockout.attempt("192.0.2.1", "ann", START)))
    assert [fail(lockout, START) for _ in range(5)] == [0] * 5


def test_attempts_sent_at_once_are_all_charged_before_the_first_has_failed(
    lockout: Lockout,
) -> None:
    outcomes = [lockout.attempt("192.0.2.1", "ann", START) for _ in range(100)]
    assert sum(isinstance(outcome, Charge) for outcome in outcomes) == PAIR_FAILURES


def test_one_source_that_tries_many_names_is_locked_itself(lockout: Lockout) -> None:
    refused = [fail(lockout, START, name=f"name {n}") for n in range(100)]
    assert refused[:SOURCE_FAILURES] == [0] * SOURCE_FAILURES
    assert set(refused[SOURCE_FAILURES:]) == {MINUTE}


def test_an_own_account_does_not_free_a_source_from_its_other_failures(lockout: Lockout) -> None:
    let_through = 0
    for n in range(100):
        let_through += fail(lockout, START, name=f"name {n}") == 0
        own = lockout.attempt("192.0.2.1", "own", START)
        if isinstance(own, Charge):
            lockout.succeeded(own)
    assert let_through == SOURCE_FAILURES


def test_ten_thousand_tries_at_one_account_reach_the_hash_a_few_hundred_times(
    lockout: Lockout,
) -> None:
    tried = [n for n in range(10_000) if fail(lockout, START + n * SECOND_NS) == 0]
    # Four locks of 1, 2, 4 and 8 min, then 15 min each: five tries between two locks.
    assert len(tried) <= 5 * (4 + (10_000 - 900) // 900 + 1)
    for first, sixth in zip(tried, tried[5:], strict=False):
        assert sixth - first >= 60


def remembered(names: int, sources: int, most_records: int = MOST_RECORDS) -> int:
    lockout = Lockout(most_records)
    for n in range(names):
        network = n % sources
        lockout.attempt(f"2001:db8:{network >> 16:x}:{network & 0xFFFF:x}::1", f"{n}", START + n)
    return len(lockout)


def test_memory_is_bounded_whatever_names_are_tried() -> None:
    assert remembered(1_000, sources=1) == SOURCE_FAILURES + 1
    assert remembered(1_000, sources=1_000, most_records=900) == 900


@pytest.mark.soak
def test_memory_is_bounded_for_a_million_names() -> None:
    assert remembered(1_000_000, sources=1_000_000) == MOST_RECORDS


def test_names_tried_by_one_source_do_not_push_out_its_lock() -> None:
    lockout = Lockout(most_records=100)
    lock(lockout, START)
    for n in range(10_000):
        fail(lockout, START + 1, name=f"name {n}")
    assert fail(lockout, START + 2) > 0


@given(
    st.lists(
        st.tuples(st.integers(0, 30 * SECOND_NS), st.sampled_from("ab"), st.booleans()),
        max_size=200,
    )
)
def test_never_more_than_five_failures_in_a_minute(steps: list[tuple[int, str, bool]]) -> None:
    lockout, now = Lockout(), START
    failures: dict[str, list[int]] = {"a": [], "b": []}
    for pause, name, is_right in steps:
        now += pause
        charge = lockout.attempt("192.0.2.1", name, now)
        if not isinstance(charge, Charge):
            continue
        if is_right:
            lockout.succeeded(charge)
            failures[name].clear()
        else:
            lockout.failed(charge, now)
            failures[name].append(now)
            assert sum(now - at < MINUTE for at in failures[name]) <= PAIR_FAILURES


@pytest.mark.parametrize(
    ("address", "source"),
    [
        ("192.0.2.1", "192.0.2.1"),
        ("::ffff:192.0.2.1", "192.0.2.1"),
        ("2001:db8:1:2:3:4:5:6", "2001:db8:1:2::/64"),
        ("fe80::1%eth0", "fe80::/64"),
        ("::1", "::1"),
        ("a name", "a name"),
    ],
)
def test_an_ipv6_network_is_one_source(address: str, source: str) -> None:
    assert source_of(address) == source
