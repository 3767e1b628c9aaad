"""Waiting for what comes on a connection: each arrival lets whoever waits look again."""

from __future__ import annotations

import asyncio
from collections.abc import Callable


class News:
    """The arrivals of one connection."""

    def __init__(self) -> None:
        """Begin with nothing to tell."""
        self._came = asyncio.Event()

    def came(self) -> None:
        """Tell that something came, or that nothing will any more."""
        self._came.set()

    async def until(self, condition: Callable[[], bool], within: float) -> bool:
        """Wait until a condition on what came holds; tell whether it does within so long [s]."""
        try:
            async with asyncio.timeout(within):
                while not condition():
                    self._came.clear()
                    await self._came.wait()
        except TimeoutError:
            return False
        return True
