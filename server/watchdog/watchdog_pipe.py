"""Watchdog pipe: the format of the orders, sent once, and of the beat that follows each tick.

Owns these formats and that of the process's reports. Must import the standard library only, so that
the process starts at once.
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
"""Kinds of a frame: start of a tick; end of the server in order; cells that may move, no beat."""

ANSWER = struct.Struct("<Q")
"""Report of the process through its own pipe: one bit for each cell whose robot it has just
stopped. It is repeated, mostly with no bit set, as the sign that the process is alive."""


class Deadlines(NamedTuple):
    """Longest times without a beat of the server before a robot is stopped [s].

    Attributes:
        real: for any controller.
        emulated: for a controller that reports to be emulated; at least `real`.
    """

    real: float
    emulated: float


@dataclass(frozen=True, slots=True)
class StopTarget:
    """Address and STOP bytes of one cell's controller.

    Attributes:
        stop: the bytes of its STOP, hexadecimal.
        is_kept: keep a connection up; else one is made when it is needed, because the controller
            takes only one at a time.
        answer: first bytes, behind its length, of a frame that answers STOP, hexadecimal.
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
    """Return the line that the server writes first.

    Args:
        targets: one for each cell, in their order.
    """
    told = {"deadlines": deadlines, "targets": [asdict(target) for target in targets]}
    return json.dumps(told).encode() + b"\n"


def read_orders(line: bytes) -> tuple[Deadlines, list[StopTarget]]:
    """Return the contents of a line that `orders` made."""
    told = json.loads(line)
    return Deadlines(*told["deadlines"]), [StopTarget(**target) for target in told["targets"]]
