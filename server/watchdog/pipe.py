"""What the server tells its watchdog process through a pipe: its orders once, then a beat a tick.

Owns the form of both, and of what comes back. Must import the standard library only, so that the
process starts at once.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Literal

BEAT = struct.Struct("<QB")
"""One bit for each cell whose robot may move, and which kind of beat it is."""

IS_BEAT, IS_FAREWELL, IS_NEWS = 0, 1, 2
"""A tick begins; the server ends in good order; which robots may move, and no beat."""

ALIVE = b"."
"""What the process says through its own pipe, again and again."""

STOPPED = b"S"
"""What it says there when it has stopped robots."""


@dataclass(frozen=True, slots=True)
class StopTarget:
    """Where and how one cell's robot is stopped.

    Attributes:
        cell: name of the cell, for the log.
        host: address of its controller.
        port: its motion port.
        stop: the bytes of its STOP, hexadecimal.
        is_kept: keep a connection up; else one is made when it is needed, because the controller
            takes only one at a time.
        answer: how a frame goes on behind its length that answers STOP, hexadecimal.
        order: byte order of the length of a frame.
    """

    cell: str
    host: str
    port: int
    stop: str
    is_kept: bool
    answer: str
    order: Literal["little", "big"]


def orders(deadline: float, targets: Sequence[StopTarget]) -> bytes:
    """Return the one line that begins the pipe.

    Args:
        deadline: the robots are stopped when no beat came for so long [s].
        targets: one for each cell, in their order.
    """
    told = {"deadline": deadline, "targets": [asdict(target) for target in targets]}
    return json.dumps(told).encode() + b"\n"


def read_orders(line: bytes) -> tuple[float, list[StopTarget]]:
    """Return deadline [s] and targets of a line that `orders` made."""
    told = json.loads(line)
    return told["deadline"], [StopTarget(**target) for target in told["targets"]]
