"""Who commands the motion, and which points are taken of them.

Owns that one link commands at a time, what a point may do at its place in the trajectory, and that
the buffer has room for it. Answers nobody and ends no motion: a point that may not be taken is
handed back, and the controller does the rest.
"""

from __future__ import annotations

from enum import Enum

from openpendant.simplemsg import (
    CommType,
    JointTraj,
    JointTrajPt,
    JointTrajPtFull,
    SpecialSequence,
)

from .admission import Admission
from .faults import ErrorCode, Refusal, ViolationKind
from .intake import Admitted, Rejected, admit
from .referee import Referee
from .servo import Phase, Servo
from .trajectory import Step, Trajectory

PointMessage = JointTrajPt | JointTrajPtFull | JointTraj


class Outcome(Enum):
    """What became of a message with points."""

    TAKEN = "taken"
    BEGAN = "taken, and they begin a trajectory"
    REFUSED = "refused; the motion goes on"
    WAITS = "to be offered again later"


class PointTaking:
    """The way of points into the servo.

    Attributes:
        owner: the link that commands the motion; None where anybody may begin one.
    """

    def __init__(
        self, admission: Admission, servo: Servo, referee: Referee, *, is_strict: bool
    ) -> None:
        """Take points of whoever sends the first.

        Args:
            admission: the checks, with the robot's limits.
            servo: what executes them.
            referee: counts them.
            is_strict: a gap in the sequence is a fault.
        """
        self.owner: int | None = None
        self._admission = admission
        self._servo = servo
        self._referee = referee
        self._trajectory = Trajectory(is_strict=is_strict)

    @property
    def is_download(self) -> bool:
        """Whether points are collected until the client says END."""
        return self._trajectory.is_download

    def break_off(self) -> None:
        """Forget the trajectory and who commanded it."""
        self._trajectory.break_off()
        self.owner = None

    def take(
        self, link: int, message: PointMessage, now: int, *, is_behind: bool
    ) -> Outcome | Rejected:
        """Take points if whoever sends them may command, they are the next ones, and there is room.

        Args:
            link: where they came from.
            message: one point or a whole trajectory.
            now: the time [ns].
            is_behind: others of this link wait already.

        Returns:
            What became of them; `Rejected` where the motion is to be broken off because of them.
        """
        step = Step.START if isinstance(message, JointTraj) else self._trajectory.classify(message)
        if not self._may_command(link, step):
            return Outcome.REFUSED
        if is_behind:
            return Outcome.WAITS
        match step:
            case Step.DUPLICATE:
                self.owner = link
                return Outcome.TAKEN
            case Step.STALE:
                return Outcome.REFUSED
            case Step.OUT_OF_ORDER:
                assert not isinstance(message, JointTraj)
                refusal = Refusal(ErrorCode.SEQUENCE, ViolationKind.SEQUENCE)
                return Rejected(message.sequence, refusal)
        if step is Step.START:
            if _is_download(message) or self.is_download:
                # A download replaces whatever there is, and is replaced by whatever comes.
                self._servo.stop(now)
            if self._servo.phase is Phase.STOPPING:
                return Outcome.WAITS
        return self._take_step(link, message, step, now)

    def _may_command(self, link: int, step: Step) -> bool:
        if self.owner is None or link == self.owner:
            return True
        return step is Step.START and self._servo.at_rest

    def _take_step(
        self, link: int, message: PointMessage, step: Step, now: int
    ) -> Outcome | Rejected:
        points = message.points if isinstance(message, JointTraj) else (message,)
        is_download = self.is_download and step is not Step.START
        if step is Step.END and is_download and self._trajectory.repeats_only_point(points[0]):
            points = ()
        buffer = self._servo.buffer
        if len(points) > buffer.room:
            waiting_helps = len(points) <= buffer.depth and not is_download
            if waiting_helps and message.comm_type == CommType.REQUEST:
                return Outcome.WAITS
            return Rejected(points[0].sequence, Refusal(ErrorCode.BUFFER_OVERFLOW))
        if step is Step.START:
            buffer.close()
        elapsed = None if step is Step.START else self._trajectory.elapsed
        admitted = admit(self._admission, points, self._servo.tail(), elapsed)
        if isinstance(admitted, Rejected):
            return admitted
        self._accept(link, message, step, admitted, now)
        if isinstance(message, JointTraj) or step is Step.END:
            self._servo.go(now)
            self._trajectory.finish()
        return Outcome.BEGAN if step is Step.START else Outcome.TAKEN

    def _accept(
        self, link: int, message: PointMessage, step: Step, admitted: Admitted, now: int
    ) -> None:
        self.owner = link
        if step is Step.START:
            self._referee.count("trajectories")
        if isinstance(message, JointTraj):
            self._trajectory.replace_by_whole()
        else:
            self._trajectory.accept(message, step, admitted.elapsed)
        is_streamed = not self.is_download and not isinstance(message, JointTraj)
        for leg in admitted.legs:
            self._servo.append(leg, now, streamed=is_streamed)
        self._referee.count("points-accepted", len(admitted.legs))
        self._referee.count("stray-joint-values", admitted.strays)


def _is_download(message: PointMessage) -> bool:
    return not isinstance(message, JointTraj) and message.sequence == SpecialSequence.START_DOWNLOAD
