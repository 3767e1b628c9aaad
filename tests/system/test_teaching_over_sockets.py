import contextlib
import io
import json
from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager
from itertools import count
from pathlib import Path
from typing import Any

import pytest

from openpendant.simplemsg.pendant import Activity, ProgramState
from openpendant.simplemsg.verdicts import VerdictCode as V
from openpendant.tools.packets.rerun import main as rerun
from openpendant.tools.pendants import client

pytestmark = [pytest.mark.realtime, pytest.mark.asyncio(loop_scope="module")]

CELL: dict[str, Any] = {"has_store": True}
NUMBERS = count(1)
"""For what is kept under a name, so that a test can begin anew."""


@pytest.fixture(scope="module", autouse=True)
def journal_that_runs_again_exactly(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    journal = tmp_path_factory.mktemp("journal") / "server.journal"
    CELL["server"] = ("--signals", "openpendant", "--journal", str(journal))
    yield
    if not journal.exists():  # none of the tests on the file's cell was chosen
        return
    with contextlib.redirect_stdout(io.StringIO()) as said:
        assert rerun([str(journal), "--json"]) == 0
    assert json.loads(said.getvalue())["identical"]


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
        speed = {"kind": "fraction", "value": 0.8}
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
    await (await pendant.move_joints([first + by, *rest], speed=1.0)).done()
    await pendant.next_state()


@asynccontextmanager
async def automatic(cell: Any) -> AsyncIterator[client.PendantClient]:
    pendant = await cell.ready_pendant()
    async with pendant.control():
        await pendant.set_mode(client.OperatingMode.AUTOMATIC)
        await pendant.next_state()
        yield pendant


async def taught(pendant: client.PendantClient) -> Taught:
    """A program of three points in which a signal is set."""
    program = Taught(pendant, f"taught {next(NUMBERS)}")
    await program.change("create")
    await program.record("p0")
    await go_aside(pendant, 0.1)
    await program.record("p1")
    await go_aside(pendant, -0.05)
    await program.record("middle")
    switch_on = {"statement": "set-output", "signal": 2, "value": True}
    await program.edit("insert", at=2, statements=[switch_on])
    return program


@pytest.mark.asyncio(loop_scope="function")
async def test_a_taught_program_is_there_after_a_restart(start_cell: Any, tmp_path: Path) -> None:
    more = ("--store", str(tmp_path / "store.db"))
    first = await start_cell(server=more)
    async with automatic(first) as pendant:
        program = Taught(pendant, "taught")
        await program.change("create")
        await program.record("p0")
    await first.end()
    reader = await (await start_cell(server=more)).ready_pendant()
    listed = await reader.programs.list()
    assert [each["name"] for each in listed["programs"]] == ["taught"]
    assert await Taught(reader, "taught").moves() == ["p0"]


async def test_an_app_teaches_and_edits_a_program(cell_of_the_file: Any) -> None:
    async with automatic(cell_of_the_file) as pendant:
        program = Taught(pendant, f"taught {next(NUMBERS)}")
        await program.change("create")
        await program.record("p0")
        await go_aside(pendant, 0.1)
        await program.record("p1")
        await go_aside(pendant, -0.05)
        await program.record("between", at=1, comment="halfway")
        assert await program.moves() == ["p0", "between", "p1"]
        await program.edit("reorder", first=1, count=1, to=2)
        assert await program.moves() == ["p0", "p1", "between"]
        await program.change("undo")
        assert await program.moves() == ["p0", "between", "p1"]
        await program.change("redo")
        await program.edit("rename-point", name="between", new_name="middle")
        await program.edit("comment-point", name="middle", comment="here it waits")
        await go_aside(pendant, -0.02)
        await program.change("touch_up", point="middle")
        switch_on = {"statement": "set-output", "signal": 2, "value": True}
        await program.edit("insert", at=2, statements=[switch_on])
        await program.edit("delete", first=0)
        assert await program.moves() == ["p1", "middle"]
        await program.change("undo")
        with pytest.raises(client.Refused) as late:
            await pendant.manage(
                {"op": "programs.undo", "name": program.name, "expected_revision": 1}
            )
        assert late.value.code == V.REVISION_CONFLICT
        assert f"{program.revision}" in str(late.value)
        assert await program.moves() == ["p0", "p1", "middle"]


async def test_a_taught_program_is_tried_dry_and_repeated(
    cell_of_the_file: Any,
) -> None:
    async with automatic(cell_of_the_file) as pendant:
        program = await taught(pendant)
        found = await pendant.manage({"op": "programs.dry_run", "name": program.name})
        assert [each["reachable"] for each in found["points"]] == [True] * 3
        assert found["duration"] > 0
        assert found["path"]
        await (await pendant.run_program(program.name, loops=2)).done()
        signals = await pendant.manage({"op": "signals.read"})
        assert signals["outputs"][2] is True


async def test_a_taught_program_is_stepped_through_and_goes_on(cell_of_the_file: Any) -> None:
    async with automatic(cell_of_the_file) as pendant:
        program = await taught(pendant)
        await (await pendant.run_program(program.name, run=client.RunKind.STEP_FORWARD)).done()
        await (await pendant.run_program(program.name, run=client.RunKind.STEP_FORWARD)).done()
        await (await pendant.run_program(program.name, run=client.RunKind.STEP_BACKWARD)).done()
        assert (await pendant.next_state()).program_state == ProgramState.STEPPED
        await (await pendant.run_program(program.name)).done()


async def test_a_taught_program_is_paused_stopped_and_begun_at_a_line(
    cell_of_the_file: Any,
) -> None:
    async with automatic(cell_of_the_file) as pendant:
        program = await taught(pendant)
        rest = await pendant.run_program(program.name)
        await pendant.wait_until(lambda state: state.activity == Activity.MOVING)
        await pendant.pause()
        await pendant.wait_until(lambda state: state.activity == Activity.PAUSED)
        await pendant.resume()
        await rest.done()
        lines = (await program.text()).splitlines()
        line = next(n for n, each in enumerate(lines, start=1) if each.startswith("move PTP p1"))
        stopped = await pendant.run_program(program.name, line=line)
        await pendant.wait_until(lambda state: state.activity == Activity.MOVING)
        await pendant.program_stop()
        with pytest.raises(client.Aborted) as aborted:
            await stopped.done()
        assert aborted.value.code == V.PROGRAM_STOPPED
        await pendant.wait_until(lambda state: state.activity == Activity.IDLE)
        assert (await pendant.next_state()).program_state == ProgramState.NONE
        await (await pendant.run_program(program.name, line=line)).done()


async def test_a_recording_is_played_back_and_a_jog_follows(cell_of_the_file: Any) -> None:
    async with automatic(cell_of_the_file) as pendant:
        swing = f"swing {next(NUMBERS)}"
        await pendant.manage({"op": "recordings.start", "name": swing})
        await go_aside(pendant, 0.1)
        await pendant.manage({"op": "recordings.stop"})
        told = await pendant.manage({"op": "recordings.play", "name": swing, "factor": 2})
        assert told["approach"] > 0
        await pendant.wait_until(lambda state: state.activity == Activity.MOVING)
        await pendant.wait_until(lambda state: state.activity == Activity.IDLE)
        await pendant.set_mode(client.OperatingMode.MANUAL_REDUCED)
        async with pendant.enabling():
            async with pendant.jog({0: 0.3}) as jog:
                await jog.hold(0.15)
            await jog.release()
