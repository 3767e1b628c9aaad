"""A jog as a motion: from the press to rest, set-point by set-point.

Owns the joining of a press with the jog mathematics: what a jog message aims at, the ramp that
begins when the press ends, and the account of the stop. The mathematics are `motion.jog`'s, the
rules of a press are `press`', and when a set-point leaves is `point_stream`'s.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

from openpendant.motion.trajectory.trajectory import Row
from openpendant.simplemsg.pendant import JogEnd

from ...events.cell_events import StopAccount
from .press import Press

if TYPE_CHECKING:
    from openpendant.motion.jog import JogCaps, Jogger, JogSetpoint, JogTarget

JOG_PERIOD = 0.01
"""Time between two set-points of a jog [s]."""


class JogRows:
    """The set-points of a jog, made one by one.

    Attributes:
        last: the set-point that was taken last.
        press: the press that drives it now.
        step: the last step of the mathematics, with scale and reason; None before the first.
        start: (n,) where it began [rad or m].
        is_urgent: the press has ended since the last set-point, so that the next one slows down.
    """

    def __init__(
        self, jogger: Jogger, start: Sequence[float], target: JogTarget, press: Press
    ) -> None:
        """Begin at rest where the robot stands."""
        rest = [0.0] * len(start)
        self.last = Row(0.0, list(start), rest, rest)
        self.press = press
        self.step: JogSetpoint | None = None
        self.start = tuple(start)
        self.is_urgent = False
        self._jogger = jogger
        self._taken = 0
        self._released_at: Row | None = None
        jogger.aim(target)

    @property
    def next_time(self) -> float | None:
        """Time of the next set-point [s]; None once the press has ended and it stands."""
        if self._released_at is not None and self._taken and not any(self.last.velocity):
            return None
        return self._taken * JOG_PERIOD

    def take(self) -> Row:
        """Make and return the next set-point."""
        time = self._taken * JOG_PERIOD
        self._taken += 1
        self.is_urgent = False
        if time == 0.0:
            return self.last
        step = self._jogger.step(JOG_PERIOD)
        self.step = step
        self.last = Row(time, step.position, step.velocity, step.acceleration)
        return self.last

    def way_back(self) -> tuple[tuple[float, ...], ...]:
        """Return the waypoints from where it is now back to where it began, the start last."""
        here, *back = self._jogger.way.way_back()
        return tuple(back) or (here,)

    def aim(self, target: JogTarget, press: Press) -> None:
        """Let a new press take over, smoothly; the old one is dead."""
        self.press = press
        self.is_urgent = False
        self._released_at = None
        self._jogger.aim(target)

    def limit(self, caps: JogCaps) -> None:
        """Let other caps rule from the next set-point on."""
        self._jogger.limit(caps)

    def release(self, why: JogEnd, now: int) -> None:
        """End the press: from the next set-point on the robot ramps to rest."""
        self.press.end(why, now)
        if self._released_at is None:
            self._released_at = self.last
            self.is_urgent = True
            self._jogger.aim(None)

    def account(self) -> StopAccount:
        """Return how it came to rest; of a jog that stands, or was stopped by the controller."""
        began = self._released_at or self.last
        gaps = [abs(a - b) for a, b in zip(began.position, self.last.position, strict=True)]
        return StopAccount(
            self.press.number,
            self.press.ended or JogEnd.STOPPED,
            self.last.time - began.time,
            max(gaps, default=math.nan),
            tuple(began.position),
            tuple(self.last.position),
        )
