"""The core of one robot cell: authority, stop, planning and motion, behind one set of rules.

Owns every decision about motion. Both faces ask it; it never looks at their messages. It owns no
socket and no clock: each call takes `now` and returns what is to be done.

A motion's life: `ask` (the conditions hold, the authority is there) → planned here, or by the
planning process and back through `planned` → certified, started → set-points through `answered`
and `tick` → `Ended`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from openpendant.motion.errors import MotionError
from openpendant.motion.limits import JointLimits
from openpendant.motion.ptp import straight_move
from openpendant.motion.straight_certificate import certify_straight_move
from openpendant.simplemsg import ControllerMode, Message, TriState
from openpendant.simplemsg.pendant import Activity, LinkState
from openpendant.simplemsg.verdicts import VerdictCode

from .authority import Authority, Change, Holder
from .controller_path import ControllerPath
from .execution import Certified, Execution, Phase, start_mismatch
from .feedback import Feedback
from .jobs import Job, Planned
from .joint_slots import JointSlots
from .news import AuthorityMoved, Begun, Ended, LatchedStop, News, Refused, Request, StopMoved
from .outgoing import DropLink, Forward, ForwardStop, Keep, Outgoing, Plan
from .plan_store import StoredMotion
from .refusal import Refusal, refusal_of
from .settings import CellSettings
from .uplinks.generic import GenericUplink

_STOPPING_NS = 5_000_000_000
_STOP_REPEAT_NS = 100_000_000


Listener = Callable[[News, int], list[Outgoing]]


@dataclass(slots=True)
class _Work:
    """A motion between its request and its end."""

    request: Request
    job_id: int
    plan_time: float = 0.0
    execution: Execution | None = None


class RobotCell:
    """One robot: who may move it, whether it may move now, and what it is doing.

    Attributes:
        authority: the lease.
        feedback: what the controller said last.
        stop: the latched software stop, None where there is none.
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
        self.stop: LatchedStop | None = None
        self._link = settings.controller
        self._uplink = GenericUplink(settings.controller, limits.velocity)
        self._tell = listener
        self._up = dict.fromkeys(ControllerPath, False)
        self._work: _Work | None = None
        self._stopping_since: int | None = None
        self._stop_repeated = 0
        self._last_job = 0
        self._motions = 0
        self._closing = False

    @property
    def activity(self) -> Activity:
        """What the cell is doing."""
        if self._stopping_since is not None:
            return Activity.STOPPING
        if self._work is None:
            return Activity.IDLE
        return Activity.PLANNING if self._work.execution is None else Activity.MOVING

    @property
    def request(self) -> Request | None:
        """The request that is being planned or moved."""
        return None if self._work is None else self._work.request

    def link_state(self, now: int) -> LinkState:
        """Return the state of the controller connection."""
        if not (self._up[ControllerPath.MOTION] and self._up[ControllerPath.STATE]):
            return LinkState.DOWN
        return LinkState.UP if self.feedback.is_fresh(now) else LinkState.STALE

    def obstacle(self, now: int) -> Refusal | None:
        """Return the first condition that keeps any motion from starting, whoever asks."""
        if self.activity is Activity.PLANNING:
            return self._unready(now) or Refusal(VerdictCode.PLANNING)
        return self._unready(now)

    def _unready(self, now: int) -> Refusal | None:
        """Return what keeps a motion from starting, a request that is being planned aside."""
        if self._closing:
            return Refusal(VerdictCode.SHUTTING_DOWN)
        if self.stop is not None:
            return Refusal(
                VerdictCode.STOP_LATCHED,
                f"software stop by {self.stop.by.name}: {self.stop.reason}",
            )
        if self.link_state(now) is LinkState.DOWN:
            return Refusal(VerdictCode.CONTROLLER_DOWN)
        if self.feedback.broken:
            return Refusal(VerdictCode.NOT_FINITE, "the controller reports a position that is none")
        if not self.feedback.is_fresh(now):
            age = self.feedback.age(now)
            text = "" if age is None else f"the last position report is {age / 1e6:.0f} ms old"
            return Refusal(VerdictCode.FEEDBACK_STALE, text)
        if self.is_busy or not self.feedback.is_standing:
            return Refusal(VerdictCode.MOVING)
        if self.feedback.complaint:
            return Refusal(
                VerdictCode.CONTROLLER_NOT_READY,
                f"the controller cannot move: {self.feedback.complaint}",
            )
        return None

    def _permission(self, session: int, now: int) -> Refusal | None:
        holder = self.authority.holder
        if holder is None or self.authority.is_overdue(now):
            return Refusal(VerdictCode.NOT_IN_CONTROL)
        return None if holder.session == session else _held_by(holder)

    def check(self, session: int, now: int) -> Refusal | None:
        """Return why a connection may not start a motion now; None where it may."""
        return self._permission(session, now) or self.obstacle(now)

    @property
    def standing_at(self) -> tuple[float, ...]:
        """Where the robot stands, (n,) controller side; only meaningful when `check` said None."""
        assert self.feedback.position is not None
        return self.feedback.position

    def new_job_id(self) -> int:
        """Return a number for a planning job."""
        self._last_job += 1
        return self._last_job

    def ask(self, request: Request, job: Job) -> list[Outgoing]:
        """Have a motion planned that `check` permitted; its fate comes as news."""
        self._work = _Work(request, job.job_id)
        return [Plan(job)]

    def move_joints(
        self, request: Request, goal: Sequence[float], speed: float, now: int
    ) -> list[Outgoing]:
        """Plan, certify and start a joint move that `check` permitted, on this call stack.

        A straight joint move is timed in closed form, so it needs no planning process.
        """
        start = self.standing_at
        try:
            move = straight_move(start, goal, self.limits, speed=speed)
            certificate = certify_straight_move(move, self.limits, start=start)
        except MotionError as error:
            return self._tell(Refused(request, refusal_of(error)), now)
        work = _Work(request, self.new_job_id())
        return self._start(work, Certified(move, certificate), now)

    def planned(self, planned: Planned, now: int) -> list[Outgoing]:
        """Take the answer of the planning process; one that nobody waits for is dropped."""
        work = self._work
        if work is None or work.execution is not None or work.job_id != planned.job_id:
            return []
        self._work = None
        if isinstance(planned.result, Refusal):
            return self._tell(Refused(work.request, planned.result), now)
        trajectory, certificate = planned.result
        refusal = (
            self._permission(work.request.session, now)
            or self._unready(now)
            or start_mismatch(trajectory, self.feedback)
        )
        if refusal is not None:
            return self._tell(Refused(work.request, refusal), now)
        work.plan_time = planned.plan_time
        return self._start(work, Certified(trajectory, certificate), now)

    def _start(self, work: _Work, certified: Certified, now: int) -> list[Outgoing]:
        execution = Execution(
            certified,
            self.limits,
            self._uplink,
            self._link,
            now,
            known_error=self.feedback.error,
        )
        first = execution.next_point(now)
        if isinstance(first, Refusal):
            return self._tell(Refused(work.request, first), now)
        work.execution = execution
        self._work = work
        out: list[Outgoing] = [] if first is None else [Forward(first)]
        out += self._tell(Begun(work.request), now)
        self._motions += 1
        out.append(Keep(StoredMotion(self._motions, now, work.plan_time, certified)))
        return out

    def answered(self, reply: Message, pending: int, now: int) -> list[Outgoing]:
        """Take an answer of the controller on the motion link.

        Args:
            reply: the answer.
            pending: answers that the link still owes.
            now: monotonic time, ns.
        """
        work = self._work
        refusal = self._uplink.answer(reply, pending)
        if work is None or work.execution is None:
            return []
        if refusal is not None:
            return self._abort(refusal, now)
        return self._send_next(work.execution, now)

    def _send_next(self, execution: Execution, now: int) -> list[Outgoing]:
        point = execution.next_point(now)
        if isinstance(point, Refusal):
            return self._abort(point, now)
        return [] if point is None else [Forward(point)]

    def misanswered(self, problem: str, now: int) -> list[Outgoing]:
        """Take an answer that nobody asked for, or that cannot be read, on the motion link.

        From then on nobody knows which answer belongs to which point, so a motion ends.
        """
        if self.activity is not Activity.MOVING:
            return []
        return self._abort(Refusal(VerdictCode.CONTROLLER_MISMATCH, problem), now)

    def _abort(self, refusal: Refusal, now: int) -> list[Outgoing]:
        """End a motion; begin a new conversation where the old one cannot be trusted."""
        out = self.end(refusal, now)
        if refusal.code in (VerdictCode.CONTROLLER_MISMATCH, VerdictCode.CONTROLLER_SILENT):
            out.append(DropLink(refusal.sentence))
        return out

    def reported(self, message: Message, now: int) -> list[Outgoing]:
        """Take a report of the controller on the state link; a change of its mode stops."""
        before = self.feedback.mode
        self.feedback.take(message, now)
        after = self.feedback.mode
        if after is before or self._work is None:
            return []
        text = f"the controller's mode changed from {before.name} to {after.name}".lower()
        return self.end(Refusal(VerdictCode.CONTROLLER_STOPPED, text), now)

    def path_changed(self, path: ControllerPath, up: bool, now: int) -> list[Outgoing]:
        """Take note that a connection to the controller came or went."""
        self._up[path] = up
        if up or path is ControllerPath.STOP:
            return []
        if path is ControllerPath.MOTION:
            self._uplink.lost()
        else:
            self.feedback.forget()
        if self._work is None:
            return []
        return self.end(
            Refusal(
                VerdictCode.CONTROLLER_LOST, f"the controller's {path.name.lower()} link was lost"
            ),
            now,
        )

    def end(self, refusal: Refusal, now: int) -> list[Outgoing]:
        """End whatever is planned or moving, and have the robot stopped.

        Returns:
            The stop first, then the news for whoever asked for the motion.
        """
        work = self._work
        if work is None:
            return []
        self._work = None
        if work.execution is None:
            return self._tell(Refused(work.request, refusal), now)
        out = self._halt(now)
        return out + self._tell(self._ended(work, refusal), now)

    def _halt(self, now: int) -> list[Outgoing]:
        self._stopping_since = now
        self._stop_repeated = now
        return [self._stop_now(now)]

    def _stop_now(self, now: int) -> ForwardStop:
        return ForwardStop(self._uplink.stop(now, is_sent=self._up[ControllerPath.MOTION]))

    @staticmethod
    def _ended(work: _Work, refusal: Refusal | None) -> Ended:
        assert work.execution is not None
        duration = work.execution.certified.trajectory.duration
        return Ended(work.request, refusal, work.plan_time, duration)

    def halt(self, refusal: Refusal, now: int) -> list[Outgoing]:
        """Send a stop whether or not we know of a motion, and end what is under way."""
        moves = self.activity is Activity.MOVING
        out = self.end(refusal, now)
        if moves:
            return out
        if self._is_seen_moving:
            return self._halt(now) + out
        return [self._stop_now(now), *out]

    def software_stop(self, by: Holder, reason: str, now: int) -> list[Outgoing]:
        """Stop the robot and latch; anyone may, at any time. The stop leaves first."""
        out = self.halt(Refusal(VerdictCode.STOPPED, f"software stop by {by.name}: {reason}"), now)
        if self.stop is None:
            self.stop = LatchedStop(by, reason, now)
            out += self._tell(StopMoved(self.stop, by), now)
        return out

    def reset_stop(self, by: Holder, now: int) -> Refusal | list[Outgoing]:
        """Unlatch the software stop; moves nothing.

        Returns:
            Why it may not be reset, or the news.
        """
        refusal = self._permission(by.session, now)
        if refusal is not None:
            return refusal
        if self.is_busy or self._is_seen_moving:
            return Refusal(VerdictCode.MOVING, "the robot has not come to rest yet")
        if self.stop is None:
            return []
        self.stop = None
        return self._tell(StopMoved(None, by), now)

    def take_authority(self, holder: Holder, now: int, *, beats: bool) -> Refusal | list[Outgoing]:
        """Give the authority to a connection if it is free.

        Returns:
            Why it may not have it, or the news; none where it has it already.
        """
        current = self.authority.holder
        if current is not None and current.session != holder.session:
            return _held_by(current)
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
        self._closing = True
        return self.end(Refusal(VerdictCode.SHUTTING_DOWN), now)

    def tick(self, now: int) -> list[Outgoing]:
        """Advance by one control tick: deadlines, due set-points, arrival."""
        out = self.authority_gone(self.authority.expire(now), now)
        self._settle_stop(now, out)
        if self._uplink.stop_overdue(now):
            out.append(DropLink("a STOP was not answered"))
        work = self._work
        if work is None or work.execution is None:
            return out
        refusal = work.execution.advance(self.feedback, now)
        if refusal is not None:
            return out + self._abort(refusal, now)
        if work.execution.phase is Phase.ARRIVED:
            self._work = None
            return out + self._tell(self._ended(work, None), now)
        return out + self._send_next(work.execution, now)

    def _settle_stop(self, now: int, out: list[Outgoing]) -> None:
        """Leave STOPPING once the robot is seen at rest; repeat the stop until then."""
        since = self._stopping_since
        if since is None:
            return
        feedback = self.feedback
        if feedback.position is not None and feedback.received > since and feedback.is_standing:
            self._stopping_since = None
        elif now - since > _STOPPING_NS and feedback.position is None:
            # Without reports nobody can say that it stands; `obstacle` keeps refusing motion.
            self._stopping_since = None
        elif now - self._stop_repeated >= _STOP_REPEAT_NS:
            self._stop_repeated = now
            out.append(self._stop_now(now))

    @property
    def mode(self) -> ControllerMode:
        """The controller's own operating mode, mirrored."""
        return self.feedback.mode

    @property
    def is_busy(self) -> bool:
        """Whether a motion of ours is under way or being stopped."""
        return self.activity in (Activity.MOVING, Activity.STOPPING)

    @property
    def _is_seen_moving(self) -> bool:
        return self.feedback.position is not None and not self.feedback.is_standing

    @property
    def is_moving(self) -> bool:
        """Whether the robot moves, is about to, or is being stopped, as far as anyone knows."""
        status = self.feedback.status
        return self.is_busy or (status is not None and status.in_motion == TriState.TRUE)


def _held_by(holder: Holder) -> Refusal:
    return Refusal(VerdictCode.HELD_BY_OTHER, f"{holder.name} is in control")
