"""Clients of the gateway that are no pages: each holds a key of its own cell, to and fro, and rests
as long in between.

Runs as a separate process, `byte_clients.py PAGE CELL...`, until it is ended; then it prints which
share of the time their robots jogged, and how often a press of theirs was refused or ended by
itself, by reason.
"""

import asyncio
import json
import signal
import sys
from collections import Counter

from aiohttp import ClientSession, ClientWebSocketResponse

from openpendant.tools.bench.jogging_pendants import BEAT, KEYS, JoggingPendant

STATE_RATE = 30.0
HELD, REST = 30, 30
"""Beats of a press and of the time to the next: a hand at a page has this rhythm, too."""


class _Bytes(asyncio.Transport):
    """What a pendant writes to: each write becomes one message of a WebSocket."""

    def __init__(self, socket: ClientWebSocketResponse) -> None:
        super().__init__()
        self._socket = socket
        self.unsent: list[bytes] = []

    def write(self, data: bytes | bytearray | memoryview) -> None:
        self.unsent.append(bytes(data))

    async def send(self) -> None:
        while self.unsent:
            await self._socket.send_bytes(self.unsent.pop(0))


async def _holds(session: ClientSession, page: str, pendant: JoggingPendant, later: float) -> None:
    """Hold a key from some time on [s]: hands neither press nor turn in step."""
    async with session.ws_connect(f"{page}servers/", max_msg_size=0) as socket:
        transport = _Bytes(socket)
        pendant.connection_made(transport)

        async def beats() -> None:
            await asyncio.sleep(later)
            while True:
                pendant.beat()
                await transport.send()
                await asyncio.sleep(BEAT)

        beating = asyncio.ensure_future(beats())
        try:
            async for message in socket:
                pendant.data_received(message.data)
                await transport.send()
        finally:
            beating.cancel()


async def _main(page: str, *cells: str) -> None:
    over = asyncio.Event()
    asyncio.get_running_loop().add_signal_handler(signal.SIGTERM, over.set)
    pendants = [
        JoggingPendant(cell, KEYS[at % len(KEYS)], STATE_RATE, held=HELD, rest=REST)
        for at, cell in enumerate(cells)
    ]
    stretch = (HELD + REST) * BEAT / len(cells)
    async with ClientSession() as session:
        tasks = [
            asyncio.ensure_future(_holds(session, page, pendant, at * stretch))
            for at, pendant in enumerate(pendants)
        ]
        await over.wait()
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
    jogged = sum(each.jogging for each in pendants) / sum(len(each.ticks) for each in pendants)
    ended = sum((each.ended for each in pendants), Counter[str]())
    sys.stdout.write(f"{json.dumps({'jogged': jogged, 'ended': ended})}\n")


if __name__ == "__main__":
    asyncio.run(_main(*sys.argv[1:]))
