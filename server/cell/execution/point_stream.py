"""Point stream: one motion sent through an uplink, at most `lead` ahead of the robot.

Owns when the next set-point is due, when a motion has arrived and what aborts it. It never makes a
set-point: it sends those of its source, in order, each once, after a last look at each.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from enum import Enum

from openpendant.motion.description.limits import JointLimits
from openpendant.motion.trajectory.trajectory import Row, Trajectory
from openpendant.simplemsg import Message
from openpendant.simplemsg.verdicts import VerdictCode

from ...refusal import Refusal
from ...settings.cell_settings import ControllerLink
from ...uplinks.uplink import UNDER_RUNS, Uplink, error_text
from .feedback import Feedback, lost
from .motion_watch import MotionWatch
from .setpoint_guard import SetpointGuard
from .setpoint_sources import SetpointSource
from .tracking import LONGEST_LAG, JogPace, TrackingMonitor

ARRIVAL_TOLERANCE = 1e-3
"""A joint this close to the goal has arrived [rad or m]; the ROS-I client takes 0.005."""

START_TOLERANCE = 0.01
"""Largest distance between where a motion starts and where the robot stands [rad or m]."""

_SETTLING_NS = 2_000_000_000

_AWAY_NS = 30_000_000
"""A server that did not look at its motion for so long was away."""

_TOO_LATE_NS = 100_000_000
"""What runs out so soon after it came back may run out before enough has left: one at a time."""

_BLAMED_NS = 1_000_000_000
"""An end that comes later has another reason."""

_HALF_TICK_NS = 5_000_000
"""A second point leaves in a tick only where it is due by so much.

Where the robot is, is known no better than its reports are regular. Without this, points that are
due about when a tick comes would leave in pairs in every other tick, and what begins with the next
point, such as the ramp of a key that nobody holds any more, would begin a tick late.
"""


class StreamPhase(Enum):
    """The phases of a motion from its first set-point to standstill."""

    SENDING = "points are being sent"
    SETTLING = "all points are sent, the robot has not come to rest at the goal yet"
    ARRIVED = "the robot stands at the goal"


# Each tick of each robot asks for them, and members of an enumeration are slow to look up.
_SENDING, _SETTLING, _ARRIVED = StreamPhase


class PointStream:
    """One motion under way.

    Attributes:
        started: time of the first set-point [ns].
    """

    def __init__(
        self,
        rows: SetpointSource,
        limits: JointLimits,
        uplink: Uplink,
        link: ControllerLink,
        now: int,
        *,
        lead: float | None = None,
        pace: JogPace | None = None,
        known_error: int = 0,
        start: Sequence[float] | None = None,
        watch: MotionWatch | None = None,
    ) -> None:
        """Make a motion that starts now; `next_point` gives its first set-point at once.

        Args:
            rows: where the set-points come from; the first is at rest.
            lead: how far set-points leave ahead of the robot [s]; the link's where left out.
            pace: of a jog; None for a planned motion.
            known_error: error that the controller shows already; it ends no motion by itself.
            start: (n,) where a jog begins, which may be beyond a limit; None for all else.
            watch: is told each set-point that leaves; None where nobody compares.
        """
        self.rows = rows
        self.phase = _SENDING
        self.started = now
        self._uplink = uplink
        self._lead = round((link.planned_lead if lead is None else lead) * 1e9)
        self._guard = SetpointGuard(limits, start)
        self._tracking = TrackingMonitor(now, pace)
        self._watch = watch
        self._known_error = known_error
        self._sent = 0
        self._all_taken = 0  # when nothing was left to send or to be answered
        self._is_turn = True  # no point has left since the last tick
        self._before: Row | None = None  # the point before the last one
        self._looked = now
        self._left_dry: tuple[int, int] = (0, 0)  # when, and for how long nobody had looked [ns]

    @property
    def reached(self) -> float:
        """Time of the set-point where the robot is, as far as its reports tell [s]."""
        return self._tracking.reached

    def next_point(self, now: int) -> Message | Refusal | None:
        """Return the next set-point where one is due and the link has room for it."""
        if now != self._looked:
            self._look(now)
        rows, tracking = self.rows, self._tracking
        due = None if self._uplink.is_full else rows.next_time
        if due is None:
            return None
        if self.phase is _SETTLING:
            # A new press after all had left: the pause between must not be caught up with.
            self.phase = _SENDING
            tracking.go_on(due, now)
        lead = self._lead if self._is_turn else self._lead - _HALF_TICK_NS
        is_due = round(due * 1e9) <= tracking.time(now) + lead
        # Where the reports just moved the robot back, none is due in a tick: a ramp must not wait.
        if not is_due and not (self._is_turn and rows.is_urgent):
            return None
        self._is_turn = False
        last = rows.last
        row = rows.take()
        refusal = self._guard.check(row)
        if refusal is not None:
            return refusal
        point = self._uplink.point(self._sent, row, row.time - last.time, now)
        tracking.sent(row)
        if self._watch is not None:
            self._watch.commanded(tracking.earliest(row.time), row)
        self._before = last
        self._sent += 1
        return point

    def advance(self, feedback: Feedback, now: int) -> Refusal | None:
        """Look at the controller's reports once a tick.

        Returns:
            Why the motion must end, None while all is well; `phase` tells whether it arrived.
        """
        self._is_turn = True
        self._look(now)
        overdue = self._uplink.overdue(now)
        if overdue is not None:
            return overdue
        refusal = lost(feedback, now)
        if refusal is not None:
            return refusal
        error = self._new_error(feedback)
        if error:
            return self.blamed(Refusal(VerdictCode.CONTROLLER_STOPPED, error), feedback, now)
        if self.rows.next_time is None and not self._uplink.awaiting:
            return self._settle(feedback, now)
        self._tracking.update(feedback)
        lag = self._tracking.lag
        if lag > LONGEST_LAG:
            text = f"the robot is {lag:.2f} s behind the points that it was sent"
            return Refusal(VerdictCode.NOT_FOLLOWING, text, value=lag, limit=LONGEST_LAG)
        return None

    def _new_error(self, feedback: Feedback) -> str:
        """Return which error appeared since the motion began; empty for none."""
        error = feedback.error
        if error == self._known_error:
            return ""
        self._known_error = error
        return f"the controller went into {error_text(error)}" if error else ""

    def explained(self, refusal: Refusal, feedback: Feedback, now: int) -> Refusal:
        """Return why the controller refused a point, with what else is known of its reason."""
        if refusal.code is not VerdictCode.CONTROLLER_REFUSED:
            return refusal
        blamed = self.blamed(refusal, feedback, now)
        if blamed is not refusal:
            return blamed
        # By the server's clock: reports that are as late as the points make the robot seem behind.
        dry = (now - self._tracking.earliest(0.0)) / 1e9 - self._stock
        if feedback.error:
            known = f"; it shows {error_text(feedback.error)}"
        elif dry > 0.0:
            known = (
                f"; those before it had lasted until {dry * 1e3:.0f} ms earlier,"
                " perhaps a buffer under-run: points came late"
            )
        else:
            return refusal
        return replace(refusal, text=refusal.text + known)

    def _look(self, now: int) -> None:
        """Note whether the robot ran out of points while the server was away."""
        away = now - self._looked
        self._looked = now
        if away < _AWAY_NS:
            return
        last = self.rows.last
        end = self._tracking.base + round(last.time * 1e9)
        if any(last.velocity) and end <= now + _TOO_LATE_NS:
            self._left_dry = now, away

    def blamed(self, refusal: Refusal, feedback: Feedback, now: int) -> Refusal:
        """Return why the controller ended a motion: because of us, where we left it dry.

        Args:
            refusal: what it says by itself, or a point that it refused.
            feedback: what it shows.
        """
        self._look(now)
        when, away = self._left_dry
        if not away or now - when > _BLAMED_NS or feedback.fault:
            return refusal
        # After an under-run some controllers show nothing and take no point any more.
        is_refused = refusal.code is VerdictCode.CONTROLLER_REFUSED and not feedback.error
        if not is_refused and feedback.error not in UNDER_RUNS:
            return refusal
        text = (
            f"the server was away for {away / 1e6:.0f} ms, and the robot ran out of points"
            f" ({refusal.text})"
        )
        return Refusal(VerdictCode.SERVER_LATE, text, value=away / 1e9)

    @property
    def _stock(self) -> float:
        """Until when the points before the last one keep the robot moving as planned [s]."""
        before = self._before
        return math.inf if before is None or not any(before.velocity) else before.time

    def _settle(self, feedback: Feedback, now: int) -> Refusal | None:
        if self.phase is not _SETTLING:
            self.phase, self._all_taken = _SETTLING, now
        end = self._tracking.base + round(self.rows.last.time * 1e9)
        final = self.rows.last.position
        # A report from before the end of the motion says nothing about its end, and none from
        # before the last point was taken: a robot that waited for it stood as well.
        since = max(end, self._all_taken)
        if feedback.received < since or feedback.position is None:
            return None
        gaps = [abs(at - goal) for at, goal in zip(feedback.position, final, strict=True)]
        if max(gaps) <= ARRIVAL_TOLERANCE and feedback.stands_after(since, now):
            self.phase = _ARRIVED
            return None
        if now < end + _SETTLING_NS:
            return None
        worst = max(range(len(gaps)), key=gaps.__getitem__)
        return Refusal(
            VerdictCode.NOT_ARRIVED,
            f"{_SETTLING_NS / 1e9:g} s after the end of the motion joint {worst + 1} is"
            f" {gaps[worst]:.6f} from its goal",
            worst,
            feedback.position[worst],
            final[worst],
        )


def start_mismatch(trajectory: Trajectory, feedback: Feedback) -> Refusal | None:
    """Return why a planned motion starts elsewhere than the robot stands; None where it does."""
    if feedback.position is None or not feedback.is_standing:
        return Refusal(VerdictCode.NOT_STANDING, "the robot is not at rest")
    for joint, (planned, actual) in enumerate(
        zip(trajectory.position[0].tolist(), feedback.position, strict=True)
    ):
        if abs(planned - actual) > START_TOLERANCE:
            return Refusal(
                VerdictCode.NOT_STANDING,
                f"joint {joint + 1} stands at {actual:.6f}, the motion starts at {planned:.6f}",
                joint,
                actual,
                planned,
            )
    return None
