"""Promises 3, 27 and 31: a silent peer goes, old state says so, who goes leaves nothing behind."""

import asyncio
import gc
import itertools
import os
import socket
import subprocess
import tracemalloc
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from promises.promise_figures import tell
from promises.promise_table import figure
from rigs.cells.server_rig import MS, TICK, ServerRig, ready
from rigs.motion.jog_pad import JogPad
from rigs.peers.own_network import begun_in_own_network, last_words
from rigs.processes.app_on_loop import app_on_loop, clients_of, said, until
from rigs.processes.promise_rig import promise_rig

from openpendant.simplemsg import Ping
from openpendant.simplemsg.pendant import (
    AuthorityBeat,
    AuthorityChanged,
    AuthorityReason,
    LinkState,
    State,
)
from openpendant.simplemsg.verdicts import VerdictCode as V

FREE, CLOSED = figure(3, "free"), figure(3, "closed")
CABLE = Path(__file__).parents[1] / "rigs" / "peers" / "pulled_cable.py"


def test_promise_3_the_authority_of_a_silent_peer_is_free_after_three_seconds() -> None:
    rig = ready()
    pad = JogPad(rig)
    witness = rig.pendant("witness")
    last = rig.now
    pad.pendant.send(AuthorityBeat())
    while rig.core.cell.authority.holder is not None:
        rig.wait(10)
        assert rig.now - last <= FREE.ns + TICK
    assert rig.now - last >= FREE.ns
    (change,) = witness.all(AuthorityChanged)
    assert change.reason == AuthorityReason.EXPIRED


@pytest.mark.virtual_clock
async def test_promise_3_the_kernel_is_told_to_look_for_dead_peers() -> None:
    async with app_on_loop() as served:
        await served.visitor(begin=said())
        await until(lambda: served.connections == 1, 1.0)
        (client,) = clients_of(served.app).values()
        assert client._transport is not None
        accepted = client._transport.get_extra_info("socket")
        tcp = socket.IPPROTO_TCP
        assert accepted.getsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE) == 1
        idle, pause, count = (
            accepted.getsockopt(tcp, option)
            for option in (socket.TCP_KEEPIDLE, socket.TCP_KEEPINTVL, socket.TCP_KEEPCNT)
        )
        assert idle + pause * count <= CLOSED.seconds
        assert accepted.getsockopt(tcp, socket.TCP_USER_TIMEOUT) <= CLOSED.ms
        await asyncio.sleep(0)


@pytest.fixture(scope="module")
def cable() -> Iterator[subprocess.Popen[str]]:
    """A server and two pendants, and the cable between them, which is pulled once."""
    with begun_in_own_network(CABLE) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "2\n"
        yield process


@pytest.mark.realtime
def test_nobody_is_gone_before_the_cable_is_pulled(cable: subprocess.Popen[str]) -> None:
    assert cable.poll() is None


@pytest.mark.realtime
def test_promise_3_a_pulled_cable_is_noticed_within_three_seconds(
    cable: subprocess.Popen[str],
) -> None:
    talking, listening = map(float, last_words(cable).split())
    tell(f"promise 3: noticed after {talking:.2f} s with state under way, {listening:.2f} s idle")
    assert talking <= CLOSED.seconds
    assert listening <= CLOSED.seconds


SERVER = str(Path(__file__).parent.parent.parent / "server") + "/*"
INSTALLED = "*/openpendant/server/*"

GROWTH = figure(31, "growth")


def come_and_go(rig: ServerRig, number: int) -> None:
    pad = JogPad(rig, f"pad {number}")
    pad.squeeze()
    assert pad.press(1.0 if number % 2 else -1.0, 0.0) is V.ACCEPTED
    pad.hold(30)
    if number % 3:
        pad.release()
    pad.pendant.close()
    rig.wait(100)
    # What the rig itself writes down is no leak of the server.
    rig.log.clear()
    rig.points.clear()
    del rig._peers[pad.pendant.session]


def growth(cycles: int) -> int:
    rig = ready(modes={"initial": "manual_high"})
    rig.pendant("witness")
    number = 0
    # What other tests left is not looked through with each collection: that took seconds.
    gc.freeze()
    # Empties the interpreter's lists of free tuples: what is taken from them is not seen.
    gc.collect()
    tracemalloc.start()
    try:
        sizes = []
        for _ in range(2):
            for _ in range(cycles):
                number += 1
                come_and_go(rig, number)
            for peer in rig._peers.values():
                peer.got.clear()
            gc.collect()
            kept = [tracemalloc.Filter(True, SERVER), tracemalloc.Filter(True, INSTALLED)]
            snapshot = tracemalloc.take_snapshot().filter_traces(kept)
            sizes.append(sum(each.size for each in snapshot.statistics("filename")))
    finally:
        tracemalloc.stop()
    return sizes[1] - sizes[0]


def test_promise_31_a_core_forgets_whoever_left() -> None:
    cycles = 20
    assert growth(cycles) < 10 * cycles


@pytest.mark.soak
@pytest.mark.timeout(3_600)
def test_promise_31_a_core_forgets_ten_thousand_who_left() -> None:
    assert growth(5_000) < 5_000


@pytest.mark.soak
@pytest.mark.timeout(7_200)
def test_promise_31_a_core_keeps_its_size_over_a_million_who_came_and_went() -> None:
    rig = ready(modes={"initial": "manual_high"})
    witness, sizes = rig.pendant("witness"), list[float]()
    for number in range(1, 1_000_001):
        come_and_go(rig, number)
        if number % 100 == 0:
            # Whoever says nothing for 30 s would be told to leave in each tick.
            witness.send(Ping())
            witness.got.clear()
        if number % 50_000 == 0:
            gc.collect()
            sizes.append(_resident("self"))
    told = ", ".join(f"{mebibytes:.2f}" for mebibytes in sizes)
    tell(f"promise 31, MiB each 50,000 who came, jogged and left: {told}")
    assert not witness.closed_for
    assert sizes[-1] - sizes[0] < GROWTH.bound


@pytest.mark.virtual_clock
async def test_promise_31_sockets_and_tasks_are_back_to_where_they_were() -> None:
    async with app_on_loop() as served:
        files, tasks = _open_files(), len(asyncio.all_tasks())
        for _ in range(5):
            for _ in range(15):
                await served.visitor(begin=said())
            await until(lambda: served.connections == 15, 1.0)
            served.close()
            await until(lambda: served.connections == 0, 1.0)
        assert _open_files() == files
        assert len(asyncio.all_tasks()) == tasks


def _open_files(pid: int | str = "self") -> int:
    return len(os.listdir(f"/proc/{pid}/fd"))


def _resident(pid: int | str) -> float:
    """Return the memory that a process has [MiB]."""
    pages = int(Path(f"/proc/{pid}/statm").read_text("ascii").split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 2**20


@pytest.mark.soak
@pytest.mark.realtime
@pytest.mark.timeout(3_600)
def test_promise_31_a_server_process_keeps_its_size_over_a_thousand_jogs(tmp_path: Path) -> None:
    with promise_rig(tmp_path) as rig:
        sizes = []
        for number in range(1, GROWTH.trials + 1):
            pendant = rig.pendant(f"hand {number}")
            pendant.take_control()
            pendant.press(0.5 if number % 2 else -0.5)
            pendant.listen(0.06)
            pendant.abort() if number % 3 == 0 else pendant.close()
            if number % 100 == 0:
                sizes.append((_resident(rig.server_pid), _open_files(rig.server_pid)))
        told = ", ".join(f"{mebibytes:.2f} {files}" for mebibytes, files in sizes)
        tell(f"promise 31, MiB and files each 100 jogs: {told}")
        # The first hundred fill what is filled once.
        assert sizes[-1][0] - sizes[0][0] < GROWTH.bound
        assert sizes[-1][1] - sizes[0][1] <= 1


STALE = figure(27, "stale").ns


def silent_for(milliseconds: int, **settings: Any) -> tuple[ServerRig, list[State]]:
    """Let a controller fall silent; return the states told since."""
    rig = ready(**settings)
    pendant = rig.pendant(state_rate=100.0)
    rig.wait(100)
    rig.controller.reports = False
    pendant.got.clear()
    rig.wait(milliseconds)
    return rig, pendant.all(State)


def test_promise_27_the_age_grows_with_the_clock_and_stale_is_told_beyond_100_ms() -> None:
    _, states = silent_for(500)
    assert [round(state.age * 1e9) for state in states] == [n * TICK for n in range(1, 51)]
    for state in states:
        is_old = round(state.age * 1e9) > STALE
        assert (state.link == LinkState.STALE) == is_old


@pytest.mark.parametrize("late", [0, 1, 9_999_999])
def test_promise_27_the_flag_turns_between_100_ms_and_the_next_nanosecond(late: int) -> None:
    rig, _ = silent_for(90)
    rig.now += STALE - 90 * MS + late
    assert (rig.core.cell.link_state(rig.now) is LinkState.STALE) == (late > 0)


def test_promise_27_a_controller_that_reports_slowly_is_not_called_stale_between_two() -> None:
    """As amended: from two and a half of its declared periods on."""
    _, states = silent_for(500, controller={"state_period": 0.1})
    stale = [state.age for state in states if state.link == LinkState.STALE]
    assert min(stale) == pytest.approx(figure(27, "periods").bound * 0.1 + 0.01)


def test_promise_27_messages_are_numbered_and_their_time_never_stands_still() -> None:
    _, states = silent_for(300)
    for one, two in itertools.pairwise(states):
        assert two.sequence > one.sequence
        assert (two.time_s, two.time_ns) > (one.time_s, one.time_ns)
        assert two.age > one.age


def test_promise_27_what_is_fresh_again_is_called_so_at_once() -> None:
    rig, _ = silent_for(300)
    pendant = rig.pendant(state_rate=100.0)
    rig.controller.reports = True
    rig.wait(10)
    (state,) = pendant.all(State)
    assert (state.age, state.link) == (0.0, LinkState.UP)
