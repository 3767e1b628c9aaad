from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError
from rigs.cells.admission_desk import account

from openpendant.server.access.accounts import Account, AccountBook, name_fault
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
    fault = name_fault(name)
    assert fault is not None
    assert fault.code is V.BAD_ACCOUNT_NAME


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
    found = book.find("aNN")
    assert found is not None
    assert found.name == "Ann"
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
