"""Promise 20: 20 connections at once, then 50 a second, whatever storms in; exact on its clocks."""

import asyncio
import errno
import logging
import os
import resource
import socket
from collections.abc import Iterator

import pytest
from hypothesis import given
from hypothesis import strategies as st
from promises.promise_table import figure
from rigs.processes.app_on_loop import app_on_loop, said, until

from openpendant.server.shell.listening import AcceptRate, Listening

pytestmark = pytest.mark.virtual_clock

MS = 1_000_000
BURST, PER_SECOND = figure(20, "burst").count, figure(20, "rate").count
INTERVAL = figure(20, "interval").ns
BACKLOG = figure(20, "queue").count
EXHAUSTED_PAUSE = figure(21, "pause").seconds
START = 5_000_000_000


@given(st.lists(st.integers(0, 60 * MS), min_size=1, max_size=300))
def test_promise_20_no_window_has_more_than_the_burst_and_its_share(gaps: list[int]) -> None:
    rate, now, taken = AcceptRate(), START, list[int]()
    for gap in gaps:
        now += gap
        if not rate.take(now):
            taken.append(now)
    for first, begin in enumerate(taken):
        for last, end in enumerate(taken[first:], first):
            assert last - first + 1 <= BURST + (end - begin) // INTERVAL


@given(st.integers(0, 10 * INTERVAL))
def test_promise_20_who_waits_as_long_as_told_is_taken_and_not_a_nanosecond_sooner(
    after: int,
) -> None:
    rate = AcceptRate()
    assert [rate.take(START) for _ in range(BURST)] == [0] * BURST
    now = START + after % INTERVAL
    wait = rate.take(now)
    assert wait == START + INTERVAL - now
    assert rate.take(now + wait - 1) == 1
    assert rate.take(now + wait) == 0


class Noted(asyncio.Protocol):
    def __init__(self, name: str, log: list[tuple[str, float]]) -> None:
        self._entry, self._log = name, log

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        self._log.append((self._entry, asyncio.get_running_loop().time()))
        transport.close()


def knock(port: int, count: int) -> list[socket.socket]:
    sockets = [socket.socket() for _ in range(count)]
    for sock in sockets:
        sock.setblocking(False)
        assert sock.connect_ex(("127.0.0.1", port)) == errno.EINPROGRESS
    return sockets


async def test_promise_20_a_storm_is_taken_at_its_rate_and_no_port_starves_another() -> None:
    taken: list[tuple[str, float]] = []
    listening = Listening()
    stormed = await listening.listen("127.0.0.1", 0, lambda: Noted("stormed", taken))
    quiet = await listening.listen("127.0.0.1", 0, lambda: Noted("quiet", taken))
    began = asyncio.get_running_loop().time()
    sockets = knock(stormed, BURST)
    await asyncio.sleep(0.0005)
    sockets += knock(stormed, BACKLOG)
    await asyncio.sleep(0.0005)
    sockets += knock(quiet, 1)
    await asyncio.sleep(1.0)
    listening.close()
    for sock in sockets:
        sock.close()
    times = sorted(time - began for _, time in taken)
    assert len(times) == BURST + BACKLOG + 1
    assert times[BURST - 1] < 0.001
    for number, time in enumerate(times[BURST:], 1):
        assert time == pytest.approx(number / PER_SECOND, abs=0.0015)
    # The quiet port waits behind one connection of the stormed one, not behind all.
    assert [name for name, _ in sorted(taken, key=lambda each: each[1])].index("quiet") <= BURST + 1


@pytest.fixture
def few_files() -> Iterator[None]:
    limits = resource.getrlimit(resource.RLIMIT_NOFILE)
    free = os.open(os.devnull, os.O_RDONLY)
    os.close(free)
    yield
    resource.setrlimit(resource.RLIMIT_NOFILE, limits)


@pytest.mark.usefixtures("few_files")
async def test_promise_21_without_descriptors_nobody_is_taken_for_a_second_and_that_is_said_once(
    caplog: pytest.LogCaptureFixture,
) -> None:
    taken: list[tuple[str, float]] = []
    listening = Listening()
    port = await listening.listen("127.0.0.1", 0, lambda: Noted("late", taken))
    sockets = knock(port, 3)
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (sockets[0].fileno(), hard))
    with caplog.at_level(logging.INFO, logger="openpendant.server"):
        await asyncio.sleep(2.5 * EXHAUSTED_PAUSE)
        assert not taken
        resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))
        await until(lambda: len(taken) == 3, EXHAUSTED_PAUSE)
    listening.close()
    for sock in sockets:
        sock.close()
    assert [record.message for record in caplog.records] == [
        "no connection can be taken now: Too many open files"
    ]


def timers_of(listening: Listening) -> int:
    scheduled: list[asyncio.TimerHandle] = vars(asyncio.get_running_loop())["_scheduled"]
    callbacks = [callback_of(timer) for timer in scheduled if not timer.cancelled()]
    return sum(getattr(callback, "__self__", None) is listening for callback in callbacks)


def callback_of(timer: asyncio.TimerHandle) -> object:
    return getattr(timer, "_callback", None)


@pytest.mark.parametrize("ports", [1, 3])
async def test_promise_21_without_descriptors_one_is_tried_a_second_by_one_timer(
    monkeypatch: pytest.MonkeyPatch, ports: int
) -> None:
    tried: list[float] = []
    loop = asyncio.get_running_loop()

    def accept(_: socket.socket) -> None:
        tried.append(loop.time())
        raise OSError(errno.EMFILE, os.strerror(errno.EMFILE))

    monkeypatch.setattr(socket.socket, "accept", accept)
    listening = Listening()
    sockets: list[socket.socket] = []
    for _ in range(ports):
        sockets += knock(await listening.listen("127.0.0.1", 0, lambda: Noted("", [])), 2)
    timers = []
    for _ in range(5):
        await asyncio.sleep(EXHAUSTED_PAUSE)
        timers.append(timers_of(listening))
    listening.close()
    for sock in sockets:
        sock.close()
    assert len(tried) in (5, 6)  # the first is tried at once
    assert timers == [1] * 5
    assert timers_of(listening) == 0


async def test_promise_20_ticks_go_on_through_a_storm() -> None:
    async with app_on_loop() as served:
        before = served.app.overruns
        for _ in range(3):
            for _ in range(BACKLOG):
                await served.visitor(begin=said())
            await asyncio.sleep(0.1)
        assert served.app.overruns == before
