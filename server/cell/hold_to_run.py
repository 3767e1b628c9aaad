"""Hold-to-run: what ends a press, and what a lost enabling device ends (promises 37 and 38).

Owns the order in which both are judged: what has arrived is read first, and then, at each tick and
at each request that could move, presses come before enabling devices. A page that freezes or a
network that stalls silences both at once; so it ends as a silent press, by a ramp, and not by a
STOP. For the same reason an enabling device may be silent for a tick longer than a press that is
held beside it (`OperatingModes`).

Owns how long the ramp of an ended press may last (`ramp_time`). A lost enabling device does not
stop it, because both hands open at once; one that lasts longer is stopped whatever the device does.
Motions and programs have no press: there the device alone decides.

None of these stops latches. What becomes of a motion that ends is the cell's business.
"""

from __future__ import annotations

import math

from openpendant.motion.description.limits import JointLimits
from openpendant.simplemsg.pendant import Activity, EnablingPosition, JogEnd
from openpendant.simplemsg.verdicts import VerdictCode

from ..control import MotionAuthority, OperatingModes
from ..refusal import Refusal
from .execution.setpoint_sources import JogRows
from .execution.trajectory_execution import TrajectoryExecution

LONGEST_RAMP = 1.0
"""No ramp lasts longer than that, however slowly a robot brakes [s]."""

_BRAKING = 1.5
"""A tool jog that is released at full speed brakes along its path, which takes up to 1.3 times what
the slowest joint needs by itself."""

_SPARE_TICKS = 2

GRACE_TICKS = 2
"""So long after the ramp began the release of the key may follow that of its enabling device."""


def ramp_time(limits: JointLimits, tick_rate: float) -> float:
    """Return how long after the first set-point of its ramp a jog may still move [s].

    Args:
        tick_rate: of the server [Hz].
    """
    pairs = zip(limits.velocity, limits.acceleration, strict=True)
    slowest = max(velocity / acceleration for velocity, acceleration in pairs)
    # Rounding must not add a tick where the time is a whole number of them.
    ticks = math.ceil(_BRAKING * slowest * tick_rate - 1e-9) + _SPARE_TICKS
    return min(LONGEST_RAMP, ticks / tick_rate)


class HoldToRun:
    """The press and the enabling devices of one cell.

    Attributes:
        ramp_time: how long after the first set-point of its ramp a jog may still move [s].
    """

    def __init__(
        self,
        authority: MotionAuthority,
        modes: OperatingModes,
        driving: TrajectoryExecution,
        limits: JointLimits,
        tick_rate: int,
    ) -> None:
        """Judge what is planned or driven.

        Args:
            tick_rate: of the server [Hz].
        """
        self.ramp_time = ramp_time(limits, tick_rate)
        self._authority = authority
        self._modes = modes
        self._driving = driving
        self._ramp_ns = round(self.ramp_time * 1e9)
        self._grace_ns = round(GRACE_TICKS * 1e9 / tick_rate)

    def judge_press(self, now: int) -> None:
        """Let the robot ramp to rest where the press that drives it is silent."""
        jog = self._driving.driven_jog
        if jog is not None and jog.press.ended is None and jog.press.is_overdue(now):
            jog.release(JogEnd.SILENT, now)

    def enable(self, session: int, position: int, now: int) -> Refusal | None:
        """Take the position of a connection's enabling device.

        Returns:
            Why what is under way, a program that only waits included, has to end in this very turn.
        """
        self.judge_press(now)
        self._modes.enable(session, position, now)
        if position == EnablingPosition.HELD or not self._modes.needs_enabling():
            return None
        if not self._authority.is_held_by(session) or self._stands_paused:
            return None
        jog = self._driving.driven_jog
        if jog is not None:
            if position == EnablingPosition.RELEASED:
                if jog.press.ended is None:
                    jog.lose_enabling(now)
                return None
            jog.press.cut_short(now)
        return Refusal(VerdictCode.ENABLING_LOST)

    def tick(self, now: int) -> Refusal | None:
        """Judge the press, then the enabling devices; to be asked before set-points leave.

        Returns:
            Why what is planned or moves must end.
        """
        self.judge_press(now)
        jog = self._driving.driven_jog
        if jog is None or jog.press.ended is None:
            return self.lost_enabling(now)
        refusal = self._ramp_fault(jog, now)
        if refusal is not None:
            jog.press.cut_short(now)
        return refusal

    def _ramp_fault(self, jog: JogRows, now: int) -> Refusal | None:
        """Return why a jog whose press has ended is stopped; None while it ramps to rest."""
        if jog.ramp_began is None:
            jog.ramp_began = now
        lasted = now - jog.ramp_began
        if jog.press.awaits_release and lasted >= self._grace_ns:
            return Refusal(VerdictCode.ENABLING_LOST)
        if lasted < self._ramp_ns or jog.next_time is None:
            return None
        took, limit = lasted / 1e9, self.ramp_time
        text = f"the robot still moved {took:.2f} s after its ramp began, accepted {limit:.2f} s"
        return Refusal(VerdictCode.PRESS_DEAD, text, value=took, limit=limit)

    def lost_enabling(self, now: int) -> Refusal | None:
        """Return why what is planned or moves must end, where nobody enables it any more."""
        work, modes = self._driving.work, self._modes
        if work is None or modes.is_enabled(work.request.session, now):
            return None
        if not modes.needs_enabling() or self._stands_paused:
            return None
        return Refusal(VerdictCode.ENABLING_LOST)

    @property
    def _stands_paused(self) -> bool:
        """Whether a motion that somebody paused stands; `resume` asks for the device again.

        One that is only held goes on by itself: it ends, or it would set off by a hand that let go
        meanwhile.
        """
        work = self._driving.work
        if work is None or not work.is_paused:
            return False
        return self._driving.activity is Activity.PAUSED
