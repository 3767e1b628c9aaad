"""Client of the document store: its default path, its opening, and requests to its thread.

Owns the default path of the store's file, and the answers when there is no store. A server without
a store still moves robots, so `AbsentStore` answers every request with the reason.

Owns the one thread of the store, so that a slow disk holds up neither event loop nor robot.
Requests are done in the order they came; each gets exactly one answer, and a change is answered
after the disk has it. Waiting requests are bounded in number and in bytes: more are answered at
once with `StoreBusy`.
"""

from __future__ import annotations

import asyncio
import logging
import os
import threading
from collections import deque
from collections.abc import AsyncIterator, Callable, Mapping
from concurrent.futures import Future
from contextlib import asynccontextmanager
from functools import partial
from pathlib import Path
from typing import Protocol

from openpendant.simplemsg.verdicts import VerdictCode

from ..settings.cell_settings import StoreFile
from ..settings.config_file import OFF
from .documents import Store
from .requests import Answer, Request, perform, size_of
from .sqlite_store import open_store
from .store_errors import StoreBusy, StoreError, StoreFailed

MOST_WAITING = 1_024
"""Greatest number of requests that wait for a slow disk."""

MOST_WAITING_BYTES = 64 << 20
"""Greatest number of bytes of documents and chunks that wait."""

_FAREWELL = 5.0

log = logging.getLogger("openpendant.server")

OnDone = Callable[[Answer], None]
Call = Callable[[], None]


class StoreWriter:
    """Store with a thread of its own.

    Attributes:
        is_failing: the last change could not be saved; for the log, which must not fill.
    """

    def __init__(
        self, open_store: Callable[[], Store], hand_over: Callable[[Call], object]
    ) -> None:
        """Start the thread and wait until it has opened the store.

        Args:
            open_store: opens it; called in the thread, which also closes it.
            hand_over: schedules a call in the thread that takes answers; with asyncio the loop's
                `call_soon_threadsafe`.

        Raises:
            StoreError: the store cannot be opened.
        """
        self._hand_over = hand_over
        self._turn = threading.Condition()
        self._waiting: deque[tuple[Request, OnDone]] = deque()
        self._waiting_bytes = 0
        self._is_closing = False
        self.is_failing = False
        opened: Future[None] = Future()
        self._thread = threading.Thread(
            target=self._run, args=(open_store, opened), name="store", daemon=True
        )
        self._thread.start()
        opened.result()

    def submit(self, request: Request, on_done: OnDone) -> None:
        """Queue a request; `on_done` gets its answer later, never within this call."""
        with self._turn:
            refusal = self._refusal(request)
            if refusal is None:
                self._waiting.append((request, on_done))
                self._waiting_bytes += size_of(request)
                self._turn.notify()
        if refusal is not None:
            self._deliver(on_done, refusal)

    def close(self) -> bool:
        """Carry out the waiting requests, for at most 5 s, and close the store.

        Returns:
            True if all were carried out; a disk that hangs may prevent the rest.
        """
        with self._turn:
            self._is_closing = True
            self._turn.notify()
        self._thread.join(_FAREWELL)
        if self._thread.is_alive():
            log.error("the disk did not take what was to be saved within %g s", _FAREWELL)
            return False
        return True

    def _refusal(self, request: Request) -> StoreError | None:
        if self._is_closing:
            return StoreBusy("the store is being closed")
        if len(self._waiting) >= MOST_WAITING:
            return StoreBusy(f"{len(self._waiting)} requests wait for the disk; at most that many")
        if self._waiting_bytes + size_of(request) > MOST_WAITING_BYTES:
            return StoreBusy(
                f"{self._waiting_bytes} bytes wait for the disk; at most {MOST_WAITING_BYTES}"
            )
        return None

    def _run(self, open_store: Callable[[], Store], opened: Future[None]) -> None:
        try:
            store = open_store()
        except BaseException as error:
            opened.set_exception(error)
            return
        opened.set_result(None)
        while (taken := self._next()) is not None:
            request, on_done = taken
            self._deliver(on_done, self._answer(store, request))
        try:
            store.close()
        except StoreError as error:
            log.error("the store was not closed well: %s", error)

    def _next(self) -> tuple[Request, OnDone] | None:
        with self._turn:
            while not self._waiting and not self._is_closing:
                self._turn.wait()
            if not self._waiting:
                return None
            request, on_done = self._waiting.popleft()
            self._waiting_bytes -= size_of(request)
            return request, on_done

    def _answer(self, store: Store, request: Request) -> Answer:
        try:
            answer: Answer = perform(store, request)
        except StoreFailed as error:
            # Logged once per period of failure: the log must not fill the disk that is full.
            if not self.is_failing:
                log.error("the store fails: %s", error)
            self.is_failing = True
            return error
        except StoreError as error:
            return error
        except Exception as error:
            # A fault of ours: the client gets an answer, and the next request is served.
            log.exception("a request to the store failed")
            return StoreFailed(f"{type(error).__name__}: {error}")
        self.is_failing = False
        return answer

    def _deliver(self, on_done: OnDone, answer: Answer) -> None:
        try:
            self._hand_over(lambda: on_done(answer))
        except RuntimeError as error:
            # The loop ended before the answer; the change itself is on the disk.
            log.info("nobody waits for an answer of the store any more: %s", error)


class StoreClient(Protocol):
    """Interface that takes requests and answers them later; `StoreWriter` implements it."""

    def submit(self, request: Request, on_done: Callable[[Answer], None]) -> None:
        """Take a request; `on_done` is called with its answer in a later turn of the loop."""


class NoStore(StoreError):
    """Refusal of a server that keeps no documents."""

    code = VerdictCode.NO_STORE


class AbsentStore:
    """Store client that answers every request with the reason why there is no store."""

    def __init__(self, error: StoreError | None = None) -> None:
        """Take the reason; by default, that nobody named a file."""
        self._error = error or NoStore("this server was started without a store")

    def submit(self, request: Request, on_done: Callable[[Answer], None]) -> None:
        """Refuse a request."""
        asyncio.get_running_loop().call_soon(on_done, self._error)


STORE_VARIABLE = "OPENPENDANT_STORE"
"""Environment variable: the store's file."""


def default_path(environment: Mapping[str, str] = os.environ) -> Path:
    """Return the file that the environment names, else the one in the user's data folder."""
    named = environment.get(STORE_VARIABLE)
    if named:
        return Path(named)
    data = environment.get("XDG_DATA_HOME")
    folder = Path(data) if data else Path.home() / ".local" / "share"
    return folder / "openpendant" / "store.db"


@asynccontextmanager
async def opened_store(settings: StoreFile) -> AsyncIterator[StoreClient]:
    """Keep the store open while the context lasts.

    Yields:
        The store; where it cannot be opened, what answers every request with the reason.
    """
    if settings.path == OFF:
        yield AbsentStore()
        return
    path = Path(settings.path) if settings.path else default_path()
    hand_over = asyncio.get_running_loop().call_soon_threadsafe
    try:
        writer = await asyncio.to_thread(StoreWriter, partial(open_store, path), hand_over)
    except StoreError as error:
        log.error("no programs are kept: %s", error)
        yield AbsentStore(error)
        return
    try:
        yield writer
    finally:
        await asyncio.to_thread(writer.close)
