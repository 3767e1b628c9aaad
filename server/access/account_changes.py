"""A change of one account, as an admin asks for it at his pendant.

Owns what a change says and which of `StoredAccounts`' calls makes it. Checking and making it block
on the disk, hashing on the processor: none belongs on the event loop.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from ..refusal import Refusal
from .account_store import StoredAccounts
from .accounts import Account, name_fault
from .passwords import PasswordHash, password_fault
from .roles import Role
from .secret import Secret


class AccountAction(StrEnum):
    """What is done to an account."""

    ADD = "add"
    SET_PASSWORD = "set password"
    SET_ROLE = "set role"
    DISABLE = "disable"
    ENABLE = "enable"
    REMOVE = "remove"


@dataclass(frozen=True, slots=True)
class AccountChange:
    """A change that is wanted.

    Attributes:
        number: of the change, for its answer.
        author: who wants it.
        action: what is done.
        name: to whose account.
        role: the role wanted; None where none is.
        password: the password wanted; None where none is.
    """

    number: int
    author: str
    action: AccountAction
    name: str
    role: Role | None = None
    password: Secret | None = None


def change_fault(change: AccountChange) -> Refusal | None:
    """Return why a change is refused whatever accounts there are; None where it is not."""
    if change.password is None:
        return None
    return name_fault(change.name) or password_fault(change.password, change.name)


def make_change(
    accounts: StoredAccounts, change: AccountChange, hashed: PasswordHash | None
) -> None:
    """Make a change.

    Args:
        accounts: the accounts.
        change: what is wanted.
        hashed: the hash of its password; None where it has none.

    Raises:
        AccountRefused: it is not made.
        StoreError: it cannot be saved.
    """
    match change.action:
        case AccountAction.ADD:
            assert change.role is not None, "a new account has a role"
            assert hashed is not None, "a new account has a password"
            accounts.add(Account(name=change.name, role=change.role, password=hashed))
        case AccountAction.SET_PASSWORD:
            assert hashed is not None, "a new password was hashed"
            accounts.set_password(change.name, hashed)
        case AccountAction.SET_ROLE:
            assert change.role is not None, "a new role was named"
            accounts.set_role(change.name, change.role)
        case AccountAction.DISABLE | AccountAction.ENABLE:
            accounts.set_disabled(change.name, change.action is AccountAction.DISABLE)
        case AccountAction.REMOVE:
            accounts.remove(change.name)
