import random
from collections.abc import Callable
from dataclasses import dataclass

import pytest
from rigs.cells.admission_desk import BOOK, LAN, LOCAL, START, Desk, account, is_right
from rigs.cells.expectations import expect, only, refusal_from

from openpendant.server.access.accounts import AccountBook
from openpendant.server.access.admission import VerifyJob
from openpendant.server.access.audit import AuditEvent
from openpendant.server.access.lockout import SECOND_NS
from openpendant.server.access.pairing import (
    ALPHABET,
    LENGTH,
    LIFETIME_NS,
    MOST_WRONG,
    PairingCode,
    PairingCodes,
)
from openpendant.server.access.passwords import NOBODYS_HASH, Secret
from openpendant.server.access.request_gate import Basis, Granted, GrantEnded
from openpendant.server.refusal import Refusal
from openpendant.simplemsg.pendant.roles import Permission, Role
from openpendant.simplemsg.verdicts import VerdictCode as V


def code_of(answer: object) -> V | None:
    return answer.code if isinstance(answer, Refusal) else None


@pytest.fixture
def desk() -> Desk:
    """A desk at which connection 1 has arrived."""
    desk = Desk()
    desk.arrive(1)
    return desk


# Who needs no login.


def test_without_accounts_everybody_on_this_machine_is_admin_by_his_hello_name() -> None:
    desk = Desk(AccountBook(), single_user_host=True)
    assert desk.arrive(1, LOCAL) == Granted(1, Role.ADMIN, "app 1", Basis.SINGLE_USER)
    assert all(desk.login.may(1, permission) is None for permission in Permission)


@pytest.mark.parametrize(
    ("book", "single_user_host", "address"),
    [(BOOK, True, LOCAL), (AccountBook(), False, LOCAL), (AccountBook(), True, LAN)],
)
def test_with_accounts_or_from_outside_nobody_is_admin_by_himself(
    book: AccountBook, single_user_host: bool, address: str
) -> None:
    desk = Desk(book, single_user_host)
    assert desk.arrive(1, address) is None
    assert code_of(desk.login.may(1, Permission.MOVE)) is V.LOGIN_NEEDED


@pytest.mark.parametrize(
    ("address", "observe_without_login", "may_look_on"),
    [(LOCAL, False, True), (LAN, False, False), (LAN, True, True)],
)
def test_looking_on_from_outside_needs_a_login_unless_configured(
    address: str, observe_without_login: bool, may_look_on: bool
) -> None:
    """Promise 29: an observer has to log in as well."""
    desk = Desk(observe_without_login=observe_without_login)
    desk.arrive(1, address)
    assert (desk.login.may(1, Permission.OBSERVE) is None) is may_look_on


@pytest.mark.parametrize("session", [1, 2])
def test_every_connection_that_said_hello_may_stop(desk: Desk, session: int) -> None:
    """Promise 19: logged in or not, and while locked out (promise 29)."""
    desk.arrive(2)
    desk.log_in(2, "vera")
    for _ in range(10):
        desk.attempt(1, "ann", "wrong")
    assert code_of(desk.attempt(1, "ann", "wrong")) is V.LOCKED_OUT
    assert desk.login.may(session, Permission.STOP) is None


def test_before_hello_nobody_may_do_anything() -> None:
    desk = Desk()
    assert {code_of(desk.login.may(7, permission)) for permission in Permission} == {V.HELLO_FIRST}
    assert code_of(desk.attempt(7, "ann", "x")) is V.HELLO_FIRST


# Passwords.


def test_the_right_password_grants_the_accounts_role(desk: Desk) -> None:
    assert desk.log_in(1, "otto") == Granted(1, Role.OPERATOR, "otto", Basis.ACCOUNT)
    assert desk.login.may(1, Permission.MOVE) is None
    refusal = refusal_from(desk.login.may(1, Permission.EDIT_PROGRAM))
    assert refusal.code is V.ROLE_TOO_LOW
    assert refusal.text == "edit-program needs the role programmer; otto is operator"


@pytest.mark.parametrize(
    ("name", "password"),
    [("ann", "wrong"), ("nobody", "ann's password"), ("gone", "gone's password"), ("", "")],
)
def test_wrong_unknown_and_disabled_are_told_alike(desk: Desk, name: str, password: str) -> None:
    assert desk.attempt(1, name, password) == Refusal(V.LOGIN_FAILED)
    assert desk.login.grant_of(1) is None


def job_of(desk: Desk, name: str, password: str = "", session: int = 1) -> VerifyJob:
    """Begin to log in, with the account's own password unless told another."""
    typed = Secret(password or f"{name}'s password")
    return expect(VerifyJob, desk.login.try_password(session, name, typed, START))


def test_an_unknown_user_is_checked_too(desk: Desk) -> None:
    """Promise 29: the same job with a hash of the same cost."""
    job = job_of(desk, "nobody", "guess")
    assert job.kept is NOBODYS_HASH
    assert code_of(desk.login.verified(job.job_id, True, START)) is V.LOGIN_FAILED


def test_unknown_names_are_locked_as_known_ones_are() -> None:
    def answers(name: str) -> list[V | None]:
        desk = Desk()
        desk.arrive(1)
        return [code_of(desk.attempt(1, name, "wrong")) for _ in range(8)]

    assert answers("ann") == answers("nobody")
    assert answers("ann")[5] is V.LOCKED_OUT


def test_a_lock_refuses_the_right_password_too_and_says_for_how_long(desk: Desk) -> None:
    for _ in range(5):
        desk.attempt(1, "ann", "wrong")
    refusal = refusal_from(desk.attempt(1, "ann", "ann's password", START + 10 * SECOND_NS))
    assert (refusal.code, refusal.value) == (V.LOCKED_OUT, 50.0)
    assert "50 s" in refusal.text
    assert desk.log_in(1, "ann", START + 60 * SECOND_NS).role is Role.ADMIN


def test_reconnecting_does_not_escape_the_lock() -> None:
    desk = Desk()
    for session in range(1, 6):
        desk.arrive(session)
        job = job_of(desk, "ann", "wrong", session)
        desk.login.closed(session, START)
        desk.login.verified(job.job_id, False, START)
    desk.arrive(6)
    assert code_of(desk.attempt(6, "ann", "wrong")) is V.LOCKED_OUT


def test_a_thousand_wrong_names_of_an_address_lock_nobody_out_there() -> None:
    """Promise 29: whoever shares the address gets in; when, is the queue's business."""
    desk = Desk()
    for session in range(1_000):
        desk.arrive(session)
        assert code_of(desk.attempt(session, f"name {session}", "x")) is V.LOGIN_FAILED
        desk.login.closed(session, START)
    desk.arrive(1_000)
    assert desk.log_in(1_000, "ann").role is Role.ADMIN


def test_a_job_tells_the_queue_who_asks_for_whom_and_whether_that_failed_before(desk: Desk) -> None:
    def queued(name: str) -> tuple[str, str, bool]:
        job = job_of(desk, name, "wrong")
        desk.login.verified(job.job_id, False, START)
        return job.source, job.account, job.has_failed

    assert queued("Ann") == (LAN, "ann", False)
    assert queued("ANN") == (LAN, "ann", True)
    assert queued("Nobody") == (LAN, "nobody", False)


def test_a_connection_that_ends_names_the_check_that_it_waits_for(desk: Desk) -> None:
    desk.arrive(2)
    job = job_of(desk, "ann")
    assert desk.login.waits(1)
    assert not desk.login.waits(2)
    assert desk.login.closed(2, START) is None
    assert desk.login.closed(1, START) == job.job_id
    assert not desk.login.waits(1)


def test_one_connection_checks_one_password_at_a_time(desk: Desk) -> None:
    assert isinstance(desk.login.try_password(1, "ann", Secret("a"), START), VerifyJob)
    second = desk.login.try_password(1, "ann", Secret("b"), START)
    assert code_of(second) is V.LOGIN_BUSY


def test_a_check_that_the_worker_had_no_room_for_is_no_attempt(desk: Desk) -> None:
    for _ in range(10):
        job = job_of(desk, "ann", "x")
        assert desk.login.not_verified(job.job_id).code is V.LOGIN_BUSY
    assert desk.log_in(1, "ann").name == "ann"


def test_a_grant_belongs_to_one_connection(desk: Desk) -> None:
    """Promise 28: an outcome counts once, for the connection that asked, and dies with it."""
    desk.arrive(2)
    job = job_of(desk, "ann")
    assert isinstance(desk.login.verified(job.job_id, is_right(job), START), Granted)
    assert desk.login.grant_of(2) is None
    desk.login.logout(1, START)
    assert code_of(desk.login.verified(job.job_id, True, START)) is V.LOGIN_FAILED
    assert desk.login.grant_of(1) is None


def test_an_outcome_that_comes_after_its_connection_grants_nothing(desk: Desk) -> None:
    job = job_of(desk, "ann")
    desk.login.closed(1, START)
    assert code_of(desk.login.verified(job.job_id, True, START)) is V.LOGIN_FAILED
    desk.arrive(1)
    assert desk.login.grant_of(1) is None


def test_a_failed_login_leaves_what_was_granted(desk: Desk) -> None:
    granted = desk.log_in(1, "otto")
    desk.attempt(1, "ann", "wrong")
    assert desk.login.grant_of(1) == granted


# Changes of accounts.


def test_an_account_changed_while_its_password_is_checked_is_not_granted(desk: Desk) -> None:
    job = job_of(desk, "otto")
    desk.login.accounts_changed(AccountBook([account("ann", Role.ADMIN)]), START)
    assert code_of(desk.login.verified(job.job_id, True, START)) is V.LOGIN_FAILED


def test_the_first_account_ends_the_single_user() -> None:
    desk = Desk(AccountBook(), single_user_host=True)
    desk.arrive(1, LOCAL)
    only(GrantEnded, desk.login.accounts_changed(BOOK, START))
    assert desk.login.may(1, Permission.OBSERVE) is None
    assert code_of(desk.login.may(1, Permission.MOVE)) is V.LOGIN_NEEDED


# Pairing.


@dataclass
class Lesson:
    """A desk at which Ann has issued a code on connection 1, and a guest has come on 2."""

    desk: Desk
    code: PairingCode

    def pair(self, typed: str | Secret, name: str = "Tim", session: int = 2) -> object:
        typed = typed if isinstance(typed, Secret) else Secret(typed)
        return self.desk.login.pair(session, typed, name, START)


@pytest.fixture
def lesson(desk: Desk) -> Lesson:
    desk.log_in(1, "ann")
    code = desk.login.issue_pairing(1, START, random.Random(1))
    desk.arrive(2)
    return Lesson(desk, expect(PairingCode, code))


def test_a_guest_with_the_code_is_operator_of_that_cell_and_of_no_other(lesson: Lesson) -> None:
    shown = lesson.code.shown
    assert lesson.pair(shown) == Granted(2, Role.OPERATOR, "Tim", Basis.PAIRING)
    lesson.desk.arrive(3, cell="another cell")
    assert code_of(lesson.pair(shown, "Tom", 3)) is V.PAIRING_WRONG


@pytest.mark.parametrize(("name", "code"), [("", V.LOGIN_NEEDED), ("otto", V.ROLE_TOO_LOW)])
def test_only_who_may_pair_gets_a_code(desk: Desk, name: str, code: V) -> None:
    if name:
        desk.log_in(1, name)
    assert code_of(desk.login.issue_pairing(1, START, random.Random(1))) is code
    assert code_of(desk.login.withdraw_pairing(1, START)) is code


def test_guessing_a_code_is_locked_after_five_tries(lesson: Lesson) -> None:
    answers = [code_of(lesson.pair(typed)) for typed in [*["WRONG"] * 6, lesson.code.shown]]
    assert answers == [V.PAIRING_WRONG] * 5 + [V.LOCKED_OUT] * 2


def test_wrong_passwords_do_not_lock_pairing_nor_wrong_codes_logging_in(lesson: Lesson) -> None:
    desk = lesson.desk
    for n in range(100):
        desk.attempt(2, f"name {n}", "x")
        desk.attempt(2, "", "x")
    assert [code_of(lesson.pair("WRONG")) for _ in range(5)] == [V.PAIRING_WRONG] * 5
    assert code_of(lesson.pair(lesson.code.shown)) is V.LOCKED_OUT
    assert desk.log_in(2, "otto").name == "otto"


@pytest.mark.parametrize("name", ["ANN", "otto", "tim"])
def test_nobody_is_called_like_an_account_or_another_guest(lesson: Lesson, name: str) -> None:
    lesson.pair(lesson.code.shown)
    lesson.desk.arrive(3)
    assert code_of(lesson.pair(lesson.code.shown, name, 3)) is V.NAME_TAKEN


def test_a_bad_name_is_told_before_the_code_is_looked_at(lesson: Lesson) -> None:
    assert {code_of(lesson.pair("WRONG", "a/b")) for _ in range(10)} == {V.BAD_ACCOUNT_NAME}


def test_the_end_of_the_lesson_takes_back_what_guests_were_granted(lesson: Lesson) -> None:
    lesson.pair(lesson.code.shown)
    login = lesson.desk.login
    assert login.withdraw_pairing(1, START) == [GrantEnded(2, "the lesson is over")]
    assert code_of(login.may(2, Permission.MOVE)) is V.LOGIN_NEEDED
    assert code_of(lesson.pair(lesson.code.shown)) is V.PAIRING_WRONG


# What is noted.


def test_logins_and_failures_are_noted_with_who_and_from_where(desk: Desk) -> None:
    desk.attempt(1, "ann", "wrong")
    desk.log_in(1, "ann")
    desk.login.closed(1, START)
    noted = [(entry.event, entry.who, entry.source) for entry in desk.log]
    assert noted == [
        (AuditEvent.CONNECTED, "", LAN),
        (AuditEvent.LOGIN_FAILED, "", LAN),
        (AuditEvent.LOGIN, "ann", LAN),
        (AuditEvent.DISCONNECTED, "ann", LAN),
    ]
    assert desk.log[1].detail == {"account": "ann", "known": True, "client": "app 1"}


def test_no_secret_is_in_any_note_answer_or_state(lesson: Lesson) -> None:
    """Promise 30: canaries in every credential field, the name field included."""
    canary, desk, code = "canary-7f3a", lesson.desk, lesson.code
    answers: list[object] = [desk.attempt(2, "ann", canary), desk.attempt(2, canary, canary)]
    answers.append(desk.login.try_password(2, canary, Secret(canary), START))
    answers += [lesson.pair(canary), lesson.pair(code.text)]
    shown = repr(answers) + repr(desk.log) + repr(list(desk.login.visitors)) + repr(code)
    assert canary not in shown
    assert code.text.reveal() not in shown
    assert not any(known.password.digest in shown for known in BOOK)


def issued() -> tuple[PairingCodes, PairingCode]:
    codes = PairingCodes()
    return codes, codes.issue("cell", "ann", START, random.Random(1))


def test_a_code_is_short_and_has_no_sign_that_is_mistaken_for_another() -> None:
    _, code = issued()
    assert len(code.text.reveal()) == LENGTH
    assert set(code.text.reveal()) <= set(ALPHABET)
    assert not set(ALPHABET) & set("01OIL2Z5S")
    assert len(code.shown) == LENGTH + 1


@pytest.mark.parametrize("typed", [str, " {} ".format, str.lower, "-".join])
def test_a_code_is_taken_however_it_is_typed(typed: Callable[[str], str]) -> None:
    codes, code = issued()
    assert codes.redeem(Secret(typed(code.shown)), START) is code


def test_a_code_serves_a_whole_class_until_it_ends() -> None:
    codes, code = issued()
    assert all(codes.redeem(code.text, START + LIFETIME_NS - 1) for _ in range(30))
    assert codes.redeem(code.text, START + LIFETIME_NS) is None


def test_another_code_of_the_cell_ends_the_first_and_not_that_of_another_cell() -> None:
    codes, chance = PairingCodes(), random.Random(1)
    first = codes.issue("left", "ann", START, chance)
    right = codes.issue("right", "ann", START, chance)
    second = codes.issue("left", "ann", START, chance)
    assert codes.redeem(first.text, START) is None
    assert codes.redeem(right.text, START) is right
    assert codes.redeem(second.text, START) is second
    assert codes.withdraw("left")
    assert codes.redeem(second.text, START) is None


def test_many_wrong_codes_end_every_code() -> None:
    codes, chance = PairingCodes(), random.Random(1)
    code = codes.issue("cell", "ann", START, chance)
    for _ in range(MOST_WRONG):
        assert codes.redeem(Secret("??????"), START) is None
    assert codes.redeem(code.text, START) is None
    again = codes.issue("cell", "ann", START, chance)
    assert codes.redeem(again.text, START) is again


@pytest.mark.parametrize("typed", ["", "\0" * 6, "\ud800" * 6, "Ω" * 6, "A" * 10**6])
def test_what_is_no_code_is_refused_without_an_error(typed: str) -> None:
    codes = PairingCodes()
    codes.issue("cell", "ann", START, random.Random(1))
    assert codes.redeem(Secret(typed), START) is None
