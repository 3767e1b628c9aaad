"""Promise 31: whoever comes, jogs and goes leaves nothing behind."""

import asyncio
import gc
import os
import tracemalloc
from pathlib import Path

import pytest
from promises.promise_figures import tell
from promises.promise_table import figure
from rigs.cells.server_rig import ServerRig, ready
from rigs.motion.jog_pad import JogPad
from rigs.processes.app_on_loop import app_on_loop, said, until
from rigs.processes.promise_rig import promise_rig

from openpendant.simplemsg import Ping
from openpendant.simplemsg.verdicts import VerdictCode as V

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
    # Sessions of the rig are numbered by those it has, so one stays.
    rig.pendant("witness")
    number = 0
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
    cycles = 30
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
