"""Processes and sockets that the latency benchmarks talk to.

The baselines run here too, as `python -m openpendant.tools.bench.peers echo|relay`: the least that
an asyncio program can do with a packet, so that a ratio says what ours adds.
"""

from __future__ import annotations

import asyncio
import json
import os
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass

from openpendant.simplemsg import (
    JointFeedback,
    JointTrajPtFull,
    Message,
    Status,
    accepted,
    codec_for,
    joint_array,
)

TIMEOUT = 10.0

ROBOT = "ur5"
EMULATOR = (
    *("openpendant.controller_emulator", "--robot", ROBOT, "--json"),
    *("--motion-port", "0", "--state-port", "0"),
)
SERVER = (
    *("openpendant.server", "--robot", ROBOT, "--json"),
    *("--pendant-port", "0", "--ros-motion-port", "0", "--ros-state-port", "0"),
)
"""Commands of `process`, on any free ports."""


class _EchoPeer(asyncio.Protocol):
    """Peer that returns the bytes that it receives."""

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        assert isinstance(transport, asyncio.Transport)
        self._transport = transport

    def data_received(self, data: bytes) -> None:
        self._transport.write(data)


class _RelayPeer(asyncio.Protocol):
    """Peer that forwards the bytes that it receives to another connection."""

    def __init__(self, upstream: asyncio.Transport) -> None:
        self._upstream = upstream

    def data_received(self, data: bytes) -> None:
        self._upstream.write(data)


async def _serve_echo() -> None:
    server = await asyncio.get_running_loop().create_server(_EchoPeer, "127.0.0.1", 0)
    print(json.dumps({"port": server.sockets[0].getsockname()[1]}), flush=True)
    await server.serve_forever()


async def _serve_relay(port: int) -> None:
    loop = asyncio.get_running_loop()
    upstream, _ = await loop.create_connection(asyncio.Protocol, "127.0.0.1", port)
    server = await loop.create_server(lambda: _RelayPeer(upstream), "127.0.0.1", 0)
    print(json.dumps({"port": server.sockets[0].getsockname()[1]}), flush=True)
    await server.serve_forever()


def pin(pid: int, place: int) -> None:
    """Keep a process on one processor, where the system can.

    Whether two processes share a processor changes the time of a round trip by a factor of two, and
    the scheduler decides it anew in every run. So subject and baseline get the same place.

    Args:
        pid: process id, 0 for this one.
        place: counts the processors that this process may use.
    """
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(pid, {_PROCESSORS[place % len(_PROCESSORS)]})


def before_ordinary_programs(pid: int) -> None:
    """Let a process run first, as if it had a machine of its own; where the system allows it."""
    with suppress(PermissionError):
        os.setpriority(os.PRIO_PROCESS, pid, _PEER_NICENESS)


_PEER_NICENESS = -5
_PROCESSORS = sorted(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else [0]


@contextmanager
def process(
    *command: str, place: int | None = None, first: bool = False
) -> Iterator[dict[str, int]]:
    """Run a Python module that prints one JSON line when it is ready; end it afterwards."""
    child = subprocess.Popen(
        [sys.executable, "-m", *command],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
    )
    try:
        assert child.stdout is not None
        ready: dict[str, int] = json.loads(child.stdout.readline())
        if place is not None:
            pin(child.pid, place)
        if first:
            before_ordinary_programs(child.pid)
        yield ready
    finally:
        child.terminate()
        child.wait(TIMEOUT)
        assert child.stdout is not None
        child.stdout.close()


@contextmanager
def pinned(place: int) -> Iterator[None]:
    """Keep this process on one processor for the length of the context."""
    pin(0, place)
    try:
        yield
    finally:
        if hasattr(os, "sched_setaffinity"):
            os.sched_setaffinity(0, _PROCESSORS)


def connect(port: int) -> socket.socket:
    """Return a blocking connection to a port of this machine that sends at once."""
    connection = socket.create_connection(("127.0.0.1", port), timeout=TIMEOUT)
    connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    return connection


def listen() -> socket.socket:
    """Return a listening socket on a free port of this machine."""
    listener = socket.create_server(("127.0.0.1", 0))
    listener.settimeout(TIMEOUT)
    return listener


def accept(listener: socket.socket) -> socket.socket:
    """Return the next connection, blocking and sending at once."""
    connection, _ = listener.accept()
    connection.settimeout(TIMEOUT)
    connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    return connection


def receive_exactly(connection: socket.socket, size: int) -> bytes:
    """Read so many bytes."""
    data = bytearray()
    while len(data) < size:
        part = connection.recv(size - len(data))
        if not part:
            raise ConnectionError("the peer closed the connection")
        data += part
    return bytes(data)


def receive_message(connection: socket.socket) -> Message:
    """Read one standard frame, little endian."""
    prefix = receive_exactly(connection, 4)
    return codec_for().decode(
        prefix + receive_exactly(connection, int.from_bytes(prefix, "little"))
    )


def state_reports(
    position: tuple[float, ...], *, moving: bool = False
) -> tuple[JointFeedback, Status]:
    """Return what a controller whose robot is there reports, (n,) [rad or m]."""
    still = joint_array(())
    return (
        JointFeedback(
            robot_id=0,
            valid_fields=14,
            time=0.0,
            positions=joint_array(position),
            velocities=still,
            accelerations=still,
        ),
        Status(
            drives_powered=1,
            e_stopped=0,
            error_code=0,
            in_error=0,
            in_motion=int(moving),
            mode=2,
            motion_possible=1,
        ),
    )


@dataclass
class PlainController:
    """A controller without dynamics: it stands at each point as soon as it receives it.

    Attributes:
        motion: its motion connection.
        position: of its joints [rad].
    """

    motion: socket.socket
    state: socket.socket
    position: tuple[float, ...]
    moving: bool = False
    ended: bool = False

    def report(self) -> None:
        """Send joint feedback and status at 100 Hz until `ended`; runs in a thread."""
        codec = codec_for()
        while not self.ended:
            feedback, status = state_reports(self.position, moving=self.moving)
            frames = codec.encode(feedback) + codec.encode(status)
            try:
                self.state.sendall(frames)
            except OSError:
                return
            time.sleep(0.01)

    def obey(self, first: Message, goal: tuple[float, ...]) -> None:
        """Answer points, from one that was received, until the goal was sent."""
        message = first
        while True:
            self.motion.sendall(codec_for().encode(accepted(message)))
            if isinstance(message, JointTrajPtFull):
                self.position = message.positions[: len(self.position)]
                near = max(abs(a - b) for a, b in zip(self.position, goal, strict=True)) < 1e-6
                if near and not any(message.velocities):
                    return
            message = receive_message(self.motion)


@contextmanager
def plain_controller(
    motion: socket.socket, state: socket.socket, position: tuple[float, ...]
) -> Iterator[PlainController]:
    """Report state from a thread for the length of the context."""
    controller = PlainController(motion, state, position)
    thread = threading.Thread(target=controller.report, daemon=True)
    thread.start()
    try:
        yield controller
    finally:
        controller.ended = True
        thread.join(TIMEOUT)


if __name__ == "__main__":
    match sys.argv[1:]:
        case ["echo"]:
            asyncio.run(_serve_echo())
        case ["relay", port]:
            asyncio.run(_serve_relay(int(port)))
