"""A thread with an event loop of its own, for programs that do not use asyncio.

Owns how a blocking call gets its result, how Ctrl-C cancels it, and that no call outlives the loop:
one that waits when the loop is ended, and one that comes after, fails with `ConnectionLost`.
"""

from __future__ import annotations

import asyncio
import concurrent.futures
import contextlib
import threading
from collections.abc import Callable, Coroutine, Iterator
from contextlib import AbstractAsyncContextManager
from typing import Any, TypeVar

from .connection_errors import ConnectionLost

_T = TypeVar("_T")

_WIND_UP = 2.0
"""Time for cancelled tasks to end [s]."""

_CLOSED = "the client is closed"


class LoopThread:
    """An event loop that runs in a daemon thread until it is ended."""

    def __init__(self, name: str) -> None:
        self._loop = asyncio.new_event_loop()
        # Guards both: what is handed to the loop is there when the loop is told to end.
        self._lock = threading.Lock()
        self._has_ended = False
        self._is_closed = False
        self._open: set[concurrent.futures.Future[Any]] = set()
        self._thread = threading.Thread(target=self._run, name=name, daemon=True)
        self._thread.start()

    def call(self, work: Coroutine[Any, Any, _T]) -> _T:
        """Run a coroutine on the loop and wait for its result; Ctrl-C cancels it.

        Raises:
            ConnectionLost: the loop was ended, before or meanwhile.
            RuntimeError: called from the loop's own thread, which would wait for itself.
        """
        future = self._hand_over(work)
        try:
            return future.result()
        except concurrent.futures.CancelledError:
            if self._has_ended:
                raise ConnectionLost(_CLOSED) from None
            raise
        except KeyboardInterrupt:
            future.cancel()
            raise
        finally:
            with self._lock:
                self._open.discard(future)

    def _hand_over(self, work: Coroutine[Any, Any, _T]) -> concurrent.futures.Future[_T]:
        """Put a coroutine on the loop; one that cannot be is closed."""
        if self._is_current():
            work.close()
            raise RuntimeError("a callback must not make a blocking call: it runs on the loop")
        with self._lock:
            if not self._has_ended:
                future = asyncio.run_coroutine_threadsafe(work, self._loop)
                self._open.add(future)
                return future
        work.close()
        raise ConnectionLost(_CLOSED)

    @contextlib.contextmanager
    def entered(
        self,
        manager: AbstractAsyncContextManager[_T],
        misses: Callable[[], bool] = lambda: False,
    ) -> Iterator[_T]:
        """Hold an asynchronous context for the length of this one.

        Where the loop was ended inside, there is nothing left to leave.

        Args:
            misses: returns True if a context that could not be left owes its user a result.

        Raises:
            ConnectionLost: the same, where the context owes something; or the loop broke.
        """
        value = self.call(_enter(manager))
        try:
            yield value
        except BaseException as error:
            is_handled: bool | None = False
            # Where the loop was ended meanwhile, what left the block is the better account.
            with contextlib.suppress(ConnectionLost):
                is_handled = self.call(_leave(manager, error))
            if not is_handled:
                raise
        else:
            try:
                self.call(_leave(manager, None))
            except ConnectionLost:
                if not self._is_closed or misses():
                    raise

    def end(self) -> None:
        """Cancel all calls and end the thread; a second call waits for that too.

        Raises:
            RuntimeError: called from the loop's own thread, which would wait for itself.
        """
        if self._is_current():
            raise RuntimeError("a callback must not close the client: it runs on the loop")
        with self._lock:
            is_first, self._has_ended = not self._has_ended, True
            self._is_closed = self._is_closed or is_first
            if is_first:
                self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join()

    def _is_current(self) -> bool:
        return threading.current_thread() is self._thread

    def _run(self) -> None:
        try:
            self._loop.run_forever()
        finally:
            with self._lock:
                self._has_ended = True  # also where a callback broke the loop
            try:
                self._loop.run_until_complete(self._wind_up())
            finally:
                self._loop.close()
                with self._lock:
                    left, self._open = self._open, set()
                for future in left:
                    _fail(future)

    async def _wind_up(self) -> None:
        """Cancel every task, and wait a little until they are over."""
        tasks = asyncio.all_tasks() - {asyncio.current_task()}
        for task in tasks:
            task.cancel()
        if tasks:
            await asyncio.wait(tasks, timeout=_WIND_UP)
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(_WIND_UP):
                await self._loop.shutdown_asyncgens()


def _fail(future: concurrent.futures.Future[Any]) -> None:
    """Fail a future that nothing will complete any more."""
    with contextlib.suppress(concurrent.futures.InvalidStateError):
        future.set_exception(ConnectionLost(_CLOSED))


async def _enter(manager: AbstractAsyncContextManager[_T]) -> _T:
    return await manager.__aenter__()


async def _leave(
    manager: AbstractAsyncContextManager[Any], error: BaseException | None
) -> bool | None:
    kind, trace = (None, None) if error is None else (type(error), error.__traceback__)
    return await manager.__aexit__(kind, error, trace)
