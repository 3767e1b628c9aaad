"""Controllers that do not tell frames apart: whatever comes is read as a point of fixed layout.

Owns as much of Fanuc's and Stäubli's receivers as makes them dangerous to a careless tester, and a
third controller that clips what it is asked for. All move at once, at their own speed or in the
time that they are given; `farthest` is how far any joint ever was from its start.
"""

import asyncio
import math
import struct
from collections.abc import AsyncIterator, Callable, Coroutine
from contextlib import asynccontextmanager
from typing import Any

from openpendant.tools.packets.conformance.server.target import Options

HOST = "127.0.0.1"
START = (0.5, -0.5, 0.7, 0.2, 0.3, 0.4)
_TICK = 0.02
_OWN_SPEED = 0.5
_LARGEST = 2 * math.pi
_REPORT = struct.Struct("<5i10f")
_STATUS = struct.Struct("<11i")

Receiver = Callable[
    ["FixedLayout", asyncio.StreamReader, asyncio.StreamWriter], Coroutine[Any, Any, None]
]


class FixedLayout:
    """A controller with six joints.

    Attributes:
        position: where the joints are [rad].
        farthest: the largest displacement of any joint so far [rad].
        points: how many points it took.
    """

    def __init__(self) -> None:
        self.position = list(START)
        self.farthest = 0.0
        self.points = 0
        self._goal = list(START)
        self._speeds = [0.0] * 6

    def go(self, joints: tuple[float, ...], seconds: float | None = None) -> None:
        """Move there, in a time or at its own speed."""
        self.points += 1
        self._goal = list(joints[:6])
        ways = [abs(goal - at) for goal, at in zip(self._goal, self.position, strict=True)]
        own = [_OWN_SPEED] * 6
        self._speeds = own if seconds is None else [way / max(seconds, 0.01) for way in ways]

    def stop(self) -> None:
        self._goal = list(self.position)

    async def run(self) -> None:
        while True:
            await asyncio.sleep(_TICK)
            for joint, goal in enumerate(self._goal):
                most = self._speeds[joint] * _TICK
                self.position[joint] += min(max(goal - self.position[joint], -most), most)
            away = (abs(at - start) for at, start in zip(self.position, START, strict=True))
            self.farthest = max(self.farthest, *away)

    async def report(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        try:
            while True:
                pairs = zip(self._goal, self.position, strict=True)
                moves = any(abs(goal - at) > 1e-9 for goal, at in pairs)
                joints = (*self.position, 0.0, 0.0, 0.0, 0.0)
                writer.write(_REPORT.pack(56, 10, 1, 0, 0, *joints))
                writer.write(_STATUS.pack(40, 13, 1, 0, 1, 0, 0, 0, int(moves), 2, 1))
                await writer.drain()
                await asyncio.sleep(0.024)
        except ConnectionError:
            return
        finally:
            writer.close()


def _is_reachable(joints: tuple[float, ...]) -> bool:
    return all(abs(value) < _LARGEST for value in joints[:6])


async def fanuc(
    robot: FixedLayout, reader: asyncio.StreamReader, writer: asyncio.StreamWriter
) -> None:
    """Read fifty-six bytes or more as a point, whatever type and length they state."""
    while True:
        data = await reader.readexactly(60)
        length, kind, _, _, sequence = struct.unpack("<5i", data[:20])
        joints = struct.unpack("<10f", data[20:60])
        if kind == 11 and length >= 64:
            await reader.readexactly(8)
        if sequence == -4:
            robot.stop()
        elif sequence < 0:
            continue
        elif _is_reachable(joints):
            robot.go(joints)
        writer.write(struct.pack("<5i", 56, 10, 3, 1, sequence) + bytes(40))


async def staubli(
    robot: FixedLayout, reader: asyncio.StreamReader, writer: asyncio.StreamWriter
) -> None:
    """Read a header, and fifty-two bytes behind type 11; other bodies stay in the stream."""
    while True:
        _, kind, comm, _ = struct.unpack("<4i", await reader.readexactly(16))
        if kind != 11:
            continue
        body = await reader.readexactly(52)
        (sequence,) = struct.unpack("<i", body[:4])
        joints = struct.unpack("<10f", body[4:44])
        (speed,) = struct.unpack("<f", body[44:48])
        code = 1
        if sequence == -4:
            robot.stop()
        elif speed > 0 and _is_reachable(joints):
            robot.go(joints)
        else:
            code = 2
        if comm == 2:
            writer.write(struct.pack("<5i", 64, 11, 3, code, sequence) + bytes(48))


async def clipping(
    robot: FixedLayout, reader: asyncio.StreamReader, writer: asyncio.StreamWriter
) -> None:
    """Take any point in time, and bring whatever it says into the range; no number is its end."""
    while True:
        (length,) = struct.unpack("<i", await reader.readexactly(4))
        data = await reader.readexactly(length)
        kind, comm, _ = struct.unpack("<3i", data[:12])
        if comm != 2:
            continue
        if kind != 11 or length != 64:
            writer.write(struct.pack("<4i", 12, kind, 3, 1 if kind == 1 else 2))
            continue
        sequence, *values = struct.unpack("<i12f", data[12:])
        if sequence == -4:
            robot.stop()
        else:
            clipped = tuple(max(-_LARGEST, min(_LARGEST, value)) for value in values[:6])
            robot.go(clipped, values[11])
        writer.write(struct.pack("<4i", 12, 11, 3, 1))


@asynccontextmanager
async def running(receive: Receiver) -> AsyncIterator[tuple[FixedLayout, Options]]:
    """Run a controller; yields it and how to judge it."""
    robot = FixedLayout()

    async def serve(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        try:
            await receive(robot, reader, writer)
        except (asyncio.IncompleteReadError, ConnectionError):
            return
        finally:
            writer.close()

    servers = [
        await asyncio.start_server(serve, HOST, 0),
        await asyncio.start_server(robot.report, HOST, 0),
    ]
    ports = [server.sockets[0].getsockname()[1] for server in servers]
    moving = asyncio.create_task(robot.run())
    try:
        yield robot, Options(HOST, ports[0], ports[1])
    finally:
        moving.cancel()
        for server in servers:
            server.close()
            await server.wait_closed()
        await asyncio.sleep(0.1)
