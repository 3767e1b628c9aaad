"""Opening the store that a server's settings name; a server without one still moves robots."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from functools import partial
from pathlib import Path

from ..configuration_file import OFF
from ..settings import StoreFile
from .door import AbsentStore, StoreDoor
from .errors import StoreError
from .location import default_path
from .sqlite_store import open_store
from .writer import StoreWriter

log = logging.getLogger("openpendant.server")


@asynccontextmanager
async def opened_store(settings: StoreFile) -> AsyncIterator[StoreDoor]:
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
