"""Accounts: what one is, the set of them at one moment, their documents and their changes.

An account and the book of them are plain values, which `admission` asks. Owns the rules of the set:
no two accounts differ in capitals alone, and there is always somebody who can manage the others.
Owns what a change says that an admin asks for at his pendant, and which call of `StoredAccounts`
makes it. Every call of that blocks on the disk, and hashing a password on the processor, so
checking and making a change both stay off the event loop.
"""

from __future__ import annotations

import unicodedata
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Annotated

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, ValidationError

from openpendant.simplemsg.pendant.roles import Role
from openpendant.simplemsg.verdicts import VerdictCode

from ..refusal import Refusal
from ..store.documents import DocumentKind, Heading, Store
from ..store.store_errors import BadDocument
from .passwords import PasswordHash, Secret, password_fault

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

    model_config = ConfigDict(frozen=True, extra="forbid")

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


class AccountRefused(Exception):
    """A change of accounts that is not made."""

    def __init__(self, refusal: Refusal) -> None:
        super().__init__(refusal.sentence)
        self.refusal = refusal


def read_account(key: str, body: str) -> Account:
    """Return the account in a document.

    Raises:
        BadDocument: it is no account, or that of another name.
    """
    try:
        account = Account.model_validate_json(body)
    except ValidationError as error:
        # Without the input: it holds the hash.
        first = error.errors(include_url=False, include_input=False, include_context=False)[0]
        place = ".".join(str(part) for part in first["loc"])
        raise BadDocument(f"account {key!r}", first["msg"], place=place) from None
    if account.key != key:
        problem = f"is {account.name!r}, which is kept as {account.key!r}; accepted: that name"
        raise BadDocument(f"account {key!r}", problem, place="name")
    return account


class StoredAccounts:
    """The accounts that a store keeps."""

    def __init__(self, store: Store, author: str) -> None:
        """Take a store, and the name under which changes are saved."""
        self._store = store
        self._author = author

    def book(self) -> AccountBook:
        """Return the accounts as they are now; one that is damaged does not hide the others.

        Raises:
            StoreError: the store cannot be read.
        """
        accounts: list[Account] = []
        unreadable: dict[str, str] = {}
        for heading in self._store.headings(DocumentKind.ACCOUNT):
            try:
                accounts.append(self._load(heading.name)[0])
            except BadDocument as error:
                unreadable[heading.name] = f"{error.place}: {error.problem}".removeprefix(": ")
        return AccountBook(accounts, unreadable)

    def add(self, account: Account) -> None:
        """Add an account.

        Raises:
            AccountRefused: there is one of this name, perhaps unreadable; or it is the first, and
                no admin.
            StoreError: it cannot be saved.
        """
        book = self.book()
        if book.find(account.name) is not None:
            text = f"there is an account {account.name!r} already"
            raise AccountRefused(Refusal(VerdictCode.ACCOUNT_EXISTS, text))
        if account.key in book.unreadable:
            problem = f"that cannot be read ({book.unreadable[account.key]}); remove it first"
            text = f"there is an account {account.name!r} {problem}"
            raise AccountRefused(Refusal(VerdictCode.ACCOUNT_EXISTS, text))
        if not len(book) and account.role is not Role.ADMIN:
            text = f"the first account has to be admin, not {account.role.value}"
            raise AccountRefused(Refusal(VerdictCode.LAST_ADMIN, text))
        self._save(account, expected_revision=0)

    def remove(self, name: str) -> None:
        """Remove an account, also one that cannot be read.

        Raises:
            AccountRefused: there is none of this name, or nobody could manage the others. The very
                last account may go: then the cell has a single user again.
            StoreError: the change cannot be saved.
        """
        book = self.book()
        key = next((key for key in (name, account_key(name)) if key in book.unreadable), None)
        if key is not None:
            self._remove_unread(key)
            return
        account, revision = self._existing(name)
        if len(book) + len(book.unreadable) > 1:
            self._check_last_admin(account)
        self._store.delete(
            DocumentKind.ACCOUNT, account.key, expected_revision=revision, author=self._author
        )

    def set_role(self, name: str, role: Role) -> None:
        """Give an account another role; raises as `remove` does, also for the very last one."""
        account, revision = self._existing(name)
        if role is not Role.ADMIN:
            self._check_last_admin(account)
        self._save(account.model_copy(update={"role": role}), expected_revision=revision)

    def set_disabled(self, name: str, disabled: bool) -> None:
        """Let nobody log in with an account, or let them again; raises as `set_role`."""
        account, revision = self._existing(name)
        if disabled:
            self._check_last_admin(account)
        self._save(account.model_copy(update={"disabled": disabled}), expected_revision=revision)

    def set_password(self, name: str, password: PasswordHash) -> None:
        """Give an account another password.

        Raises:
            AccountRefused: there is none of this name.
            StoreError: the change cannot be saved.
        """
        account, revision = self._existing(name)
        self._save(account.model_copy(update={"password": password}), expected_revision=revision)

    def bring(self, accounts: Sequence[Account], *, replace: bool) -> tuple[Heading, ...]:
        """Take whole accounts that were exported, all or none.

        Args:
            replace: take them instead of those of the same names; else these are refused.

        Raises:
            AccountRefused: afterwards nobody could manage the accounts.
            StoreError: they cannot be saved, or a name is taken.
        """
        with self._store.together():
            kept = {
                heading.name: heading.revision
                for heading in self._store.headings(DocumentKind.ACCOUNT)
            }
            saved = tuple(
                self._save(each, expected_revision=kept.get(each.key, 0) if replace else 0)
                for each in accounts
            )
            if not self.book().has_admin:
                text = "nobody could log in as admin afterwards; accepted: with an admin among them"
                raise AccountRefused(Refusal(VerdictCode.LAST_ADMIN, text))
        return saved

    def _remove_unread(self, key: str) -> None:
        revision = self._store.load(DocumentKind.ACCOUNT, key).heading.revision
        self._store.delete(
            DocumentKind.ACCOUNT, key, expected_revision=revision, author=self._author
        )

    def _check_last_admin(self, account: Account) -> None:
        if self.book().is_last_admin(account):
            text = f"{account.name!r} is the only admin; nobody could manage the accounts"
            raise AccountRefused(Refusal(VerdictCode.LAST_ADMIN, text))

    def _existing(self, name: str) -> tuple[Account, int]:
        book = self.book()
        found = book.find(name)
        if found is None and account_key(name) in book.unreadable:
            problem = book.unreadable[account_key(name)]
            text = f"account {name!r} cannot be read ({problem}); remove it and add it anew"
            raise AccountRefused(Refusal(VerdictCode.UNKNOWN_ACCOUNT, text))
        if found is None:
            known = ", ".join(sorted(account.name for account in book)) or "none"
            text = f"there is no account {name!r}; there are: {known}"
            raise AccountRefused(Refusal(VerdictCode.UNKNOWN_ACCOUNT, text))
        return self._load(found.key)

    def _load(self, key: str) -> tuple[Account, int]:
        document = self._store.load(DocumentKind.ACCOUNT, key)
        return read_account(key, document.body), document.heading.revision

    def _save(self, account: Account, *, expected_revision: int) -> Heading:
        return self._store.save(
            DocumentKind.ACCOUNT,
            account.key,
            account.model_dump_json(),
            expected_revision=expected_revision,
            author=self._author,
        )


class AccountAction(StrEnum):
    """Kind of a change to an account."""

    ADD = "add"
    SET_PASSWORD = "set password"
    SET_ROLE = "set role"
    DISABLE = "disable"
    ENABLE = "enable"
    REMOVE = "remove"


@dataclass(frozen=True, slots=True)
class AccountChange:
    """A change that is wanted."""

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
