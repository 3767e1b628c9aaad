"""Ports: opened for one program alone, and one clear line for each that cannot be."""

import asyncio
import errno
import os
import sys
import tty
from collections.abc import AsyncIterator, Callable
from pathlib import Path

import pytest
import pytest_asyncio

from openpendant.tools.pendants.keypad import serial_port
from openpendant.tools.pendants.keypad.serial_port import (
    KeypadPortMisnamed,
    KeypadPortUnusable,
    check_port,
    open_port,
)

pytest.importorskip("serial_asyncio")
pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="pseudo-terminals")


class Noted(asyncio.Protocol):
    def __init__(self) -> None:
        self.came = bytearray()
        self.ended = asyncio.Event()
        self.grown = asyncio.Event()

    def data_received(self, data: bytes) -> None:
        self.came += data
        self.grown.set()

    def connection_lost(self, exc: Exception | None) -> None:
        self.ended.set()


async def why(port: str) -> str:
    with pytest.raises(KeypadPortUnusable) as refused:
        await open_port(port, 115_200, Noted)
    return str(refused.value)


@pytest_asyncio.fixture
async def pty() -> AsyncIterator[tuple[int, str]]:
    ours, theirs = os.openpty()
    tty.setraw(theirs)
    yield ours, os.ttyname(theirs)
    os.close(theirs)
    os.close(ours)


async def test_bytes_go_both_ways_on_a_device(pty: tuple[int, str]) -> None:
    noted = Noted()
    transport = await open_port(pty[1], 115_200, lambda: noted)
    os.write(pty[0], b"\0hello\0")
    await asyncio.wait_for(noted.grown.wait(), 5)
    transport.write(b"\0\x01")
    await asyncio.sleep(0.05)
    assert (bytes(noted.came), os.read(pty[0], 10)) == (b"\0hello\0", b"\0\x01")
    transport.abort()
    await asyncio.wait_for(noted.ended.wait(), 5)


async def test_a_pulled_cable_is_the_end_of_the_port() -> None:
    ours, theirs = os.openpty()
    noted = Noted()
    transport = await open_port(os.ttyname(theirs), 115_200, lambda: noted)
    os.close(theirs)
    await asyncio.sleep(0.01)
    os.close(ours)
    await asyncio.wait_for(noted.ended.wait(), 5)
    assert transport.is_closing()


async def test_a_port_that_another_bridge_has_is_held(pty: tuple[int, str]) -> None:
    transport = await open_port(pty[1], 115_200, Noted)
    try:
        assert await why(pty[1]) == (
            f"{pty[1]} is held by another program; only one bridge may have it"
        )
    finally:
        transport.abort()
        await asyncio.sleep(0.01)


async def test_a_port_that_is_not_there_is_named_with_those_that_are(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(serial_port, "seen_ports", lambda: ("/dev/ttyUSB0",))
    port = str(tmp_path / "ttyACM0")
    assert await why(port) == (
        f"no such port {port}; plug it in, or name another with --port (seen: /dev/ttyUSB0)."
        " Trying every 0.5 to 5 s"
    )


async def test_what_is_no_serial_port_says_so() -> None:
    assert await why("/dev/null") == (
        "/dev/null is no serial port (Inappropriate ioctl for device)"
    )


@pytest.mark.parametrize(
    ("number", "said"),
    [
        (errno.EACCES, "not allowed to open {port}; add this user to the group that owns it ("),
        (errno.EIO, "{port} cannot be opened (Input/output error)"),
    ],
)
async def test_what_the_system_forbids_or_cannot_do_is_told(
    monkeypatch: pytest.MonkeyPatch, pty: tuple[int, str], number: int, said: str
) -> None:
    """Whoever runs the tests may be allowed everything."""
    opened = os.open

    def refuse(path: str, *arguments: int) -> int:
        if path == pty[1]:
            raise OSError(number, os.strerror(number))
        return opened(path, *arguments)

    monkeypatch.setattr(os, "open", refuse)
    assert (await why(pty[1])).startswith(said.format(port=pty[1]))


async def test_a_socket_is_a_port_too(unused: Callable[[], int]) -> None:
    got = bytearray()
    served = asyncio.Event()

    async def serve(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        got.extend(await reader.readexactly(2))
        writer.write(b"\0a\0")
        await writer.drain()
        writer.close()
        served.set()

    server = await asyncio.start_server(serve, "127.0.0.1", 0)
    number = server.sockets[0].getsockname()[1]
    noted = Noted()
    transport = await open_port(f"socket://127.0.0.1:{number}", 115_200, lambda: noted)
    transport.write(b"hi")
    await asyncio.wait_for(noted.ended.wait(), 5)
    assert (bytes(got), bytes(noted.came)) == (b"hi", b"\0a\0")
    server.close()
    await server.wait_closed()
    assert (await why(f"socket://127.0.0.1:{unused()}")).startswith("nobody listens at socket://")


@pytest.fixture
def unused() -> Callable[[], int]:
    import socket

    def port() -> int:
        with socket.socket() as probe:
            probe.bind(("127.0.0.1", 0))
            return int(probe.getsockname()[1])

    return port


@pytest.mark.parametrize(
    "port", ["", "rfc2217://a:1", "socket://", "socket://a", "socket://a:99999", "socket://a:1/x"]
)
def test_what_names_no_port_is_refused_before_it_is_opened(port: str) -> None:
    with pytest.raises(KeypadPortMisnamed, match="is no port; accepted: "):
        check_port(port)


def test_a_device_and_a_socket_are_names_of_ports() -> None:
    check_port("/dev/ttyACM0")
    check_port("socket://127.0.0.1:4000")
