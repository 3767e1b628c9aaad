"""Teaching and running a program as it is used: processes on real sockets, a store on disk."""

from __future__ import annotations

from typing import Any

import pytest

from openpendant.simplemsg.pendant import Activity, ProgramState
from openpendant.simplemsg.verdicts import VerdictCode as V
from openpendant.tools.pendants.client import Aborted, PendantClient, Refused, RunKind

pytestmark = [pytest.mark.realtime, pytest.mark.asyncio, pytest.mark.soak]


async def teach(pendant: PendantClient, *offsets: float) -> None:
    """Make the program `taught` of points at these offsets of joint 1 from home [rad]."""
    home = list(pendant.joints())
    answer = await pendant.manage({"op": "programs.create", "name": "taught"})
    for number, offset in enumerate(offsets):
        target = [home[0] + offset, *home[1:]]
        if offset:
            await (await pendant.move_joints(target, speed=0.5)).done()
        answer = await pendant.manage(
            {
                "op": "programs.record",
                "name": "taught",
                "expected_revision": answer["revision"],
                "point": f"p{number}",
                "move": {
                    "way": "PTP",
                    "point": f"p{number}",
                    "speed": {"kind": "fraction", "value": 0.2},
                },
            }
        )


async def test_three_points_are_taught_run_stepped_paused_resumed_and_stopped(
    start_cell: Any, tmp_path: Any
) -> None:
    store = str(tmp_path / "store.db")
    cell = await start_cell(server=("--store", store))
    pendant = await cell.ready_pendant()
    async with pendant.control():
        await teach(pendant, 0.0, 0.4, 0.8)
        found = await pendant.manage({"op": "programs.dry_run", "name": "taught"})
        assert found["refused"] == 0
        assert [each["point"] for each in found["points"]] == ["p0", "p1", "p2"]

        await (await pendant.run_program("taught")).done()
        await pendant.next_state()
        assert pendant.joints()[0] == pytest.approx(0.8, abs=1e-3)

        for _ in range(2):
            await (await pendant.run_program("taught", run=RunKind.STEP_FORWARD)).done()
        state = await pendant.next_state()
        assert state.program_state == ProgramState.STEPPED
        step_back = await pendant.run_program("taught", run=RunKind.STEP_BACKWARD)
        await step_back.done()
        await pendant.next_state()
        assert pendant.joints()[0] == pytest.approx(0.0, abs=1e-3)

        rest = await pendant.run_program("taught")
        await pendant.wait_until(lambda state: state.activity == Activity.MOVING)
        await pendant.pause()
        await pendant.wait_until(lambda state: not any(state.velocities))
        held = pendant.joints()
        with pytest.raises(Refused) as refused:
            await pendant.move_joints(held)
        assert refused.value.code == V.PROGRAM_RUNNING
        await pendant.resume()
        await pendant.wait_until(lambda state: state.activity == Activity.MOVING)
        await pendant.program_stop()
        with pytest.raises(Aborted) as aborted:
            await rest.done()
        assert aborted.value.code == V.PROGRAM_STOPPED
        await pendant.wait_until(lambda state: state.activity == Activity.IDLE)
        state = await pendant.next_state()
        assert state.program_state == ProgramState.NONE
    assert (await cell.end())["violations"] == 0

    again = await start_cell(server=("--store", store))
    reader = await again.ready_pendant()
    listed = await reader.manage({"op": "programs.list"})
    assert [each["name"] for each in listed["programs"]] == ["taught"]
    await again.end()
