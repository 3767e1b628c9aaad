"""How the watchdog process stops the robot of a cell: where, and with which bytes.

Apart from `process`, so that the process itself needs neither settings nor codec.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

from openpendant.simplemsg import (
    STANDARD,
    ByteOrder,
    CommType,
    Connection,
    JointTrajPt,
    MsgType,
    ReplyCode,
    Role,
    SpecialSequence,
    joint_array,
)

from ..settings import CellSettings
from .pipe import Deadlines, StopTarget
from .process import Watchdog


def stop_target(settings: CellSettings) -> StopTarget:
    """Return where and how the robot of a cell is stopped."""
    link = settings.controller
    wire = Connection(Role.CLIENT, STANDARD, link.order, real_size=link.real_size)
    stop = JointTrajPt(SpecialSequence.STOP, joint_array(()), velocity=0.0, duration=0.0)
    order: Literal["little", "big"] = "big" if link.order is ByteOrder.BIG else "little"
    answer = (MsgType.JOINT_TRAJ_PT, CommType.REPLY, ReplyCode.SUCCESS)
    return StopTarget(
        cell=settings.name,
        host=link.host,
        port=link.motion_port,
        stop=wire.send(stop).hex(),
        is_kept=link.stop_connection,
        answer=b"".join(code.to_bytes(4, order) for code in answer).hex(),
        order=order,
    )


def watchdog_of(cells: Sequence[CellSettings]) -> Watchdog:
    """Return the watchdog of a server, not started yet; its deadlines are those of all cells."""
    targets = [stop_target(cell) for cell in cells]
    rule = cells[0].watchdog
    deadlines = Deadlines(rule.real_deadline, rule.emulated_deadline)
    return Watchdog(targets, deadlines, 1.0 / cells[0].tick_rate)
