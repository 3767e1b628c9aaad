from __future__ import annotations

import asyncio
import json
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

import pytest
from rigs.cells.journalled_cell import journalled_cell
from rigs.cells.scene_guard_rig import BOX, EMPTY, GuardedRig
from rigs.cells.server_rig import ServerRig, ready
from rigs.clock.virtual_clock import VirtualLoop
from rigs.peers.server_clients import Pendant

from openpendant.server.events.effects import Ask, Cancel, Effect
from openpendant.server.planning.jobs import PathFree
from openpendant.tools.packets.rerun import main
from openpendant.tools.pendants.client import Refused

GOAL = (0.5, 0.5)


def planning() -> tuple[ServerRig, Pendant]:
    rig = ready(plans_at_once=False)
    pendant = rig.holder()
    pendant.path((0.1, 0.1), GOAL)
    return rig, pendant


def withdrawn(out: list[Effect]) -> list[int]:
    return [each.id for each in out if isinstance(each, Cancel)]


def withdrawn_of(rig: ServerRig) -> list[int]:
    return withdrawn([item for _, item in rig.log])


@pytest.mark.parametrize("end", [Pendant.release, Pendant.stop], ids=["release", "software stop"])
def test_a_motion_that_ends_while_it_is_planned_withdraws_its_job(
    end: Callable[[Pendant], object],
) -> None:
    rig, pendant = planning()
    end(pendant)
    assert withdrawn_of(rig) == [rig.jobs[0].job_id]


def test_however_often_a_motion_is_asked_for_and_dropped_one_job_is_waited_for() -> None:
    rig, pendant = planning()
    for _ in range(20):
        pendant.release()
        pendant.take()
        pendant.path((0.1, 0.1), GOAL)
    asked = [job.job_id for job in rig.jobs]
    assert len(asked) == 21
    assert withdrawn_of(rig) == asked[:-1]


def test_a_motion_that_moves_or_was_refused_withdraws_nothing() -> None:
    rig, pendant = planning()
    rig.plan()
    rig.wait(50)
    pendant.stop()
    assert withdrawn_of(rig) == []


def test_a_look_is_withdrawn_when_the_scene_changes_again() -> None:
    moving = GuardedRig()
    first = moving.change()
    again = moving.change_scene(EMPTY)
    assert withdrawn(again) == [first.job_id]
    assert isinstance(again[-1], Ask)


def test_a_look_is_withdrawn_when_the_motion_has_ended() -> None:
    moving = GuardedRig()
    job = moving.change()
    moving.pendant.stop()
    assert withdrawn(moving.guard.tick(moving.rig.now)) == [job.job_id]
    assert moving.guard.tick(moving.rig.now) == []


def test_a_look_that_was_answered_is_not_withdrawn() -> None:
    moving = GuardedRig()
    moving.answer(moving.change(), PathFree())
    assert withdrawn(moving.change_scene(BOX)) == []


async def _ask_and_drop(folder: Path) -> None:
    async with journalled_cell(folder / "emulator", folder / "server") as cell:
        pendant = await cell.pendant()
        async with pendant, pendant.control():
            home = list(pendant.joints())
            path = [[home[0] + 0.3, *home[1:]], home]
            for _ in range(3):
                asking = asyncio.ensure_future(pendant.follow_joints(path, speed=0.5))
                await asyncio.sleep(0.01)
                await pendant.program_stop()
                with pytest.raises(Refused):
                    await asking
            await (await pendant.follow_joints(path, speed=0.5)).done()


def test_a_server_that_withdrew_jobs_runs_again_from_its_journal(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with closing(VirtualLoop()) as loop:
        loop.run_until_complete(_ask_and_drop(tmp_path))
    file = tmp_path / "server"
    events = [json.loads(line) for line in file.read_text().splitlines()]
    answers = [event for event in events if event.get("on") == "planned"]
    asked = [event for event in events if event.get("out") == "planner"]
    assert (len(asked), len(answers)) == (4, 1)
    assert main([str(file), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["identical"]
