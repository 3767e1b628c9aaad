"""The lock-out, with numbers for time (promise 29)."""

import pytest
from hypothesis import given
from hypothesis import strategies as st
from promises.promise_table import figure
from rigs.cells.expectations import expect

from openpendant.server.access.lockout import (
    FORGET_NS,
    LONGEST_LOCK_NS,
    MOST_ACCOUNTS,
    MOST_RECORDS,
    PAIR_FAILURES,
    SECOND_NS,
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
        lockout.failed(charge)
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


def test_many_names_lock_nobody_else_at_their_source(lockout: Lockout) -> None:
    assert {fail(lockout, START, name=f"name {n}") for n in range(1_000)} == {0}
    assert fail(lockout, START) == 0


def test_a_queue_that_is_longer_than_a_lock_lets_in_five_more_when_it_would_be_over(
    lockout: Lockout,
) -> None:
    charges = [lockout.attempt("192.0.2.1", "ann", START + n * SECOND_NS) for n in range(5)]
    over = START + 4 * SECOND_NS + MINUTE
    assert lockout.attempt("192.0.2.1", "ann", over - 1) == 1
    charges += [lockout.attempt("192.0.2.1", "ann", over) for _ in range(5)]
    assert lockout.attempt("192.0.2.1", "ann", over) == MINUTE
    for charge in charges:
        lockout.failed(expect(Charge, charge))
    # Both fives were wrong, and the second lock is twice as long.
    assert lockout.attempt("192.0.2.1", "ann", over) == 2 * MINUTE


def test_who_is_refused_is_told_how_long_if_all_that_wait_are_wrong(lockout: Lockout) -> None:
    charges = [lockout.attempt("192.0.2.1", "ann", START + n * SECOND_NS) for n in range(5)]
    told = lockout.attempt("192.0.2.1", "ann", START + 10 * SECOND_NS)
    assert told == MINUTE - 6 * SECOND_NS
    for charge in charges:
        lockout.failed(expect(Charge, charge))
    assert fail(lockout, START + 10 * SECOND_NS + told - 1) == 1
    assert fail(lockout, START + 10 * SECOND_NS + told) == 0


@pytest.mark.parametrize("settled", ["withdrawn", "succeeded"])
def test_an_attempt_that_did_not_fail_makes_room_for_another(
    lockout: Lockout, settled: str
) -> None:
    charges = [expect(Charge, lockout.attempt("192.0.2.1", "ann", START)) for _ in range(5)]
    assert fail(lockout, START) == MINUTE
    getattr(lockout, settled)(charges[0])
    assert fail(lockout, START) == 0


def test_a_charge_says_whether_an_attempt_there_has_failed_before(lockout: Lockout) -> None:
    def has_failed(address: str = "192.0.2.1", at: int = START) -> bool:
        charge = expect(Charge, lockout.attempt(address, "ann", at))
        lockout.withdrawn(charge)
        return charge.has_failed

    assert not has_failed()
    fail(lockout, START)
    assert has_failed(at=START + 10 * MINUTE)
    assert not has_failed("192.0.2.2")
    lockout.succeeded(expect(Charge, lockout.attempt("192.0.2.1", "ann", START + 10 * MINUTE)))
    assert not has_failed(at=START + 10 * MINUTE)


def test_what_was_never_checked_leaves_nothing_behind(lockout: Lockout) -> None:
    for n in range(1_000):
        lockout.withdrawn(expect(Charge, lockout.attempt("192.0.2.1", f"{n}", START)))
    assert len(lockout) == 0


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
    assert remembered(3_000, sources=1) == MOST_ACCOUNTS
    assert remembered(1_000, sources=1_000, most_records=900) == 900


@pytest.mark.soak
@pytest.mark.parametrize("names", [100_000, 1_000_000], ids="{} names".format)
def test_memory_is_bounded_for_as_many_names_as_sources(names: int) -> None:
    assert remembered(names, sources=names) == MOST_RECORDS


def test_names_tried_by_one_source_do_not_push_out_what_another_is_locked_for() -> None:
    lockout = Lockout()
    lock(lockout, START)
    for n in range(2 * MOST_RECORDS):
        fail(lockout, START + 1, address="192.0.2.2", name=f"name {n}")
    assert fail(lockout, START + 2) > 0


def test_names_tried_once_a_second_do_not_push_out_the_lock_of_the_same_source() -> None:
    lockout, now = Lockout(), START
    for _ in range(4):
        now += lock(lockout, now)
    locked_for = lock(lockout, now)
    assert locked_for == LONGEST_LOCK_NS
    for n in range(locked_for // SECOND_NS):
        fail(lockout, now + n * SECOND_NS, name=f"name {n}")
    assert fail(lockout, now + locked_for - 1) == 1


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
            lockout.failed(charge)
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
