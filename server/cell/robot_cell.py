"""Core of one robot cell: authority, stop, mode and the conditions of motion.

Owns who may move the robot and whether it may move now, and what ends a motion against its will.
Both endpoints ask it; it never looks at their messages. It owns no socket and no clock: each call
takes `now` and returns what is to be done. How a motion begins and is steered: `cell_motions`.

Owns the question whether the controller is emulated, and what its answers are worth
(`Identification`). The question is OPERATOR_EVENT with the action IDENTIFY, which does nothing. It
is asked once at each connect, and on the state connection only: there vendors' programs read
nothing, while some of their motion servers end on a message that they do not know. Silence means a
real one.
"""

from __future__ import annotations

from functools import partial

from openpendant.motion.description.limits import JointLimits
from openpendant.simplemsg import Message, ReplyCode, Status, TriState
from openpendant.simplemsg.pendant import (
    Activity,
    AuthorityReason,
    LinkState,
    OperatingMode,
    OperatorAction,
    OperatorEvent,
)
from openpendant.simplemsg.verdicts import VerdictCode

from ..control import AuthorityChange, Holder, MotionAuthority, MotionKind, OperatingModes
from ..events.cell_events import (
    AuthorityTransferred,
    Interruption,
    OperatingModeChanged,
    ProgramEnded,
    ProgramStarted,
    RunningProgram,
    StopLatch,
    StopLatchChanged,
)
from ..events.effects import Effect, LogLine, QueryController, Then
from ..events.pending import Pending
from ..refusal import Refusal
from ..settings.cell_settings import CellSettings, ControllerPath
from ..uplinks import dialect_of
from .cell_motions import CellMotions
from .execution.feedback import Feedback, interruption
from .execution.motion_watch import ArmPoints
from .execution.trajectory_execution import Publish, TrajectoryExecution
from .hold_to_run import HoldToRun
from .interlocks import check_interlocks, examine_cell, held_by, permission
from .joint_names import JointNames
from .joint_slots import JointSlots

PATIENCE_NS = 2_000_000_000
"""An answer that takes longer says nothing: whoever gives it is taken for a real controller."""


class Identification:
    """Asks the controller of a cell what it is, and keeps `Feedback.says_emulated`."""

    def __init__(self, feedback: Feedback) -> None:
        """Have nobody to ask yet."""
        self._feedback = feedback
        self._asked = 0
        self._said: bool | None = None  # what the first answer on this connection was taken for
        self._is_told = False  # that an answer too many or too late came

    def link(self, up: bool, now: int) -> list[Effect]:
        """Take note that the state connection came or went; ask on a new one."""
        self._feedback.says_emulated = False
        self._said, self._is_told, self._asked = None, False, now
        return [QueryController(OperatorEvent(OperatorAction.IDENTIFY))] if up else []

    def answered(self, reply_code: int, now: int) -> list[Effect] | Refusal:
        """Take an answer, asked for or not.

        The first one in time counts. No later one makes a controller emulated; one that says
        otherwise takes that back until the next connect.

        Returns:
            A line for the log where it is odd, once a connection; why nothing may move on where
            the controller contradicts what it was believed.
        """
        says_so = reply_code == ReplyCode.SUCCESS
        late = now - self._asked
        if self._said is None and late <= PATIENCE_NS:
            self._said = self._feedback.says_emulated = says_so
            return []
        if self._said is None:
            self._said = False
            after = f"{late / 1e9:.1f} s after it was asked, more than {PATIENCE_NS / 1e9:g} s"
            return self._odd(f"the controller said whether it is emulated {after}")
        if self._feedback.says_emulated and not says_so:
            self._said = self._feedback.says_emulated = False
            text = "the controller said that it is emulated, and then that it is not"
            return Refusal(VerdictCode.CONTROLLER_MISMATCH, text)
        return self._odd("the controller said more than once whether it is emulated")

    def _odd(self, what: str) -> list[Effect]:
        if self._is_told:
            return []
        self._is_told = True
        taken_for = "emulated" if self._feedback.says_emulated else "a real one"
        return [LogLine(f"{what}; it is taken for {taken_for}")]


_IDLE, _LINK_UP = Activity.IDLE, LinkState.UP  # asked for each tick, and slow to look up

SERVER = Holder(0, "the server")
"""Who did it, where the server did it by itself."""

CONTROLLER = Holder(0, "the controller")
"""Who turned the mode selector, where it is the controller's own."""


class RobotCell:
    """One robot: who may move it, whether it may move now, and what it is doing.

    Attributes:
        declaration: what its controller can do.
        modes: the mode of operation, enabling (training) and speeds.
        hold_to_run: judges the press and the enabling devices.
        motions: what is planned and moved.
        stop: the latched stop, None where there is none.
        program: the program under way, None where there is none; `show_program` says it.
        awaited: what of frames and tools awaits the store's answer, or is being put in force, in
            words; by `show_scene`.
        ended: why the last motion ended before its goal; None where it arrived or another began.
        unread: what is kept of frames, tools and scene and is not in force, in words; likewise.
        unbuilt: what was added to the scene and a jog would not see yet, in words; likewise.
    """

    def __init__(
        self,
        settings: CellSettings,
        limits: JointLimits,
        publish: Publish,
        pending: Pending,
        points: ArmPoints,
    ) -> None:
        """Make a cell without a controller connection.

        Args:
            points: tool and elbow, held to the cap of the mode by what is reported, too.
        """
        self.limits = limits
        self.joint_names = JointNames(limits)
        self.declaration = dialect_of(settings.controller).declared(settings.controller)
        self._is_told_emulated = settings.controller.emulated
        self.slots = JointSlots(limits)
        self.authority = MotionAuthority(round(settings.pendants.authority_timeout * 1e9))
        self.feedback = Feedback(limits.dof, settings.controller)
        self._identification = Identification(self.feedback)
        self.stop: StopLatch | None = None
        self.ended: Refusal | None = None
        self.program: RunningProgram | None = None
        self.awaited = self.unread = self.unbuilt = ""
        self.is_closing = False
        self._publish = publish
        self.driving = TrajectoryExecution(
            *(settings.controller, limits, self.feedback, publish, self.protective_stop),
            pending.cancel,
            cap=self._tool_speed_cap,
            points=points,
        )
        self.modes = OperatingModes(settings.modes, settings.tick_rate, self.driving.held_press)
        self.hold_to_run = HoldToRun(
            *(self.authority, self.modes, self.driving, limits, settings.tick_rate)
        )
        self.motions = CellMotions(
            *(limits, self.authority, self.feedback, self.modes, self.driving),
            *(self._recheck, publish, pending),
        )

    def show_program(self, program: RunningProgram | None) -> None:
        """Take note of the program that is under way; None for none."""
        self.program = program

    def show_scene(self, awaited: str, unread: str, unbuilt: str) -> None:
        """Take note of what of frames, tools and scene is awaited and not in force, in words."""
        self.awaited, self.unread, self.unbuilt = awaited, unread, unbuilt

    def _tool_speed_cap(self) -> float | None:
        return self.modes.tool_speed_cap(self.feedback.mode)

    @property
    def activity(self) -> Activity:
        """What the cell is doing; between the motions of a program, what that says."""
        activity = self.driving.activity
        if activity is _IDLE and self.program is not None:
            return self.program.activity
        return activity

    @property
    def is_known_emulated(self) -> bool:
        """Whether the controller is known to be emulated: it says so, and so does the cell's file.

        Neither is enough for what only training may do. A real one could be made to answer the
        question by chance, and a file may be copied to another cell.
        """
        return self._is_told_emulated and self.feedback.says_emulated

    def link_state(self, now: int) -> LinkState:
        """Return the state of the controller connection."""
        if not self.driving.is_linked:
            return LinkState.DOWN
        return _LINK_UP if self.feedback.is_fresh(now) else LinkState.STALE

    def obstacle(self, now: int) -> Refusal | None:
        """Return the first condition that keeps any motion from starting, whoever asks."""
        return next((found.refusal for found in examine_cell(self, now) if found.refusal), None)

    def _recheck(self, session: int, kind: MotionKind, now: int) -> Refusal | None:
        return check_interlocks(self, session, now, kind, planned=True)

    def reported(self, message: Message, now: int) -> list[Effect]:
        """Take a report of the controller on the state link.

        A fault or another mode stops, and so does a robot that is not where it was commanded to be.
        """
        if not isinstance(message, Status):
            self.feedback.take(message, now)
            return self.driving.reported(now)
        before = self.feedback.shown
        self.feedback.take(message, now)
        after = self.feedback.shown
        refusal = interruption(before, after)
        if refusal is None:
            return []
        if after.error != before.error:
            refusal = self.driving.blamed(refusal, now)
        out = self._interrupt(refusal, now)
        mode = self.modes.mode(self.feedback.mode)
        if mode is not self.modes.mode(before.mode):
            out += self._publish(OperatingModeChanged(mode, CONTROLLER), now)
        return out

    def identified(self, reply_code: int, now: int) -> list[Effect]:
        """Take what the controller answered to whether it is emulated.

        One that contradicts itself is none to move by: what moves is stopped.
        """
        told = self._identification.answered(reply_code, now)
        if isinstance(told, Refusal):
            return [*self._interrupt(told, now), LogLine(told.sentence)]
        return told

    def _interrupt(self, refusal: Refusal, now: int) -> list[Effect]:
        """End what is planned or moves, and tell whatever only waits to move."""
        return self.end(refusal, now) + self._publish(Interruption(refusal), now)

    def path_changed(self, path: ControllerPath, up: bool, now: int) -> list[Effect]:
        """Take note that a connection to the controller came or went."""
        self.driving.path_changed(path, up)
        asked = [] if path is not ControllerPath.STATE else self._identification.link(up, now)
        if up or path is ControllerPath.STOP:
            return asked
        text = f"the controller's {path.name.lower()} link was lost"
        return self._interrupt(Refusal(VerdictCode.CONTROLLER_LOST, text), now)

    def end(self, refusal: Refusal, now: int) -> list[Effect]:
        """End whatever is planned or moving, and have the robot stopped."""
        return self.driving.end(refusal, now)

    def halt(self, refusal: Refusal, now: int) -> list[Effect]:
        """Send a stop whether or not we know of a motion, and end what is under way."""
        return self.driving.halt(refusal, now) + self._publish(Interruption(refusal), now)

    def announce(self, event: ProgramStarted | ProgramEnded, now: int) -> list[Effect]:
        """Tell everybody what became of a program; its executor knows."""
        return self._publish(event, now)

    def software_stop(self, by: Holder, reason: str, now: int) -> list[Effect]:
        """Stop the robot and latch; anyone may, at any time. The stop leaves first."""
        stop = StopLatch(by, reason, now)
        return [self.driving.stop(now), Then(partial(self._stopped, stop, now))]

    def _stopped(self, stop: StopLatch, now: int) -> list[Effect]:
        """End what the stop has ended, tell everybody and latch."""
        refusal = Refusal(VerdictCode.STOPPED, stop.sentence)
        out = self.driving.stopped(refusal, now) + self._publish(Interruption(refusal), now)
        return out + self._latch(stop, now)

    def protective_stop(self, refusal: Refusal, now: int) -> list[Effect]:
        """Stop the robot and latch, because the server found something wrong by itself."""
        out = self.halt(refusal, now)
        return out + self._latch(StopLatch(SERVER, refusal.sentence, now, True, refusal.code), now)

    def _latch(self, stop: StopLatch, now: int) -> list[Effect]:
        self.modes.disarm()
        # A software stop takes the place of a protective one: a person's word weighs more.
        if self.stop is not None and (stop.is_protective or not self.stop.is_protective):
            return []
        self.stop = stop
        return self._publish(StopLatchChanged(stop, stop.by), now)

    def reset_stop(self, by: Holder, now: int) -> Refusal | list[Effect]:
        """Unlatch the stop; moves nothing, and whoever enabled must press anew."""
        refusal = permission(self.authority, by.session, now)
        if refusal is not None:
            return refusal
        if self.is_busy or self.driving.is_seen_moving:
            return Refusal(VerdictCode.MOVING, "the robot has not come to rest yet")
        if self.stop is None:
            return []
        self.stop = None
        self.modes.disarm()
        return self._publish(StopLatchChanged(None, by), now)

    def set_mode(self, by: Holder, mode: int, now: int) -> Refusal | list[Effect]:
        """Set the mode of operation; what moves is stopped first."""
        refusal = permission(self.authority, by.session, now)
        if refusal is not None:
            return refusal
        before = self.modes.mode(self.feedback.mode)
        after = self.modes.set_mode(mode)
        if isinstance(after, Refusal):
            return after
        if after is before:
            return []
        text = f"{by.name} changed the mode to {after.name.lower().replace('_', ' ')}"
        out = self.end(Refusal(VerdictCode.MODE_CHANGED, text), now)
        return out + self._publish(OperatingModeChanged(after, by), now)

    def take_authority(
        self, holder: Holder, now: int, *, beats: bool, force: bool = False
    ) -> Refusal | list[Effect]:
        """Give the authority to a connection if it is free, or by force at standstill."""
        current = self.authority.holder
        if current is not None and current.session != holder.session:
            if not force:
                return held_by(current)
            if self.modes.mode(self.feedback.mode) is not OperatingMode.AUTOMATIC:
                text = f"{current.name} may be at the robot: no take-over in manual"
                return Refusal(VerdictCode.NO_TAKE_OVER, text)
            if self.is_moving:
                text = f"{current.name} moves the robot; stop it, and take over once it stands"
                return Refusal(VerdictCode.MOVING, text)
            gone = self.authority.release(current.session, AuthorityReason.TAKEN_OVER)
            out = self.authority_gone(gone, now)
            self.authority.request(holder, now, beats=beats)
            return out + self._publish(
                AuthorityTransferred(AuthorityChange(holder, AuthorityReason.TAKEN_OVER)), now
            )
        change = self.authority.request(holder, now, beats=beats)
        return [] if change is None else self._publish(AuthorityTransferred(change), now)

    def authority_gone(self, change: AuthorityChange | None, now: int) -> list[Effect]:
        """Stop what the former holder was moving, and tell everybody; None does nothing."""
        if change is None:
            return []
        text = f"the motion authority ended: {change.reason.name.lower().replace('_', ' ')}"
        out = self.end(Refusal(VerdictCode.AUTHORITY_LOST, text), now)
        return out + self._publish(AuthorityTransferred(change), now)

    def shut_down(self, now: int) -> list[Effect]:
        """Stop the robot because the server is going down; nothing starts any more."""
        self.is_closing = True
        return self.end(Refusal(VerdictCode.SHUTTING_DOWN), now)

    def tick(self, now: int) -> list[Effect]:
        """Advance by one control tick: deadlines, due set-points, arrival."""
        expired = self.authority.expire(now)
        out = [] if expired is None else self.authority_gone(expired, now)
        out += self.driving.settle(now)
        lost = self.hold_to_run.tick(now)
        return out + (self.driving.advance(now) if lost is None else self.end(lost, now))

    def enable(self, session: int, position: int, now: int) -> list[Effect]:
        """Take the position of a connection's enabling device; what it does not enable ends."""
        lost = self.hold_to_run.enable(session, position, now)
        return [] if lost is None else self._interrupt(lost, now)

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
        return self.driving.is_busy

    @property
    def is_moving(self) -> bool:
        """Whether the robot moves, is about to, or is being stopped, as far as anyone knows."""
        status = self.feedback.status
        return self.is_busy or (status is not None and status.in_motion == TriState.TRUE)
