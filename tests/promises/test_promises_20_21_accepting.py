"""Promises 19 to 21: connections at their rate, so many and no more; files are counted before.

20 connections at once, then 50 a second, whatever storms in; exact on its clocks.
"""

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
from rigs.peers.server_clients import hello
from rigs.processes.app_on_loop import app_on_loop, said, until

from openpendant.server.access import arrivals
from openpendant.server.access.arrivals import MOST_WAITING
from openpendant.server.access.places import MOST_STOP_PLACES, place_refusal
from openpendant.server.access.token_bucket import TokenBucket
from openpendant.server.cli.serve import main
from openpendant.server.settings.cell_settings import make_settings
from openpendant.server.settings.config_file import ConfigurationError
from openpendant.server.settings.server_settings import ServerSettings, make_server_settings
from openpendant.server.shell.clients import MOST_TURNED_AWAY
from openpendant.server.shell.listening import Listening
from openpendant.server.shell.server_process import files_needed, provide_files
from openpendant.simplemsg import PENDANT, ByteOrder, Connection, Received, Role
from openpendant.simplemsg.pendant import Verdict
from openpendant.simplemsg.verdicts import VerdictCode as V
from openpendant.tools.pendants.client import PendantClient, Refused

pytestmark = pytest.mark.virtual_clock

MS = 1_000_000
BURST, PER_SECOND = figure(20, "burst").count, figure(20, "rate").count
INTERVAL = figure(20, "interval").ns
BACKLOG = figure(20, "queue").count
EXHAUSTED_PAUSE = figure(21, "pause").seconds
START = 5_000_000_000


@given(st.lists(st.integers(0, 60 * MS), min_size=1, max_size=300))
def test_promise_20_no_window_has_more_than_the_burst_and_its_share(gaps: list[int]) -> None:
    rate, now, taken = TokenBucket(arrivals.PER_SECOND, arrivals.BURST), START, list[int]()
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
    rate = TokenBucket(arrivals.PER_SECOND, arrivals.BURST)
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
    callbacks = [getattr(timer, "_callback", None) for timer in scheduled if not timer.cancelled()]
    return sum(getattr(callback, "__self__", None) is listening for callback in callbacks)


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


PLACES = 16
MOST = figure(21, "most").count
MOST_STRANGERS, STOP_PLACES = figure(21, "strangers").count, figure(21, "kept").count


@pytest.mark.parametrize(
    ("connections", "strangers", "is_pendant", "named"),
    [
        (255, 0, True, None),
        (256, 0, True, "256 connections"),
        (247, 0, False, None),
        (248, 0, False, "more than 248 connections; the last 8 are for pendants"),
        (100, MOST_STRANGERS - 1, True, None),
        (100, MOST_STRANGERS, True, "64 pendants that did not say hello"),
        (100, MOST_STRANGERS, False, None),
    ],
)
def test_promise_21_there_is_a_place_or_a_reason(
    connections: int, strangers: int, is_pendant: bool, named: str | None
) -> None:
    refusal = place_refusal(connections, strangers, 256, is_pendant=is_pendant)
    assert (refusal is None) == (named is None)
    assert named is None or (refusal is not None and named in refusal.sentence)


def test_promise_21_no_file_may_ask_for_more_than_1024_connections() -> None:
    with pytest.raises(ConfigurationError, match="max_connections"):
        make_settings({"listen": {"max_connections": MOST + 1}}, "cell.toml")
    make_settings({"listen": {"max_connections": MOST}}, "cell.toml")


async def test_promise_21_who_has_no_place_is_closed_at_once_and_the_others_stay() -> None:
    async with app_on_loop(max_connections=PLACES) as served:
        for _ in range(PLACES):
            await served.visitor(begin=said())
        await until(lambda: served.connections == PLACES, 1.0)
        loop = asyncio.get_running_loop()
        late = await served.visitor()
        came = loop.time()
        assert await loop.sock_recv(late, 1) == b""
        assert loop.time() - came <= figure(21, "closed").seconds
        assert served.connections == PLACES


async def answers(sock: socket.socket, wire: Connection, within: float) -> list[Received]:
    loop, heard = asyncio.get_running_loop(), list[Received]()
    async with asyncio.timeout(within):
        while data := await loop.sock_recv(sock, 4_096):
            heard += wire.receive(data)
    return heard


@pytest.mark.parametrize("order", list(ByteOrder))
@pytest.mark.parametrize("piece", [1, 1_000])
async def test_promise_20_who_has_no_place_is_told_when_to_come_again(
    order: ByteOrder, piece: int
) -> None:
    async with app_on_loop(max_connections=PLACES) as served:
        for _ in range(PLACES):
            await served.visitor(begin=said())
        await until(lambda: served.connections == PLACES, 1.0)
        late = await served.visitor()
        wire = Connection(Role.CLIENT, PENDANT, order)
        greeting = wire.send(hello("late"))
        for begin in range(0, len(greeting), piece):
            await asyncio.get_running_loop().sock_sendall(late, greeting[begin : begin + piece])
        (told,) = await answers(late, wire, 0.05)
        assert isinstance(told, Verdict)
        assert (told.code, told.value) == (V.NO_PLACE, 5.0)
        assert told.text == "more than 16 connections; come again in 5 s"
        assert served.connections == PLACES


async def test_promise_20_who_does_as_told_finds_a_place_that_strangers_took() -> None:
    async with app_on_loop() as served:
        for crowd in (BURST, BACKLOG, MOST_STRANGERS - BURST - BACKLOG):
            for _ in range(crowd):
                await served.visitor()
            await asyncio.sleep(crowd / PER_SECOND)
        assert served.connections == MOST_STRANGERS
        with pytest.raises(Refused, match="64 pendants") as refused:
            await PendantClient.connect("127.0.0.1", served.pendant)
        assert refused.value.code == V.NO_PLACE
        await asyncio.sleep(refused.value.value)
        async with await PendantClient.connect("127.0.0.1", served.pendant):
            assert served.connections == 1


async def test_promise_19_ros_clients_leave_places_for_whoever_wants_to_stop() -> None:
    async with app_on_loop(max_connections=PLACES) as served:
        for _ in range(PLACES):
            await served.visitor(served.ros_state)
        await asyncio.sleep(0.5)
        assert served.connections == PLACES - STOP_PLACES
        for _ in range(STOP_PLACES):
            await served.visitor(begin=said())
        await until(lambda: served.connections == PLACES, 1.0)


async def test_promise_21_strangers_take_64_places_and_are_gone_after_their_deadline() -> None:
    async with app_on_loop() as served:
        # In crowds that the system's queue holds; else its own second try takes a second.
        for crowd in (BURST, BACKLOG, MOST_STRANGERS + 6 - BURST - BACKLOG):
            for _ in range(crowd):
                await served.visitor()
            await asyncio.sleep(crowd / PER_SECOND)
        assert served.connections == MOST_STRANGERS
        await asyncio.sleep(2.0)
        assert served.connections == 0
        await served.visitor(begin=said())
        await until(lambda: served.connections == 1, 0.1)


# Open files.


def settings(connections: int = 256) -> ServerSettings:
    return make_server_settings({"listen": {"max_connections": connections}}, "cell.toml")


def test_promise_21_connections_that_agree_on_tls_are_counted_beside_all_places() -> None:
    at_once = 256 + MOST_TURNED_AWAY + MOST_STRANGERS + MOST_STOP_PLACES + MOST_WAITING + BACKLOG
    assert files_needed(settings()) - at_once >= 64


@pytest.fixture
def system(monkeypatch: pytest.MonkeyPatch) -> list[tuple[int, int]]:
    limits = [(1_024, 4_096)]
    monkeypatch.setattr(resource, "getrlimit", lambda _: limits[-1])
    monkeypatch.setattr(resource, "setrlimit", lambda _, pair: limits.append(pair))
    return limits


def test_promise_21_a_soft_limit_that_is_too_low_is_raised(system: list[tuple[int, int]]) -> None:
    system[:] = [(64, 4_096)]
    provide_files(settings(), "cell.toml")
    assert system[-1] == (files_needed(settings()), 4_096)


def test_a_limit_that_is_high_enough_is_left_alone(system: list[tuple[int, int]]) -> None:
    provide_files(settings(), "cell.toml")
    assert system == [(1_024, 4_096)]


def test_promise_21_a_hard_limit_that_is_too_low_is_refused_with_what_would_do(
    system: list[tuple[int, int]],
) -> None:
    system[:] = [(400, 400)]
    with pytest.raises(ConfigurationError) as refused:
        provide_files(settings(), "cell.toml")
    most = 400 - (files_needed(settings()) - 256)
    assert f"at most {most} connections" in str(refused.value)
    provide_files(settings(most), "cell.toml")
    system[:] = [(40, 40)]
    with pytest.raises(ConfigurationError, match="accepted: a higher limit"):
        provide_files(settings(1), "cell.toml")


def test_promise_21_the_command_says_so_in_one_line(
    system: list[tuple[int, int]], capsys: pytest.CaptureFixture[str]
) -> None:
    system[:] = [(40, 40)]
    assert main(["--pendant-port", "0"]) == 2
    said = capsys.readouterr().err
    assert said.startswith("openpendant serve: arguments: listen.max_connections: 256 connections")
    assert said.count("\n") == 1
