"""The controller's core: messages and time in, messages out.

Owns what is answered and when, the emergency stop, and the seven fields of STATUS. Which points are
taken is `command_intake`'s business, how they become motion `servo`'s. Pure: no sockets, files or
clock; `now` is monotonic time in nanoseconds and never goes backwards.

Every request is answered exactly once, topics never. The reply to a point that finds the buffer
full is withheld until there is room. STOP, an emergency stop, a fault or a lost link flush the
buffer; requests whose reply is then still withheld are answered FAILURE, before the STOP's own
SUCCESS.
"""

from __future__ import annotations

from collections import deque

from openpendant.simplemsg import (
    CommType,
    ControllerMode,
    JointTraj,
    JointTrajPt,
    JointTrajPtFull,
    Malformed,
    Message,
    Received,
    SpecialSequence,
    Status,
    TriState,
    Unasked,
    accepted,
    refused,
)
from openpendant.simplemsg.pendant import (
    OperatorAction,
    OperatorEvent,
    ReadSignals,
    SetInputs,
    WriteOutputs,
)

from ..error_codes import ErrorCode, PointRefusal
from ..float32 import NANOSECONDS
from ..interpolation.segment import State
from ..interpolation.servo import Servo, ServoPhase, StartRule
from ..profiles import ControllerProfile
from .admission import Admission
from .command_intake import IntakeOutcome, PointIntake, PointMessage, Rejected
from .referee import Referee, Violation
from .signals import DigitalSignals
from .state_reports import StateReports, answer

Outgoing = list[tuple[int, Message]]
"""Replies with the number of the motion link that each belongs to, in order."""

_LEAST_WITHHELD = 64

_TRI = (int(TriState.FALSE), int(TriState.TRUE))
"""A truth value as STATUS has it, at the index that Python gives it."""

_AUTO = int(ControllerMode.AUTO)
_IDENTIFY = int(OperatorAction.IDENTIFY)


class EmulatedController:
    """One emulated controller."""

    def __init__(
        self,
        admission: Admission,
        start: tuple[float, ...],
        profile: ControllerProfile,
        *,
        buffer_depth: int = 200,
        start_rule: StartRule,
        is_strict: bool = True,
        operator_events: bool = True,
        signals: DigitalSignals | None = None,
        referee: Referee | None = None,
        now: int = 0,
    ) -> None:
        """Switch the controller on: at rest, drives powered, no error.

        Args:
            start: (n,) where the robot stands [rad or m], controller side.
            operator_events: the messages OPERATOR_EVENT and SET_INPUTS are obeyed.
        """
        self.referee = referee or Referee()
        self._limits = admission.limits
        self._profile = profile
        self._servo = Servo(admission.axes, start, buffer_depth, start_rule)
        self._taking = PointIntake(admission, self._servo, self.referee, is_strict=is_strict)
        self._operator_events = operator_events
        self._signals = signals or DigitalSignals(0, 0)
        self._withheld: deque[tuple[int, PointMessage]] = deque()
        self._most_withheld = max(_LEAST_WITHHELD, buffer_depth)
        self._error = ErrorCode.NONE
        self._e_stopped = False
        self._out: Outgoing = []
        self._began = now
        self._reports = StateReports(profile)

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Names of the joints, in wire order."""
        return self._limits.names

    def connected(self, link: int, now: int) -> None:
        """Note a new motion link; nothing depends on it yet."""
        self.referee.count("motion-links")

    def disconnected(self, link: int, now: int) -> Outgoing:
        """Note a lost motion link: if it owns a motion, that ends on a ramp from `now`.

        A link lost at rest leaves its trajectory open: the client may come back on a new link,
        repeat the point whose reply it missed, and go on.
        """
        self._run(now)
        self._withheld = deque(entry for entry in self._withheld if entry[0] != link)
        if link == self._taking.owner:
            if self._servo.at_rest:
                self._taking.owner = None
            else:
                self.referee.count("lost-links")
                self._break_off(ErrorCode.LINK_LOST, now)
        self._run(now)
        return [entry for entry in self._flush_out() if entry[0] != link]

    def handle(self, link: int, message: Received, now: int) -> Outgoing:
        """Take a message of a motion link and return what is to be sent, to any link."""
        self._run(now)
        match message:
            case Unasked():
                pass
            case Malformed():
                self.referee.count("malformed-frames")
                self._say(link, self.answer(message, now))
            case JointTrajPt() | JointTrajPtFull() | JointTraj():
                if message.PLACE.msg_type not in self._profile.accepts:
                    self._say(link, self.answer(message, now))
                elif message.comm_type in (CommType.REQUEST, CommType.TOPIC):
                    self._handle_points(link, message, now)
            case OperatorEvent() if message.action != _IDENTIFY:
                done = self._operator_events and self._operate_by(message.action, now)
                if message.comm_type == CommType.REQUEST:
                    self._say(link, accepted(message) if done else refused(message))
            case _:
                self._say(link, self.answer(message, now))
        self._run(now)
        return self._flush_out()

    def was_away(self, since: int, now: int) -> None:
        """Note that this process read nothing from any link for a time; no client is at fault.

        To be called before anything else is done about the first event behind that time.
        """
        self.referee.count("stalls")
        self._servo.excuse(since, now)

    def advance(self, now: int) -> Outgoing:
        """Advance to a time: motion continues, and replies that were withheld become due."""
        self._run(now)
        return self._flush_out()

    def answer(self, message: Received, now: int) -> Message | None:
        """Return the reply to a message that moves nothing; either port may send it."""
        if isinstance(message, OperatorEvent) and message.action == _IDENTIFY:
            # Whatever the profile: no emulated controller shall ever be taken for a real one.
            return accepted(message) if message.comm_type == CommType.REQUEST else None
        if isinstance(message, ReadSignals | WriteOutputs):
            return self._signals.answer(message)
        if isinstance(message, SetInputs):
            return self._signals.answer(message) if self._operator_events else refused(message)
        return answer(message, self.status(now))

    def operate(self, action: OperatorAction, now: int) -> Outgoing:
        """Carry out an operator's action: emergency stop or reset."""
        self._run(now)
        self._operate_by(action, now)
        return self._flush_out()

    def motion(self, now: int) -> State:
        """Return position, velocity and acceleration; call `advance` with the same time first."""
        return self._servo.sample(now)

    def status(self, now: int) -> Status:
        """Return STATUS as a topic."""
        e_stopped, error = self._e_stopped, self._error
        is_stopping = self._servo.phase is ServoPhase.STOPPING
        return Status(
            drives_powered=_TRI[is_stopping or not e_stopped],
            e_stopped=_TRI[e_stopped],
            error_code=int(error),
            in_error=_TRI[error is not ErrorCode.NONE],
            in_motion=_TRI[self._servo.in_motion],
            mode=_AUTO,
            motion_possible=_TRI[not e_stopped and not is_stopping],
        )

    def status_change(self, now: int) -> Status | None:
        """Return STATUS if it differs from the one returned last, by this or `state_messages`."""
        return self._reports.change(self.status(now))

    def state_messages(self, now: int) -> list[Message]:
        """Return one round of the state port; call `advance` with the same time first."""
        seconds = (now - self._began) / NANOSECONDS
        return self._reports.round(self._servo.sample(now), self.status(now), seconds)

    def _handle_points(self, link: int, message: PointMessage, now: int) -> None:
        if not isinstance(message, JointTraj) and message.sequence == SpecialSequence.STOP:
            self.referee.count("stops")
            self._break_off(None, now)
            self._answer_points(link, message, IntakeOutcome.TAKEN)
            return
        outcome = self._take(link, message, now)
        if outcome is IntakeOutcome.WAITS:
            if len(self._withheld) < self._most_withheld:
                self._withheld.append((link, message))
                return
            self._break_off(ErrorCode.BUFFER_OVERFLOW, now)
            outcome = IntakeOutcome.REFUSED
        self._answer_points(link, message, outcome)

    def _answer_points(self, link: int, message: PointMessage, outcome: IntakeOutcome) -> None:
        if outcome is IntakeOutcome.REFUSED:
            self.referee.count("points-refused")
        if message.comm_type == CommType.REQUEST:
            is_refused = outcome is IntakeOutcome.REFUSED
            self._say(link, refused(message) if is_refused else accepted(message))

    def _take(
        self, link: int, message: PointMessage, now: int, *, is_head: bool = False
    ) -> IntakeOutcome:
        """Take points if the state of the controller allows it; nothing is answered here.

        Args:
            is_head: the message waited, and everything before it is dealt with.
        """
        if self._e_stopped:
            return IntakeOutcome.REFUSED
        is_behind = not is_head and link in [waiting for waiting, _ in self._withheld]
        outcome = self._taking.take(link, message, now, is_behind=is_behind)
        if isinstance(outcome, Rejected):
            self._note(link, outcome.sequence, outcome.refusal, now)
            self._break_off(outcome.refusal.code, now)
            return IntakeOutcome.REFUSED
        if outcome is IntakeOutcome.BEGAN:
            self._error = ErrorCode.NONE
        return outcome

    def _note(self, link: int, sequence: int, refusal: PointRefusal, now: int) -> None:
        if refusal.kind is None:
            return
        joint = "" if refusal.joint < 0 else self._limits.names[refusal.joint]
        time = (now - self._began) / NANOSECONDS
        self.referee.note(
            Violation(refusal.kind, joint, refusal.value, refusal.limit, sequence, time, link)
        )

    def _run(self, now: int) -> None:
        """Advance to a time; points that wait are admitted as soon as they fit."""
        while True:
            problem = self._servo.advance(now)
            if problem is not None:
                self.referee.count("broken-off")
                if problem.code is ErrorCode.BUFFER_UNDERRUN:
                    self.referee.count("under-runs")
                self._note(self._taking.owner or 0, self._servo.sequence, problem, now)
                self._break_off(problem.code, now)
                continue
            if not self._withheld:
                return
            link, message = self._withheld[0]
            outcome = self._take(link, message, now, is_head=True)
            if outcome is IntakeOutcome.WAITS:
                return
            # A refusal has emptied the queue and answered what was in it, this one included.
            if self._withheld:
                self._withheld.popleft()
                self._answer_points(link, message, outcome)

    def _break_off(self, code: ErrorCode | None, now: int) -> None:
        """End the motion on a ramp, forget its trajectory and fail whatever still waits.

        Args:
            code: the error from now on; None keeps what there is.
        """
        self._servo.stop(now)
        self._taking.break_off()
        if code is not None:
            self._error = code
        while self._withheld:
            link, message = self._withheld.popleft()
            self._answer_points(link, message, IntakeOutcome.REFUSED)

    def _operate_by(self, action: int, now: int) -> bool:
        """Carry out an operator's action; return True if it changed anything."""
        if action == OperatorAction.EMERGENCY_STOP:
            self.referee.count("emergency-stops")
            self._e_stopped = True
            self._break_off(None, now)
            return True
        if action == OperatorAction.RESET and self._servo.phase is not ServoPhase.STOPPING:
            self.referee.count("resets")
            self._e_stopped = False
            self._error = ErrorCode.NONE
            return True
        return False

    def _say(self, link: int, message: Message | None) -> None:
        if message is not None:
            self._out.append((link, message))

    def _flush_out(self) -> Outgoing:
        out, self._out = self._out, []
        return out
