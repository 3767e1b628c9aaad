"""Pendants that send the dearest frames of all as fast as the server reads, and read every answer.

Runs as a separate process, `flooding_pendants.py PORT SECONDS COUNT KIND CELL`, and prints how many
bytes left. They hold no authority; a `stranger` never says hello, a `viewer` has. What stops a
robot, takes the authority or changes something is not sent: whoever may do that may end a motion.
"""

import asyncio
import random
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))

from rigs.data.dearest_frames import message_rows, operation_rows, stream_rows
from rigs.data.legal_requests import frame_of

from openpendant.server.store.documents import DocumentKind
from openpendant.simplemsg.pendant import PROTOCOL_VERSION, Hello
from openpendant.simplemsg.pendant.management import OPERATIONS
from openpendant.simplemsg.pendant.roles import PERMISSIONS_OF, Role

_PIECE = 64 * 1024


class _Anything:
    most_objects = most_frames = most_tools = 100

    def revision(self, kind: DocumentKind, name: str = "") -> int:
        return 0

    def kept(self, name: str) -> str:
        return ""

    def somebody(self) -> int:
        return 0

    def plan(self) -> int:
        return 1


def flood() -> list[bytes]:
    """Return the frames, in an order that is the same in every run."""
    looks = PERMISSIONS_OF[Role.VIEWER]
    frames = []
    for name, row in operation_rows().items():
        op, _, shape = name.partition(": ")
        needs = OPERATIONS[op].NEEDS
        if not shape.startswith("legal") or ((needs is None or needs in looks) and "log" not in op):
            frames.append(row.make(_Anything(), 1))
    for name, row in message_rows().items():
        if name.endswith(("cut short", "no number in it")) and not name.startswith("SoftwareStop"):
            frames.append(row.make(_Anything(), 1))
    streams = stream_rows()
    for name in ("a stream of bare headers", "a stream of pings", "a stream of whys"):
        frames.append(streams[name].make(_Anything(), 1)[:_PIECE])
    random.Random(53).shuffle(frames)
    return frames


async def _talk(port: int, frames: list[bytes], begin: bytes, ends: float) -> int:
    """Send all again and again; come back after an end, as often as the server lets anybody in."""
    sent = 0
    while time.monotonic() < ends:
        try:
            reader, writer = await asyncio.open_connection("127.0.0.1", port)
        except OSError:
            await asyncio.sleep(0.1)
            continue
        reading = asyncio.ensure_future(_read(reader))
        try:
            writer.write(begin)
            while time.monotonic() < ends and not reading.done():
                for frame in frames:
                    writer.write(frame)
                    await writer.drain()
                    # A drain that waits for nothing gives the reader no turn.
                    await asyncio.sleep(0)
                    sent += len(frame)
                    if reading.done() or time.monotonic() >= ends:
                        break
        except OSError:
            pass  # it was closed, and comes back
        finally:
            reading.cancel()
            writer.close()
        await asyncio.sleep(0.05)
    return sent


async def _read(reader: asyncio.StreamReader) -> None:
    while await reader.read(_PIECE):
        pass


async def _run(port: int, seconds: float, count: int, kind: str, cell: str) -> int:
    begin = frame_of(Hello(PROTOCOL_VERSION, 0.0, cell, "flood")) if kind == "viewer" else b""
    frames, ends = flood(), time.monotonic() + seconds
    return sum(await asyncio.gather(*(_talk(port, frames, begin, ends) for _ in range(count))))


if __name__ == "__main__":
    port, seconds, count, kind, cell = sys.argv[1:]
    total = asyncio.run(_run(int(port), float(seconds), int(count), kind, cell))
    sys.stdout.write(f"{total}\n")
