"""Intake of points: who commands the motion, and which points are taken of them.

Owns that one link commands at a time, what a point may do at its place in the trajectory, that the
buffer has room for it, and the running state from point to point within a message. A message of
many points is taken entirely or not at all. Answers nobody and ends no motion: a point that may not
be taken is handed back, and the controller does the rest.
"""

from __future__ import annotations

from collections.abc import Sequence
from enum import Enum
from typing import NamedTuple

from openpendant.simplemsg import (
    CommType,
    JointTraj,
    JointTrajPt,
    JointTrajPtFull,
    SpecialSequence,
    TrajPoint,
)

from ..error_codes import ErrorCode, PointRefusal, ViolationKind
from ..interpolation.legs import Knot, MotionLeg
from ..interpolation.servo import Servo, ServoPhase
from .admission import Admission
from .points import PointKind, PointSequence, read_point
from .referee import Referee


class Admitted(NamedTuple):
    """Points that may all be buffered.

    Attributes:
        legs: the way to each point.
        elapsed: time of the last point, from the start of the trajectory [ns].
        strays: points with values beyond the robot's joints.
    """

    legs: tuple[MotionLeg, ...]
    elapsed: int
    strays: int


class Rejected(NamedTuple):
    """A point that may not be taken."""

    sequence: int
    refusal: PointRefusal


def admit(
    admission: Admission,
    points: Sequence[JointTrajPt | JointTrajPtFull | TrajPoint],
    tail: Knot,
    elapsed: int | None,
) -> Admitted | Rejected:
    """Check points one after the other.

    Args:
        tail: state that the motion has before them.
        elapsed: time of the point before, from the start of the trajectory [ns]; None if these
            points start one.
    """
    legs: list[MotionLeg] = []
    strays = 0
    for wire in points:
        point = read_point(wire, admission.limits.dof)
        if isinstance(point, PointRefusal):
            return Rejected(wire.sequence, point)
        if elapsed is None:
            leg = admission.first(point, tail)
        else:
            leg = admission.next(point, tail, elapsed)
        if isinstance(leg, PointRefusal):
            return Rejected(wire.sequence, leg)
        elapsed = (elapsed or 0) + point.duration if point.time is None else point.time
        tail = leg.end
        strays += point.has_stray_joints
        legs.append(leg)
    return Admitted(tuple(legs), elapsed or 0, strays)


PointMessage = JointTrajPt | JointTrajPtFull | JointTraj


class IntakeOutcome(Enum):
    """Outcome of a message with points."""

    TAKEN = "taken"
    BEGAN = "taken, and they begin a trajectory"
    REFUSED = "refused; the motion goes on"
    WAITS = "to be offered again later"


class PointIntake:
    """Intake of points into the servo.

    Attributes:
        owner: the link that commands the motion; None while any link may start one.
    """

    def __init__(
        self, admission: Admission, servo: Servo, referee: Referee, *, is_strict: bool
    ) -> None:
        """Take points of whoever sends the first."""
        self.owner: int | None = None
        self._admission = admission
        self._servo = servo
        self._referee = referee
        self._trajectory = PointSequence(is_strict=is_strict)

    @property
    def is_download(self) -> bool:
        """True while points are collected until the client sends END."""
        return self._trajectory.is_download

    def break_off(self) -> None:
        """Forget the trajectory and who commanded it."""
        self._trajectory.break_off()
        self.owner = None

    def take(
        self, link: int, message: PointMessage, now: int, *, is_behind: bool
    ) -> IntakeOutcome | Rejected:
        """Take points if their sender may command, they are the next ones, and there is room."""
        step = (
            PointKind.START
            if isinstance(message, JointTraj)
            else self._trajectory.classify(message)
        )
        if not self._may_command(link, step):
            return IntakeOutcome.REFUSED
        if is_behind:
            return IntakeOutcome.WAITS
        match step:
            case PointKind.DUPLICATE:
                self.owner = link
                return IntakeOutcome.TAKEN
            case PointKind.STALE:
                return IntakeOutcome.REFUSED
            case PointKind.OUT_OF_ORDER:
                assert not isinstance(message, JointTraj)
                refusal = PointRefusal(ErrorCode.SEQUENCE, ViolationKind.SEQUENCE)
                return Rejected(message.sequence, refusal)
        if step is PointKind.START:
            if _is_download(message) or self.is_download:
                # A download replaces any trajectory, and any trajectory replaces it.
                self._servo.stop(now)
            if self._servo.phase is ServoPhase.STOPPING:
                return IntakeOutcome.WAITS
        return self._take_step(link, message, step, now)

    def _may_command(self, link: int, step: PointKind) -> bool:
        if self.owner is None or link == self.owner:
            return True
        return step is PointKind.START and self._servo.at_rest

    def _take_step(
        self, link: int, message: PointMessage, step: PointKind, now: int
    ) -> IntakeOutcome | Rejected:
        points = message.points if isinstance(message, JointTraj) else (message,)
        is_download = self.is_download and step is not PointKind.START
        if step is PointKind.END and is_download and self._trajectory.repeats_only_point(points[0]):
            points = ()
        buffer = self._servo.buffer
        if len(points) > buffer.room:
            waiting_helps = len(points) <= buffer.depth and not is_download
            if waiting_helps and message.comm_type == CommType.REQUEST:
                return IntakeOutcome.WAITS
            return Rejected(points[0].sequence, PointRefusal(ErrorCode.BUFFER_OVERFLOW))
        if step is PointKind.START:
            buffer.close()
        elapsed = None if step is PointKind.START else self._trajectory.elapsed
        admitted = admit(self._admission, points, self._servo.tail(), elapsed)
        if isinstance(admitted, Rejected):
            return admitted
        self._accept(link, message, step, admitted, now)
        if isinstance(message, JointTraj) or step is PointKind.END:
            self._servo.go(now)
            self._trajectory.finish()
        return IntakeOutcome.BEGAN if step is PointKind.START else IntakeOutcome.TAKEN

    def _accept(
        self, link: int, message: PointMessage, step: PointKind, admitted: Admitted, now: int
    ) -> None:
        self.owner = link
        if step is PointKind.START:
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
