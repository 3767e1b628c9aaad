"""Whose password is checked next (promise 29), exact on a clock of our own."""

from itertools import count, pairwise

import pytest
from promises.promise_table import figure
from rigs.cells.admission_desk import BOOK, LAN, SECOND, START, Desk, account
from rigs.cells.expectations import expect, refusal_from
from rigs.cells.login_line import CHECK, LoginLine

from openpendant.server.access.accounts import AccountBook
from openpendant.server.access.lockout import MOST_RECORDS
from openpendant.server.access.login_queue import (
    FRESH_IN_A_ROW,
    MOST_WAITING,
    SLOW_NS,
    SLOWED_FROM,
    LoginQueue,
    QueuedCheck,
)
from openpendant.simplemsg.pendant.roles import Role
from openpendant.simplemsg.verdicts import VerdictCode as V

ELSEWHERE = "198.51.100.7"
MINUTE = 60 * SECOND


class Numbered:
    """A queue whose places are numbered as they come."""

    def __init__(self, most_waiting: int = MOST_WAITING) -> None:
        self.queue = LoginQueue(most_waiting)
        self.numbers = count(1)

    def put(self, source: str, account: str, *, has_failed: bool = False) -> QueuedCheck | None:
        return self.queue.put(QueuedCheck(next(self.numbers), source, account, has_failed))

    def check(self, now: int = START, *, is_right: bool | None = False) -> str:
        """Check the next one; return whose it was, as ADDRESS/ACCOUNT."""
        place = expect(QueuedCheck, self.queue.take(now))
        self.queue.settle(is_right, now)
        return f"{place.source}/{place.account}"

    def checked(self, times: int, *, is_right: bool | None = True) -> list[str]:
        return [self.check(is_right=is_right) for _ in range(times)]


@pytest.fixture
def line() -> Numbered:
    return Numbered()


# Turns.


def test_addresses_take_turns_and_within_one_its_accounts(line: Numbered) -> None:
    for source, name in ("A1", "A1", "A2", "A3", "B1", "B1", "C1"):
        line.put(source, name)
    assert line.checked(7) == ["A/1", "B/1", "C/1", "A/2", "B/1", "A/3", "A/1"]
    assert line.queue.take(START) is None


def test_one_check_is_under_way_at_a_time(line: Numbered) -> None:
    line.put("A", "1")
    line.put("B", "1")
    line.queue.take(START)
    with pytest.raises(AssertionError, match="one check at a time"):
        line.queue.take(START)


def test_who_comes_while_another_is_checked_is_next(line: Numbered) -> None:
    for name in range(30):
        line.put("A", f"{name}")
    first = expect(QueuedCheck, line.queue.take(START))
    line.put("B", "admin")
    line.queue.settle(False, START)
    assert first.source == "A"
    assert line.check() == "B/admin"


def test_accounts_without_a_failure_there_go_first(line: Numbered) -> None:
    line.put("A", "failed", has_failed=True)
    for name in ("new", "newer"):
        line.put("A", name)
    assert line.checked(3) == ["A/new", "A/newer", "A/failed"]


def test_an_account_whose_first_guess_was_wrong_waits_behind_those_without(line: Numbered) -> None:
    for _ in range(3):
        line.put("A", "guessed")
    assert line.check(is_right=False) == "A/guessed"
    for name in ("pupil", "other"):
        line.put("A", name)
    assert line.checked(4) == ["A/pupil", "A/other", "A/guessed", "A/guessed"]


def test_a_right_password_makes_an_account_fresh_again(line: Numbered) -> None:
    for _ in range(2):
        line.put("A", "ann", has_failed=True)
    line.put("A", "guessed", has_failed=True)
    assert line.check(is_right=True) == "A/ann"
    assert line.check(is_right=True) == "A/ann"


def test_new_names_without_end_do_not_keep_out_who_mistyped_once(line: Numbered) -> None:
    line.put("A", "mistyped", has_failed=True)
    checked = []
    for name in range(FRESH_IN_A_ROW + 2):
        line.put("A", f"{name}")
        line.put("A", f"{name} more")
        checked.append(line.check(is_right=True))
    assert checked.index("A/mistyped") == FRESH_IN_A_ROW


def test_whoever_gives_an_account_a_password_has_his_turn_as_an_address_has(line: Numbered) -> None:
    for name in range(30):
        line.put("A", f"{name}")
        line.put("B", f"{name}")
    line.put("new passwords", "ann")
    assert line.checked(3)[2] == "new passwords/ann"


# An address that guesses.


def fail(line: Numbered, times: int, now: int = START, source: str = "A") -> None:
    for n in range(times):
        line.put(source, f"name {n}")
        line.check(now)


def test_sixty_failures_in_a_minute_put_an_address_behind_all_others(line: Numbered) -> None:
    fail(line, figure(29, "slowed").count - 1)
    line.put("A", "pupil")
    line.put("B", "1")
    line.put("B", "2")
    assert line.check(is_right=False) == "A/pupil"
    line.put("A", "another pupil")
    assert [line.check(START + SLOW_NS) for _ in range(3)] == ["B/1", "B/2", "A/another pupil"]


def test_it_is_checked_once_a_second_and_never_locked(line: Numbered) -> None:
    fail(line, SLOWED_FROM)
    for name in range(100):
        line.put("A", f"pupil {name}")
    now, began = START, list[int]()
    while len(line.queue):
        found = line.queue.take(now)
        if isinstance(found, int):
            now += found
            continue
        began.append(now)
        now += CHECK
        line.queue.settle(True, now)
        if len(began) == 50:
            break
    assert {later - earlier for earlier, later in pairwise(began)} == {SLOW_NS}


def test_a_minute_without_so_many_failures_ends_it(line: Numbered) -> None:
    fail(line, SLOWED_FROM)
    line.put("A", "pupil")
    assert line.queue.take(START + SLOW_NS - 1) == 1
    assert line.check(START + MINUTE) == "A/pupil"
    for source in "AB":
        line.put(source, "pupil")
    assert line.check(START + MINUTE) == "A/pupil"


def test_as_many_failures_in_more_than_a_minute_make_nobody_slow(line: Numbered) -> None:
    for n in range(2 * SLOWED_FROM):
        for source in "AB":
            line.put(source, f"{n}")
        now = START + n * MINUTE // (SLOWED_FROM - 1)
        assert line.check(now, is_right=False) == f"A/{n}"
        assert line.check(now, is_right=True) == f"B/{n}"


@pytest.mark.parametrize("is_right", [True, None])
def test_only_wrong_passwords_make_an_address_slow(line: Numbered, is_right: bool | None) -> None:
    for n in range(2 * SLOWED_FROM):
        line.put("A", f"{n}")
        line.check(is_right=is_right)
    line.put("A", "pupil")
    assert line.check() == "A/pupil"


def test_of_two_slow_addresses_each_has_its_second(line: Numbered) -> None:
    for source in "AB":
        fail(line, SLOWED_FROM, source=source)
    for name in range(2):
        line.put("A", f"{name}")
        line.put("B", f"{name}")
    now = START + SLOW_NS
    assert [line.check(now), line.check(now)] == ["A/0", "B/0"]
    assert line.queue.take(now) == SLOW_NS


def test_that_an_address_became_slow_is_told_once(line: Numbered) -> None:
    told = []
    for n in range(2 * SLOWED_FROM):
        line.put("A", f"{n}")
        now = START + n * SLOW_NS // 2
        while isinstance(line.queue.take(now), int):
            now += SLOW_NS
        told.append(line.queue.settle(False, now))
    assert told.index(True) == SLOWED_FROM - 1
    assert told.count(True) == 1


def test_addresses_are_forgotten_a_minute_after_their_last_wrong_password(line: Numbered) -> None:
    for n in range(1_000):
        line.put(f"A{n}", "name")
        line.check(START + n * SECOND)
        assert line.queue.remembered() <= 60


# Room.


def test_an_address_that_fills_the_queue_loses_its_own_last_place_to_another() -> None:
    line = Numbered(most_waiting=10)
    for name in range(10):
        assert line.put("A", f"{name}") is None
    away = expect(QueuedCheck, line.put("B", "ann"))
    assert (away.source, away.account) == ("A", "9")
    assert len(line.queue) == 10
    assert line.checked(2) == ["A/0", "B/ann"]


def test_within_an_address_the_account_with_the_most_loses_its_last() -> None:
    line = Numbered(most_waiting=6)
    for name in ("1", "2", "guessed", "guessed", "guessed", "3"):
        assert line.put("A", name) is None
    away = expect(QueuedCheck, line.put("A", "pupil"))
    assert (away.number, away.account) == (5, "guessed")


def test_who_already_has_the_most_finds_no_room_himself() -> None:
    line = Numbered(most_waiting=6)
    for source in "AAABBC":
        assert line.put(source, source) is None
    away = expect(QueuedCheck, line.put("A", "A"))
    assert away.number == 7


def test_whoever_waits_alone_at_an_address_is_never_turned_away() -> None:
    line = Numbered(most_waiting=32)
    for other in range(20):
        line.put(f"B{other}", "pupil")
    turned_away = [line.put("A", f"{n}") for n in range(1_000)]
    assert {place.source for place in turned_away if place is not None} == {"A"}
    assert len(line.queue) == 32


def test_what_is_withdrawn_waits_no_more_and_what_is_under_way_does(line: Numbered) -> None:
    line.put("A", "1")
    line.put("A", "2")
    under_way = expect(QueuedCheck, line.queue.take(START))
    assert not line.queue.withdraw(under_way.number)
    assert line.queue.withdraw(2)
    assert not line.queue.withdraw(2)
    line.queue.settle(False, START)
    assert line.queue.take(START) is None


def test_a_place_shows_no_name(line: Numbered) -> None:
    assert "canary" not in repr(QueuedCheck(1, "A", "canary"))


# With the desk before it.


PUPILS = [f"pupil{n}" for n in range(30)]
CLASS = AccountBook([*BOOK, *(account(name, Role.OPERATOR) for name in PUPILS)])


@pytest.fixture
def door() -> LoginLine:
    return LoginLine(Desk(CLASS))


@pytest.mark.parametrize("ahead", [0.0, 3.0, 7.0, 30.0, 120.0], ids="{} s ahead".format)
def test_promise_29_a_class_logs_in_beside_who_guesses_behind_its_own_address(
    door: LoginLine, ahead: float
) -> None:
    """He takes five connections a second, before the class and beside it; every fifth guesses at a
    pupil's name, the others at thirty of his own."""
    names = [f"his own {n}" for n in range(30)]
    every, mine, begin = SECOND // 5, count(), round(ahead * SECOND)
    for n in range((begin + 4 * MINUTE) // every):
        # Before the class comes he has locked the one pupil out.
        is_aimed = n % 5 == 0 or n < 5
        name = PUPILS[0] if is_aimed else names[next(mine) % 30]
        door.come(LAN, name, "not it", n * every)
    door.run(START + begin)
    before = len(door.checked)
    sessions = [door.come(LAN, name, after=1) for name in PUPILS]
    door.run(door.now + MINUTE)
    first, *others = (door.answers[session] for session in sessions)
    assert all(answer.is_in for answer in others)
    assert len(others) == figure(29, "pupils").count
    assert max(answer.checks for answer in others) - before <= figure(29, "checks").count
    if ahead:
        assert refusal_from(first.outcome).code is V.LOCKED_OUT


def test_promise_29_a_class_waits_for_no_more_than_one_guess_at_each_name_and_five_at_a_pupils(
    door: LoginLine,
) -> None:
    """All of them wait already when the class comes, and ten more at each of his own names."""
    for name in [*(f"his own {n}" for n in range(30)), *[PUPILS[0]] * 5]:
        door.come(LAN, name, "not it")
    for n in range(300):
        door.come(LAN, f"his own {n % 30}", "not it")
    door.run(door.now)
    sessions = [door.come(LAN, name) for name in PUPILS]
    door.run(door.now + MINUTE)
    first, *others = (door.answers[session] for session in sessions)
    assert refusal_from(first.outcome).code is V.LOCKED_OUT
    assert all(answer.is_in for answer in others)
    # Each account once, and after each eleven one that has failed.
    assert max(answer.checks for answer in others) == 60 + 5
    assert figure(29, "checks").count == 60 + 5


def test_promise_29_the_pupil_who_was_guessed_at_is_told_how_long_and_gets_in(
    door: LoginLine,
) -> None:
    every = SECOND // 5
    for n in range(3 * MINUTE // every):
        door.come(LAN, PUPILS[0] if n % 5 == 0 or n < 5 else f"his own {n % 30}", "no", n * every)
    door.run(START + 2 * SECOND)
    refused = door.come(LAN, PUPILS[0])
    door.run(door.now)
    refusal = refusal_from(door.answers[refused].outcome)
    assert refusal.code is V.LOCKED_OUT
    assert 0 < refusal.value <= figure(29, "lock").seconds
    again = door.come(LAN, PUPILS[0], after=round(refusal.value * SECOND))
    door.run(door.now + 2 * MINUTE)
    assert door.answers[again].is_in
    assert door.answers[again].at - START <= figure(29, "lock").ns + 30 * SECOND


def test_promise_29_thirty_wrong_logins_of_another_host_let_an_admin_in_next(
    door: LoginLine,
) -> None:
    for n in range(30):
        door.come(ELSEWHERE, f"name {n}", "not it")
    door.run(START + 10 * CHECK + CHECK // 3)
    ann = door.come(LAN, "ann")
    door.run(door.now + MINUTE)
    assert door.answers[ann].is_in
    # The eleventh is under way, and Ann's is the twelfth.
    assert door.answers[ann].checks == 12
    assert door.answers[ann].at == START + 12 * CHECK


def test_an_unknown_name_takes_the_same_way_and_time(door: LoginLine) -> None:
    def fate(name: str) -> list[tuple[object, int, int]]:
        line = LoginLine(Desk(CLASS))
        sessions = [line.come(LAN, name, "not it", n * SECOND // 8) for n in range(8)]
        for n in range(12):
            line.come(LAN, PUPILS[n], after=n * SECOND // 8)
        line.run(START + MINUTE)
        found = (line.answers[session] for session in sessions)
        return [(answer.outcome, answer.at, answer.checks) for answer in found]

    assert fate("ann") == fate("nobody") == fate("gone")


INVISIBLE = ["ann\u200b", "a\u200dnn", "ann\ufeff", "ann\u00ad", "\u2060ann", "ann\ufe0f"]
SAME = ["Ann", "ANN", "ａｎｎ"]


@pytest.mark.parametrize("spelling", SAME)
def test_spellings_that_find_an_account_are_one_account_in_the_count(
    door: LoginLine, spelling: str
) -> None:
    for n in range(5):
        door.come(LAN, spelling if n % 2 else "ann", "not it")
    door.run(START + MINUTE // 2)
    refused = [door.come(LAN, name, "ann's password") for name in ("ann", spelling)]
    door.run(door.now)
    assert {refusal_from(door.answers[each].outcome).code for each in refused} == {V.LOCKED_OUT}


@pytest.mark.parametrize("spelling", INVISIBLE)
def test_names_that_differ_by_invisible_characters_open_no_other_way_to_an_account(
    door: LoginLine, spelling: str
) -> None:
    guess = door.come(LAN, spelling, "ann's password")
    for name in INVISIBLE:
        door.come(LAN, name, "not it")
    mine = door.come(LAN, "ann")
    door.run(START + MINUTE // 2)
    assert refusal_from(door.answers[guess].outcome).code is V.LOGIN_FAILED
    assert door.answers[mine].is_in


def test_a_login_whose_connection_ended_is_not_checked_and_counts_as_no_attempt(
    door: LoginLine,
) -> None:
    other = door.come(ELSEWHERE, "otto")
    for _ in range(20):
        session = door.come(LAN, "ann", "not it")
        door.run(door.now)
        door.leave(session)
    ann = door.come(LAN, "ann")
    door.run(START + MINUTE // 2)
    assert door.answers[other].is_in
    assert [job.account for job in door.checked] == ["otto", "ann"]
    assert door.answers[ann].is_in


def test_who_leaves_while_his_password_is_checked_has_failed_all_the_same(door: LoginLine) -> None:
    for _ in range(5):
        session = door.come(LAN, "ann", "not it")
        door.run(door.now)
        door.leave(session)
        door.run(door.now + CHECK)
    ann = door.come(LAN, "ann")
    door.run(door.now)
    assert refusal_from(door.answers[ann].outcome).code is V.LOCKED_OUT


@pytest.mark.parametrize(
    "logins", [5_000, pytest.param(100_000, marks=pytest.mark.soak)], ids="{} logins".format
)
def test_wrong_logins_without_end_take_bounded_memory_and_keep_nobody_out(logins: int) -> None:
    line = LoginLine(Desk(CLASS))
    for n in range(logins):
        network = n % 4_099
        address = f"2001:db8:{network:x}::1" if n % 2 else LAN
        session = line.come(address, f"name {n}", "not it")
        line.run(line.now + SECOND // 100)
        if n % 3 == 0:
            line.leave(session)
        elif session - 1_000 in line.answers:
            line.desk.login.closed(session - 1_000, line.now)
        assert len(line.queue) <= MOST_WAITING
    login = line.desk.login
    assert len(login._lockout) <= MOST_RECORDS
    assert line.queue.remembered() <= 60 * SECOND // CHECK + 1
    assert len(login._checks) <= MOST_WAITING + 1
    ann = line.come(ELSEWHERE, "ann")
    line.run(line.now + 3 * MINUTE)
    assert line.answers[ann].is_in
