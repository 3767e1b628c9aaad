"""Accounts, and passwords: rules, hashing, and the same cost whoever is asked for (promise 29)."""

import asyncio
import hashlib
import logging
import pickle
from functools import partial
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError
from rigs.cells.admission_desk import account
from rigs.cells.expectations import known, refusal_from

from openpendant.server.access import access_backend
from openpendant.server.access.access_backend import PasswordWorker
from openpendant.server.access.accounts import Account, AccountBook, name_fault
from openpendant.server.access.admission import VerifyJob
from openpendant.server.access.passwords import (
    NOBODYS_HASH,
    PasswordHash,
    ScryptCost,
    Secret,
    hash_password,
    is_password,
    password_fault,
)
from openpendant.simplemsg.pendant.roles import Role
from openpendant.simplemsg.verdicts import VerdictCode as V


@pytest.mark.parametrize("name", ["ann", "Ann B. Clark", "jörg", "a", "李", "robot-7_b", "x" * 32])
def test_a_name_is_letters_digits_and_a_few_signs_between(name: str) -> None:
    assert name_fault(name) is None


@pytest.mark.parametrize(
    "name",
    [
        *("", "x" * 33, "ü" * 17, " ann", "ann ", "a  b", ".", "../ann", "a/b", "a\\b", "a\0b"),
        *("a\nb", "a\x1b[2Jb", "a\x7fb", "‮ann", "ﬁn", "ann;", "-ann", "\ud800"),
    ],
)
def test_another_name_is_refused_with_its_code(name: str) -> None:
    assert refusal_from(name_fault(name)).code is V.BAD_ACCOUNT_NAME


@given(st.text(max_size=40))
def test_no_name_that_passes_can_break_a_line_or_a_path(name: str) -> None:
    if name_fault(name) is None:
        assert name.isprintable()
        assert not set(name) & set("/\\\0'\"`$;<>|&")
        assert len(name.encode()) <= 32


def test_a_kept_account_with_a_bad_name_is_not_read() -> None:
    good = account("ann", Role.ADMIN).model_dump()
    with pytest.raises(ValidationError, match="letters and digits"):
        Account.model_validate(good | {"name": "a/b"})


def test_an_account_is_found_whatever_its_capitals() -> None:
    book = AccountBook([account("Ann", Role.ADMIN)])
    assert known(book.find("aNN")).name == "Ann"
    assert book.find("bob") is None


def test_the_last_admin_is_the_one_without_whom_nobody_manages() -> None:
    ann, bob = account("ann", Role.ADMIN), account("bob", Role.VIEWER)
    off = account("off", Role.ADMIN, disabled=True)
    assert AccountBook([ann, bob, off]).is_last_admin(ann)
    assert not AccountBook([ann, bob, off]).is_last_admin(off)
    assert not AccountBook([ann, account("eve", Role.ADMIN)]).is_last_admin(ann)


def test_the_repr_of_an_account_shows_no_hash() -> None:
    ann = account("ann", Role.ADMIN)
    assert ann.password.digest not in repr(ann)
    assert ann.password.salt not in repr(ann.password)


CHEAP = ScryptCost(n=2**14, r=8, p=1)
SALT = bytes(range(16))


def test_the_right_password_is_told_from_others() -> None:
    kept = hash_password(Secret("correct horse"), SALT, CHEAP)
    assert is_password(Secret("correct horse"), kept)
    assert not is_password(Secret("correct horsf"), kept)
    assert not is_password(Secret(""), kept)


def test_one_password_typed_in_two_compositions_is_the_same() -> None:
    kept = hash_password(Secret("Bj\u00f6rnsson"), SALT, CHEAP)
    assert is_password(Secret("Bjo\u0308rnsson"), kept)


def test_a_lone_surrogate_is_a_wrong_password_and_no_error() -> None:
    assert not is_password(Secret("\ud800"), hash_password(Secret("x"), SALT, CHEAP))


def test_another_salt_gives_another_hash() -> None:
    first = hash_password(Secret("correct horse"), SALT, CHEAP)
    assert hash_password(Secret("correct horse"), bytes(16), CHEAP).digest != first.digest


def test_nobody_costs_exactly_what_an_account_costs(monkeypatch: pytest.MonkeyPatch) -> None:
    calls: list[dict[str, Any]] = []
    real = hashlib.scrypt

    def scrypt(password: bytes, **parameters: Any) -> bytes:
        calls.append({key: value for key, value in parameters.items() if key != "salt"})
        return real(password, **parameters | {"n": 2, "r": 1, "p": 1})

    monkeypatch.setattr(hashlib, "scrypt", scrypt)
    is_password(Secret("guess"), hash_password(Secret("correct horse"), SALT))
    is_password(Secret("guess"), NOBODYS_HASH)
    hashed, known, unknown = calls
    assert hashed == known == unknown
    assert (known["n"], known["r"], known["p"]) == (2**15, 8, 3)


@pytest.mark.parametrize(
    "cost", [{"n": 2**13}, {"n": 40_000}, {"r": 1}, {"p": 0}, {"n": 2**20, "r": 32}]
)
def test_a_kept_cost_that_is_too_low_or_too_high_is_not_read(cost: dict[str, int]) -> None:
    with pytest.raises(ValidationError):
        PasswordHash.model_validate({"salt": "00" * 16, "digest": "00" * 32, "cost": cost})


@pytest.mark.parametrize(
    "password",
    [
        *("", "short", "x" * 129, "aaaaaaaa", "abababab", "password", "PassW0rd", "12345678"),
        *("abcdefghij", "87654321", "robert2024", "tab\there it is", "nul\0 in the middle"),
        # A little around what everybody tries first changes nothing.
        *("password123", "Password123!", "P@$$w0rd2024", "pass-word-1", "0penpendant1", "passw0rd"),
        *("admin2024!", "Welcome1", "letme1n!!", "trustno1", "!!robot!!", "2024_summer"),
        *("1234abcd", "qwerty123456", "1q2w3e4r", "zaq12wsx", "abc123abc", "aaab123456"),
        *("horsehorse", "passwordpassword", "x7!x7!x7!x7!", "r0bert-2024", "ROBERTrobert"),
    ],
)
def test_a_password_that_is_easily_guessed_is_refused(password: str) -> None:
    """NIST SP 800-63B: dictionary words, repetitions, sequences, names and derivatives of them."""
    assert refusal_from(password_fault(Secret(password), "robert")).code is V.BAD_PASSWORD


@pytest.mark.parametrize(
    "password",
    [
        *("correct horse", "Mein Rad ist grün", "日本語のパスワード", "x7!kQ2?m", "Tr0ub4dor&3"),
        *("robot arm dances", "the password is long enough", "correcthorsecorrecthorse"),
        *("welding 4 ever", "abc of the violet hammock"),
    ],
)
def test_a_password_may_hold_spaces_and_any_letters(password: str) -> None:
    assert password_fault(Secret(password), "robert") is None


@given(st.text(min_size=8))
def test_no_reason_for_refusing_a_password_shows_it(password: str) -> None:
    """Promise 30: what is refused is not repeated."""
    fault = password_fault(Secret("canary" + password), "ann")
    assert fault is None or "canary" not in fault.sentence


def test_a_secret_shows_itself_to_nobody() -> None:
    """Promise 30: not printed, not formatted, not pickled."""
    secret = Secret("canary")
    shown = repr(secret) + str(secret) + f"{secret}{secret!r:>20}{[secret]}{secret:x}"
    assert "canary" not in shown
    with pytest.raises(TypeError, match="not pickled"):
        pickle.dumps(secret)


@pytest.fixture(scope="module")
def kept() -> PasswordHash:
    return hash_password(Secret("correct horse"), bytes(16), CHEAP)


def job(
    number: int, kept: PasswordHash, password: str = "correct horse", source: str = "192.0.2.1"
) -> VerifyJob:
    return VerifyJob(number, 1, Secret(password), kept, source, f"name {number}", has_failed=False)


@pytest.mark.virtual_clock
async def test_an_answer_comes_later_with_its_job(kept: PasswordHash) -> None:
    worker = PasswordWorker()
    answers: dict[int, bool | None] = {}
    for number, password in ((1, "correct horse"), (2, "wrong")):
        worker.submit(job(number, kept, password), partial(answers.__setitem__, number))
    assert answers == {}
    await asyncio.sleep(0.01)
    assert answers == {1: True, 2: False}
    worker.close()


@pytest.mark.virtual_clock
async def test_passwords_are_checked_in_turns_of_addresses_and_new_ones_in_theirs(
    kept: PasswordHash,
) -> None:
    worker = PasswordWorker()
    answered: dict[int | str, object] = {}
    for number in range(6):
        source = "192.0.2.1" if number < 4 else f"192.0.2.{number}"
        submitted = job(number, kept, source=source)
        worker.submit(submitted, partial(answered.__setitem__, number))
    answered["new"] = await worker.hash(Secret("a new password"), "ann")
    assert list(answered) == [0, 4, 5, "new"]
    assert isinstance(answered["new"], PasswordHash)
    await asyncio.sleep(0.01)
    assert list(answered) == [0, 4, 5, "new", 1, 2, 3]
    worker.close()


@pytest.mark.virtual_clock
async def test_what_is_withdrawn_is_told_as_not_checked_and_the_one_under_way_as_it_is(
    kept: PasswordHash,
) -> None:
    worker = PasswordWorker()
    answers: dict[int, bool | None] = {}
    for number in range(3):
        worker.submit(job(number, kept), partial(answers.__setitem__, number))
    for number in range(2):
        worker.withdraw(number)
    worker.withdraw(99)
    await asyncio.sleep(0.01)
    assert answers == {0: True, 1: None, 2: True}
    worker.close()


@pytest.mark.virtual_clock
async def test_where_too_many_wait_a_new_password_is_refused_as_a_login_is(
    kept: PasswordHash,
) -> None:
    worker = PasswordWorker(most_waiting=0)
    answers: list[bool | None] = []
    worker.submit(job(1, kept), answers.append)
    outcome = await worker.hash(Secret("a new password"), "ann")
    assert refusal_from(outcome).code is V.LOGIN_BUSY
    assert answers == [None]
    worker.close()


@pytest.mark.virtual_clock
async def test_a_check_that_the_system_cannot_make_is_told_and_says_nothing_of_the_password(
    kept: PasswordHash, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    def fail(password: Secret, *_: object) -> bool:
        raise ValueError(f"memory limit exceeded by {password.reveal()}")

    monkeypatch.setattr(access_backend, "is_password", fail)
    monkeypatch.setattr(access_backend, "hash_password", fail)
    caplog.set_level(logging.DEBUG)
    worker = PasswordWorker()
    answers: list[bool | None] = []
    worker.submit(job(1, kept, "a canary of 7"), answers.append)
    outcome = await worker.hash(Secret("a canary of 7"), "ann")
    assert answers == [None]
    assert refusal_from(outcome).code is V.LOGIN_BUSY
    assert "a password could not be checked: ValueError" in caplog.text
    assert "canary" not in caplog.text
    worker.close()


@pytest.mark.virtual_clock
async def test_an_address_that_guesses_is_checked_once_a_second_and_told_of(
    kept: PasswordHash, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(access_backend, "is_password", lambda *_: False)
    told: list[tuple[str, int]] = []
    worker = PasswordWorker(slowed=lambda *about: told.append(about))
    loop, at = asyncio.get_running_loop(), list[float]()
    began = loop.time()
    for number in range(65):
        worker.submit(job(number, kept), lambda _: at.append(loop.time() - began))
    await asyncio.sleep(30)
    assert at[:60] == [0.0] * 60
    assert at[60:] == pytest.approx([1.0, 2.0, 3.0, 4.0, 5.0], abs=1e-6)
    assert [source for source, _ in told] == ["192.0.2.1"]
    worker.close()


@pytest.mark.realtime
async def test_the_loop_goes_on_while_passwords_are_checked(kept: PasswordHash) -> None:
    worker = PasswordWorker(most_waiting=3)
    answers: list[bool | None] = []
    turns: list[int] = []
    while len(turns) < 5 and not any(count > 20 for count in turns):  # a busy machine has few
        answers.clear()
        for number in range(6):
            worker.submit(job(number, kept), answers.append)
        turns.append(0)
        async with asyncio.timeout(60):
            while len(answers) < 6:
                await asyncio.sleep(0.001)
                turns[-1] += 1
        assert answers == [None, None, True, True, True, True]
    assert turns[-1] > 20, turns
    worker.close()
