"""A blocking client that one thread closes while others use it: nobody waits for ever."""

import asyncio
import contextlib
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Future

import pytest
from rigs.peers.scripted_pendant_server import ScriptedPendantServer, scripted_server

from openpendant.tools.pendants import loop_thread
from openpendant.tools.pendants.client import ConnectionLost
from openpendant.tools.pendants.loop_thread import LoopThread
from openpendant.tools.pendants.sync_client import SyncPendantClient

pytestmark = pytest.mark.realtime

TRIES = 25

PATIENCE = 30.0
"""Whoever has not come back after so long never will [s]."""


@pytest.fixture
def server() -> Iterator[ScriptedPendantServer]:
    thread = LoopThread("scripted server")
    with thread.entered(scripted_server()) as running:
        yield running
    thread.end()


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
        pendant = SyncPendantClient.connect("127.0.0.1", server.port)
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
    pendant = SyncPendantClient.connect("127.0.0.1", server.port)

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
    pendant = SyncPendantClient.connect("127.0.0.1", server.port)
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
