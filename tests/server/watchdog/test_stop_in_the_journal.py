"""A stop that the watchdog told of is in the journal, so that a run repeats to the byte."""

import asyncio
from collections.abc import Sequence
from pathlib import Path
from typing import cast

from rigs.cells.journalled_cell import journalled_cell
from rigs.clock.virtual_clock import VirtualLoop

from openpendant.server.watchdog.watchdog_process import Watchdog
from openpendant.tools.packets.rerun import main as rerun


class TellsOnce:
    stopped = 1

    def beat(self, moving: Sequence[bool], emulated: Sequence[bool]) -> int:
        told, self.stopped = self.stopped, 0
        return told

    def update(self, moving: Sequence[bool], emulated: Sequence[bool]) -> None:
        """Nothing is watched here."""


def test_a_run_with_a_watchdogs_stop_runs_again_exactly(
    tmp_path: Path, virtual_loop: VirtualLoop
) -> None:
    file = tmp_path / "server.journal"

    async def live() -> None:
        async with journalled_cell(tmp_path / "emulator.journal", file) as cell:
            pendant = await cell.pendant()
            async with pendant.control():
                at = pendant.joints()
                await pendant.move_joints([at[0] + 0.5, *at[1:]], speed=0.1)
                await asyncio.sleep(0.5)
                cell.app._watchdog = cast(Watchdog, TellsOnce())
                await asyncio.sleep(0.1)
                assert cell.app.cells[0].core.cell.stop is not None
            await pendant.close()

    virtual_loop.run_until_complete(live())
    assert '"ask": "stopped"' in file.read_text()
    assert rerun([str(file)]) == 0
