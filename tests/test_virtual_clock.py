import asyncio
import socket
import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

import pytest
from rigs.clock.virtual_clock import SETTLE_S, START_NS, StalledError, VirtualLoop

HOUR_S = 3600.0


@pytest.mark.virtual_clock
async def test_an_hour_of_sleep_takes_milliseconds() -> None:
    loop = asyncio.get_running_loop()
    began, began_really = loop.time(), time.monotonic()
    await asyncio.sleep(HOUR_S)
    assert loop.time() - began == HOUR_S
    assert time.monotonic() - began_really < 1.0


async def test_an_unmarked_test_keeps_the_real_clock() -> None:
    assert not isinstance(asyncio.get_running_loop(), VirtualLoop)


@pytest.mark.virtual_clock
async def test_absolute_deadlines_do_not_drift() -> None:
    loop = asyncio.get_running_loop()
    assert isinstance(loop, VirtualLoop)
    began = loop.time()
    for tick in range(1, 1001):
        await asyncio.sleep(began + tick * 0.01 - loop.time())
    assert abs(loop.now_ns - START_NS - 10_000_000_000) <= 1


@pytest.mark.virtual_clock
async def test_a_timeout_fires_at_its_virtual_time() -> None:
    loop = asyncio.get_running_loop()
    began = loop.time()
    with pytest.raises(TimeoutError):
        async with asyncio.timeout(2.5):
            await loop.create_future()
    assert loop.time() - began == pytest.approx(2.5, abs=1e-9)


@pytest.mark.virtual_clock
async def test_timers_fire_in_the_order_of_their_times() -> None:
    loop = asyncio.get_running_loop()
    fired: list[str] = []
    loop.call_later(0.3, fired.append, "late")
    loop.call_later(0.1, fired.append, "early")
    loop.call_later(0.2, fired.append, "never").cancel()
    await asyncio.sleep(1.0)
    assert fired == ["early", "late"]


@pytest.mark.virtual_clock
async def test_an_executor_runs_inline_and_beats_every_deadline() -> None:
    async with asyncio.timeout(0.001):
        assert await asyncio.to_thread(sum, [1, 2, 3]) == 6


@pytest.mark.virtual_clock
async def test_an_executor_hands_on_what_was_raised() -> None:
    with pytest.raises(ValueError, match="invalid literal"):
        await asyncio.to_thread(int, "seven")


@pytest.mark.virtual_clock
async def test_a_socket_pair_echoes_before_time_moves() -> None:
    loop = asyncio.get_running_loop()
    near, far = socket.socketpair()
    echo = asyncio.create_task(_echo(*await asyncio.open_connection(sock=far)))
    reader, writer = await asyncio.open_connection(sock=near)
    began = loop.time()
    writer.write(b"points")
    async with asyncio.timeout(0.001):
        assert await reader.readexactly(6) == b"points"
    assert loop.time() == began
    await _close(writer)
    await echo


@pytest.mark.virtual_clock
async def test_loopback_tcp_delivers_before_a_deadline_passes() -> None:
    server = await asyncio.start_server(_echo, "127.0.0.1", 0)
    host, port = server.sockets[0].getsockname()
    reader, writer = await asyncio.open_connection(host, port)
    for number in range(100):
        writer.write(bytes([number]))
        async with asyncio.timeout(0.001):
            assert await reader.readexactly(1) == bytes([number])
        await asyncio.sleep(0.01)
    await _close(writer)
    server.close()
    await server.wait_closed()


@pytest.fixture
def pauses(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """The real pauses that a loop makes for what is under way."""
    made: list[float] = []
    monkeypatch.setattr(time, "sleep", made.append)
    return made


@pytest.mark.virtual_clock
async def test_the_loop_pauses_once_for_what_is_sent_and_not_yet_received(
    pauses: list[float],
) -> None:
    async with _connection() as (near, _):
        near.send(b"points")
        pauses.clear()
        await _jump(3)
        assert pauses == [SETTLE_S]


@pytest.mark.virtual_clock
async def test_the_loop_does_not_pause_for_what_was_received(pauses: list[float]) -> None:
    async with _connection() as (near, far):
        for _ in range(3):
            near.send(b"points")
            assert await asyncio.get_running_loop().sock_recv(far, 10) == b"points"
            pauses.clear()
            await _jump(1)
            assert pauses == []


@pytest.mark.virtual_clock
@pytest.mark.parametrize("change", ["ended", "asked for"])
async def test_the_loop_pauses_once_where_a_connection_changes(
    change: str, pauses: list[float]
) -> None:
    async with _connection() as (near, _):
        with socket.socket() as other:
            other.setblocking(False)
            if change == "ended":
                near.shutdown(socket.SHUT_WR)
            else:
                with pytest.raises(OSError, match=r"refused|in progress"):
                    other.connect(near.getsockname())
            pauses.clear()
            await _jump(3)
            assert pauses == [SETTLE_S]


async def _jump(times: int) -> None:
    """Let the clock jump so often."""
    for _ in range(times):
        await asyncio.sleep(0.01)


@asynccontextmanager
async def _connection() -> AsyncIterator[tuple[socket.socket, socket.socket]]:
    """Connect two sockets over TCP, and let the loop watch a third one, to which nothing comes."""
    loop = asyncio.get_running_loop()
    with socket.create_server(("127.0.0.1", 0)) as server, socket.socket() as near:
        server.setblocking(False)
        near.setblocking(False)
        await loop.sock_connect(near, server.getsockname())
        far, _ = await loop.sock_accept(server)
        with far:
            loop.add_reader(server, lambda: None)
            await _jump(1)
            yield near, far
            loop.remove_reader(server)


def test_waiting_for_what_never_comes_fails_and_names_who_waits(virtual_loop: VirtualLoop) -> None:
    async def wait_for_nobody() -> None:
        await virtual_loop.create_future()

    task = virtual_loop.create_task(wait_for_nobody())
    with pytest.raises(StalledError, match="wait_for_nobody"):
        virtual_loop.run_until_complete(task)
    task.cancel()
    with pytest.raises(asyncio.CancelledError):
        virtual_loop.run_until_complete(task)


def test_two_runs_send_the_same_bytes_at_the_same_times() -> None:
    first, second = (asyncio.Runner(loop_factory=VirtualLoop) for _ in range(2))
    with first, second:
        log = first.run(_chatter())
        assert log == second.run(_chatter())
    assert len(log) == 50


async def _chatter() -> list[tuple[float, bytes]]:
    loop = asyncio.get_running_loop()
    near, far = socket.socketpair()
    echo = asyncio.create_task(_echo(*await asyncio.open_connection(sock=far)))
    reader, writer = await asyncio.open_connection(sock=near)
    log: list[tuple[float, bytes]] = []
    for number in range(50):
        await asyncio.sleep(0.004 * (number % 7))
        writer.write(bytes([number]))
        log.append((loop.time(), await reader.readexactly(1)))
    await _close(writer)
    await echo
    return log


async def _echo(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
    while data := await reader.read(1024):
        writer.write(data)
    await _close(writer)


async def _close(writer: asyncio.StreamWriter) -> None:
    writer.close()
    await writer.wait_closed()
