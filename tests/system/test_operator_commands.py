import asyncio
import json
import signal
import sys
from collections.abc import Callable
from typing import Any

import pytest
import pytest_asyncio
from rigs.clock.busy_machine import PATIENCE

from openpendant.motion.description.robot import serial_robot
from openpendant.simplemsg.pendant import OperatingMode, StopKind
from openpendant.tools.pendants.client import PendantClient
from openpendant.tools.pendants.commands import home, reset, run, stop

pytestmark = [pytest.mark.realtime, pytest.mark.asyncio(loop_scope="module")]

CELL = {"has_store": True}
HOME = serial_robot("ur5").home_position
AWAY = 0.3
"""How far the first joint stands from home [rad]."""

SLOW = 0.25
"""Of the joints' largest speed, at which the program goes from one end of its way to the other in
nearly half a second."""

Main = Callable[[list[str]], int]


async def command(
    cell: Any, main: Main, capsys: pytest.CaptureFixture[str], *arguments: str
) -> tuple[int, str, str]:
    where = ["--server", f"127.0.0.1:{cell.ports['pendant']}"]
    code = await asyncio.to_thread(main, [*arguments, *where])
    said = capsys.readouterr()
    return code, said.out, said.err


async def away_from_home(cell: Any) -> PendantClient:
    pendant: PendantClient = await cell.ready_pendant()
    async with pendant.control():
        await pendant.reset_stop()
        for target in (HOME, (HOME[0] + AWAY, *HOME[1:])):
            await pendant.next_state()
            if max(abs(at - to) for at, to in zip(pendant.joints(), target, strict=True)) > 1e-3:
                await (await pendant.move_joints(target, speed=1.0)).done()
    return pendant


async def test_home_moves_the_robot_there_and_says_so(
    shared_cell: Any, capsys: pytest.CaptureFixture[str]
) -> None:
    pendant = await away_from_home(shared_cell)
    code, out, err = await command(shared_cell, home.main, capsys, "--speed", "0.5")
    assert (code, err) == (0, "")
    assert "home at 50% speed: completed" in out
    await pendant.next_state()
    assert pendant.joints()[0] == pytest.approx(HOME[0], abs=1e-3)
    assert pendant.state is not None
    assert pendant.state.holder == 0


async def test_a_stop_is_latched_named_and_reset_by_who_says_yes(
    shared_cell: Any, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    pendant = await away_from_home(shared_cell)
    code, out, _ = await command(shared_cell, stop.main, capsys, "--reason", "tea", "--json")
    assert (code, json.loads(out)["event"]) == (0, "stopped")
    await pendant.wait_until(lambda state: state.stop == StopKind.SOFTWARE)

    code, _, err = await command(shared_cell, home.main, capsys)
    assert code == 1
    assert "STOP_LATCHED: software stop by openpendant stop: tea" in err
    assert "Traceback" not in err

    monkeypatch.setattr("sys.stdin.isatty", lambda: False, raising=False)
    code, _, err = await command(shared_cell, reset.main, capsys)
    assert (code, "a script says --yes" in err) == (2, True)
    assert pendant.state is not None
    assert pendant.state.stop == StopKind.SOFTWARE

    code, out, _ = await command(shared_cell, reset.main, capsys, "--yes")
    assert (code, "the stop by openpendant stop (tea) is reset" in out) == (0, True)
    await pendant.wait_until(lambda state: state.stop == StopKind.NONE)
    code, out, _ = await command(shared_cell, reset.main, capsys)
    assert (code, out) == (0, "no stop is latched\n")


async def test_a_mode_that_asks_for_the_enabling_device_is_named_with_what_to_do(
    shared_cell: Any, capsys: pytest.CaptureFixture[str]
) -> None:
    pendant = await away_from_home(shared_cell)
    async with pendant.control():
        await pendant.set_mode(OperatingMode.MANUAL_REDUCED)
    code, _, err = await command(shared_cell, home.main, capsys)
    async with pendant.control():
        await pendant.set_mode(OperatingMode.AUTOMATIC)
    assert code == 1
    assert "NOT_ENABLED" in err
    assert "which this command has none of" in err


async def test_who_holds_the_authority_is_named(
    shared_cell: Any, capsys: pytest.CaptureFixture[str]
) -> None:
    pendant = await away_from_home(shared_cell)
    async with pendant.control():
        code, out, err = await command(shared_cell, home.main, capsys, "--json")
    assert code == 1
    assert json.loads(out)["name"] == "HELD_BY_OTHER"
    assert "pendant is in control" in err


@pytest_asyncio.fixture(scope="module", loop_scope="module")
async def program(cell_of_the_file: Any) -> str:
    """A program that is taught from the end of its way to the middle."""
    name, pendant = "slow", await away_from_home(cell_of_the_file)
    async with pendant.control():
        made: Any = await pendant.programs.create(name)
        for number, offset in enumerate((0.0, -AWAY / 2)):
            if offset:
                at = pendant.joints()
                await (await pendant.move_joints([at[0] + offset, *at[1:]], speed=1.0)).done()
                await pendant.next_state()
            speed = {"kind": "fraction", "value": SLOW}
            move = {"way": "PTP", "point": f"p{number}", "speed": speed}
            made = await pendant.manage(
                {
                    "op": "programs.record",
                    "name": name,
                    "expected_revision": made["revision"],
                    "point": f"p{number}",
                    "move": move,
                }
            )
    await cell_of_the_file.hang_up()
    return name


async def test_a_run_of_no_program_fails(
    shared_cell: Any, capsys: pytest.CaptureFixture[str]
) -> None:
    await shared_cell.ready_pendant()
    code, _, _ = await command(shared_cell, run.main, capsys, "no such program")
    assert code == 1


async def test_run_tells_the_lines_and_ctrl_c_stops_the_robot_on_its_way(
    shared_cell: Any, program: str
) -> None:
    pendant = await shared_cell.ready_pendant()
    process = await asyncio.create_subprocess_exec(
        *(sys.executable, "-m", "openpendant.tools", "run", program, "--json", "--loops", "0"),
        *("--server", f"127.0.0.1:{shared_cell.ports['pendant']}"),
        stdout=asyncio.subprocess.PIPE,
        stderr=asyncio.subprocess.PIPE,
    )
    await pendant.wait_until(lambda state: state.in_motion == 1)
    await asyncio.sleep(0.1)
    process.send_signal(signal.SIGINT)
    out_bytes, err_bytes = await asyncio.wait_for(process.communicate(), PATIENCE)
    events = [json.loads(line) for line in out_bytes.decode().splitlines()]
    assert process.returncode == 130
    assert err_bytes.decode() == (
        "openpendant run: program 'slow': interrupted, the robot stands\n"
    )
    assert {"asked", "begun", "line", "stopped"} <= {each["event"] for each in events}
    state = await pendant.wait_until(lambda state: state.in_motion == 0)
    assert (state.stop, state.holder) == (StopKind.NONE, 0)


async def test_a_run_that_nobody_ends_says_that_it_is_completed(
    shared_cell: Any, program: str, capsys: pytest.CaptureFixture[str]
) -> None:
    await shared_cell.ready_pendant()
    code, out, _ = await command(shared_cell, run.main, capsys, program, "--speed", "1")
    assert (code, "completed" in out) == (0, True)
