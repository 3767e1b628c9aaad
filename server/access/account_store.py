"""Accounts in the store: how one is written as a document, and the changes that keep a cell usable.

Owns the rules of the set: no two accounts that differ in capitals alone, and always somebody who
can manage the others. Every call blocks on the disk and so stays off the event loop.
"""

from __future__ import annotations

from pydantic import ValidationError

from openpendant.simplemsg.verdicts import VerdictCode

from ..refusal import Refusal
from ..store.documents import DocumentKind
from ..store.errors import BadDocument
from ..store.store import Store
from .accounts import Account, AccountBook
from .passwords import PasswordHash
from .roles import Role


class AccountRefused(Exception):
    """A change of accounts that is not made.

    Attributes:
        refusal: why.
    """

    def __init__(self, refusal: Refusal) -> None:
        super().__init__(refusal.sentence)
        self.refusal = refusal


class StoredAccounts:
    """The accounts that a store keeps."""

    def __init__(self, store: Store, author: str) -> None:
        """Take a store, and the name under which changes are saved."""
        self._store = store
        self._author = author

    def book(self) -> AccountBook:
        """Return the accounts as they are now.

        Raises:
            StoreError: they cannot be read, or one of them is none.
        """
        headings = self._store.headings(DocumentKind.ACCOUNT)
        return AccountBook(self._load(heading.name)[0] for heading in headings)

    def add(self, account: Account) -> None:
        """Add an account.

        Raises:
            AccountRefused: there is one of this name; or it is the first, and no admin.
            StoreError: it cannot be saved.
        """
        book = self.book()
        if book.find(account.name) is not None:
            text = f"there is an account {account.name!r} already"
            raise AccountRefused(Refusal(VerdictCode.ACCOUNT_EXISTS, text))
        if not len(book) and account.role is not Role.ADMIN:
            text = f"the first account has to be admin, not {account.role.value}"
            raise AccountRefused(Refusal(VerdictCode.LAST_ADMIN, text))
        self._save(account, expected_revision=0)

    def remove(self, name: str) -> None:
        """Remove an account.

        Raises:
            AccountRefused: there is none of this name, or nobody could manage the others. The very
                last account may go: then the cell has a single user again.
            StoreError: the change cannot be saved.
        """
        account, revision = self._existing(name)
        if len(self.book()) > 1:
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

    def _check_last_admin(self, account: Account) -> None:
        if self.book().is_last_admin(account):
            text = f"{account.name!r} is the only admin; nobody could manage the accounts"
            raise AccountRefused(Refusal(VerdictCode.LAST_ADMIN, text))

    def _existing(self, name: str) -> tuple[Account, int]:
        found = self.book().find(name)
        if found is None:
            known = ", ".join(sorted(account.name for account in self.book())) or "none"
            text = f"there is no account {name!r}; there are: {known}"
            raise AccountRefused(Refusal(VerdictCode.UNKNOWN_ACCOUNT, text))
        return self._load(found.key)

    def _load(self, key: str) -> tuple[Account, int]:
        document = self._store.load(DocumentKind.ACCOUNT, key)
        try:
            account = Account.model_validate_json(document.body)
        except ValidationError as error:
            # Without the input: it holds the hash.
            first = error.errors(include_url=False, include_input=False, include_context=False)[0]
            place = ".".join(str(part) for part in first["loc"])
            raise BadDocument(f"account {key!r}", first["msg"], place=place) from None
        return account, document.heading.revision

    def _save(self, account: Account, *, expected_revision: int) -> None:
        self._store.save(
            DocumentKind.ACCOUNT,
            account.key,
            account.model_dump_json(),
            expected_revision=expected_revision,
            author=self._author,
        )
