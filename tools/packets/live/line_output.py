"""Line output to a file that never holds up the traffic.

Owns the buffer in front of the file, the size limit, and what happens when the file cannot be
written: writing ends for good and says why; nobody is stopped by it. The file is its owner's alone:
what people typed is in the frames. Lines are collected here and
written by an executor, since a full pipe or a slow disk blocks.
"""

from __future__ import annotations

import asyncio
import os
import select
import stat
import sys
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from threading import Event as Flag

from openpendant.simplemsg.journal_writer import open_for_owner

FLUSH_PERIOD = 0.1
"""Lines reach the file within this time [s]."""

MAX_BACKLOG = 64 * 1024 * 1024
"""A file or reader that is further behind than this ends it [bytes]."""

GIVE_UP = 2.0
"""At the end, a reader of a pipe has this time to take the rest [s]."""

_PIPE_SHARE = 4096  # a pipe that takes anything takes this much without blocking
_POLL = 0.05


class LineOutput:
    """A file of lines that is being written, or standard output.

    It is opened by `start`, so that a run that cannot start does not destroy its content.

    Attributes:
        ended: why nothing more is written, empty while all is well.
        failed: the reason is a failure, not the size limit.
        written: bytes accepted so far.
    """

    def __init__(
        self,
        path: str,
        *,
        max_size: int | None = None,
        on_end: Callable[[str], None] = lambda reason: None,
    ) -> None:
        """Take lines for a file, "-" for standard output; it is left alone until `start`."""
        self._path = path
        self._file: int | None = None
        self._is_never_waited_for = False
        self.ended = ""
        self.failed = False
        self.written = 0
        self._max_size = max_size
        self._on_end = on_end
        self._buffer = bytearray()
        self._executor = ThreadPoolExecutor(1, "line-output")
        self._gives_up = Flag()
        self._task: asyncio.Task[None] | None = None
        self._stopping = asyncio.Event()

    def start(self) -> None:
        """Open the file, emptied, and start to flush on the running loop; OSError if it cannot."""
        self._file = _open(self._path)
        # Windows can wait for sockets only; there a reader that takes nothing is waited for.
        is_file = stat.S_ISREG(os.fstat(self._file).st_mode)
        self._is_never_waited_for = is_file or sys.platform == "win32"
        self._task = asyncio.get_running_loop().create_task(self._flush_often())

    def write(self, line: str) -> None:
        """Take a line without its line feed; does nothing once writing has ended."""
        if self.ended:
            return
        data = line.encode() + b"\n"
        if self._max_size is not None and self.written + len(data) > self._max_size:
            self._end(f"--max-size of {self._max_size} bytes is reached")
        elif len(self._buffer) + len(data) > MAX_BACKLOG:
            self._end("its reader or disk is too slow", failed=True)
        else:
            self._buffer += data
            self.written += len(data)

    def _end(self, reason: str, *, failed: bool = False) -> None:
        if not self.ended:
            self.ended, self.failed = reason, failed
            self._on_end(reason)

    async def _flush_often(self) -> None:
        while not self._stopping.is_set():
            try:
                async with asyncio.timeout(FLUSH_PERIOD):
                    await self._stopping.wait()
            except TimeoutError:
                await self._flush()

    async def _flush(self) -> None:
        if self._file is None or not self._buffer:
            return
        data, self._buffer = bytes(self._buffer), bytearray()
        loop = asyncio.get_running_loop()
        try:
            await loop.run_in_executor(self._executor, self._write_all, self._file, data)
        except OSError as error:
            self._buffer.clear()
            self._end(error.strerror or str(error), failed=True)

    def _write_all(self, file: int, data: bytes) -> None:
        """Write in the executor's thread; a pipe that nobody reads does not hold it for ever."""
        rest = memoryview(data)
        while rest:
            if self._is_never_waited_for:
                rest = rest[os.write(file, rest) :]
            elif select.select([], [file], [], _POLL)[1]:
                rest = rest[os.write(file, rest[:_PIPE_SHARE]) :]
            elif self._gives_up.is_set():
                raise TimeoutError(f"the reader left {len(rest)} bytes unread")

    async def close(self) -> None:
        """Write what is left and close; a reader that takes nothing is given up.

        Does nothing to a file that was never opened.
        """
        self._stopping.set()
        loop = asyncio.get_running_loop()
        patience = loop.call_later(GIVE_UP, self._gives_up.set)
        if self._task is not None:
            await self._task
        await self._flush()
        patience.cancel()
        self._executor.shutdown()
        if self._file is None:
            return
        try:
            os.close(self._file)
        except OSError as error:
            self._end(error.strerror or str(error), failed=True)


def _open(path: str) -> int:
    if path == "-":
        return os.dup(sys.stdout.fileno())
    return open_for_owner(Path(path))
