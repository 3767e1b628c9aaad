"""The blocking client: the same calls as the asyncio client, from ordinary threads."""

import inspect
import statistics
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise

import pytest
from rigs.clock.busy_machine import SCALE
from rigs.peers.scripted_pendant_server import ScriptedPendantServer, scripted_server

from openpendant.simplemsg.pendant import (
    Enabling,
    EnablingPosition,
    JogBeat,
    JogRelease,
    JogStart,
    OperatingMode,
    SetMode,
)
from openpendant.simplemsg.verdicts import VerdictCode
from openpendant.tools.pendants.client import ConnectionLost, PendantClient, Refused
from openpendant.tools.pendants.loop_thread import LoopThread
from openpendant.tools.pendants.sync_client import SyncPendantClient

pytestmark = pytest.mark.realtime

ASYNC_ONLY = {"abort"}
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
    with SyncPendantClient.connect("127.0.0.1", server.port) as connected:
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
            if len(server.all(JogBeat)) >= BEATS:
                break
    assert jog.account is not None
    beats = server.times(JogBeat)
    assert len(beats) >= BEATS
    assert statistics.median(after - before for before, after in pairwise(beats)) < 0.1 * SCALE
    assert len(server.all(JogRelease)) == 1
    until(lambda: server.all(Enabling)[-1].position == EnablingPosition.RELEASED)


def test_an_error_in_the_block_releases_the_jog(
    server: ScriptedPendantServer, pendant: SyncPendantClient
) -> None:
    with pytest.raises(ZeroDivisionError), pendant.jog_tool(z=0.5):
        _ = 1 / 0
    assert len(server.all(JogRelease)) == 1


def test_a_program_that_hangs_lets_go_after_the_bound(
    server: ScriptedPendantServer, pendant: SyncPendantClient
) -> None:
    """No beat is sent later than the bound after the press was accepted.

    Both are noted when the server's thread gets to them. The margin is for a busy machine that
    keeps client or server from running for so long; most often the difference is below the bound.
    """
    with pendant.jog({0: 0.5}, longest=LONGEST):
        until(lambda: server.times(JogBeat))
        time.sleep(LONGEST + 0.5 * SCALE)
        start, last = server.times(JogStart)[0], server.times(JogBeat)[-1]
    assert last - start < LONGEST + 0.25 * SCALE


def test_a_refused_call_raises_in_the_callers_thread(
    server: ScriptedPendantServer, pendant: SyncPendantClient
) -> None:
    server.refusals[SetMode] = (VerdictCode.NOT_IN_CONTROL, "nobody is")
    with pytest.raises(Refused, match="nobody is"):
        pendant.set_mode(OperatingMode.AUTOMATIC)


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
    pendant = SyncPendantClient.connect("127.0.0.1", server.port)
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
