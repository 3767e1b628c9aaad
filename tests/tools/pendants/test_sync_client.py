"""The blocking client: the calls of the asyncio client, from threads, one of which may close it."""

import asyncio
import contextlib
import inspect
import statistics
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from itertools import pairwise

import pytest
from rigs.clock.busy_machine import SCALE
from rigs.peers.scripted_pendant_server import ScriptedPendantServer, scripted_server

from openpendant.simplemsg import pendant as messages
from openpendant.simplemsg.verdicts import VerdictCode
from openpendant.tools.pendants import loop_thread
from openpendant.tools.pendants.client import ConnectionLost, PendantClient, Refused
from openpendant.tools.pendants.loop_thread import LoopThread
from openpendant.tools.pendants.sync_client import SyncPendantClient

pytestmark = pytest.mark.realtime

ASYNC_ONLY = {"abort", "fed_enabling", "fed_jog"}
SYNC_ONLY: set[str] = set()
DIFFERENT_DEFAULTS = {(name, "longest") for name in ("jog", "jog_tool", "jog_out")}

BEATS = 5
"""Of so many the gap in the middle tells how often a press is kept alive."""

LONGEST = 0.5
"""The bound of a jog whose program hangs [s]."""


def calls(client: type) -> dict[str, inspect.Signature]:
    return {
        name: inspect.signature(member)
        for name, member in inspect.getmembers(client, callable)
        if not name.startswith("_")
    }


def test_both_clients_have_the_same_calls_with_the_same_arguments() -> None:
    blocking, asynchronous = calls(SyncPendantClient), calls(PendantClient)
    assert set(asynchronous) - set(blocking) == ASYNC_ONLY
    assert set(blocking) - set(asynchronous) == SYNC_ONLY
    for name, signature in blocking.items():
        for argument, here in signature.parameters.items():
            there = asynchronous[name].parameters[argument]
            assert here.kind == there.kind, f"{name}({argument})"
            if (name, argument) not in DIFFERENT_DEFAULTS:
                assert here.default == there.default, f"{name}({argument})"
        assert list(signature.parameters) == list(asynchronous[name].parameters), name


def until(holds: Callable[[], object], within: float = 10.0) -> None:
    """Wait until something holds of what the server's thread wrote down."""
    end = time.monotonic() + within
    while not holds():
        assert time.monotonic() < end, f"not within {within:g} s"
        time.sleep(0.005)


@pytest.fixture
def server() -> Iterator[ScriptedPendantServer]:
    thread = LoopThread("scripted server")
    with thread.entered(scripted_server()) as running:
        yield running
    thread.end()


@pytest.fixture
def pendant(server: ScriptedPendantServer) -> Iterator[SyncPendantClient]:
    with SyncPendantClient.connect("127.0.0.1", server.port, state_rate=100.0) as connected:
        connected.next_state()
        yield connected


def test_motions_block_until_they_have_ended(pendant: SyncPendantClient) -> None:
    with pendant.control():
        assert pendant.in_control
        assert pendant.move_joints(pendant.joints(), speed=0.2).done().plan_time == 0.25
        assert pendant.step({0: 0.1}).done(within=5).motion_time == 0.5


def test_a_wait_can_be_bounded(server: ScriptedPendantServer, pendant: SyncPendantClient) -> None:
    server.completes = False
    motion = pendant.home()
    with pytest.raises(TimeoutError):
        motion.done(within=0.05)
    assert not motion.is_over


def test_a_jog_is_held_while_the_program_waits_and_released_after(
    server: ScriptedPendantServer, pendant: SyncPendantClient
) -> None:
    with pendant.enabling(), pendant.jog({0: 0.5}) as jog:
        for _ in range(100):  # three times 0.1 s, and more where the machine is busy
            jog.hold(0.1)
            if len(server.all(messages.JogBeat)) >= BEATS:
                break
    assert jog.account is not None
    beats = server.times(messages.JogBeat)
    assert len(beats) >= BEATS
    assert statistics.median(after - before for before, after in pairwise(beats)) < 0.1 * SCALE
    assert len(server.all(messages.JogRelease)) == 1
    until(lambda: server.all(messages.Enabling)[-1].position == messages.EnablingPosition.RELEASED)


def test_an_error_in_the_block_releases_the_jog(
    server: ScriptedPendantServer, pendant: SyncPendantClient
) -> None:
    with pytest.raises(ZeroDivisionError), pendant.jog_tool(z=0.5):
        _ = 1 / 0
    assert len(server.all(messages.JogRelease)) == 1


def test_a_program_that_hangs_lets_go_after_the_bound(
    server: ScriptedPendantServer, pendant: SyncPendantClient
) -> None:
    """No beat is sent later than the bound after the press was accepted.

    Both are noted when the server's thread gets to them. The margin is for a busy machine that
    keeps client or server from running for so long; most often the difference is below the bound.
    """
    with pendant.jog({0: 0.5}, longest=LONGEST):
        until(lambda: server.times(messages.JogBeat))
        time.sleep(LONGEST + 0.5 * SCALE)
        start, last = server.times(messages.JogStart)[0], server.times(messages.JogBeat)[-1]
    assert last - start < LONGEST + 0.25 * SCALE


def test_a_refused_call_raises_in_the_callers_thread(
    server: ScriptedPendantServer, pendant: SyncPendantClient
) -> None:
    server.refusals[messages.SetMode] = (VerdictCode.NOT_IN_CONTROL, "nobody is")
    with pytest.raises(Refused, match="nobody is"):
        pendant.set_mode(messages.OperatingMode.AUTOMATIC)


def test_states_are_yielded_and_never_twice(pendant: SyncPendantClient) -> None:
    seen = [state.sequence for state, _ in zip(pendant.states(), range(4), strict=False)]
    assert seen == sorted(set(seen))


def test_threads_may_share_one_client(pendant: SyncPendantClient) -> None:
    with ThreadPoolExecutor(8) as pool:
        motions = list(pool.map(lambda _: pendant.home(), range(40)))
        results = list(pool.map(lambda motion: motion.done(within=10), motions))
    assert len({motion.request_id for motion in motions}) == 40
    assert {result.motion_time for result in results} == {0.5}


def test_a_blocking_call_in_a_callback_is_refused_not_deadlocked(
    pendant: SyncPendantClient,
) -> None:
    failures: list[str] = []
    heard = threading.Event()

    def ask_back(_: object) -> None:
        try:
            pendant.pause()
        except RuntimeError as error:
            failures.append(str(error))
        heard.set()

    pendant.background.on_state = ask_back
    assert heard.wait(5)
    assert "callback" in failures[0]


def test_a_lost_link_ends_what_blocks(
    server: ScriptedPendantServer, pendant: SyncPendantClient
) -> None:
    server.completes = False
    motion = pendant.home()
    pendant.background.abort()
    with pytest.raises(ConnectionLost):
        motion.done(within=5)


def test_a_closed_client_says_so_and_leaves_no_thread(server: ScriptedPendantServer) -> None:
    before = threading.active_count()
    pendant = SyncPendantClient.connect("127.0.0.1", server.port, state_rate=100.0)
    pendant.close()
    pendant.close()
    assert threading.active_count() == before
    for call in (pendant.pause, pendant.next_state, pendant.snapshot):
        with pytest.raises(ConnectionLost, match="the client is closed"):
            call()


def test_a_connection_that_nobody_takes_leaves_no_thread() -> None:
    before = threading.active_count()
    with pytest.raises(OSError, match=r"127\.0\.0\.1"):
        SyncPendantClient.connect("127.0.0.1", 1)
    assert threading.active_count() == before


# A client that one thread closes while others use it.


TRIES = 25

PATIENCE = 30.0
"""Whoever has not come back after so long never will [s]."""


def begun(work: Callable[[], object]) -> Future[object]:
    """Run something in a daemon thread, which keeps no test from ending."""
    future: Future[object] = Future()

    def run() -> None:
        try:
            future.set_result(work())
        except BaseException as error:
            future.set_exception(error)

    threading.Thread(target=run, daemon=True).start()
    return future


def failure(future: Future[object]) -> BaseException | None:
    return future.exception(timeout=PATIENCE)


Use = Callable[[SyncPendantClient, threading.Event], object]


def jog(pendant: SyncPendantClient, ready: threading.Event) -> None:
    with pendant.control(), pendant.enabling(), pendant.jog({0: 0.5}) as held:
        ready.set()
        held.hold(1e6)


def await_a_motion(pendant: SyncPendantClient, ready: threading.Event) -> None:
    motion = pendant.home()
    ready.set()
    motion.done(within=1e6)


def ask_again_and_again(pendant: SyncPendantClient, ready: threading.Event) -> None:
    while True:
        pendant.pause()
        ready.set()


def take_control_again_and_again(pendant: SyncPendantClient, ready: threading.Event) -> None:
    while True:
        with pendant.control():
            ready.set()


@pytest.mark.parametrize(
    "use", [jog, await_a_motion, ask_again_and_again, take_control_again_and_again]
)
def test_whoever_uses_a_client_that_another_thread_closes_hears_that_it_is_lost(
    use: Use, server: ScriptedPendantServer
) -> None:
    server.completes = False
    for _ in range(TRIES):
        pendant = SyncPendantClient.connect("127.0.0.1", server.port, state_rate=100.0)
        pendant.next_state()
        ready = threading.Event()
        using = begun(lambda pendant=pendant, ready=ready: use(pendant, ready))  # type: ignore[misc]
        assert ready.wait(PATIENCE)
        closing = [begun(pendant.close) for _ in range(2)]
        assert [failure(each) for each in closing] == [None, None]
        assert isinstance(failure(using), ConnectionLost)


def test_leaving_a_block_after_the_close_keeps_the_error_of_the_block(
    server: ScriptedPendantServer,
) -> None:
    pendant = SyncPendantClient.connect("127.0.0.1", server.port, state_rate=100.0)

    def close_and_stumble() -> None:
        with pendant.control():
            pendant.close()
            _ = 1 / 0

    assert isinstance(failure(begun(close_and_stumble)), ZeroDivisionError)


def close_in_control(pendant: SyncPendantClient) -> None:
    with pendant.control(), pendant.enabling():
        pendant.close()


def close_after_the_release(pendant: SyncPendantClient) -> None:
    with pendant.control(), pendant.enabling(), pendant.jog({0: 0.5}) as held:
        held.release()
        pendant.close()


def close_under_the_key(pendant: SyncPendantClient) -> None:
    with pendant.control(), pendant.enabling(), pendant.jog({0: 0.5}):
        pendant.close()


Leave = Callable[[SyncPendantClient], None]


@pytest.mark.parametrize(
    ("leave", "told"),
    [
        (close_in_control, None),
        (close_after_the_release, None),
        (close_under_the_key, ConnectionLost),
    ],
)
def test_a_block_that_closes_its_client_ends_well_unless_a_jog_owes_its_account(
    leave: Leave, told: type[Exception] | None, server: ScriptedPendantServer
) -> None:
    pendant = SyncPendantClient.connect("127.0.0.1", server.port, state_rate=100.0)
    pendant.next_state()
    left = failure(begun(lambda: leave(pendant)))
    assert left is None if told is None else isinstance(left, told)


# The loop alone.


async def for_ever() -> None:
    await asyncio.Event().wait()


async def for_ever_though_cancelled() -> None:
    while True:
        with contextlib.suppress(asyncio.CancelledError):
            await for_ever()


@pytest.mark.parametrize("work", [for_ever, for_ever_though_cancelled])
def test_a_call_that_waits_fails_when_the_loop_is_ended(
    work: Callable[[], object], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(loop_thread, "_WIND_UP", 0.1)
    thread = LoopThread("loop")
    begins = threading.Event()

    async def begin() -> None:
        # What refuses to leave is left behind, and says so on the screen of the tests.
        asyncio.current_task()._log_destroy_pending = False  # type: ignore[union-attr]
        begins.set()
        await work()  # type: ignore[misc]

    waiting = begun(lambda: thread.call(begin()))
    assert begins.wait(PATIENCE)
    thread.end()
    assert isinstance(failure(waiting), ConnectionLost)


def test_a_loop_that_a_callback_breaks_fails_what_waits_and_what_comes(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(threading, "excepthook", lambda _: None)  # the test is about the others
    thread = LoopThread("loop")
    waiting = begun(lambda: thread.call(for_ever()))

    def leave() -> None:
        raise SystemExit

    thread._loop.call_soon_threadsafe(leave)
    assert isinstance(failure(waiting), ConnectionLost)
    assert isinstance(failure(begun(lambda: thread.call(for_ever()))), ConnectionLost)
    thread.end()


def test_what_is_under_way_on_the_loop_takes_its_leave_before_the_loop_ends() -> None:
    thread = LoopThread("loop")
    left: list[str] = []

    async def work() -> None:
        try:
            await for_ever()
        finally:
            left.append("task")

    async def begin() -> asyncio.Task[None]:
        task = asyncio.create_task(work())
        await asyncio.sleep(0)
        return task

    task = thread.call(begin())
    thread.end()
    thread.end()
    assert left == ["task"]
    assert task.cancelled()
