"""Where the robot stands, for what is taught there: a point of a program, a named position."""

from __future__ import annotations

from openpendant.simplemsg.pendant import Activity
from openpendant.simplemsg.verdicts import VerdictCode

from ..refusal import Refusal
from .robot_cell import RobotCell


def standing_at(cell: RobotCell, what: str, now: int) -> tuple[float, ...] | Refusal:
    """Return where the robot stands, (n,) joints [rad or m], or why nothing can be taught now.

    Args:
        what: is taught, for the refusal.
    """
    feedback = cell.feedback
    if feedback.position is None or not feedback.is_fresh(now):
        return Refusal(VerdictCode.FEEDBACK_STALE)
    # Some controllers report a motion as long as they are sent points, even equal ones.
    is_paused = cell.driving.activity is Activity.PAUSED
    if not (feedback.joints_rest if is_paused else feedback.is_standing and not cell.is_busy):
        return Refusal(VerdictCode.MOVING, f"{what} is taught while the robot stands")
    return tuple(feedback.position)
