"""What the controller reports after which nothing may go on by itself.

Owns these rules, and their words: one for each status that comes, so that a fault which is gone
before the next tick is not missed, and one for what holds now. They are the same for what moves and
for what waits to move, such as a program in a wait.
"""

from __future__ import annotations

from typing import NamedTuple

from openpendant.simplemsg import ControllerMode
from openpendant.simplemsg.verdicts import VerdictCode

from ...refusal import Refusal
from ...uplinks.uplink import error_text
from .feedback import Feedback


class Shown(NamedTuple):
    """What of a status may end what is under way.

    Attributes:
        mode: the controller's own mode.
        fault: its emergency stop or the loss of drive power, in words; empty for neither.
        error: the error that it shows; 0 for none.
    """

    mode: ControllerMode
    fault: str
    error: int


def shown(feedback: Feedback) -> Shown:
    """Return what the controller shows."""
    return Shown(feedback.mode, feedback.fault, feedback.error)


def interruption(before: Shown, after: Shown) -> Refusal | None:
    """Return why a status ends what is under way; None where it shows nothing new.

    Args:
        before: what the controller showed until then.
        after: what it shows now.
    """
    if after.fault and after.fault != before.fault:
        return Refusal(VerdictCode.CONTROLLER_STOPPED, after.fault)
    if after.mode is not before.mode:
        text = f"the controller's mode changed from {before.mode.name} to {after.mode.name}".lower()
        return Refusal(VerdictCode.CONTROLLER_STOPPED, text)
    # Some controllers show their last error until the next trajectory.
    if after.error and after.error != before.error:
        text = f"the controller went into {error_text(after.error)}"
        return Refusal(VerdictCode.CONTROLLER_STOPPED, text)
    return None


def lost(feedback: Feedback, now: int) -> Refusal | None:
    """Return why nothing may go on by what is known of the robot now; None where it may.

    Args:
        feedback: what the controller said last.
        now: monotonic time, ns.
    """
    if feedback.is_lost(now):
        age = feedback.age(now)
        seen = "never" if age is None else f"{age / 1e6:.0f} ms ago"
        return Refusal(VerdictCode.FEEDBACK_STALE, f"the last position report came {seen}")
    if feedback.broken:
        return Refusal(VerdictCode.NOT_FINITE, "the controller reports a position that is none")
    fault = feedback.fault
    return Refusal(VerdictCode.CONTROLLER_STOPPED, fault) if fault else None
