"""Client of the document store: its default path, its opening, and requests to its thread.

Owns the default path of the store's file, and the answers when there is no store. A server without
a store still moves robots, so `AbsentStore` answers every request with the reason.
"""

from __future__ import annotations

import asyncio
import logging
import os
from collections.abc import AsyncIterator, Callable, Mapping
from contextlib import asynccontextmanager
from functools import partial
from pathlib import Path
from typing import Protocol

from openpendant.simplemsg.verdicts import VerdictCode

from ..settings.cell_settings import StoreFile
from ..settings.config_file import OFF
from .requests import Answer, Request
from .sqlite_store import open_store
from .store_errors import StoreError
from .writer import StoreWriter


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


log = logging.getLogger("openpendant.server")


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
