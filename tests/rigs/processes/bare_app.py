"""A server with nothing beside its cells: no store, accounts or watchdog but what is given."""

import asyncio
from collections.abc import Callable, Sequence

from openpendant.server.access.access_backend import DeliverChange, DeliverCheck
from openpendant.server.access.accounts import AccountBook, AccountChange
from openpendant.server.access.admission import VerifyJob
from openpendant.server.access.audit import AuditEntry
from openpendant.server.refusal import Refusal
from openpendant.server.shell.app import App
from openpendant.server.shell.cell_shell import CellParts
from openpendant.server.shell.inbox import loop_time
from openpendant.server.store.store_client import AbsentStore, StoreClient
from openpendant.server.watchdog.watchdog_process import Watchdog
from openpendant.simplemsg.journal import Journal
from openpendant.simplemsg.verdicts import VerdictCode


class NoAccess:
    """No accounts and no audit log: everybody on this machine is its single user."""

    def __init__(self) -> None:
        self.single_user = True
        self.book = AccountBook()

    def record(self, entry: AuditEntry) -> None:
        """Forget an entry."""

    def check(self, job: VerifyJob, deliver: DeliverCheck) -> None:
        """Find every password wrong: there is no account."""
        asyncio.get_running_loop().call_soon(deliver, False)

    def withdraw(self, job_id: int) -> None:
        """Take nothing back: every answer is on its way."""

    def change(self, change: AccountChange, deliver: DeliverChange) -> None:
        """Refuse a change: there is nowhere to keep it."""
        asyncio.get_running_loop().call_soon(deliver, Refusal(VerdictCode.NO_STORE, "no accounts"))

    async def keep_up(self, on_change: Callable[[], None]) -> None:
        """Read nothing."""


def bare_app(
    served: Sequence[CellParts],
    journal: Journal | None = None,
    store: StoreClient | None = None,
    watchdog: Watchdog | None = None,
    clock: Callable[[], int] = loop_time,
    access: NoAccess | None = None,
) -> App:
    """Return a server without what is left out."""
    parts = journal or Journal(), store or AbsentStore(), access or NoAccess(), watchdog
    return App(served, *parts, clock=clock)
