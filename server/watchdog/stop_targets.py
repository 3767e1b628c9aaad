"""Stop targets of the watchdog process: address and STOP bytes for the robot of each cell.

Separate from `watchdog_process`, so that the process itself needs neither settings nor codec.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

from openpendant.simplemsg import STANDARD, ByteOrder, codec_for

from ..settings.cell_settings import CellSettings
from ..uplinks import dialect_of
from .watchdog_pipe import Deadlines, StopTarget
from .watchdog_process import Watchdog

_HEADER = slice(4, 16)
"""Type, communication type and reply code of a frame: they tell the answer to a STOP."""


def stop_target(settings: CellSettings) -> StopTarget:
    """Return the stop target of a cell."""
    link = settings.controller
    dialect, codec = dialect_of(link), codec_for(STANDARD, link.order, link.real_size)
    order: Literal["little", "big"] = "big" if link.order is ByteOrder.BIG else "little"
    return StopTarget(
        cell=settings.name,
        host=link.host,
        port=link.motion_port,
        stop=codec.encode(dialect.stop).hex(),
        is_kept=link.stop_connection,
        answer=codec.encode(dialect.stopped)[_HEADER].hex(),
        order=order,
    )


def watchdog_of(cells: Sequence[CellSettings]) -> Watchdog:
    """Return the watchdog of a server, not started yet; all cells have the same deadlines."""
    targets = [stop_target(cell) for cell in cells]
    rule = cells[0].watchdog
    deadlines = Deadlines(rule.real_deadline, rule.emulated_deadline)
    return Watchdog(targets, deadlines, 1.0 / cells[0].tick_rate)
