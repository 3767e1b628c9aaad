import asyncio
import json
from pathlib import Path
from typing import Any

import pytest
from rigs.clock.busy_machine import PATIENT

from openpendant.simplemsg.pendant import Activity, ProgramState
from openpendant.simplemsg.verdicts import VerdictCode as V
from openpendant.tools.packets.rerun import main as rerun
from openpendant.tools.pendants import client

pytestmark = pytest.mark.realtime

CONFIG = f'{PATIENT}controller.signals = "openpendant"\n'


class Taught:
    def __init__(self, pendant: client.PendantClient, name: str) -> None:
        self.pendant = pendant
        self.name = name
        self.revision = 0

    async def change(self, op: str, **fields: Any) -> dict[str, Any]:
        request = {"op": f"programs.{op}", "name": self.name, **fields}
        if op != "create":
            request["expected_revision"] = self.revision
        answer = await self.pendant.manage(request)
        self.revision = answer["revision"]
        return answer

    async def edit(self, kind: str, **fields: Any) -> None:
        await self.change("edit", edit={"edit": kind, **fields})

    async def record(self, point: str, **more: Any) -> None:
        speed = {"kind": "fraction", "value": 0.3}
        move = {"way": "PTP", "point": point, "speed": speed}
        await self.change("record", point=point, move=move, **more)

    async def text(self) -> str:
        answer = await self.pendant.manage({"op": "programs.load", "name": self.name})
        return str(answer["body"])

    async def moves(self) -> list[str]:
        lines = [line.split() for line in (await self.text()).splitlines()]
        return [words[2] for words in lines if words[:1] == ["move"]]


async def go_aside(pendant: client.PendantClient, by: float) -> None:
    await pendant.next_state()
    first, *rest = pendant.joints()
    await (await pendant.move_joints([first + by, *rest], speed=0.5)).done()
    await pendant.next_state()


async def edited(pendant: client.PendantClient) -> Taught:
    program = Taught(pendant, "taught")
    await program.change("create")
    await program.record("p0")
    await go_aside(pendant, 0.3)
    await program.record("p1")
    await go_aside(pendant, -0.15)
    await program.record("between", at=1, comment="halfway")
    assert await program.moves() == ["p0", "between", "p1"]
    await program.edit("reorder", first=1, count=1, to=2)
    assert await program.moves() == ["p0", "p1", "between"]
    await program.change("undo")
    assert await program.moves() == ["p0", "between", "p1"]
    await program.change("redo")
    await program.edit("rename-point", name="between", new_name="middle")
    await program.edit("comment-point", name="middle", comment="here it waits")
    await go_aside(pendant, -0.05)
    await program.change("touch_up", point="middle")
    switch_on = {"statement": "set-output", "signal": 2, "value": True}
    await program.edit("insert", at=2, statements=[switch_on])
    await program.edit("delete", first=0)
    assert await program.moves() == ["p1", "middle"]
    await program.change("undo")
    with pytest.raises(client.Refused) as late:
        await pendant.manage({"op": "programs.undo", "name": "taught", "expected_revision": 1})
    assert late.value.code == V.REVISION_CONFLICT
    assert f"{program.revision}" in str(late.value)
    assert await program.moves() == ["p0", "p1", "middle"]
    return program


async def played_back(pendant: client.PendantClient, program: Taught) -> None:
    found = await pendant.manage({"op": "programs.dry_run", "name": "taught"})
    assert [each["reachable"] for each in found["points"]] == [True] * 3
    assert found["duration"] > 0
    assert found["path"]
    await (await pendant.run_program("taught", loops=2)).done()
    signals = await pendant.manage({"op": "signals.read"})
    assert signals["outputs"][2] is True
    await (await pendant.run_program("taught", run=client.RunKind.STEP_FORWARD)).done()
    await (await pendant.run_program("taught", run=client.RunKind.STEP_FORWARD)).done()
    await (await pendant.run_program("taught", run=client.RunKind.STEP_BACKWARD)).done()
    assert (await pendant.next_state()).program_state == ProgramState.STEPPED
    rest = await pendant.run_program("taught")
    await pendant.wait_until(lambda state: state.activity == Activity.MOVING)
    await pendant.pause()
    await pendant.wait_until(lambda state: state.activity == Activity.PAUSED)
    await pendant.resume()
    await rest.done()
    lines = (await program.text()).splitlines()
    line = next(n for n, each in enumerate(lines, start=1) if each.startswith("move PTP p1"))
    stopped = await pendant.run_program("taught", line=line)
    await pendant.wait_until(lambda state: state.activity == Activity.MOVING)
    await pendant.program_stop()
    with pytest.raises(client.Aborted) as aborted:
        await stopped.done()
    assert aborted.value.code == V.PROGRAM_STOPPED
    await pendant.wait_until(lambda state: state.activity == Activity.IDLE)
    assert (await pendant.next_state()).program_state == ProgramState.NONE
    await (await pendant.run_program("taught", line=line)).done()


async def recorded(pendant: client.PendantClient) -> None:
    await pendant.manage({"op": "recordings.start", "name": "swing"})
    await go_aside(pendant, 0.2)
    await pendant.manage({"op": "recordings.stop"})
    told = await pendant.manage({"op": "recordings.play", "name": "swing", "factor": 2})
    assert told["approach"] > 0
    await pendant.wait_until(lambda state: state.activity == Activity.MOVING)
    await pendant.wait_until(lambda state: state.activity == Activity.IDLE)


async def jogged(pendant: client.PendantClient) -> None:
    await pendant.set_mode(client.OperatingMode.MANUAL_REDUCED)
    async with pendant.enabling():
        async with pendant.jog({0: 0.3}) as jog:
            await jog.hold(0.3)
        await jog.release()


async def test_an_app_teaches_edits_and_plays_back_and_its_journal_runs_again_exactly(
    start_cell: Any, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    config, journal = tmp_path / "cell.toml", tmp_path / "server.journal"
    config.write_text(CONFIG, encoding="utf-8")
    more = ("--config", str(config), "--store", str(tmp_path / "store.db"))
    cell = await start_cell(server=(*more, "--journal", str(journal)))
    pendant = await cell.ready_pendant()
    async with pendant.control():
        await pendant.set_mode(client.OperatingMode.AUTOMATIC)
        await pendant.next_state()
        program = await edited(pendant)
        await played_back(pendant, program)
        await recorded(pendant)
        await jogged(pendant)
    assert (await cell.end())["violations"] == 0
    reader = await (await start_cell(server=more)).ready_pendant()
    listed = await reader.programs.list()
    assert [each["name"] for each in listed["programs"]] == ["taught"]
    # The rerun has a loop of its own, which must not be nested in this one.
    assert await asyncio.to_thread(rerun, [str(journal), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["identical"]
