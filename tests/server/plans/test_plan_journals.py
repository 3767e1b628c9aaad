"""A server that made and executed plans runs again from its journal, byte for byte."""

import asyncio
import json
from contextlib import closing
from pathlib import Path

import pytest
from rigs.cells.journalled_cell import journalled_cell
from rigs.clock.virtual_clock import VirtualLoop

from openpendant.simplemsg.verdicts import VerdictCode as V
from openpendant.tools.packets.rerun import main
from openpendant.tools.pendants.client import PendantClient, Refused


async def _rows(pendant: PendantClient, plan: int) -> list[list[float]]:
    rows: list[list[float]] = []
    while True:
        shown = await pendant.plans.samples(plan, first=len(rows), with_tool=True)
        rows += shown["rows"]
        if not shown["more"]:
            return rows
        await asyncio.sleep(0.05)


async def _plan_and_execute(folder: Path) -> None:
    async with journalled_cell(folder / "emulator", folder / "server") as cell:
        pendant = await cell.pendant()
        async with pendant, pendant.control():
            home = list(pendant.joints())
            there = [home[0] + 0.3, *home[1:]]
            made = await pendant.plans.make({"kind": "ptp", "joints": there})
            stale = await pendant.plans.make({"kind": "path", "waypoints": [there, home]})
            dropped = await pendant.plans.make(
                {"kind": "free", "joints": there, "planner": "BuiltInRRTConnect"}
            )
            assert len(await _rows(pendant, made["plan"])) == made["samples"]
            await pendant.plans.drop(dropped["plan"])
            result = await (await pendant.execute(made["plan"], override_is_one=True)).done()
            assert result.motion_time == pytest.approx(made["duration"], abs=1e-6)
            with pytest.raises(Refused) as refused:
                await pendant.execute(stale["plan"])
            assert refused.value.code == V.PLAN_STALE
            assert pendant.joints() == pytest.approx(there, abs=1e-3)
            heads = (await pendant.plans.show())["plans"]
            states = {head["plan"]: head["state"] for head in heads}
            assert states == {1: "done", 2: "stale", 3: "dropped"}


def test_a_server_that_executed_plans_runs_again_from_its_journal(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with closing(VirtualLoop()) as loop:
        loop.run_until_complete(_plan_and_execute(tmp_path))
    assert main([str(tmp_path / "server"), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told
