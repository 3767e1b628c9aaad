"""How a jog came to rest, as its pendant is told; plain data."""

from __future__ import annotations

from dataclasses import dataclass

from openpendant.simplemsg.pendant import JogEnd


@dataclass(frozen=True, slots=True)
class StopAccount:
    """How a jog came to rest.

    Attributes:
        press: number of the press.
        reason: why the press ended.
        time: from its end to rest, in set-points that left after it [s].
        joint_distance: farthest that a joint went in that time [rad or m].
        began_at: (n,) where the joints were when it ended, as sent.
        ended_at: (n,) where they stand.
    """

    press: int
    reason: JogEnd
    time: float
    joint_distance: float
    began_at: tuple[float, ...]
    ended_at: tuple[float, ...]
