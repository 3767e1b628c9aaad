"""Processes that stall, or freeze in the middle of a motion (promises 26 and 55)."""

import asyncio
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest
from promises.promise_table import figure
from rigs.peers.minimum_controller import CODEC, STOP
from rigs.processes.burner import MOST_VOID, VoidTime, burner

from openpendant.simplemsg.pendant import StopKind
from openpendant.simplemsg.verdicts import VerdictCode as V
from openpendant.tools.bench.cells import running_room
from openpendant.tools.bench.jogging_pendants import ANYWHERE, SLOT
from openpendant.tools.pendants.client import Aborted

pytestmark = pytest.mark.realtime

ALERT = "controller.lead = 0.1\nwatchdog.deadline = 0.05\n"
"""The controller has points for twice as long as the watchdog waits."""


STOP_BYTES = CODEC.encode(STOP).hex()


def stops_received(journal: Path) -> list[int]:
    """Return when an emulator got STOP, by its journal [ns of the machine's monotonic clock]."""
    header, *events = (json.loads(line) for line in journal.read_text("utf-8").splitlines())
    return [
        header["now"] + event["t"]
        for event in events
        if "on" in event and STOP_BYTES in event.get("hex", "")
    ]


def await_stop(journal: Path) -> None:
    """Wait for a STOP, for up to twenty times the watchdog's deadline: a busy machine lets it wait
    as well."""
    until = time.monotonic() + 1.0
    while STOP_BYTES not in journal.read_text("utf-8") and time.monotonic() < until:
        time.sleep(0.02)


async def freeze_in_motion(cell: Any, journal: Path) -> dict[str, int]:
    pendant = await cell.ready_pendant()
    async with pendant.control():
        start = pendant.joints()
        target = [start[0] + 0.8, *start[1:]]
        move = await pendant.move_joints(target, speed=0.1)
        await pendant.wait_until(lambda state: state.positions[0] > start[0] + 0.02)

        frozen = time.monotonic_ns()
        os.kill(cell.server.pid, signal.SIGSTOP)
        await asyncio.to_thread(await_stop, journal)
        await asyncio.sleep(0.2)
        thawed = time.monotonic_ns()
        os.kill(cell.server.pid, signal.SIGCONT)

        with pytest.raises(Aborted) as aborted:
            await move.done()
        assert aborted.value.code == V.SERVER_LATE
        state = await pendant.wait_until(lambda state: state.stop != StopKind.NONE, within=5)
        assert state.stop == StopKind.PROTECTIVE
        await pendant.wait_until(lambda state: not any(state.velocities), within=5)
        at = pendant.joints()
        await asyncio.sleep(0.3)
        assert pendant.joints() == at
        assert at[0] < target[0] - 0.1
    events: dict[str, int] = (await cell.end())["events"]
    assert frozen < stops_received(journal)[0] < thawed
    return events


async def test_a_frozen_server_is_stopped_by_its_watchdog_and_goes_on_with_nothing(
    start_cell: Any, tmp_path: Path
) -> None:
    """STOP comes while the server is frozen, and before the points end."""
    journal = tmp_path / "emulator.journal"
    cell = await start_cell(settings=ALERT, emulator=("--journal", str(journal)))
    assert "under-runs" not in await freeze_in_motion(cell, journal)


STALLS, STALL = figure(55, "stalls").count, figure(55, "stall").seconds
TOO_LONG = 0.215
"""A stall that the machine made longer than this [s] is void, and made again."""

JOGGED = 60.0
ROBOTS = 30
JOG_LEAD = 0.1
"""The most that a jog may have ahead [s]: a machine that is so busy needs it."""


@pytest.mark.soak
async def test_promise_55_fifty_stalls_of_200_ms_end_no_planned_motion(start_cell: Any) -> None:
    cell = await start_cell(settings="")
    pendant = await cell.ready_pendant()
    void, done, voided = VoidTime(), 0, 0
    async with pendant.control():
        start = pendant.joints()[0]
        while done < STALLS:
            process = cell.server if done % 2 else cell.emulator
            at = pendant.joints()
            away = 1.0 if at[0] < start + 0.5 else -1.0
            began = time.monotonic()
            move = await pendant.move_joints([at[0] + away, *at[1:]], speed=0.3)
            await asyncio.sleep(0.3 + 0.01 * (done % 40))
            stopped = time.monotonic()
            await asyncio.to_thread(_stall, process.pid)
            took = time.monotonic() - stopped
            aborted = await _how_it_ends(move)
            if aborted is None:
                done += 1
                continue
            # What the idle timer tells of the machine comes a moment later.
            await asyncio.sleep(0.5)
            is_void = took > TOO_LONG or void.is_void(began, time.monotonic())
            assert is_void, f"stall {done + 1}, {took * 1e3:.0f} ms: {aborted}"
            voided += 1
            assert voided <= MOST_VOID * STALLS, "the machine was late too often"
            await _begin_anew(pendant)
    void.end()


async def _how_it_ends(move: Any) -> Aborted | None:
    try:
        await move.done()
    except Aborted as aborted:
        return aborted
    return None


def _stall(pid: int) -> None:
    os.kill(pid, signal.SIGSTOP)
    time.sleep(STALL)
    os.kill(pid, signal.SIGCONT)


async def _begin_anew(pendant: Any) -> None:
    await pendant.wait_until(lambda state: not any(state.velocities), within=5)
    await pendant.wait_until(lambda state: state.motion_possible == 1, within=5)
    if pendant.state.stop != StopKind.NONE:
        await pendant.reset_stop()


@pytest.mark.soak
def test_thirty_jogging_robots_beside_a_burner_are_held_99_percent_of_the_time() -> None:
    """What ends a jog is reset and pressed anew; what the machine itself missed is void."""
    void = VoidTime()
    with running_room(ROBOTS, is_pinned=False, jog_lead=JOG_LEAD) as (server, cells), burner():
        command = [sys.executable, "-m", "openpendant.tools.bench.jogging_pendants"]
        command += [str(server["pendant"]), str(server["pid"]), str(JOGGED), ANYWHERE, *cells]
        done = subprocess.run(command, capture_output=True, text=True, timeout=240, check=True)
        account = json.loads(done.stdout)
    held = heard = voided = 0
    slots = {float(begins): counts for begins, counts in account["slots"].items()}
    for begins, (told, jogging) in slots.items():
        if void.is_void(begins, begins + SLOT):
            voided += 1
        else:
            heard, held = heard + told, held + jogging
    void.end()
    told = f"{account['ended']}, {voided} of {len(slots)} slots void, latched {account['latched']}"
    told = f"held {100 * held / heard:.2f} %, {told}"
    assert voided <= MOST_VOID * len(slots), told
    assert held >= 0.99 * heard, told
    assert not account["latched"], told
