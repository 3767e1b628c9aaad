"""Motions of one robot cell: requested, planned, started, steered and ended by their owner.

Owns which plan is waited for, at what share of its planned speed a motion runs, and pause, resume
and program stop. Whether a motion may start is `interlocks`' chain; how a motion is driven is
`trajectory_execution`'s.

A motion's life: `ask` or `move_joints` (the conditions hold, the authority is there) → planned
here, or by the planning process and back as its answer → certified, started → set-points
through the cell's `answered` and `tick` → `MotionEnded`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from openpendant.motion.description.limits import JointLimits
from openpendant.motion.errors import MotionError
from openpendant.motion.scene.scene import Scene
from openpendant.motion.trajectory.certificate import certify_straight_move
from openpendant.motion.trajectory.ptp import StraightMove, straight_move
from openpendant.simplemsg.pendant import JogEnd
from openpendant.simplemsg.verdicts import VerdictCode

from ..control import Holder, MotionAuthority, MotionKind, OperatingModes
from ..events.cell_events import MotionEnded, MotionRefused, MotionRequest, MotionStarted
from ..events.effects import Effect
from ..events.pending import Pending
from ..planning.jobs import CertifiedTrajectory, JointPathJob, MotionJob, PlanAnswer
from ..refusal import Refusal, refusal_of
from .execution.feedback import Feedback
from .execution.point_stream import start_mismatch
from .execution.setpoint_sources import JogRows, Press, StoredRows
from .execution.trajectory_execution import (
    ActiveMotion,
    Publish,
    TrajectoryExecution,
    UndoPlan,
    Waypoints,
)
from .interlocks import permission

if TYPE_CHECKING:
    from openpendant.motion.jog import JogTarget

Recheck = Callable[[int, MotionKind, int], Refusal | None]
"""Returns why a session may not begin, at a time [ns], what was planned for it; None if it may."""

FreeWay = Callable[[Sequence[float], Sequence[float]], bool]
"""Tells, in about a millisecond, whether a straight joint move between two positions, (n,) each,
surely touches nothing. A no says only that it must be looked at."""

_MOST_SAMPLES = 6000
"""Longest move that is planned on the event loop: a minute. To pause one takes all its samples."""

_HOLD = "it is held until it is known whether the way through the changed scene is free"


class CellMotions:
    """The planned and the running motion of a cell, commanded by the holder of the authority.

    Attributes:
        scene: what motions must not touch, the robot itself included; None to check nothing.
        is_surely_free: tells of a straight move that it touches nothing in that scene; where there
            is a scene and nobody to tell, nothing is sure.
    """

    def __init__(
        self,
        limits: JointLimits,
        authority: MotionAuthority,
        feedback: Feedback,
        modes: OperatingModes,
        driving: TrajectoryExecution,
        recheck: Recheck,
        publish: Publish,
        pending: Pending,
    ) -> None:
        """Make one where nothing is planned."""
        self.scene: Scene | None = None
        self.is_surely_free: FreeWay | None = None
        self._limits = limits
        self._authority = authority
        self._feedback = feedback
        self._modes = modes
        self._driving = driving
        self._recheck = recheck
        self._publish = publish
        self._pending = pending
        self._last_job = 0

    # What there is.

    @property
    def way_back(self) -> Waypoints | Refusal:
        """Waypoints back to where the jog began that moved last, or why there are none.

        After an undo that was ended on its way they are the rest of it.
        """
        last = self._driving.undoable
        if last is None or not (way := last.way_back):
            return Refusal(VerdictCode.NO_JOG_TO_UNDO)
        return self._driving.displaced or way

    @property
    def playing(self) -> StoredRows | None:
        """The certified trajectory that is played; None while planning, in a jog and at rest."""
        return None if self._driving.work is None else self._driving.work.stored

    @property
    def waypoints_passed(self) -> int:
        """How many waypoints after its start the robot has passed in the motion that is played."""
        return 0 if self._driving.work is None else self._driving.work.waypoints_passed

    @property
    def hold(self) -> str:
        """Why the motion that is played stands though nobody paused it, in words; else empty."""
        return _HOLD if self.playing is not None and self.playing.is_held else ""

    # To begin one.

    def new_job_id(self) -> int:
        """Return a number for a planning job."""
        self._last_job += 1
        return self._last_job

    def ask(
        self,
        request: MotionRequest,
        job: MotionJob,
        kind: MotionKind = MotionKind.MOVE,
        back: UndoPlan | None = None,
        begin_by: int | None = None,
    ) -> list[Effect]:
        """Have a motion planned that `check_interlocks` permits; its fate comes as a cell event.

        Args:
            back: how it is taken back once it has begun; None where it cannot be.
            begin_by: when it is too late to begin, not counting what planning takes [ns]; None
                where it never is.
        """
        if self.scene is not None:
            job = replace(job, scene=self.scene)
        cap = self._modes.tool_speed_cap(self._feedback.mode)
        self._driving.work = ActiveMotion(
            request, kind, job.job_id, planned_cap=cap, back=back, begin_by=begin_by
        )
        return self._pending.ask(job, self._planned)

    def move_joints(self, request: MotionRequest, job: JointPathJob, now: int) -> list[Effect]:
        """Make a straight joint move that is permitted, at once where that can be proved.

        It is timed and certified in closed form and begins on this call stack, where no cap of the
        tool speed rules and its way is free beyond doubt: a bound tells that from a few distances.
        Any other goes to the planning process, which looks along the way.

        Args:
            job: the move, from where the robot stands to a single goal.
        """
        if job.tool_speed is not None:
            return self.ask(request, job)
        (goal,) = job.waypoints
        try:
            move = straight_move(job.start, goal, self._limits, speed=job.speed)
            certificate = certify_straight_move(move, self._limits, start=job.start)
        except MotionError as error:
            return self._publish(MotionRefused(request, refusal_of(error)), now)
        if len(move) > _MOST_SAMPLES or not self._is_free(move):
            return self.ask(request, job)
        work = ActiveMotion(request, MotionKind.MOVE, job.job_id)
        certified = CertifiedTrajectory(move, certificate)
        return self._driving.play(work, certified, self._share(work), now)

    def execute(
        self,
        request: MotionRequest,
        certified: CertifiedTrajectory,
        plan_time: float,
        planned_cap: float | None,
        now: int,
    ) -> list[Effect]:
        """Start a plan that `check_interlocks` permits, sample by sample as it was shown.

        Whoever kept it has found that the robot stands where it begins, and that all is as it was
        planned for.

        Args:
            plan_time: how long it was planned [s].
            planned_cap: cap of the tool speed that it was planned with [m/s]; None for none.
        """
        work = ActiveMotion(
            request,
            MotionKind.MOVE,
            self.new_job_id(),
            planned_cap=planned_cap,
            plan_time=plan_time,
        )
        return self._driving.play(work, certified, self._share(work), now)

    def arrive(self, request: MotionRequest, now: int) -> list[Effect]:
        """Complete a request that is permitted and whose goal is where the robot stands."""
        ended = MotionEnded(request, None, 0.0, 0.0)
        return self._publish(MotionStarted(request), now) + self._publish(ended, now)

    def _is_free(self, move: StraightMove) -> bool:
        """Return whether it is proved that a move touches nothing, or nothing is to be checked."""
        if self.scene is None:
            return True
        return self.is_surely_free is not None and self.is_surely_free(move.start, move.goal)

    def jog(self, request: MotionRequest, rows: JogRows, lead: float, now: int) -> list[Effect]:
        """Start a jog that `check_interlocks` permits; its set-points are made as it goes."""
        back = UndoPlan(rows.way_back)
        work = ActiveMotion(request, MotionKind.JOG, self.new_job_id(), back=back)
        return self._driving.drive(work, rows, lead, now)

    def take_over_jog(
        self, request: MotionRequest, rows: JogRows, target: JogTarget, press: Press, now: int
    ) -> list[Effect]:
        """Let a new press steer the jog that is driven; the request of the old one is completed."""
        work = self._driving.work
        assert work is not None
        rows.press.end(JogEnd.REPLACED, now)  # unless it has ended already, and brakes
        before = MotionEnded(work.request, None, 0.0, rows.last.time, rows.account())
        work.request = request
        rows.aim(target, press)
        return self._publish(MotionStarted(request), now) + self._publish(before, now)

    def _planned(self, planned: PlanAnswer, now: int) -> list[Effect]:
        """Take the answer of the planning process; one that nobody waits for is dropped."""
        work = self._driving.work
        if work is None or work.execution is not None or work.job_id != planned.job_id:
            return []
        self._driving.work = None
        if isinstance(planned.result, Refusal):
            return self._publish(MotionRefused(work.request, planned.result), now)
        assert isinstance(planned.result, tuple)
        trajectory, certificate = planned.result
        refusal = (
            self._recheck(work.request.session, work.kind, now)
            or _too_late(work, max(planned.plan_time, planned.took), now)
            or start_mismatch(trajectory, self._feedback)
        )
        if refusal is not None:
            return self._publish(MotionRefused(work.request, refusal), now)
        work.plan_time, work.playback = planned.plan_time, planned.playback
        certified = CertifiedTrajectory(trajectory, certificate)
        return self._driving.play(work, certified, self._share(work), now)

    # To steer the one that is under way.

    def set_speed(self, by: Holder, override: float, cap: float, now: int) -> Refusal | None:
        """Set speed override and cap of the tool speed [m/s]; acts on the running motion.

        An override of 0 pauses it: raised again, it stands until somebody resumes it.
        """
        refusal = permission(self._authority, by.session, now)
        if refusal is None:
            refusal = self._modes.set_speed(override, cap, self._feedback.mode)
        work = self._driving.work
        if refusal is None and work is not None and work.stored is not None:
            if override:
                work.stored.scale(self._share(work))
            else:
                work.stored.pause()
        return refusal

    def _share(self, work: ActiveMotion) -> float:
        """Return at what part of its planned speed a motion runs under override and cap of now."""
        cap, planned = self._modes.tool_speed_cap(self._feedback.mode), work.planned_cap
        if cap is None or planned is None:
            return self._modes.override
        return self._modes.override * min(1.0, cap / planned)

    def pause(self, by: Holder, now: int) -> Refusal | None:
        """Bring the motion to rest on its path; None where it does."""
        refusal = permission(self._authority, by.session, now)
        stored = self.playing
        if refusal is None and (stored is None or not stored.pause()):
            return Refusal(VerdictCode.NOTHING_TO_CONTROL)
        return refusal

    def resume(self, by: Holder, now: int) -> Refusal | None:
        """End a pause, so that the motion goes on along its path, or does once `hold` is over."""
        work = self._driving.work
        refusal = permission(self._authority, by.session, now)
        if refusal is not None:
            return refusal
        if work is None or work.stored is None or not work.is_paused:
            text = f"nobody paused the motion: {self.hold}, and then goes on" if self.hold else ""
            return Refusal(VerdictCode.NOTHING_TO_CONTROL, text)
        refusal = self._modes.unready(work.kind, by.session, self._feedback.mode, now)
        if refusal is None:
            work.stored.resume()
        return refusal

    def program_stop(self, by: Holder, now: int) -> Refusal | list[Effect]:
        """End what is planned or moves, without a latch; anyone in control may."""
        refusal = permission(self._authority, by.session, now)
        if refusal is not None:
            return refusal
        if self._driving.work is None:
            return Refusal(VerdictCode.NOTHING_TO_CONTROL)
        return self._driving.end(Refusal(VerdictCode.PROGRAM_STOPPED), now)


def _too_late(work: ActiveMotion, planning: float, now: int) -> Refusal | None:
    """Return why a motion that was being planned for so long [s] may not begin any more."""
    if work.begin_by is None:
        return None
    late = (now - work.begin_by) / 1e9 - planning
    if late <= 0:
        return None
    text = f"it could begin {late:.3f} s too late, {planning:.3f} s of planning not counted"
    return Refusal(VerdictCode.TRAJECTORY_LATE, text, value=late)
