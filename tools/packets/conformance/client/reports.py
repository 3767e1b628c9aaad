"""History of the controller's reports: the state that the client had to know at each time.

Owns the look back in time over a trace's state messages. Judges nothing.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable
from dataclasses import dataclass

from openpendant.simplemsg import JointFeedback, JointPosition, Status, ValidField
from openpendant.simplemsg.motoman import MotomanJointFeedbackEx

from .trace import ClientTrace

LOOK_BACK_NS = 300_000_000
"""A client may act on a report that is this old: it takes a moment to read and to plan."""


@dataclass(frozen=True, slots=True)
class JointReport:
    """Reported position of one group.

    Attributes:
        time: when the server sent it [ns].
        group: robot or group number.
        positions: (10,) [rad or m].
    """

    time: int
    group: int
    positions: tuple[float, ...]


class ReportHistory:
    """The state messages of a trace, oldest first.

    Attributes:
        joints: joint reports.
        status: status reports with their times [ns].
    """

    def __init__(self, trace: ClientTrace) -> None:
        """Collect them from whatever port carried them."""
        self.joints: list[JointReport] = []
        self.status: list[tuple[int, Status]] = []
        self._ended = trace.ended + 1
        for frame in trace.from_controller():
            match frame.message:
                case JointPosition(joints=joints):
                    self.joints.append(JointReport(frame.time, 0, joints))
                case JointFeedback(robot_id=group, valid_fields=valid, positions=positions):
                    if valid & ValidField.POSITION:
                        self.joints.append(JointReport(frame.time, group, positions))
                case MotomanJointFeedbackEx(groups=groups):
                    self.joints += [
                        JointReport(frame.time, group.robot_id, group.positions)
                        for group in groups
                        if group.valid_fields & ValidField.POSITION
                    ]
                case Status():
                    self.status.append((frame.time, frame.message))

    def status_at(self, time: int) -> Status | None:
        """Return the last status that was sent by a time; None before the first."""
        index = bisect_right(self.status, time, key=lambda entry: entry[0])
        return self.status[index - 1][1] if index else None

    def spells(self, holds: Callable[[Status], bool]) -> list[tuple[int, int]]:
        """Return from when to when a condition was reported to hold [ns].

        The end is the first report to the contrary; the end of the trace where there is none.
        """
        found: list[tuple[int, int]] = []
        began: int | None = None
        for time, status in self.status:
            if holds(status):
                began = time if began is None else began
            elif began is not None:
                found.append((began, time))
                began = None
        return found if began is None else [*found, (began, self._ended)]

    def last_joints(self, time: int) -> JointReport | None:
        """Return the last joint report that was sent by a time; None before the first."""
        index = bisect_right(self.joints, time, key=lambda report: report.time)
        return self.joints[index - 1] if index else None

    def places(self, time: int, group: int) -> list[tuple[float, ...]]:
        """Return where a client may believe that a group stands at a time.

        The last report, and those shortly before: the client may have started from any of them.
        """
        index = bisect_right(self.joints, time, key=lambda report: report.time)
        own = [report for report in self.joints[:index] if report.group == group]
        if not own:
            return []
        recent = [report for report in own if time - report.time <= LOOK_BACK_NS] or own[-1:]
        return [report.positions for report in recent]
