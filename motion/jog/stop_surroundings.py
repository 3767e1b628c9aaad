"""What is near the place where a stop of a joint jog would end, and what that leaves of its speed.

Owns which places are looked at. A body or a border is asked about where the robot could next stand
still, so what is in between was asked about before; where bodies are near there, also about where
the robot is, because only what comes nearer counts.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from ..errors import NoAssembly
from .collision_guard import SLOW
from .model import JogModel
from .nearness import SLOW_POSTURE
from .point_speeds import StopAhead
from .reasons import JogCause
from .targets import LONGEST_STEP


class StopSurroundings:
    """Watches where one jog could stop.

    Attributes:
        stay_clear: whether all bodies are beyond `SLOW` where the last two stops asked about end,
            at the last of which it was looked last.
    """

    def __init__(self, model: JogModel) -> None:
        self._model = model
        self._clear = False  # of bodies, where the last stop asked about ends
        self.stay_clear = False

    def left(
        self, dt: float, position: Sequence[float], asked: list[float], stop: StopAhead
    ) -> tuple[float, JogCause, list[float]] | None:
        """Return what the neighbourhood of the place where a stop would end leaves of a velocity.

        Args:
            dt: length of the tick [s].
            position: (n,) where it begins [rad or m].
            asked: (n,) velocity, which sets the direction.
            stop: after the tick towards it.

        Returns:
            The share, why, and the velocity that it is of; None if it leaves all.
        """
        found: list[tuple[float, JogCause, list[float]]] = []
        near = self._bodies(dt, position, asked, stop)
        if near is not None:
            found.append((*near, stop.velocity))
        if self._model.watches_posture:
            use = _posture_left(self._model, position, stop.there)
            if use is not None:
                found.append((*use, asked))
        if not found:
            return None
        return min(found, key=lambda each: each[0] * max(map(abs, each[2])))

    def _bodies(
        self, dt: float, position: Sequence[float], asked: list[float], stop: StopAhead
    ) -> tuple[float, JogCause] | None:
        guard = self._model.guard
        if guard is None:
            return None
        after = guard.look(stop.there)
        was_clear, self._clear = self._clear, after is None or min(after.values()) >= SLOW
        self.stay_clear = was_clear and self._clear
        # What can rest beyond `SLOW` after this tick and could after the last is not near here.
        if after is None or self.stay_clear:
            return None
        before = guard.look(position)
        way = position, asked
        time = 0.5 * max(LONGEST_STEP, stop.time) + dt
        near = guard.nearing(before, after, way, time)
        if guard.in_contact(before):
            self._clear = False
        if near is None and guard.in_contact(before):
            # What parts in the end might first come nearer, or part more and come back.
            meanwhile = guard.look(stop.here)
            near = guard.nearing(before, meanwhile, way, dt)
            near = near or guard.nearing(meanwhile, after, way, time)
        return near


def _posture_left(
    model: JogModel, here: Sequence[float], there: Sequence[float]
) -> tuple[float, JogCause] | None:
    before = model.arm.posture(here)
    try:
        after = model.arm.posture(there)
    except NoAssembly:
        return None if before is None else (0.0, before.cause)
    if after is None or after.use <= SLOW_POSTURE:
        return None
    if before is not None and after.use <= before.use:
        return None
    return math.sqrt(max(0.0, (1.0 - after.use) / (1.0 - SLOW_POSTURE))), after.cause
