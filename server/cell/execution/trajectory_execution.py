"""Execution of the one motion of a cell: from the first set-point to arrival, abortion or stop.

Owns what is planned or moved (`ActiveMotion`), the conversation with the controller about it, and
the stop that is repeated until the robot is seen at rest. It asks nobody whether the robot may
move: that is the cell's business, which begins and ends motions here.

Owns what the undo of a jog goes along (`UndoPlan`). It belongs to one motion and is asked for only
while that motion is the last that began, so a request that was refused leaves it as it was, and
any other motion, after which the robot is no longer where the way ends, leaves none.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from openpendant.motion.description.limits import JointLimits
from openpendant.simplemsg import Message
from openpendant.simplemsg.pendant import Activity, JogEnd
from openpendant.simplemsg.verdicts import VerdictCode

from ...control import MotionKind
from ...events.cell_events import (
    CellEvent,
    MotionEnded,
    MotionRefused,
    MotionRequest,
    MotionStarted,
    UncommandedMotion,
    UncommandedMotionSeen,
)
from ...events.effects import (
    Effect,
    LogLine,
    ReconnectController,
    SendStop,
    SendToController,
    StorePlan,
)
from ...planning.jobs import CertifiedTrajectory, JointVector, PlaybackPlan
from ...planning.plan_store import StoredMotion
from ...refusal import Refusal
from ...settings.cell_settings import ControllerLink, ControllerPath
from ...uplinks import dialect_of
from .feedback import Feedback
from .motion_watch import ArmPoints, Cap, MotionWatch, ReportTiming, StandstillWatch
from .point_stream import START_TOLERANCE, PointStream, StreamPhase
from .setpoint_sources import JogRows, StoredRows
from .tracking import JogPace, TrackingTolerances, tracking_tolerances

Waypoints = tuple[JointVector, ...]
"""Joint positions (n,) to go to one after the other, controller side [rad or m]."""


@dataclass(frozen=True, slots=True)
class UndoPlan:
    """The undo of a motion, as it is asked for with the motion.

    Attributes:
        waypoints: returns those back to where the jog began, the start last.
        is_undo: the motion goes along them itself, so that only what it left out is still to go.
    """

    waypoints: Callable[[], Waypoints]
    is_undo: bool = False

    def left(self, passed: int, *, has_arrived: bool) -> Waypoints:
        """Return what is still to go; empty where nothing is."""
        way = self.waypoints()
        if not self.is_undo:
            return way
        if has_arrived:
            return ()
        # Set-points run ahead of the robot: all may have left before it was stopped on the way.
        return way[min(passed, len(way) - 1) :]


@dataclass(slots=True)
class ActiveMotion:
    """A motion between its request and its end.

    Attributes:
        planned_cap: cap of the tool speed that it was planned with [m/s]; None for none.
        plan_time: how long it was planned [s].
        playback: of a recording, what was asked and what is possible.
        duration: of the certified trajectory [s]; 0 of a jog.
        back: how it is taken back; None where it is no jog, no increment and no undo of one.
        begin_by: latest time at which it may begin, not counting `plan_time` [ns]; None for any.
        execution: sends its set-points; None while it is planned.
        stored: the certified trajectory that is played; None while planning and in a jog.
        jog: the jog that is driven; None for all else.
    """

    request: MotionRequest
    kind: MotionKind
    job_id: int
    planned_cap: float | None = None
    plan_time: float = 0.0
    playback: PlaybackPlan | None = None
    duration: float = 0.0
    back: UndoPlan | None = None
    begin_by: int | None = None
    has_arrived: bool = field(default=False, init=False)
    execution: PointStream | None = field(default=None, init=False)
    stored: StoredRows | None = field(default=None, init=False)
    jog: JogRows | None = field(default=None, init=False)

    def begin(self, execution: PointStream) -> None:
        """Take note that set-points are being sent."""
        rows = execution.rows
        self.execution = execution
        self.stored = rows if isinstance(rows, StoredRows) else None
        self.jog = rows if isinstance(rows, JogRows) else None

    @property
    def is_paused(self) -> bool:
        """Whether somebody paused it, and nobody has resumed it since."""
        return self.stored is not None and self.stored.pause_wanted

    @property
    def way_back(self) -> Waypoints:
        """The waypoints along which it is taken back; empty where that cannot be."""
        if self.back is None:
            return ()
        return self.back.left(self.waypoints_passed, has_arrived=self.has_arrived)

    @property
    def waypoints_passed(self) -> int:
        """How many waypoints after its start the robot has passed; 0 in a jog and while planned."""
        if self.stored is None or self.execution is None:
            return 0
        return self.stored.waypoints_passed(self.execution.reached)

    @property
    def waypoints_left(self) -> int:
        """How many waypoints the robot has yet to pass; 0 in a jog and while planned."""
        return 0 if self.stored is None else self.stored.waypoints - self.waypoints_passed


_STOPPING_NS = 5_000_000_000
_STOP_REPEAT_NS = 100_000_000
_MOST_AT_ONCE = 2  # points on one event, where several may: what is late is caught up in steps
_MOST_JOGGED_AHEAD = 0.1
"""A jog is not sent farther ahead of where the robot was seen last [s]; where reports are rarer,
not farther than a silence is long."""

_REPORTS_MISSED = 2.5
"""So many periods without a report are a silence."""

_LONGEST_SHIVER = 1.0
"""A pause whose set-points have stood so long is at rest whatever the reports say [s]."""

_IDLE, _JOGGING, _ARRIVED = Activity.IDLE, Activity.JOGGING, StreamPhase.ARRIVED  # slow to look up

Publish = Callable[[CellEvent, int], list[Effect]]
OnFault = Callable[[Refusal, int], list[Effect]]
CancelJob = Callable[[int], list[Effect]]


class TrajectoryExecution:
    """Executor of one cell: the motion it plans or moves, and its stop.

    Attributes:
        work: the motion between its request and its end; None for none.
        undoable: the last motion that began, where it can be taken back; else None.
        is_linked: the connections to the controller that a motion needs are there.
        points: tool and elbow, to see how fast they are; None where nobody knows them.
        uncommanded: how the robot moved last while nobody commanded it, since the last motion.
    """

    def __init__(
        self,
        link: ControllerLink,
        limits: JointLimits,
        feedback: Feedback,
        publish: Publish,
        on_fault: OnFault,
        cancel: CancelJob,
        cap: Cap = lambda: None,
        points: ArmPoints | None = None,
    ) -> None:
        """Make a drive that stands.

        Args:
            on_fault: told where a set-point failed its last look, or the robot is not where it was
                commanded to be; returns the protective stop.
        """
        self.undoable: ActiveMotion | None = None
        self._rested_at: tuple[float, ...] | None = None  # after the last motion that began
        self._awaits_rest = False  # it was ended, and has been in sight all the time since
        self.work: ActiveMotion | None = None
        self.is_linked = False
        self._up = dict.fromkeys(ControllerPath, False)
        self._limits = limits
        self._link = link
        self._uplink = dialect_of(link).uplink(link, limits.velocity)
        self._feedback = feedback
        self._publish = publish
        self._on_fault = on_fault
        self._cancel = cancel
        self._cap = cap
        self.points = points
        self.uncommanded: UncommandedMotion | None = None
        self._timing = ReportTiming(link.state_period)
        self._watch: MotionWatch | None = None  # from a motion's first set-point to its end
        self._standstill = StandstillWatch(limits)
        self._reports_seen = 0
        self._stopping_since: int | None = None
        self._stop_repeated = 0
        self._motions = 0

    @property
    def activity(self) -> Activity:
        """What the cell is doing."""
        if self._stopping_since is not None:
            return Activity.STOPPING
        work = self.work
        if work is None:
            return _IDLE
        if work.execution is None:
            return Activity.PLANNING
        if work.jog is not None:
            return _JOGGING
        if work.stored is None or not work.stored.is_paused:
            return Activity.MOVING
        return Activity.PAUSED if self._has_paused(work.stored) else Activity.PAUSING

    def _has_paused(self, rows: StoredRows) -> bool:
        """Return True if a pause has come to rest."""
        # What has left may still be ahead of the robot, so that its own report decides; but one
        # that shivers for ever, by its reports, goes nowhere when all it is sent stands still.
        rests = self._feedback.joints_rest or rows.rest_time >= _LONGEST_SHIVER
        return rows.is_at_rest and rests

    @property
    def request(self) -> MotionRequest | None:
        """The request that is being planned or moved."""
        return None if self.work is None else self.work.request

    @property
    def driven_jog(self) -> JogRows | None:
        """The jog that is driven, None where none is."""
        return None if self.work is None else self.work.jog

    def held_press(self, session: int) -> int:
        """Return the deadline of the press that a session holds [ns]; 0 where it holds none."""
        jog = self.driven_jog
        if jog is None or jog.press.session != session or jog.press.ended is not None:
            return 0
        return jog.press.deadline_ns

    @property
    def is_busy(self) -> bool:
        """Whether a motion of ours is under way or being stopped."""
        if self._stopping_since is not None:
            return True
        return self.work is not None and self.work.execution is not None

    @property
    def is_driving(self) -> bool:
        """Whether set-points of a motion are being sent."""
        if self._stopping_since is not None or self.work is None:
            return False
        return self.work.execution is not None

    @property
    def is_seen_moving(self) -> bool:
        """Whether the controller reports that the robot moves."""
        return self._feedback.position is not None and not self._feedback.is_standing

    @property
    def displaced(self) -> Refusal | None:
        """Why the last motion can no longer be taken back: something else moved the robot since."""
        here, left = self._feedback.position, self._rested_at
        if here is None or left is None:
            return Refusal(VerdictCode.NO_JOG_TO_UNDO, "nobody saw where the robot came to rest")
        for joint, (stands, rested) in enumerate(zip(here, left, strict=True)):
            if abs(stands - rested) > START_TOLERANCE:
                text = f"joint {joint + 1} was left at {rested:.6f} and stands at {stands:.6f}"
                return Refusal(VerdictCode.NO_JOG_TO_UNDO, text, joint, stands, rested)
        return None

    def play(
        self, work: ActiveMotion, certified: CertifiedTrajectory, override: float, now: int
    ) -> list[Effect]:
        """Start a certified trajectory, at a fraction of its speed."""
        rows = StoredRows(certified.trajectory, self._limits)
        rows.scale(override)
        work.duration = certified.trajectory.duration
        out = self._start(work, self._execution(work, rows, now), now)
        if work.execution is not None:
            self._motions += 1
            out.append(StorePlan(StoredMotion(self._motions, now, work.plan_time, certified)))
        return out

    def drive(self, work: ActiveMotion, rows: JogRows, lead: float, now: int) -> list[Effect]:
        """Start a jog; its set-points are made as it goes and leave `lead` [s] ahead."""
        return self._start(work, self._execution(work, rows, now, lead, start=rows.start), now)

    def _execution(
        self,
        work: ActiveMotion,
        rows: StoredRows | JogRows,
        now: int,
        lead: float | None = None,
        start: Sequence[float] | None = None,
    ) -> PointStream:
        limits, uplink, error = self._limits, self._uplink, self._feedback.error
        says_emulated = self._feedback.says_emulated
        tolerances = tracking_tolerances(self._link, limits, says_emulated=says_emulated)
        watch = self._watch = self._watch_for(work.kind, rows, tolerances)
        return PointStream(
            *(rows, limits, uplink, self._link, now),
            lead=lead,
            pace=None if lead is None else self._jog_pace(lead, tolerances),
            known_error=error,
            start=start,
            watch=watch,
        )

    def _jog_pace(self, lead: float, tolerances: TrackingTolerances) -> JogPace:
        room = max(_MOST_JOGGED_AHEAD - lead, 0.0)
        unseen = max(room, _REPORTS_MISSED * self._link.state_period)
        return JogPace(min(tolerances.lag, room), unseen)

    def _watch_for(
        self, kind: MotionKind, rows: StoredRows | JogRows, tolerances: TrackingTolerances
    ) -> MotionWatch:
        start = self._feedback.position or tuple(rows.last.position)
        # A ROS-Industrial trajectory moves in automatic, where no mode caps the tool, also on a
        # controller that does not say its mode, which counts as manual for everybody else.
        cap = (lambda: None) if kind is MotionKind.ROS else self._cap
        return MotionWatch(self._limits, tolerances, self._timing, start, self.points, cap)

    def _start(self, work: ActiveMotion, execution: PointStream, now: int) -> list[Effect]:
        first = execution.next_point(now)
        if isinstance(first, Refusal):
            self._watch = None
            return self._publish(MotionRefused(work.request, first), now)
        self.uncommanded = None
        self._standstill.begin_anew()
        self._timing.begin()
        work.begin(execution)
        self.work = work
        self.undoable = None if work.back is None else work
        self._rested_at, self._awaits_rest = None, False
        out: list[Effect] = [] if first is None else [SendToController(first)]
        return out + self._publish(MotionStarted(work.request, work.playback), now)

    def reported(self, now: int) -> list[Effect]:
        """Compare the newest joint report, where one has come, with what was commanded.

        To be asked in the turn that reads it: what is wrong stops the robot before anything else is
        done. Of a robot at rest it is only told that it moves.
        """
        feedback = self._feedback
        position = feedback.position
        if position is None or feedback.reports == self._reports_seen:
            return []
        self._reports_seen = feedback.reports
        report = self._timing.take(position, now)
        if self._watch is not None:
            refusal = self._watch.judge(report)
            if refusal is None:
                return []
            # What it goes on doing while it is stopped says nothing that is not said yet.
            self._watch = None
            return self._on_fault(refusal, now)
        if self.is_busy:
            return []
        moved = self._standstill.take(position, now)
        if moved is None:
            return []
        self.uncommanded = moved
        return [LogLine(moved.sentence), *self._publish(UncommandedMotionSeen(moved), now)]

    def answered(self, reply: Message, pending: int, now: int) -> list[Effect]:
        """Take an answer of the controller on the motion link.

        Args:
            pending: answers that the link still owes.
        """
        work = self.work
        refusal = self._uplink.answer(reply, pending)
        if work is None or work.execution is None:
            return []
        if refusal is not None:
            return self._abort(work.execution.explained(refusal, self._feedback, now), now)
        return self._send_next(work.execution, now)

    def blamed(self, refusal: Refusal, now: int) -> Refusal:
        """Return why the controller went into an error, where that is because of us."""
        work = self.work
        if work is None or work.execution is None:
            return refusal
        return work.execution.blamed(refusal, self._feedback, now)

    def _send_next(self, execution: PointStream, now: int) -> list[Effect]:
        out: list[Effect] = []
        while (point := execution.next_point(now)) is not None:
            if isinstance(point, Refusal):
                return out + self._abort(point, now)
            out.append(SendToController(point))
            if self._uplink.is_full or len(out) == _MOST_AT_ONCE:
                break
        return out

    def on_bad_reply(self, problem: str, now: int) -> list[Effect]:
        """Take an answer that nobody asked for, or that cannot be read, on the motion link.

        From then on nobody knows which answer belongs to which point, so a motion ends.
        """
        if not self.is_driving:
            return []
        return self._abort(Refusal(VerdictCode.CONTROLLER_MISMATCH, problem), now)

    def _abort(self, refusal: Refusal, now: int) -> list[Effect]:
        """End a motion; begin a new conversation where the old one cannot be trusted."""
        if refusal.code is VerdictCode.CERTIFICATE_REFUSED:
            return self._on_fault(refusal, now)
        out = self.end(refusal, now)
        if refusal.code in (VerdictCode.CONTROLLER_MISMATCH, VerdictCode.CONTROLLER_SILENT):
            out.append(ReconnectController(refusal.sentence))
        return out

    def path_changed(self, path: ControllerPath, up: bool) -> None:
        """Take note that a connection came or went; what was said on a lost one is forgotten."""
        self._up[path] = up
        self.is_linked = self._up[ControllerPath.MOTION] and self._up[ControllerPath.STATE]
        if not up and path is ControllerPath.MOTION:
            self._uplink.lost()
        elif not up and path is ControllerPath.STATE:
            self._feedback.forget()
            self._timing.clear()
            self._standstill.begin_anew()
            self._awaits_rest = False

    def end(self, refusal: Refusal, now: int) -> list[Effect]:
        """End whatever is planned or moving, and have the robot stopped.

        Returns:
            The stop first, then the cell event for whoever asked for the motion.
        """
        work = self.work
        if work is None:
            return []
        stop = [] if work.execution is None else [self.stop(now)]
        return stop + self._ended_before_goal(work, refusal, now)

    def _ended_before_goal(self, work: ActiveMotion, refusal: Refusal, now: int) -> list[Effect]:
        """End a motion whose stop, where it moves, was made already."""
        self.work = None
        if work.execution is None:
            return self._cancel(work.job_id) + self._publish(
                MotionRefused(work.request, refusal), now
            )
        self._begin_stopping(now)
        self._awaits_rest = self._feedback.position is not None
        return self._publish(self._ended(work, refusal, now), now)

    def _begin_stopping(self, now: int) -> None:
        self._stopping_since = now
        self._stop_repeated = now
        if self._watch is not None:
            self._watch.stopping()

    def stop(self, now: int) -> SendStop:
        """Return the stop, whether or not we know of a motion; `stopped` has to follow."""
        return SendStop(self._uplink.stop(now, is_sent=self._up[ControllerPath.MOTION]))

    @staticmethod
    def _ended(work: ActiveMotion, refusal: Refusal | None, now: int) -> MotionEnded:
        jog = work.jog
        if jog is None:
            left = work.waypoints_left
            return MotionEnded(
                work.request, refusal, work.plan_time, work.duration, waypoints_left=left
            )
        jog.press.end(JogEnd.STOPPED, now)
        return MotionEnded(work.request, refusal, 0.0, jog.last.time, jog.account())

    def stopped(self, refusal: Refusal, now: int) -> list[Effect]:
        """End what is under way, after a `stop`."""
        work, moves = self.work, self.is_driving
        out = [] if work is None else self._ended_before_goal(work, refusal, now)
        if not moves and self.is_seen_moving:
            self._begin_stopping(now)
        return out

    def halt(self, refusal: Refusal, now: int) -> list[Effect]:
        """Send a stop whether or not we know of a motion, and end what is under way."""
        return [self.stop(now), *self.stopped(refusal, now)]

    def advance(self, now: int) -> list[Effect]:
        """Look at the motion once a tick: due set-points, arrival, what aborts it."""
        work = self.work
        if work is None or (execution := work.execution) is None:
            return []
        refusal = execution.advance(self._feedback, now)
        if refusal is not None:
            return self._abort(refusal, now)
        if execution.phase is _ARRIVED:
            self.work, work.has_arrived = None, True
            self._stand()
            self._rested_at = self._feedback.position
            return self._publish(self._ended(work, None, now), now)
        return self._send_next(execution, now)

    def _stand(self) -> None:
        """From now on nothing is commanded; where the robot is then is where it stands."""
        self._watch = None
        self._standstill.begin_anew()

    def settle(self, now: int) -> list[Effect]:
        """Leave STOPPING once the robot is seen at rest; repeat the stop until then."""
        since = self._stopping_since
        if since is None and self._uplink.stop_deadline is None:
            return []
        out: list[Effect] = []
        if self._uplink.stop_overdue(now):
            out.append(ReconnectController("a STOP was not answered"))
        if since is None:
            return out
        feedback = self._feedback
        if feedback.is_lost(now):
            self._awaits_rest = False
        if feedback.position is not None and feedback.has_come_to_rest(since):
            self._stopping_since = None
            self._stand()
            if self._awaits_rest:
                # Any other stop may have ended a motion that was none of ours.
                self._rested_at, self._awaits_rest = feedback.position, False
        elif now - since > _STOPPING_NS and feedback.position is None:
            # Without reports nobody can say that it stands; `obstacle` keeps refusing motion.
            self._stopping_since = None
            self._stand()
        elif now - self._stop_repeated >= _STOP_REPEAT_NS:
            self._stop_repeated = now
            out.append(self.stop(now))
        return out
