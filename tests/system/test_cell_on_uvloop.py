import asyncio
import json
import signal
import ssl
import subprocess
import time
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest
from rigs.clock.busy_machine import PATIENCE, PATIENT, SCALE
from rigs.peers.tls_certificates import make_certificate
from rigs.peers.wire_pendant import WirePendant

from openpendant.simplemsg import TriState
from openpendant.simplemsg.pendant import Activity, Motion
from openpendant.simplemsg.verdicts import VerdictCode as V
from openpendant.tools.packets.rerun import main as rerun
from openpendant.tools.pendants.client import Aborted, Pose

pytestmark = [
    pytest.mark.realtime,
    pytest.mark.skipif(
        find_spec("uvloop") is None,
        reason="uvloop is not installed: the extra 'fast' of openpendant adds it",
    ),
]

ON_UVLOOP = ("--event-loop", "uvloop")


def runs_on_uvloop(pid: int) -> bool:
    maps = Path(f"/proc/{pid}/maps")
    return not maps.exists() or "/uvloop/" in maps.read_text()  # without /proc by its word


async def test_a_robot_moves_and_stops_over_tls_and_the_run_can_be_repeated(
    start_cell: Any, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A line is planned by a child process; an interrupt ends both in good order at any time."""
    certificate, key = make_certificate(tmp_path)
    config, journal = tmp_path / "cell.toml", tmp_path / "server.journal"
    config.write_text(f'{PATIENT}[tls]\ncertificate = "{certificate}"\nkey = "{key}"\n')
    cell = await start_cell(
        server=(*ON_UVLOOP, "--config", str(config), "--journal", str(journal)), emulator=ON_UVLOOP
    )
    trusted = ssl.create_default_context(cafile=str(certificate))
    pendant = await cell.ready_pendant(tls=trusted)
    async with pendant.control():
        home = pendant.joints()
        aside = [home[0] + 0.2, *home[1:]]
        await (await pendant.move_joints(aside, speed=0.5)).done()
        await pendant.next_state()
        assert pendant.joints() == pytest.approx(aside, abs=1e-5)
        (x, y, z), orientation = pendant.tool_pose().position, pendant.tool_pose().orientation
        lower = Pose((x, y, z - 0.05), orientation)
        await (await pendant.move_to_pose(lower, motion=Motion.LIN)).done()

        move = await pendant.move_joints([home[0] - 0.8, *home[1:]], speed=0.05)
        await pendant.wait_until(lambda state: state.in_motion == TriState.TRUE)
        await pendant.stop("a test")
        with pytest.raises(Aborted) as aborted:
            await move.done()
        assert aborted.value.code == V.STOPPED
        await pendant.wait_until(lambda state: state.activity == Activity.IDLE)
    for process in (cell.server, cell.emulator):
        process.send_signal(signal.SIGINT)
        assert await asyncio.wait_for(process.wait(), PATIENCE) == 0
    assert (await cell.end())["violations"] == 0
    assert await asyncio.to_thread(rerun, [str(journal), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["identical"]


def lose(pendant: WirePendant, end: str) -> None:
    match end:
        case "fin":
            pendant.close()
        case "reset":
            pendant.abort()
        case "kill":
            fd = pendant.sock.fileno()
            with subprocess.Popen(["sleep", "60"], pass_fds=[fd]) as holder:
                pendant.close()
                holder.kill()


async def test_promise_2_a_robot_stops_when_its_pendant_is_lost(
    start_cell: Any, tmp_path: Path
) -> None:
    config = tmp_path / "cell.toml"
    config.write_text(f'{PATIENT}modes.initial = "manual_reduced"\n')
    cell = await start_cell(server=(*ON_UVLOOP, "--config", str(config)), emulator=ON_UVLOOP)
    assert runs_on_uvloop(cell.server.pid)
    assert runs_on_uvloop(cell.emulator.pid)
    observer = WirePendant(cell.ports["pendant"], "observer")
    for end in ("fin", "reset", "kill"):
        pendant = WirePendant(cell.ports["pendant"], end)
        pendant.take_control()
        pendant.press(0.5, deadline=0.25)
        pendant.wait_until(lambda state: max(map(abs, state.velocities)) > 0.05)
        observer.wait_until(lambda state: state.holder != 0 and any(state.velocities))
        lose(pendant, end)
        lost = time.monotonic()
        observer.wait_until(lambda state: state.holder == 0 and not any(state.velocities))
        assert time.monotonic() - lost < 1.0 * SCALE, end
    observer.close()
    assert (await cell.end())["violations"] == 0
