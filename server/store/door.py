"""What a shell asks the store through: the store's thread, or the word that there is none."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Protocol

from openpendant.simplemsg.verdicts import VerdictCode

from .errors import StoreError
from .requests import Answer, Request


class StoreDoor(Protocol):
    """Takes requests and hands over their answers later; a `StoreWriter` does."""

    def submit(self, request: Request, on_done: Callable[[Answer], None]) -> None:
        """Take a request; `on_done` is called with its answer in a later turn of the loop."""


class NoStore(StoreError):
    """This server keeps no documents."""

    code = VerdictCode.NO_STORE


class AbsentStore:
    """Answers every request with the reason why there is no store."""

    def __init__(self, error: StoreError | None = None) -> None:
        """Say why there is none; nobody named a file where left out."""
        self._error = error or NoStore("this server was started without a store")

    def submit(self, request: Request, on_done: Callable[[Answer], None]) -> None:
        """Refuse a request."""
        asyncio.get_running_loop().call_soon(on_done, self._error)
