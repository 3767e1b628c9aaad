"""Relays one port to another in a thread of its own; it can stand still and go on.

One kind of relay notes when messages of a type go to the target.
"""

from __future__ import annotations

import asyncio
import threading
import time

from openpendant.simplemsg import Message


class LoopbackRelay:
    """Takes connections at a free port, each of which it carries on to the target."""

    def __init__(self, target: int) -> None:
        """Begin to listen.

        Args:
            target: the port of this machine that all is carried to.
        """
        self.port = 0
        self._target = target
        self._loop = asyncio.new_event_loop()
        self._flows = asyncio.Event()
        self._flows.set()
        self._tasks: set[asyncio.Task[None]] = set()
        self._writers: set[asyncio.StreamWriter] = set()
        self._is_up = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()
        assert self._is_up.wait(10)

    def stand_still(self) -> None:
        """Carry nothing any more, either way; what comes meanwhile is kept."""
        self._loop.call_soon_threadsafe(self._flows.clear)

    def go_on(self) -> None:
        """Deliver what was kept, and carry on."""
        self._loop.call_soon_threadsafe(self._flows.set)

    def close(self) -> None:
        """Close all connections, and end the thread."""
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join(10)

    def _noted(self, data: bytes) -> bytes:
        """See what goes to the target, just before it goes; return what is no whole frame yet."""
        return data[:0]

    def _run(self) -> None:
        asyncio.set_event_loop(self._loop)
        server = self._loop.run_until_complete(asyncio.start_server(self._relay, "127.0.0.1", 0))
        self.port = server.sockets[0].getsockname()[1]
        self._is_up.set()
        self._loop.run_forever()
        server.close()
        for each in self._writers:
            each.transport.abort()
        self._flows.set()
        self._loop.run_until_complete(asyncio.gather(*self._tasks, return_exceptions=True))
        self._loop.run_until_complete(asyncio.sleep(0))
        self._loop.close()

    async def _relay(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        task = asyncio.current_task()
        assert task is not None
        self._tasks.add(task)
        try:
            far_reader, far_writer = await asyncio.open_connection("127.0.0.1", self._target)
            both = {writer, far_writer}
            self._writers |= both
            await asyncio.gather(
                self._carry(reader, far_writer, is_noted=True),
                self._carry(far_reader, writer, is_noted=False),
            )
            self._writers -= both
        except OSError:
            writer.close()
        finally:
            self._tasks.discard(task)

    async def _carry(
        self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter, *, is_noted: bool
    ) -> None:
        left = b""
        try:
            while data := await reader.read(65536):
                await self._flows.wait()
                if is_noted:
                    left = self._noted(left + data)
                writer.write(data)
        except ConnectionError:
            return
        finally:
            writer.close()


class MessageTap(LoopbackRelay):
    """Notes when a message of a type goes to a server, by the monotonic clock."""

    def __init__(self, target: int, kind: type[Message]) -> None:
        """Begin with none noted."""
        self._type = kind.PLACE.msg_type
        self._times: list[float] = []
        super().__init__(target)

    def forget(self) -> None:
        """Begin a trial."""
        self._times = []

    def first(self) -> float:
        """Return when the first went by since the last `forget` [s]."""
        assert self._times, "none went by"
        return self._times[0]

    def _noted(self, data: bytes) -> bytes:
        now = time.monotonic()
        while (size := 4 + int.from_bytes(data[:4], "little")) <= len(data):
            if int.from_bytes(data[4:8], "little") == self._type:
                self._times.append(now)
            data = data[size:]
        return data
