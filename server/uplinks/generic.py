"""The generic controller: streamed points of type 14 or 11, stop by sequence -4.

Owns how a set-point is written for such a controller and what its answers mean. One point is under
way at a time unless the link allows more, because many controllers cannot take a second before they
answered the first. With one, no more leave in a second than answers can come back.

Residual motion after a stop: none beyond the controller's own deceleration ramp, because STOP
empties its buffer. A controller that cannot pause holds at most `lead` seconds of points.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence

from openpendant.motion.trajectory.trajectory import Row
from openpendant.simplemsg import (
    JointTrajPt,
    JointTrajPtFull,
    Message,
    MsgType,
    ReplyCode,
    SpecialSequence,
    ValidField,
    accepted,
    joint_array,
    message_type,
)
from openpendant.simplemsg.verdicts import VerdictCode

from ..refusal import Refusal
from ..settings.cell_settings import ControllerLink
from .declaration import Declaration, Feeding, FreezeProtection, JogSupport, PauseSupport
from .uplink import ControllerDialect

DEFAULT_SPEED_RATIO = 0.1
"""Speed ratio of a point of rest; what the stock client sends, since 0 means "none given"."""

_NO_JOINTS = joint_array(())
_STOP = JointTrajPt(sequence=SpecialSequence.STOP, joints=_NO_JOINTS, velocity=0.0, duration=0.0)


_ALL_FIELDS, _SUCCESS = ValidField.ALL, ReplyCode.SUCCESS

_START_TOLERANCE = 0.01

_STOP_DEADLINE_NS = 2_000_000_000
"""A STOP may be answered as late as the robot stands; after this nobody is there."""


class GenericUplink:
    """Writes set-points and reads answers of a generic controller."""

    def __init__(self, link: ControllerLink, velocity_limits: Sequence[float]) -> None:
        """Make an uplink with nothing under way.

        Args:
            velocity_limits: (n,) largest joint speeds, for the speed ratio of type 11.
        """
        self._full = link.points == "full"
        self._deadline_ns = round(link.reply_deadline * 1e9)
        self._velocity_limits = tuple(velocity_limits)
        self._padding = _NO_JOINTS[len(self._velocity_limits) :]
        self._reply_types = (
            {MsgType.JOINT_TRAJ_PT_FULL}
            if self._full
            else {MsgType.JOINT_TRAJ_PT, MsgType.JOINT_POSITION}
        )
        self._most_unanswered = link.points_in_flight
        self._deadlines: deque[int] = deque()  # of the answers to points, the oldest first
        self.stop_deadline: int | None = None

    @property
    def awaiting(self) -> bool:
        """Whether a point was sent and not answered yet."""
        return bool(self._deadlines)

    @property
    def is_full(self) -> bool:
        """Whether the next point has to wait for an answer."""
        return len(self._deadlines) >= self._most_unanswered

    def point(self, number: int, row: Row, step: float, now: int) -> Message:
        """Return the message for a set-point, and expect its answer."""
        self._deadlines.append(now + self._deadline_ns)
        if self._full:
            padding = self._padding
            # By their order, which is that of the frame: by names they take twice as long.
            return JointTrajPtFull(
                0,
                number,
                _ALL_FIELDS,
                row.time,
                (*row.position, *padding),
                (*row.velocity, *padding),
                (*row.acceleration, *padding),
            )
        ratio = max(
            abs(speed) / limit
            for speed, limit in zip(row.velocity, self._velocity_limits, strict=True)
        )
        return JointTrajPt(
            sequence=number,
            joints=joint_array(row.position),
            velocity=min(ratio, 1.0) or DEFAULT_SPEED_RATIO,
            duration=step,
        )

    def stop(self, now: int, *, is_sent: bool) -> Message:
        """Return the message that stops the robot and empties the controller's buffer."""
        self._deadlines.clear()
        if is_sent and self.stop_deadline is None:
            self.stop_deadline = now + _STOP_DEADLINE_NS
        return _STOP

    def answer(self, reply: Message, pending: int) -> Refusal | None:
        """Judge an answer on the motion link."""
        outstanding = len(self._deadlines)
        if pending <= outstanding:
            # Nothing that was sent before the points that count is owed any more.
            self.stop_deadline = None
        if pending >= outstanding:
            # Answers come in order: while that many more are owed, this one belongs to what was
            # sent before the points that count.
            return None
        self._deadlines.popleft()
        number = message_type(reply)
        if number not in self._reply_types:
            return Refusal(
                VerdictCode.CONTROLLER_MISMATCH,
                f"the controller answered a point with a message of type {number}",
            )
        if reply.reply_code != _SUCCESS:
            return Refusal(
                VerdictCode.CONTROLLER_REFUSED,
                f"the controller answered a point with reply code {int(reply.reply_code)}",
            )
        return None

    def overdue(self, now: int) -> Refusal | None:
        """Return a refusal if the answer to a point has been outstanding for too long."""
        if not self._deadlines or now < self._deadlines[0]:
            return None
        self._deadlines.clear()
        return Refusal(
            VerdictCode.CONTROLLER_SILENT,
            f"the controller has not answered a point for {self._deadline_ns / 1e9:g} s",
        )

    def stop_overdue(self, now: int) -> bool:
        """Tell, once, whether a STOP was not answered: then the link is dead, or the peer is."""
        if self.stop_deadline is None or now < self.stop_deadline:
            return False
        self.stop_deadline = None
        return True

    def lost(self) -> None:
        """Forget what was under way, because the motion link is gone."""
        self._deadlines.clear()
        self.stop_deadline = None


def generic_declaration(link: ControllerLink) -> Declaration:
    """Return what a generic controller can do: it streams, and has nothing to be prepared."""
    second_stop = link.stop_connection
    return Declaration(
        dialect="generic",
        feeding=Feeding.STREAM,
        jog=JogSupport.CONTINUOUS,
        pause=PauseSupport.PATH,
        override="live",
        points=int(MsgType.JOINT_TRAJ_PT_FULL if link.points == "full" else MsgType.JOINT_TRAJ_PT),
        in_flight=link.points_in_flight,
        most_points=None,
        lead=link.planned_lead,
        interpolation="as sent",
        path_tolerance=0.0,
        angle_tolerance=0.0,
        speed_enforced_by="server",
        second_stop=second_stop,
        link_loss_stops=True,
        residual_delay=0.0,
        blind_delay=link.planned_lead,
        following="due",
        state_period=link.state_period,
        fresh_age=link.fresh_age_ns / 1e9,
        abort_age=link.abort_age_ns / 1e9,
        identify=("slots", "limits"),
        start_tolerance=_START_TOLERANCE,
        signals=link.signals,
        reply_deadlines={
            "point": link.reply_deadline,
            "stop": _STOP_DEADLINE_NS / 1e9,
            "motion": link.reply_deadline,
        },
        freeze_protection=FreezeProtection.SECOND_CONNECTION
        if second_stop
        else FreezeProtection.NONE,
    )


GENERIC = ControllerDialect(
    GenericUplink, stop=_STOP, stopped=accepted(_STOP), declared=generic_declaration
)
