"""A controller that says whatever a test wants it to, as often as that, and reads nothing."""

import asyncio
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from dataclasses import dataclass, field

from openpendant.simplemsg import PENDANT, codec_for

HOST = "127.0.0.1"
CODEC = codec_for(PENDANT)


@dataclass
class HostileController:
    """Two listening ports, and what each connection of them is told again and again.

    Attributes:
        on_state: returns the bytes of a round on the state port, by the number of the round.
        on_motion: the same for the motion port.
        period: time between rounds [s].
        reads: whether what the server says is read, and left unanswered.
        connections: how many there have been.
        rounds: how many rounds were written whole.
    """

    on_state: Callable[[int], bytes] = lambda number: b""
    on_motion: Callable[[int], bytes] = lambda number: b""
    period: float = 0.004
    reads: bool = True
    connections: int = 0
    rounds: int = 0
    _tasks: set[asyncio.Task[None]] = field(default_factory=set)

    async def _serve(self, says: Callable[[int], bytes], writer: asyncio.StreamWriter) -> None:
        self.connections += 1
        number = 0
        try:
            while True:
                data = says(number)
                if data:
                    writer.write(data)
                    await writer.drain()
                number += 1
                self.rounds += 1
                await asyncio.sleep(self.period)
        except ConnectionError:
            pass  # the server has parted with it, as it may
        finally:
            writer.close()

    def _factory(
        self, says: Callable[[int], bytes]
    ) -> Callable[[asyncio.StreamReader, asyncio.StreamWriter], None]:
        def connected(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
            if not self.reads:
                writer.transport.pause_reading()  # type: ignore[attr-defined]  # a socket's
            task = asyncio.get_running_loop().create_task(self._serve(says, writer))
            self._tasks.add(task)
            task.add_done_callback(self._tasks.discard)

        return connected

    @asynccontextmanager
    async def listening(self) -> AsyncIterator[dict[str, int]]:
        """Listen; yields the ports as the settings of a controller have them."""
        ends = [
            await asyncio.start_server(self._factory(says), HOST, 0)
            for says in (self.on_motion, self.on_state)
        ]
        motion, state = (end.sockets[0].getsockname()[1] for end in ends)
        try:
            yield {"motion_port": motion, "state_port": state}
        finally:
            for end in ends:
                end.close()
            for task in list(self._tasks):
                task.cancel()
            await asyncio.gather(*self._tasks, return_exceptions=True)
