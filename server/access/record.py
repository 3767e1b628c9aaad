"""Who had which account, as JSON data in the server's journal, and back.

Owns that no hash of a password gets there (promise 30): each password is a number, the same one for
as long as it is not changed. That is all that a repetition needs, because what a check of a
password found is noted as an event of its own.
"""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from openpendant.simplemsg.verdicts import VerdictCode

from ..field_fault import field_fault
from ..refusal import Refusal
from .accounts import Account, AccountBook
from .passwords import DIGEST_BYTES, NOBODYS_HASH, PasswordHash
from .roles import Role


class AccessRecordError(ValueError):
    """The record holds no accounts, or no outcome; the text says why."""


class _Account(BaseModel):
    model_config = ConfigDict(extra="forbid")

    name: str
    role: Role
    disabled: bool
    password: Annotated[int, Field(ge=0, lt=2**32)]


class _Accounts(BaseModel):
    model_config = ConfigDict(extra="ignore")

    accounts: tuple[_Account, ...]
    unreadable: tuple[str, ...] = ()
    single_user: bool


class _Check(BaseModel):
    model_config = ConfigDict(extra="ignore")

    right: bool | None


class _Outcome(BaseModel):
    model_config = ConfigDict(extra="ignore")

    code: int
    text: str
    value: float
    limit: float


class PasswordNumbers:
    """The numbers that stand for passwords in one journal."""

    def __init__(self) -> None:
        """Know no password yet."""
        self._numbers: dict[PasswordHash, int] = {}

    def book_to_json(self, book: AccountBook, *, single_user: bool) -> dict[str, Any]:
        """Return accounts as plain data without any secret."""
        accounts = [
            {
                "name": account.name,
                "role": account.role.value,
                "disabled": account.disabled,
                "password": self._numbers.setdefault(account.password, len(self._numbers)),
            }
            for account in book
        ]
        unreadable = sorted(book.unreadable)
        return {"accounts": accounts, "unreadable": unreadable, "single_user": single_user}


def book_from_json(record: dict[str, Any]) -> tuple[AccountBook, bool]:
    """Return the accounts of a record, with numbers for passwords, and who is single user.

    Raises:
        AccessRecordError: the record is damaged.
    """
    try:
        read = _Accounts.model_validate(record)
        accounts = [
            Account(
                name=each.name,
                role=each.role,
                disabled=each.disabled,
                password=PasswordHash(
                    salt=NOBODYS_HASH.salt, digest=f"{each.password:0{2 * DIGEST_BYTES}x}"
                ),
            )
            for each in read.accounts
        ]
    except ValidationError as error:
        raise AccessRecordError(field_fault(error)) from None
    return AccountBook(accounts, dict.fromkeys(read.unreadable, "")), read.single_user


def check_from_json(record: dict[str, Any]) -> bool | None:
    """Return whether a password was right; None where it could not be checked.

    Raises:
        AccessRecordError: the record is damaged.
    """
    try:
        return _Check.model_validate(record).right
    except ValidationError as error:
        raise AccessRecordError(field_fault(error)) from None


def outcome_to_json(refusal: Refusal | None) -> dict[str, Any]:
    """Return as plain data why an account was not changed, or that it was."""
    told = refusal or Refusal(VerdictCode.ACCEPTED)
    return {"code": int(told.code), "text": told.text, "value": told.value, "limit": told.limit}


def outcome_from_json(record: dict[str, Any]) -> Refusal | None:
    """Return why an account was not changed; None where it was.

    Raises:
        AccessRecordError: the record is damaged.
    """
    try:
        read = _Outcome.model_validate(record)
        code = VerdictCode(read.code)
    except ValidationError as error:
        raise AccessRecordError(field_fault(error)) from None
    except ValueError as error:
        raise AccessRecordError(str(error)) from None
    if code is VerdictCode.ACCEPTED:
        return None
    return Refusal(code, read.text, value=read.value, limit=read.limit)
