"""Access backend of a process: its accounts, password checks and audit log, beside the event loop.

Owns when the accounts are read again, and that neither hashing nor the disk is waited for on the
event loop: threads and files, no decisions. The accounts are read and changed as `openpendant
users` does beside the server, by an open file of their own.

Passwords are checked by one niced thread beside the event loop, one after the other, in the order
of `login_queue`. A thread suffices because `hashlib.scrypt` lets go of the interpreter's lock while
it works; a test measures that the loop goes on meanwhile. One thread is enough for a class, and
leaves an attacker no more than one core's idle time.
"""

from __future__ import annotations

import asyncio
import logging
import os
import shlex
import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing, suppress
from dataclasses import dataclass
from functools import partial
from itertools import count
from pathlib import Path
from typing import Protocol

from openpendant.simplemsg.verdicts import VerdictCode

from ..refusal import Refusal
from ..store.sqlite_store import open_for_reading, open_store
from ..store.store_errors import StoreError
from .accounts import (
    AccountBook,
    AccountChange,
    AccountRefused,
    StoredAccounts,
    change_fault,
    make_change,
)
from .admission import VerifyJob
from .audit import AuditEntry, AuditEvent
from .audit_file import AuditLog
from .login_queue import MOST_WAITING, SLOWED_FROM, LoginQueue, QueuedCheck
from .passwords import SALT_BYTES, PasswordHash, Secret, hash_password, is_password

log = logging.getLogger("openpendant.server")

_NICENESS = 10

_NEW_PASSWORDS = "new passwords"
"""Stands for the address of whoever gives an account a password, which takes turns with those of
the logins; no address is called so."""

DeliverCheck = Callable[[bool | None], None]
"""Called on the loop with whether the password was right; None for not checked."""


Slowed = Callable[[str, int], None]
"""Told which address is checked slowly from now on, and the time [ns]."""

_Outcome = bool | PasswordHash | None


@dataclass(frozen=True, slots=True, eq=False)
class _Work:
    """What the thread is to compute.

    Attributes:
        deliver: called on the loop with the outcome; None where it was not computed.
        job_id: of the login that it belongs to; None for none.
    """

    compute: Callable[[], bool | PasswordHash]
    deliver: Callable[[_Outcome], None]
    job_id: int | None = None


class PasswordWorker:
    """Checks and hashes passwords, one after the other."""

    def __init__(self, most_waiting: int = MOST_WAITING, slowed: Slowed | None = None) -> None:
        """Make a worker whose thread starts with the first job.

        Args:
            most_waiting: so many may wait, beside the one under way.
            slowed: is told of addresses that guess too much; nobody is where left out.
        """
        self._queue = LoginQueue(most_waiting)
        self._slowed = slowed
        self._works: dict[int, _Work] = {}
        self._numbers = count(1)
        self._timer: asyncio.TimerHandle | None = None
        self._thread = ThreadPoolExecutor(1, "passwords", initializer=_step_back)

    def submit(self, job: VerifyJob, deliver: DeliverCheck) -> None:
        """Check a password; `deliver` is called from the loop, never from within this call."""

        def told(outcome: _Outcome) -> None:
            deliver(outcome if isinstance(outcome, bool) else None)

        check = QueuedCheck(next(self._numbers), job.source, job.account, job.has_failed)
        compute = partial(is_password, job.password, job.kept)
        self._put(check, _Work(compute, told, job.job_id))

    def withdraw(self, job_id: int) -> None:
        """Check a password no more that still waits; its answer is that it was not checked."""
        number = next((each for each, work in self._works.items() if work.job_id == job_id), None)
        if number is not None and self._queue.withdraw(number):
            self._give_up(number)

    async def hash(self, password: Secret, author: str) -> PasswordHash | Refusal:
        """Return what is to be kept of a new password, or why it cannot be hashed now.

        Args:
            author: who gives it; each has his turn.
        """
        hashed: asyncio.Future[_Outcome] = asyncio.get_running_loop().create_future()

        def told(outcome: _Outcome) -> None:
            if not hashed.done():
                hashed.set_result(outcome)

        compute = partial(hash_password, password, os.urandom(SALT_BYTES))
        self._put(QueuedCheck(next(self._numbers), _NEW_PASSWORDS, author), _Work(compute, told))
        outcome = await hashed
        return outcome if isinstance(outcome, PasswordHash) else Refusal(VerdictCode.LOGIN_BUSY)

    def close(self) -> None:
        """End the thread; jobs that it has not started are dropped."""
        if self._timer is not None:
            self._timer.cancel()
        self._thread.shutdown(wait=False, cancel_futures=True)

    def _put(self, check: QueuedCheck, work: _Work) -> None:
        self._works[check.number] = work
        turned_away = self._queue.put(check)
        if turned_away is not None:
            self._give_up(turned_away.number)
        self._go_on()

    def _give_up(self, number: int) -> None:
        work = self._works.pop(number)
        asyncio.get_running_loop().call_soon(work.deliver, None)

    def _go_on(self) -> None:
        """Begin the next job, unless one is under way or all that wait go slowly."""
        if self._queue.under_way is not None:
            return
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
        loop = asyncio.get_running_loop()
        check = self._queue.take(_now(loop))
        if isinstance(check, int):
            self._timer = loop.call_later(check / 1e9, self._go_on)
        elif check is not None:
            work = self._works.pop(check.number)
            computed = loop.run_in_executor(self._thread, work.compute)
            computed.add_done_callback(partial(self._done, check, work))

    def _done(
        self, check: QueuedCheck, work: _Work, computed: asyncio.Future[bool | PasswordHash]
    ) -> None:
        if computed.cancelled():  # the server ends
            return
        error = computed.exception()
        if error is not None:
            # OpenSSL found no memory. By its kind alone: what an error says may hold what it was
            # given.
            log.error("a password could not be checked: %s", type(error).__name__)
        outcome = None if error is not None else computed.result()
        now = _now(asyncio.get_running_loop())
        is_slowed = self._queue.settle(outcome if isinstance(outcome, bool) else None, now)
        self._go_on()
        if is_slowed and self._slowed is not None:
            self._slowed(check.source, now)
        work.deliver(outcome)


def _now(loop: asyncio.AbstractEventLoop) -> int:
    return int(loop.time() * 1e9)


def _step_back() -> None:
    """Lower the thread's priority below the event loop's; Linux has a niceness for each thread."""
    with suppress(AttributeError, OSError):
        os.setpriority(os.PRIO_PROCESS, threading.get_native_id(), _NICENESS)


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

    def withdraw(self, job_id: int) -> None:
        """Check a password no more that still waits; `deliver` is told that it was not checked."""

    def change(self, change: AccountChange, deliver: DeliverChange) -> None:
        """Change an account; `deliver` is called in a later turn of the loop."""

    async def keep_up(self, on_change: Callable[[], None]) -> None:
        """Read the accounts periodically; call `on_change` when `book` has changed."""


READ_PERIOD = 2.0
"""Pause between two looks at the accounts [s]."""

_Signature = tuple[tuple[int, int, int], ...]


class ProcessAccess:
    """The accounts in a store's file, the password worker and the audit log."""

    def __init__(
        self,
        file: Path | None,
        book: AccountBook,
        *,
        single_user: bool,
        audit: AuditLog | None = None,
        read_period: float = READ_PERIOD,
    ) -> None:
        """Take over what was read at the start.

        Args:
            file: the store's file; it need not be there yet. None where nothing is kept.
            audit: the audit log; none is kept where left out. It is closed with this.
            read_period: pause between two looks at the accounts [s].
        """
        self.single_user = single_user
        self.book = book
        self._file = file
        self._audit = audit
        self._period = read_period
        self._passwords = PasswordWorker(slowed=self._note_slowed)
        self._thread = ThreadPoolExecutor(1, "accounts")
        self._seen: _Signature | None = None
        self._is_troubled = False
        self._on_change: Callable[[], None] = lambda: None
        self._changing: set[asyncio.Task[None]] = set()

    def close(self) -> None:
        """End the threads; what waits for the audit log is written, for at most two seconds."""
        self._passwords.close()
        self._thread.shutdown(wait=False, cancel_futures=True)
        if self._audit is not None:
            self._audit.close()

    def record(self, entry: AuditEntry) -> None:
        """Note an entry; returns at once."""
        if self._audit is not None:
            self._audit.record(entry)

    def check(self, job: VerifyJob, deliver: DeliverCheck) -> None:
        """Check a password; `deliver` is called in a later turn of the loop."""
        self._passwords.submit(job, deliver)

    def withdraw(self, job_id: int) -> None:
        """Check a password no more that still waits; `deliver` is told that it was not checked."""
        self._passwords.withdraw(job_id)

    def _note_slowed(self, source: str, now: int) -> None:
        about = {"failures": SLOWED_FROM}
        self.record(AuditEntry(AuditEvent.LOGINS_SLOWED, now, source=source, detail=about))

    def change(self, change: AccountChange, deliver: DeliverChange) -> None:
        """Change an account; `deliver` is called in a later turn of the loop."""
        task = asyncio.get_running_loop().create_task(self._carry_out(change, deliver))
        self._changing.add(task)
        task.add_done_callback(self._changing.discard)

    async def _carry_out(self, change: AccountChange, deliver: DeliverChange) -> None:
        refusal = change_fault(change)
        hashed: PasswordHash | None = None
        if refusal is None and change.password is not None:
            outcome = await self._passwords.hash(change.password, change.author)
            if isinstance(outcome, Refusal):
                refusal = outcome
            else:
                hashed = outcome
        if refusal is None:
            loop = asyncio.get_running_loop()
            refusal = await loop.run_in_executor(self._thread, self._make, change, hashed)
            await self._look()
        deliver(refusal)

    def _make(self, change: AccountChange, hashed: PasswordHash | None) -> Refusal | None:
        if self._file is None:
            return Refusal(VerdictCode.NO_STORE)
        try:
            with closing(open_store(self._file)) as store:
                make_change(StoredAccounts(store, change.author or "admin"), change, hashed)
        except AccountRefused as error:
            return error.refusal
        except StoreError as error:
            return Refusal(error.code, str(error))
        return None

    async def keep_up(self, on_change: Callable[[], None]) -> None:
        """Read the accounts periodically; call `on_change` when `book` has changed."""
        self._on_change = on_change
        while True:
            await asyncio.sleep(self._period)
            await self._look()

    async def _look(self) -> None:
        loop = asyncio.get_running_loop()
        book = await loop.run_in_executor(self._thread, self._read)
        if book is not None and book != self.book:
            for warning in unreadable_accounts(book):
                log.error("%s", warning)
            self.book = book
            self._on_change()

    def _read(self) -> AccountBook | None:
        """Return the accounts if the file was changed; None where it was not, or on trouble."""
        if self._file is None:
            return None
        signature = _signature(self._file)
        if signature == self._seen or not signature:
            return None
        try:
            with closing(open_for_reading(self._file)) as store:
                book = StoredAccounts(store, "").book()
        except StoreError as error:
            # The accounts read last stay in force; each period of failure is logged once.
            if not self._is_troubled:
                log.error("the accounts cannot be read: %s", error)
            self._is_troubled = True
            return None
        self._is_troubled = False
        self._seen = signature
        return book


def _signature(file: Path) -> _Signature:
    """Return what changes whenever the store's file or its log does."""
    found = []
    for each in (file, file.with_name(file.name + "-wal")):
        try:
            status = os.stat(each)
        except OSError:
            continue
        found.append((status.st_ino, status.st_mtime_ns, status.st_size))
    return tuple(found)


def unreadable_accounts(book: AccountBook) -> tuple[str, ...]:
    """Return a sentence for each document that is no account."""
    return tuple(
        f"account {key!r} cannot be read, so nobody logs in with it: {why};"
        f" remove it with: openpendant users remove {shlex.quote(key)}"
        for key, why in book.unreadable.items()
    )


def read_at_start(file: Path) -> tuple[AccountBook, bool]:
    """Read the accounts before the server listens.

    A broken file is set aside, and then nobody knows who had an account.

    Args:
        file: the store's file; where there is none, there is no account.

    Returns:
        The accounts, and whether without any the machine's user may do everything.

    Raises:
        StoreError: the file belongs to another program, is of a later version or cannot be opened.
    """
    if not file.exists():
        return AccountBook(), True
    with closing(open_store(file)) as store:
        return StoredAccounts(store, "").book(), store.set_aside is None
