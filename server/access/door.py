"""What the shells ask who has an account, how passwords are checked and where the audit log is."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Protocol

from openpendant.simplemsg.verdicts import VerdictCode

from ..refusal import Refusal
from .account_changes import AccountChange
from .accounts import AccountBook
from .admission import VerifyJob
from .audit import AuditEntry
from .password_worker import Deliver as DeliverCheck

DeliverChange = Callable[[AccountChange, Refusal | None], None]
"""Called on the loop with a change and why it was not made; None where it was."""


class AccessDoor(Protocol):
    """Where accounts, passwords and the audit log of a process are; a `ProcessAccess` does it.

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
        """Read the accounts again and again; `on_change` is called when `book` is another one."""


class AbsentAccess:
    """No accounts and no audit log: everybody on this machine is its single user."""

    def __init__(self) -> None:
        """Have no account."""
        self.single_user = True
        self.book = AccountBook()

    def record(self, entry: AuditEntry) -> None:
        """Forget an entry."""

    def check(self, job: VerifyJob, deliver: DeliverCheck) -> None:
        """Find every password wrong: there is no account."""
        asyncio.get_running_loop().call_soon(deliver, job, False)

    def change(self, change: AccountChange, deliver: DeliverChange) -> None:
        """Refuse a change: there is nowhere to keep it."""
        text = "this server was started without a store, so it has no accounts"
        refusal = Refusal(VerdictCode.NO_STORE, text)
        asyncio.get_running_loop().call_soon(deliver, change, refusal)

    async def keep_up(self, on_change: Callable[[], None]) -> None:
        """Read nothing."""
