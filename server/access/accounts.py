"""Accounts: what one is, what it may be called, and the set of them at one moment.

Plain values: the store keeps them (`account_store`), `admission` asks them. Knows no file and no
session.
"""

from __future__ import annotations

import unicodedata
from collections.abc import Iterable, Iterator, Mapping
from typing import Annotated

from pydantic import AfterValidator, BaseModel, ConfigDict, Field

from openpendant.simplemsg.pendant.roles import Role
from openpendant.simplemsg.verdicts import VerdictCode

from ..refusal import Refusal
from .passwords import PasswordHash

NAME_BYTES = 32
"""Longest name, UTF-8; what the protocol's name fields hold."""

_SIGNS = frozenset("._-")


def account_key(name: str) -> str:
    """Return the key under which names compare equal: `Ann` and `ann` are one account."""
    return unicodedata.normalize("NFKC", name).casefold()


def name_fault(name: str) -> Refusal | None:
    """Return why a text is no valid name; None where it is one.

    Letters of any script and digits, and between them `.`, `_`, `-` and single spaces: what is safe
    on a screen, on a command line and in a log.
    """
    size = len(name.encode("utf-8", "replace"))
    if not 1 <= size <= NAME_BYTES:
        text = f"a name has 1 to {NAME_BYTES} bytes of UTF-8, this one {size}"
        return Refusal(VerdictCode.BAD_ACCOUNT_NAME, text, value=float(size), limit=NAME_BYTES)
    if unicodedata.normalize("NFKC", name) != name:
        return Refusal(VerdictCode.BAD_ACCOUNT_NAME, "the name holds a composed or look-alike sign")
    inside = name.replace(" ", "x")
    if all(sign.isalnum() or sign in _SIGNS for sign in inside) and _ends_well(name):
        return None
    text = "a name is letters and digits, with . _ - or single spaces between them"
    return Refusal(VerdictCode.BAD_ACCOUNT_NAME, text)


def _ends_well(name: str) -> bool:
    return name[0].isalnum() and name[-1].isalnum() and "  " not in name


def _checked_name(name: str) -> str:
    fault = name_fault(name)
    if fault is not None:
        raise ValueError(fault.sentence)
    return name


class Account(BaseModel):
    """Account that may log in, as kept in the store."""

    model_config = ConfigDict(frozen=True, extra="forbid", use_attribute_docstrings=True)

    name: Annotated[str, AfterValidator(_checked_name)]
    """As it is shown; two accounts never differ in capitals alone."""
    role: Role
    """What the account may do."""
    password: Annotated[PasswordHash, Field(repr=False)]
    """Hash of its password."""
    disabled: bool = False
    """Kept, but nobody may log in."""

    @property
    def key(self) -> str:
        """The name as the store keeps it."""
        return account_key(self.name)


class AccountBook:
    """The accounts at one moment; a change makes another book.

    Attributes:
        unreadable: documents that should be accounts and are none, by name, each with what is wrong
            with it. Nobody can log in with one, but while there is one, nobody is let in for there
            being no account.
    """

    def __init__(
        self, accounts: Iterable[Account] = (), unreadable: Mapping[str, str] | None = None
    ) -> None:
        """Take accounts with different names, and the documents that are none."""
        self._accounts = {account.key: account for account in accounts}
        self.unreadable = dict(unreadable or {})

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, AccountBook):
            return NotImplemented
        return self._accounts == other._accounts and self.unreadable == other.unreadable

    def __len__(self) -> int:
        return len(self._accounts)

    def __iter__(self) -> Iterator[Account]:
        return iter(self._accounts.values())

    def find(self, name: str) -> Account | None:
        """Return the account of a name; None where there is none."""
        return self._accounts.get(account_key(name))

    @property
    def is_empty(self) -> bool:
        """True if the store holds no account, not even one that cannot be read."""
        return not self._accounts and not self.unreadable

    @property
    def has_admin(self) -> bool:
        """True if at least one account can log in as admin."""
        return any(_can_manage(account) for account in self)

    def is_last_admin(self, account: Account) -> bool:
        """Return True if this is the only account that can manage the accounts."""
        return _can_manage(account) and not any(
            _can_manage(other) for other in self if other.key != account.key
        )


def _can_manage(account: Account) -> bool:
    return account.role is Role.ADMIN and not account.disabled
