"""A thread with an event loop of its own, for programs that do not use asyncio.

Owns how a blocking call gets its result and how Ctrl-C cancels it. Knows nothing of pendants.
"""

from __future__ import annotations

import asyncio
import contextlib
import threading
from collections.abc import Coroutine, Iterator
from contextlib import AbstractAsyncContextManager
from typing import Any, TypeVar

_T = TypeVar("_T")


class LoopThread:
    """An event loop that runs in a daemon thread until it is ended."""

    def __init__(self, name: str) -> None:
        """Start the thread."""
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._loop.run_forever, name=name, daemon=True)
        self._thread.start()

    @property
    def is_running(self) -> bool:
        """Whether it was not ended."""
        return not self._loop.is_closed()

    def call(self, work: Coroutine[Any, Any, _T]) -> _T:
        """Run a coroutine on the loop and wait for its result; Ctrl-C cancels it.

        Raises:
            RuntimeError: called from the loop's own thread, which would wait for itself, or after
                `end`.
        """
        if threading.current_thread() is self._thread or self._loop.is_closed():
            work.close()
            if self._loop.is_closed():
                raise RuntimeError("the client is closed")
            raise RuntimeError("a callback must not make a blocking call: it runs on the loop")
        future = asyncio.run_coroutine_threadsafe(work, self._loop)
        try:
            return future.result()
        except KeyboardInterrupt:
            future.cancel()
            raise

    @contextlib.contextmanager
    def entered(self, manager: AbstractAsyncContextManager[_T]) -> Iterator[_T]:
        """Hold an asynchronous context for the length of this one."""
        value = self.call(_enter(manager))
        try:
            yield value
        except BaseException as error:
            if not self.call(_leave(manager, error)):
                raise
        else:
            self.call(_leave(manager, None))

    def end(self) -> None:
        """Stop the loop and its thread; a second call does nothing."""
        if self._loop.is_closed():
            return
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join()
        self._loop.close()


async def _enter(manager: AbstractAsyncContextManager[_T]) -> _T:
    return await manager.__aenter__()


async def _leave(
    manager: AbstractAsyncContextManager[Any], error: BaseException | None
) -> bool | None:
    kind, trace = (None, None) if error is None else (type(error), error.__traceback__)
    return await manager.__aexit__(kind, error, trace)
