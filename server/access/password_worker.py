"""Password worker: one niced thread beside the event loop, with a bounded queue of checks.

A thread suffices because `hashlib.scrypt` lets go of the interpreter's lock while it works; a test
measures that the loop goes on meanwhile. One thread is enough for a class, and leaves an attacker
no more than one core's idle time.
"""

from __future__ import annotations

import asyncio
import logging
import os
import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from functools import partial

from openpendant.simplemsg.verdicts import VerdictCode

from ..refusal import Refusal
from .admission import VerifyJob
from .passwords import SALT_BYTES, PasswordHash, hash_password, is_password
from .secret import Secret

log = logging.getLogger("openpendant.server")

MOST_WAITING = 64
"""Jobs that may wait: a class of 30 that logs in at once, twice."""

_NICENESS = 10

Deliver = Callable[[bool | None], None]
"""Called on the loop with whether the password was right; None for not checked."""


class PasswordWorker:
    """Checks passwords one after the other."""

    def __init__(self, most_waiting: int = MOST_WAITING) -> None:
        """Make a worker whose thread starts with the first job."""
        self._most_waiting = most_waiting
        self._under_way = 0
        self._thread = ThreadPoolExecutor(1, "passwords", initializer=_step_back)

    def submit(self, job: VerifyJob, deliver: Deliver) -> None:
        """Check a password; `deliver` is called from the loop, never from within this call."""
        loop = asyncio.get_running_loop()
        if self._under_way >= self._most_waiting:
            loop.call_soon(deliver, None)
            return
        self._under_way += 1
        checked = loop.run_in_executor(self._thread, is_password, job.password, job.kept)
        checked.add_done_callback(partial(self._done, deliver))

    async def hash(self, password: Secret) -> PasswordHash | Refusal:
        """Return what is to be kept of a new password, or why it cannot be hashed now."""
        if self._under_way >= self._most_waiting:
            return Refusal(VerdictCode.LOGIN_BUSY)
        self._under_way += 1
        try:
            loop = asyncio.get_running_loop()
            salt = os.urandom(SALT_BYTES)
            return await loop.run_in_executor(self._thread, hash_password, password, salt)
        finally:
            self._under_way -= 1

    def close(self) -> None:
        """End the thread; jobs that it has not started are dropped."""
        self._thread.shutdown(wait=False, cancel_futures=True)

    def _done(self, deliver: Deliver, checked: asyncio.Future[bool]) -> None:
        self._under_way -= 1
        if checked.cancelled():
            return
        error = checked.exception()
        if error is not None:  # OpenSSL found no memory; the reason is no secret
            log.error("a password could not be checked: %s", error)
        deliver(None if error is not None else checked.result())


def _step_back() -> None:
    """Lower the thread's priority below the event loop's; Linux has a niceness for each thread."""
    with suppress(AttributeError, OSError):
        os.setpriority(os.PRIO_PROCESS, threading.get_native_id(), _NICENESS)
