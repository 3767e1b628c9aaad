"""The order of a trajectory's points: what each sequence number means when it arrives.

Owns the sequence rule (REP-I0006: next, or 0 for a new one), the special sequences, and the memory
of the last accepted point, which a client repeats when it missed the reply. Knows no motion.
"""

from __future__ import annotations

from enum import Enum

from openpendant.simplemsg import JointTrajPt, JointTrajPtFull, SpecialSequence, TrajPoint

WirePoint = JointTrajPt | JointTrajPtFull

_STARTS = (0, SpecialSequence.START_DOWNLOAD, SpecialSequence.START_STREAMING)


class PointKind(Enum):
    """Place of a received point in the trajectory."""

    START = "the first point of a new trajectory"
    NEXT = "the point after the last one"
    END = "the last point, as the client says"
    DUPLICATE = "the last accepted point once more"
    STALE = "a rest of a trajectory that was broken off"
    OUT_OF_ORDER = "neither the next point nor a first one"


class PointSequence:
    """The trajectory that is being received.

    Attributes:
        is_download: points are collected until the client says END.
        elapsed: time of the last accepted point, from the start of the trajectory [ns].
    """

    def __init__(self, *, is_strict: bool) -> None:
        """Make a controller's memory, in which no trajectory is open.

        Args:
            is_strict: a gap in the sequence is a fault; else points are taken in order of arrival.
        """
        self.is_download = False
        self.elapsed = 0
        self._is_strict = is_strict
        self._is_open = False
        self._was_broken_off = False
        self._expected = 0
        self._last: WirePoint | None = None

    def classify(self, message: WirePoint) -> PointKind:
        """Return what a point is; nothing changes."""
        sequence = message.sequence
        last = self._last
        # The numbers are compared first: most messages differ in them.
        if last is not None and sequence == last.sequence and message == last:
            return PointKind.DUPLICATE
        if sequence in _STARTS:
            return PointKind.START
        if self._is_open:
            if sequence == SpecialSequence.END:
                return PointKind.END
            if sequence == self._expected or (sequence > 0 and not self._is_strict):
                return PointKind.NEXT
        elif sequence > 0 and not self._is_strict:
            return PointKind.START
        return PointKind.STALE if self._was_broken_off else PointKind.OUT_OF_ORDER

    def repeats_only_point(self, message: WirePoint | TrajPoint) -> bool:
        """Return True if an END repeats the START of a one-point download.

        industrial_core sends a trajectory of one point in this form.
        """
        last = self._last
        return (
            isinstance(last, JointTrajPt)
            and isinstance(message, JointTrajPt)
            and last.sequence == SpecialSequence.START_DOWNLOAD
            and last.joints == message.joints
        )

    def accept(self, message: WirePoint, step: PointKind, elapsed: int) -> None:
        """Note an accepted point.

        Args:
            message: the point.
            step: what `classify` said of it.
            elapsed: its time from the start of the trajectory [ns].
        """
        if step is PointKind.START:
            self.is_download = message.sequence == SpecialSequence.START_DOWNLOAD
            self._was_broken_off = False
        self._is_open = step is not PointKind.END
        self._expected = max(message.sequence, 0) + 1
        self._last = message
        self.elapsed = elapsed

    def replace_by_whole(self) -> None:
        """Forget the trajectory for one that came in a single message."""
        self.finish()
        self._last = None
        self._was_broken_off = False

    def finish(self) -> None:
        """End the trajectory in good order."""
        self._is_open = False
        self.is_download = False

    def break_off(self) -> None:
        """Forget the trajectory; points of it that still arrive are stale."""
        self.finish()
        self._last = None
        self._was_broken_off = True
