"""A relay in front of the emulator, which notes when each set-point and each STOP goes by."""

from __future__ import annotations

import asyncio
import statistics
import struct
import threading
import time
from dataclasses import dataclass
from itertools import pairwise

POINT, FULL_POINT, STOP = 11, 14, -4
_HEADER = 16
_STEADY = 0.97
"""A set-point whose step is smaller than that of the steady jog belongs to the ramp."""


@dataclass(frozen=True)
class Seen:
    """A set-point, or a STOP where it has no joints; by the monotonic clock [s]."""

    at: float
    joints: tuple[float, ...]


class MotionTap:
    """Relays one port to another in a thread of its own."""

    def __init__(self, target: int) -> None:
        self.port = 0
        self._target = target
        self._seen: list[Seen] = []
        self._loop: asyncio.AbstractEventLoop | None = None
        self._is_over = asyncio.Event()
        self._up = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()
        self._up.wait(10)

    def close(self) -> None:
        if self._loop is not None:
            self._loop.call_soon_threadsafe(self._is_over.set)
        self._thread.join(10)

    def forget(self) -> None:
        self._seen = []

    def seen(self) -> list[Seen]:
        return list(self._seen)

    def end_of_steady(self, joint: int, after: float) -> tuple[float, str]:
        """Return how long after a moment the ramp or the STOP began [s], and which it was.

        Raises:
            AssertionError: no steady jog went before, or none of them came.
        """
        seen = self.seen()
        steps = [
            (each.at, abs(each.joints[joint] - earlier.joints[joint]))
            for earlier, each in pairwise(seen)
            if each.joints and earlier.joints
        ]
        before = [step for at, step in steps if at < after][-10:]
        assert len(before) >= 5, f"{len(before)} set-points before the end of the jog"
        steady = statistics.median(before)
        assert steady > 0, "it stood before the jog ended"
        stops = [(each.at, "stop") for each in seen if not each.joints and each.at >= after]
        ramps = [(at, "ramp") for at, step in steps if at >= after and step < _STEADY * steady]
        first = min(stops[:1] + ramps[:1], default=None)
        assert first is not None, "nothing ended the jog"
        return first[0] - after, first[1]

    def _run(self) -> None:
        asyncio.run(self._listen())

    async def _listen(self) -> None:
        self._loop = asyncio.get_running_loop()
        server = await asyncio.start_server(self._relay, "127.0.0.1", 0)
        self.port = server.sockets[0].getsockname()[1]
        self._up.set()
        await self._is_over.wait()
        server.close()

    async def _relay(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        try:
            far_reader, far_writer = await asyncio.open_connection("127.0.0.1", self._target)
        except OSError:
            writer.close()
            return
        back = asyncio.create_task(_copied(far_reader, writer))
        left = b""
        while data := await reader.read(65536):
            far_writer.write(data)
            left = self._noted(left + data)
        far_writer.close()
        await back

    def _noted(self, data: bytes) -> bytes:
        now = time.monotonic()
        while len(data) >= _HEADER:
            size = 4 + int.from_bytes(data[:4], "little")
            if size > len(data):
                break
            kind = int.from_bytes(data[4:8], "little")
            if kind == POINT and int.from_bytes(data[16:20], "little", signed=True) == STOP:
                self._seen.append(Seen(now, ()))
            elif kind == FULL_POINT:
                # robot, sequence, valid fields and time go before the positions
                self._seen.append(Seen(now, struct.unpack_from("<10f", data, _HEADER + 16)))
            data = data[size:]
        return data


async def _copied(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
    while data := await reader.read(65536):
        writer.write(data)
    writer.close()
