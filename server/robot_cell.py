"""The core of one robot cell: authority, stop, mode and the conditions of motion.

Owns who may move the robot and whether it may move now, and what ends a motion against its will.
Both faces ask it; it never looks at their messages. It owns no socket and no clock: each call takes
`now` and returns what is to be done. How a motion begins and is steered: `cell_motions`.
"""

from __future__ import annotations

from openpendant.motion.limits import JointLimits
from openpendant.simplemsg import ControllerMode, Message, Status, TriState
from openpendant.simplemsg.pendant import Activity, AuthorityReason, LinkState, OperatingMode
from openpendant.simplemsg.verdicts import VerdictCode

from .authority import Authority, Change, Holder
from .cell_motions import CellMotions
from .controller_path import ControllerPath
from .driving.driving import Driving, Listener
from .driving.feedback import Feedback
from .driving.interruption import interruption, shown
from .driving.motion_watch import ArmPoints
from .driving.standstill_watch import UncommandedMotion
from .identification import Identification
from .joint_slots import JointSlots
from .news import (
    AuthorityMoved,
    Interrupted,
    LatchedStop,
    ModeMoved,
    ProgramBegan,
    ProgramEnded,
    Request,
    StopMoved,
)
from .operating_mode import MotionKind, OperatingModes
from .outgoing import LogLine, Outgoing
from .playback.running_program import RunningProgram
from .readiness import examine, examine_cell, held_by, permission
from .refusal import Refusal
from .settings import CellSettings

_IDLE, _LINK_UP = Activity.IDLE, LinkState.UP  # asked for each tick, and slow to look up

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
        motions: what is planned and moved.
        stop: the latched stop, None where there is none.
        program: the program under way, None where there is none; the program desk says it.
        awaited: what of frames and tools awaits the store's answer, in words; the world says it.
        ended: why the last motion ended before its goal; None where it arrived or another began.
        unread: what is kept of frames, tools and scene and is not in force, in words; likewise.
        limits: the robot's joint limits, controller side.
        slots: reads the joint positions of messages.
    """

    def __init__(self, settings: CellSettings, limits: JointLimits, tell: Listener) -> None:
        """Make a cell without a controller connection.

        Args:
            settings: the cell's configuration.
            limits: joint limits, controller side.
            tell: told all news; returns what is to be written because of them.
        """
        self.limits = limits
        self.slots = JointSlots(limits)
        self.authority = Authority(round(settings.pendants.authority_timeout * 1e9))
        self.feedback = Feedback(limits.dof, settings.controller)
        self._identification = Identification(self.feedback)
        self.modes = OperatingModes(settings.modes)
        self.stop: LatchedStop | None = None
        self.ended: Refusal | None = None
        self.program: RunningProgram | None = None
        self.awaited = self.unread = ""
        self.is_closing = False
        self._tell = tell
        self._driving = Driving(
            *(settings.controller, limits, self.feedback, tell, self.protective_stop),
            cap=self._tool_speed_cap,
        )
        self.motions = CellMotions(
            limits, self.authority, self.feedback, self.modes, self._driving, self._recheck, tell
        )

    def watch_points(self, points: ArmPoints) -> None:
        """Have tool and elbow held to the cap of the mode by what is reported, too."""
        self._driving.points = points

    def _tool_speed_cap(self) -> float | None:
        return self.modes.tool_speed_cap(self.feedback.mode)

    @property
    def uncommanded(self) -> UncommandedMotion | None:
        """How the robot moved last while nobody commanded it, since the last motion."""
        return self._driving.uncommanded

    @property
    def activity(self) -> Activity:
        """What the cell is doing; between the motions of a program, what that says."""
        activity = self._driving.activity
        if activity is _IDLE and self.program is not None:
            return self.program.activity
        return activity

    @property
    def motion_activity(self) -> Activity:
        """What is done with a motion of ours; IDLE between those of a program."""
        return self._driving.activity

    @property
    def request(self) -> Request | None:
        """The request that is being planned or moved."""
        return self._driving.request

    def link_state(self, now: int) -> LinkState:
        """Return the state of the controller connection."""
        if not self._driving.is_linked:
            return LinkState.DOWN
        return _LINK_UP if self.feedback.is_fresh(now) else LinkState.STALE

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

    def _recheck(self, session: int, kind: MotionKind, now: int) -> Refusal | None:
        return self.check(session, now, kind, planned=True)

    @property
    def standing_at(self) -> tuple[float, ...]:
        """Where the robot stands, (n,) controller side; only meaningful when `check` said None."""
        assert self.feedback.position is not None
        return self.feedback.position

    def answered(self, reply: Message, pending: int, now: int) -> list[Outgoing]:
        """Take an answer of the controller on the motion link; see `Driving.answered`."""
        return self._driving.answered(reply, pending, now)

    def misanswered(self, problem: str, now: int) -> list[Outgoing]:
        """Take an answer of the controller that cannot belong to anything."""
        return self._driving.misanswered(problem, now)

    def reported(self, message: Message, now: int) -> list[Outgoing]:
        """Take a report of the controller on the state link.

        A fault or another mode stops, and so does a robot that is not where it was commanded to be.
        """
        if not isinstance(message, Status):
            self.feedback.take(message, now)
            return self._driving.reported(now)
        before = shown(self.feedback)
        self.feedback.take(message, now)
        after = shown(self.feedback)
        refusal = interruption(before, after)
        if refusal is None:
            return []
        if after.error != before.error:
            refusal = self._driving.blamed(refusal, now)
        out = self._interrupt(refusal, now)
        mode = self.modes.mode(self.feedback.mode)
        if mode is not self.modes.mode(before.mode):
            out += self._tell(ModeMoved(mode, CONTROLLER), now)
        return out

    def identified(self, reply_code: int, now: int) -> list[Outgoing]:
        """Take what the controller answered to whether it is emulated.

        One that contradicts itself is none to move by: what moves is stopped.
        """
        told = self._identification.answered(reply_code, now)
        if isinstance(told, Refusal):
            return [*self._interrupt(told, now), LogLine(told.sentence)]
        return told

    @property
    def says_emulated(self) -> bool:
        """Whether the controller says that it is emulated, on the connection that there is."""
        return self.feedback.says_emulated

    def _interrupt(self, refusal: Refusal, now: int) -> list[Outgoing]:
        """End what is planned or moves, and tell whatever only waits to move."""
        return self.end(refusal, now) + self._tell(Interrupted(refusal), now)

    def path_changed(self, path: ControllerPath, up: bool, now: int) -> list[Outgoing]:
        """Take note that a connection to the controller came or went."""
        self._driving.path_changed(path, up)
        asked = [] if path is not ControllerPath.STATE else self._identification.link(up, now)
        if up or path is ControllerPath.STOP:
            return asked
        text = f"the controller's {path.name.lower()} link was lost"
        return self._interrupt(Refusal(VerdictCode.CONTROLLER_LOST, text), now)

    def end(self, refusal: Refusal, now: int) -> list[Outgoing]:
        """End whatever is planned or moving, and have the robot stopped."""
        return self._driving.end(refusal, now)

    def halt(self, refusal: Refusal, now: int) -> list[Outgoing]:
        """Send a stop whether or not we know of a motion, and end what is under way."""
        return self._driving.halt(refusal, now) + self._tell(Interrupted(refusal), now)

    def announce(self, news: ProgramBegan | ProgramEnded, now: int) -> list[Outgoing]:
        """Tell everybody what became of a program; its desk knows."""
        return self._tell(news, now)

    def software_stop(self, by: Holder, reason: str, now: int) -> list[Outgoing]:
        """Stop the robot and latch; anyone may, at any time. The stop leaves first."""
        out = self.halt(Refusal(VerdictCode.STOPPED, f"software stop by {by.name}: {reason}"), now)
        return out + self._latch(LatchedStop(by, reason, now), now)

    def protective_stop(self, refusal: Refusal, now: int) -> list[Outgoing]:
        """Stop the robot and latch, because the server found something wrong by itself."""
        out = self.halt(refusal, now)
        return out + self._latch(
            LatchedStop(SERVER, refusal.sentence, now, True, refusal.code), now
        )

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

    def take_authority(
        self, holder: Holder, now: int, *, beats: bool, force: bool = False
    ) -> Refusal | list[Outgoing]:
        """Give the authority to a connection if it is free, or take it over by force at standstill.

        Returns:
            Why it may not have it, or the news; none where it has it already.
        """
        current = self.authority.holder
        if current is not None and current.session != holder.session:
            if not force:
                return held_by(current)
            if self.modes.mode(self.mode) is not OperatingMode.AUTOMATIC:
                text = f"{current.name} may be at the robot: no take-over in manual"
                return Refusal(VerdictCode.NO_TAKE_OVER, text)
            if self.is_moving:
                text = f"{current.name} moves the robot; stop it, and take over once it stands"
                return Refusal(VerdictCode.MOVING, text)
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
        text = f"the motion authority ended: {change.reason.name.lower().replace('_', ' ')}"
        out = self.end(Refusal(VerdictCode.AUTHORITY_LOST, text), now)
        return out + self._tell(AuthorityMoved(change), now)

    def shut_down(self, now: int) -> list[Outgoing]:
        """Stop the robot because the server is going down; nothing starts any more."""
        self.is_closing = True
        return self.end(Refusal(VerdictCode.SHUTTING_DOWN), now)

    def tick(self, now: int) -> list[Outgoing]:
        """Advance by one control tick: deadlines, due set-points, arrival."""
        out = self.authority_gone(self.authority.expire(now), now)
        out += self._driving.settle(now)
        lost = self.lost_enabling(now)
        return out + (self._driving.advance(now) if lost is None else self.end(lost, now))

    def lost_enabling(self, now: int) -> Refusal | None:
        """Return why what is planned or moves must end, where nobody enables it any more."""
        work, modes = self._driving.work, self.modes
        if work is None or modes.is_enabled(work.request.session, now):
            return None
        # One that somebody paused stands until `resume` asks for the device again. One that is only
        # held goes on by itself: it ends, or it would set off by a hand that let go meanwhile.
        is_paused = work.is_paused and self.motion_activity is Activity.PAUSED
        if is_paused or not modes.needs_enabling(self.mode):
            return None
        return Refusal(VerdictCode.ENABLING_LOST)

    def under_way(self) -> str:
        """Return what is planned or moves, in words; empty where nothing is."""
        if self.program is not None:
            return f"program {self.program.name!r} is under way"
        if self.activity is not Activity.IDLE:
            return f"the robot is {self.activity.name.lower()}"
        return "the robot moves" if self.is_moving else ""

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
