"""Access backend: the interface to accounts, password checks and the audit log of a process."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from ..refusal import Refusal
from .account_store import AccountChange
from .accounts import AccountBook
from .admission import VerifyJob
from .audit import AuditEntry
from .password_worker import Deliver as DeliverCheck

DeliverChange = Callable[[Refusal | None], None]
"""Called on the loop with why a change was not made; None where it was."""


class AccessBackend(Protocol):
    """Accounts, password checks and audit log of a process; `ProcessAccess` implements it.

    Attributes:
        single_user: without any account, whoever is on this machine may do everything.
        book: the accounts as they were read last.
    """

    single_user: bool
    book: AccountBook

    def record(self, entry: AuditEntry) -> None:
        """Note an entry; returns at once."""

    def check(self, job: VerifyJob, deliver: DeliverCheck) -> None:
        """Check a password; `deliver` is called in a later turn of the loop."""

    def change(self, change: AccountChange, deliver: DeliverChange) -> None:
        """Change an account; `deliver` is called in a later turn of the loop."""

    async def keep_up(self, on_change: Callable[[], None]) -> None:
        """Read the accounts periodically; call `on_change` when `book` has changed."""
