"""What the server tells its watchdog process through a pipe: its orders once, then a beat a tick.

Owns the form of both, and of what comes back. Must import the standard library only, so that the
process starts at once.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Literal, NamedTuple

BEAT = struct.Struct("<QQB")
"""One bit for each cell whose robot may move, one for each whose controller says that it is
emulated, and which kind of beat it is."""

IS_BEAT, IS_FAREWELL, IS_NEWS = 0, 1, 2
"""A tick begins; the server ends in good order; which robots may move, and no beat."""

ANSWER = struct.Struct("<Q")
"""What the process says through its own pipe: one bit for each cell whose robot it has just
stopped. It says so again and again; none are stopped in most."""


class Deadlines(NamedTuple):
    """A robot is stopped when no beat of the server came for so long [s].

    Attributes:
        real: on any controller.
        emulated: on one that says that it is emulated; no less.
    """

    real: float
    emulated: float


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


def orders(deadlines: Deadlines, targets: Sequence[StopTarget]) -> bytes:
    """Return the one line that begins the pipe.

    Args:
        deadlines: how long a beat is waited for.
        targets: one for each cell, in their order.
    """
    told = {"deadlines": deadlines, "targets": [asdict(target) for target in targets]}
    return json.dumps(told).encode() + b"\n"


def read_orders(line: bytes) -> tuple[Deadlines, list[StopTarget]]:
    """Return what a line says that `orders` made."""
    told = json.loads(line)
    return Deadlines(*told["deadlines"]), [StopTarget(**target) for target in told["targets"]]
