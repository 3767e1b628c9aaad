"""The core of one robot cell: authority, stop, planning and motion, behind one set of rules.

Owns every decision about motion. Both faces ask it; it never looks at their messages. It owns no
socket and no clock: each call takes `now` and returns what is to be done.

A motion's life: `ask` (the conditions hold, the authority is there) → planned here, or by the
planning process and back through `planned` → certified, started → set-points through `answered`
and `tick` → `Ended`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from openpendant.motion.errors import MotionError
from openpendant.motion.limits import JointLimits
from openpendant.motion.ptp import straight_move
from openpendant.motion.scene import Scene
from openpendant.motion.straight_certificate import certify_straight_move
from openpendant.simplemsg import ControllerMode, Message, TriState
from openpendant.simplemsg.pendant import (
    Activity,
    AuthorityReason,
    JogEnd,
    LinkState,
    OperatingMode,
)
from openpendant.simplemsg.verdicts import VerdictCode

from .authority import Authority, Change, Holder
from .controller_path import ControllerPath
from .driving.certified import Certified
from .driving.driving import Driving, Listener, Work
from .driving.execution import start_mismatch
from .driving.feedback import Feedback
from .driving.row_sources import StoredRows
from .driving.stop_account import StopAccount
from .jog.jogging import JogRows
from .jog.press import Press
from .joint_slots import JointSlots
from .news import (
    AuthorityMoved,
    Begun,
    Ended,
    LatchedStop,
    ModeMoved,
    Refused,
    Request,
    StopMoved,
)
from .operating_mode import MotionKind, OperatingModes
from .outgoing import Outgoing, Plan
from .planning.jobs import MotionJob, Planned
from .playback.running_program import RunningProgram
from .readiness import examine, examine_cell, held_by, permission
from .refusal import Refusal, refusal_of
from .settings import CellSettings

if TYPE_CHECKING:
    from openpendant.motion.jog import JogTarget

_AT_LIMIT = 1e-3

SERVER = Holder(0, "the server")
"""Who did it, where the server did it by itself."""

CONTROLLER = Holder(0, "the controller")
"""Who turned the mode selector, where it is the controller's own."""


class RobotCell:
    """One robot: who may move it, whether it may move now, and what it is doing.

    Attributes:
        authority: the lease.
        feedback: what the controller said last.
        modes: the mode of operation, enabling (training) and speeds.
        stop: the latched stop, None where there is none.
        program: the program under way, None where there is none; the program desk says it.
        scene: what motions must not touch, the robot itself included; None to check nothing.
        limits: the robot's joint limits, controller side.
        slots: reads the joint positions of messages.
    """

    def __init__(self, settings: CellSettings, limits: JointLimits, listener: Listener) -> None:
        """Make a cell without a controller connection.

        Args:
            settings: the cell's configuration.
            limits: joint limits, controller side.
            listener: told all news; returns what is to be written because of them.
        """
        self.limits = limits
        self.slots = JointSlots(limits)
        self.authority = Authority(round(settings.pendants.authority_timeout * 1e9))
        self.feedback = Feedback(limits.dof, settings.controller)
        self.modes = OperatingModes(settings.modes)
        self.stop: LatchedStop | None = None
        self.program: RunningProgram | None = None
        self.scene: Scene | None = None
        self.is_closing = False
        self._tell = listener
        self._driving = Driving(
            settings.controller, limits, self.feedback, listener, self.protective_stop
        )
        self._last_job = 0

    @property
    def activity(self) -> Activity:
        """What the cell is doing."""
        return self._driving.activity

    @property
    def request(self) -> Request | None:
        """The request that is being planned or moved."""
        return self._driving.request

    @property
    def driven_jog(self) -> JogRows | None:
        """The jog that is driven, None where none is."""
        return self._driving.driven_jog

    @property
    def waypoints_passed(self) -> int:
        """How many waypoints after its start the motion that is played has passed."""
        stored = self._stored
        return 0 if stored is None else stored.waypoints_passed

    def link_state(self, now: int) -> LinkState:
        """Return the state of the controller connection."""
        if not (self._driving.up[ControllerPath.MOTION] and self._driving.up[ControllerPath.STATE]):
            return LinkState.DOWN
        return LinkState.UP if self.feedback.is_fresh(now) else LinkState.STALE

    def obstacle(self, now: int) -> Refusal | None:
        """Return the first condition that keeps any motion from starting, whoever asks."""
        return next((found.refusal for found in examine_cell(self, now) if found.refusal), None)

    def check(
        self,
        session: int,
        now: int,
        kind: MotionKind = MotionKind.MOVE,
        *,
        planned: bool = False,
        steered: bool = False,
    ) -> Refusal | None:
        """Return why a connection may not start a motion now; None where it may."""
        chain = examine(self, kind, session, now, planned=planned, steered=steered)
        return next((found.refusal for found in chain if found.refusal), None)

    def outside(self) -> Refusal | None:
        """Return which joint is reported outside its limits; None where none is."""
        position = self.feedback.position
        if position is None:
            return None
        # Reports are rounded to four bytes, and a joint at rest on its limit may overshoot a hair.
        for joint, value in enumerate(position):
            lower, upper = self.limits.lower[joint], self.limits.upper[joint]
            if not lower - _AT_LIMIT <= value <= upper + _AT_LIMIT:
                bound = lower if value < lower else upper
                return Refusal(
                    VerdictCode.OUTSIDE_LIMITS,
                    f"joint {joint + 1} stands at {value:.6f}, outside its limit {bound:g}",
                    joint,
                    value,
                    bound,
                )
        return None

    @property
    def standing_at(self) -> tuple[float, ...]:
        """Where the robot stands, (n,) controller side; only meaningful when `check` said None."""
        assert self.feedback.position is not None
        return self.feedback.position

    def new_job_id(self) -> int:
        """Return a number for a planning job."""
        self._last_job += 1
        return self._last_job

    def ask(
        self, request: Request, job: MotionJob, kind: MotionKind = MotionKind.MOVE
    ) -> list[Outgoing]:
        """Have a motion planned that `check` permitted; its fate comes as news."""
        if self.scene is not None:
            job = replace(job, scene=self.scene)
        cap = self.modes.tool_speed_cap(self.mode)
        self._driving.work = Work(request, kind, job.job_id, planned_cap=cap)
        return [Plan(job)]

    def move_joints(
        self,
        request: Request,
        goal: Sequence[float],
        speed: float,
        now: int,
        kind: MotionKind = MotionKind.MOVE,
    ) -> list[Outgoing]:
        """Plan, certify and start a joint move that `check` permitted, on this call stack.

        Only where no cap of the tool speed rules (`tool_speed_cap`) and nothing can be touched
        (`scene`); else it is to be planned.

        A straight joint move is timed in closed form, so it needs no planning process.
        """
        start = self.standing_at
        try:
            move = straight_move(start, goal, self.limits, speed=speed)
            certificate = certify_straight_move(move, self.limits, start=start)
        except MotionError as error:
            return self._tell(Refused(request, refusal_of(error)), now)
        work = Work(request, kind, self.new_job_id())
        certified = Certified(move, certificate)
        return self._driving.play(work, certified, self._share(work), now)

    def jog(self, request: Request, rows: JogRows, lead: float, now: int) -> list[Outgoing]:
        """Start a jog that `check` permitted; its set-points are made as it goes."""
        work = Work(request, MotionKind.JOG, self.new_job_id())
        return self._driving.drive(work, rows, lead, now)

    def take_over_jog(
        self, request: Request, rows: JogRows, target: JogTarget, press: Press, now: int
    ) -> list[Outgoing]:
        """Let a new press steer the jog that is driven; the request of the old one is completed."""
        work = self._driving.work
        assert work is not None
        rows.press.end(JogEnd.REPLACED, now)
        account = StopAccount(
            rows.press.number,
            JogEnd.REPLACED,
            0.0,
            0.0,
            tuple(rows.last.position),
            tuple(rows.last.position),
        )
        before = Ended(work.request, None, 0.0, rows.last.time, account)
        work.request = request
        rows.aim(target, press)
        return self._tell(Begun(request), now) + self._tell(before, now)

    def planned(self, planned: Planned, now: int) -> list[Outgoing]:
        """Take the answer of the planning process; one that nobody waits for is dropped."""
        work = self._driving.work
        if work is None or work.execution is not None or work.job_id != planned.job_id:
            return []
        self._driving.work = None
        if isinstance(planned.result, Refusal):
            return self._tell(Refused(work.request, planned.result), now)
        assert isinstance(planned.result, tuple)
        trajectory, certificate = planned.result
        refusal = self.check(work.request.session, now, work.kind, planned=True) or start_mismatch(
            trajectory, self.feedback
        )
        if refusal is not None:
            return self._tell(Refused(work.request, refusal), now)
        work.plan_time = planned.plan_time
        certified = Certified(trajectory, certificate)
        return self._driving.play(work, certified, self._share(work), now)

    def answered(self, reply: Message, pending: int, now: int) -> list[Outgoing]:
        """Take an answer of the controller on the motion link; see `Driving.answered`."""
        return self._driving.answered(reply, pending, now)

    def misanswered(self, problem: str, now: int) -> list[Outgoing]:
        """Take an answer of the controller that cannot belong to anything."""
        return self._driving.misanswered(problem, now)

    def reported(self, message: Message, now: int) -> list[Outgoing]:
        """Take a report of the controller on the state link; a change of its mode stops."""
        before = self.feedback.mode
        self.feedback.take(message, now)
        after = self.feedback.mode
        if after is before:
            return []
        text = f"the controller's mode changed from {before.name} to {after.name}".lower()
        out = self.end(Refusal(VerdictCode.CONTROLLER_STOPPED, text), now)
        mode = self.modes.mode(after)
        if mode is not self.modes.mode(before):
            out += self._tell(ModeMoved(mode, CONTROLLER), now)
        return out

    def path_changed(self, path: ControllerPath, up: bool, now: int) -> list[Outgoing]:
        """Take note that a connection to the controller came or went."""
        self._driving.up[path] = up
        if up or path is ControllerPath.STOP:
            return []
        self._driving.link_lost(path)
        return self.end(
            Refusal(
                VerdictCode.CONTROLLER_LOST, f"the controller's {path.name.lower()} link was lost"
            ),
            now,
        )

    def end(self, refusal: Refusal, now: int) -> list[Outgoing]:
        """End whatever is planned or moving, and have the robot stopped."""
        return self._driving.end(refusal, now)

    def halt(self, refusal: Refusal, now: int) -> list[Outgoing]:
        """Send a stop whether or not we know of a motion, and end what is under way."""
        return self._driving.halt(refusal, now)

    def software_stop(self, by: Holder, reason: str, now: int) -> list[Outgoing]:
        """Stop the robot and latch; anyone may, at any time. The stop leaves first."""
        out = self.halt(Refusal(VerdictCode.STOPPED, f"software stop by {by.name}: {reason}"), now)
        return out + self._latch(LatchedStop(by, reason, now), now)

    def protective_stop(self, refusal: Refusal, now: int) -> list[Outgoing]:
        """Stop the robot and latch, because the server found something wrong by itself."""
        out = self.halt(refusal, now)
        return out + self._latch(LatchedStop(SERVER, refusal.sentence, now, True), now)

    def _latch(self, stop: LatchedStop, now: int) -> list[Outgoing]:
        self.modes.disarm()
        # A software stop takes the place of a protective one: a person's word weighs more.
        if self.stop is not None and (stop.is_protective or not self.stop.is_protective):
            return []
        self.stop = stop
        return self._tell(StopMoved(stop, stop.by), now)

    def reset_stop(self, by: Holder, now: int) -> Refusal | list[Outgoing]:
        """Unlatch the stop; moves nothing, and whoever enabled must press anew.

        Returns:
            Why it may not be reset, or the news.
        """
        refusal = permission(self.authority, by.session, now)
        if refusal is not None:
            return refusal
        if self.is_busy or self._driving.is_seen_moving:
            return Refusal(VerdictCode.MOVING, "the robot has not come to rest yet")
        if self.stop is None:
            return []
        self.stop = None
        self.modes.disarm()
        return self._tell(StopMoved(None, by), now)

    def set_mode(self, by: Holder, mode: int, now: int) -> Refusal | list[Outgoing]:
        """Set the mode of operation; what moves is stopped first.

        Returns:
            Why it may not be set, or what follows.
        """
        refusal = permission(self.authority, by.session, now)
        if refusal is not None:
            return refusal
        before = self.modes.mode(self.mode)
        after = self.modes.set_mode(mode)
        if isinstance(after, Refusal):
            return after
        if after is before:
            return []
        text = f"{by.name} changed the mode to {after.name.lower().replace('_', ' ')}"
        out = self.end(Refusal(VerdictCode.MODE_CHANGED, text), now)
        return out + self._tell(ModeMoved(after, by), now)

    def set_speed(self, by: Holder, override: float, cap: float, now: int) -> Refusal | None:
        """Set speed override and cap of the tool speed [m/s]; acts on the running motion.

        Returns:
            Why a value is refused.
        """
        refusal = permission(self.authority, by.session, now) or self.modes.set_speed(override, cap)
        work = self._driving.work
        if refusal is None and work is not None and work.stored is not None:
            work.stored.scale(self._share(work))
        return refusal

    def _share(self, work: Work) -> float:
        """Return at what part of its planned speed a motion runs under override and cap of now."""
        cap, planned = self.modes.tool_speed_cap(self.mode), work.planned_cap
        if cap is None or planned is None:
            return self.modes.override
        return self.modes.override * min(1.0, cap / planned)

    @property
    def has_plan_under_way(self) -> bool:
        """Whether a motion is being planned."""
        return self.activity is Activity.PLANNING

    def under_way(self) -> str:
        """Return what is planned or moves, in words; empty where nothing is."""
        if self.program is not None:
            return f"program {self.program.name!r} is under way"
        if self.activity is not Activity.IDLE:
            return f"the robot is {self.activity.name.lower()}"
        return "the robot moves" if self.is_moving else ""

    @property
    def playing(self) -> StoredRows | None:
        """The certified trajectory that is played; None while planning, in a jog and at rest."""
        return self._stored

    @property
    def _stored(self) -> StoredRows | None:
        return None if self._driving.work is None else self._driving.work.stored

    def pause(self, by: Holder, now: int) -> Refusal | None:
        """Bring the motion to rest on its path; None where it does."""
        refusal = permission(self.authority, by.session, now)
        stored = self._stored
        if refusal is None and (stored is None or not stored.pause()):
            return Refusal(VerdictCode.NOTHING_TO_CONTROL)
        return refusal

    def program_stop(self, by: Holder, now: int) -> Refusal | list[Outgoing]:
        """End what is planned or moves, without a latch; anyone in control may."""
        refusal = permission(self.authority, by.session, now)
        if refusal is not None:
            return refusal
        if self._driving.work is None:
            return Refusal(VerdictCode.NOTHING_TO_CONTROL)
        return self.end(Refusal(VerdictCode.PROGRAM_STOPPED), now)

    def resume(self, by: Holder, now: int) -> Refusal | None:
        """Let a paused motion go on along its path; None where it does."""
        work = self._driving.work
        refusal = permission(self.authority, by.session, now)
        if refusal is not None:
            return refusal
        if work is None or work.stored is None or not work.stored.is_paused:
            return Refusal(VerdictCode.NOTHING_TO_CONTROL)
        if not self.modes.override:
            return Refusal(VerdictCode.BAD_ARGUMENT, "the speed override is 0; raise it first")
        refusal = self.modes.unready(work.kind, by.session, self.mode, now)
        if refusal is None:
            work.stored.resume()
        return refusal

    def take_authority(
        self, holder: Holder, now: int, *, beats: bool, force: bool = False
    ) -> Refusal | list[Outgoing]:
        """Give the authority to a connection if it is free, or take it over by force.

        Returns:
            Why it may not have it, or the news; none where it has it already.
        """
        current = self.authority.holder
        if current is not None and current.session != holder.session:
            if not force:
                return held_by(current)
            if self.modes.mode(self.mode) is not OperatingMode.AUTOMATIC:
                text = f"{current.name} may be at the robot: no take-over in manual"
                return Refusal(VerdictCode.MODE_FORBIDS, text)
            gone = self.authority.release(current.session, AuthorityReason.TAKEN_OVER)
            out = self.authority_gone(gone, now)
            self.authority.request(holder, now, beats=beats)
            return out + self._tell(AuthorityMoved(Change(holder, AuthorityReason.TAKEN_OVER)), now)
        change = self.authority.request(holder, now, beats=beats)
        return [] if change is None else self._tell(AuthorityMoved(change), now)

    def authority_gone(self, change: Change | None, now: int) -> list[Outgoing]:
        """Stop what the former holder was moving, and tell everybody; None does nothing."""
        if change is None:
            return []
        out = self.end(
            Refusal(
                VerdictCode.AUTHORITY_LOST,
                f"the motion authority ended: {change.reason.name.lower().replace('_', ' ')}",
            ),
            now,
        )
        return out + self._tell(AuthorityMoved(change), now)

    def shut_down(self, now: int) -> list[Outgoing]:
        """Stop the robot because the server is going down; nothing starts any more."""
        self.is_closing = True
        return self.end(Refusal(VerdictCode.SHUTTING_DOWN), now)

    def tick(self, now: int) -> list[Outgoing]:
        """Advance by one control tick: deadlines, due set-points, arrival."""
        out = self.authority_gone(self.authority.expire(now), now)
        out += self._driving.settle(now)
        work = self._driving.work
        if work is not None and self._has_lost_enabling(work, now):
            return out + self.end(Refusal(VerdictCode.ENABLING_LOST), now)
        return out + self._driving.advance(now)

    def _has_lost_enabling(self, work: Work, now: int) -> bool:
        if not self.modes.needs_enabling(self.mode):
            return False
        stored = work.stored
        if stored is not None and stored.is_paused and not any(stored.last.velocity):
            # It stands on its path; `resume` asks for the enabling device again.
            return False
        return not self.modes.is_enabled(work.request.session, now)

    @property
    def is_busy(self) -> bool:
        """Whether a motion of ours is under way or being stopped."""
        return self._driving.is_busy

    @property
    def mode(self) -> ControllerMode:
        """The controller's own operating mode, mirrored."""
        return self.feedback.mode

    @property
    def is_moving(self) -> bool:
        """Whether the robot moves, is about to, or is being stopped, as far as anyone knows."""
        status = self.feedback.status
        return self.is_busy or (status is not None and status.in_motion == TriState.TRUE)
