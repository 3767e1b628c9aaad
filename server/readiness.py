"""What must hold before a robot moves: the conditions, in the order in which they are examined.

Owns the chain and its order. `RobotCell` asks for the first condition that is broken; the question
"why is it not moving?" is answered with all of them, and with the scene, which a motion is held to
by its planner. Decides nothing else and changes nothing.
"""

from __future__ import annotations

from collections.abc import Iterator
from enum import Enum
from typing import NamedTuple, Protocol

from openpendant.motion.limits import JointLimits
from openpendant.simplemsg import ControllerMode
from openpendant.simplemsg.pendant import Activity, LinkState, OperatingMode
from openpendant.simplemsg.verdicts import VerdictCode

from .authority import Authority, Holder
from .driving.feedback import Feedback
from .news import LatchedStop
from .operating_mode import MotionKind, OperatingModes
from .playback.running_program import RunningProgram
from .refusal import Refusal

_AT_LIMIT = 1e-3
"""Reports are rounded to four bytes, and a joint at rest on its limit may overshoot a hair."""


class Condition(Enum):
    """One link of the chain, named as an operator would."""

    AUTHORITY = "whoever wants to move it has the motion authority"
    PROGRAM = "no program is under way"
    SERVER = "the server is not going down"
    STOP = "no stop is latched"
    LINK = "the controller is connected"
    FEEDBACK = "the controller reports positions, freshly"
    STANDING = "nothing else moves or is planned"
    CONTROLLER = "the controller can move"
    MODE = "the mode of operation allows it"
    ENABLING = "the enabling device (training) is held where the mode asks for it"
    LIMITS = "every joint is inside its limits"
    SCENE = "the robot touches nothing of itself or of its scene"


class Finding(NamedTuple):
    """One condition and why it is broken; None where it holds."""

    condition: Condition
    refusal: Refusal | None


class Situation(Protocol):
    """What the conditions look at; a `RobotCell`."""

    authority: Authority
    feedback: Feedback
    limits: JointLimits
    modes: OperatingModes
    stop: LatchedStop | None
    program: RunningProgram | None

    @property
    def activity(self) -> Activity:
        """What the cell is doing."""

    @property
    def mode(self) -> ControllerMode:
        """The controller's own mode."""

    @property
    def is_busy(self) -> bool:
        """Whether a motion of ours is under way or being stopped."""

    @property
    def is_closing(self) -> bool:
        """Whether the server is going down."""

    def link_state(self, now: int) -> LinkState:
        """Return the state of the controller connection."""


def examine(
    cell: Situation,
    kind: MotionKind,
    session: int,
    now: int,
    *,
    planned: bool = False,
    steered: bool = False,
) -> Iterator[Finding]:
    """Yield every condition for a motion of a connection, in order, but for that of the scene.

    Args:
        cell: the cell.
        kind: what the motion is for.
        session: who wants it.
        now: monotonic time, ns.
        planned: the motion is the one that is being planned, which is then no obstacle.
        steered: the motion is the jog that is driven, which is then no obstacle either.
    """
    yield Finding(Condition.AUTHORITY, permission(cell.authority, session, now))
    yield Finding(Condition.PROGRAM, _program_fault(cell.program, kind))
    for finding in examine_cell(cell, now, planned=planned):
        if not (steered and finding.condition is Condition.STANDING):
            yield finding
    modes, controller = cell.modes, cell.mode
    yield Finding(Condition.MODE, modes.forbids(kind, controller))
    yield Finding(Condition.ENABLING, modes.not_enabled(session, controller, now))
    yield Finding(Condition.LIMITS, None if _recovers(cell, kind) else outside_limits(cell))


def _program_fault(program: RunningProgram | None, kind: MotionKind) -> Refusal | None:
    """Return why nothing but a program may move the robot; paused, it is still under way."""
    if program is None or kind is MotionKind.PROGRAM:
        return None
    text = f"program {program.name!r} is under way at line {program.line}"
    return Refusal(VerdictCode.PROGRAM_RUNNING, text)


def _recovers(cell: Situation, kind: MotionKind) -> bool:
    """Tell whether a motion may start outside the limits: a jog that leads back inside.

    A controller with its own selector has no recovery mode of ours, so any jog may there.
    """
    if kind is not MotionKind.JOG:
        return False
    return not cell.modes.is_ours or cell.modes.mode(cell.mode) is OperatingMode.RECOVERY


def examine_cell(cell: Situation, now: int, *, planned: bool = False) -> Iterator[Finding]:
    """Yield the conditions that are the same whoever asks."""
    closing = Refusal(VerdictCode.SHUTTING_DOWN) if cell.is_closing else None
    yield Finding(Condition.SERVER, closing)
    yield Finding(Condition.STOP, None if cell.stop is None else stop_refusal(cell.stop))
    down = cell.link_state(now) is LinkState.DOWN
    yield Finding(Condition.LINK, Refusal(VerdictCode.CONTROLLER_DOWN) if down else None)
    yield Finding(Condition.FEEDBACK, _feedback_fault(cell.feedback, now))
    yield Finding(Condition.STANDING, _activity_fault(cell, planned=planned))
    yield Finding(Condition.CONTROLLER, _controller_fault(cell.feedback))


def permission(authority: Authority, session: int, now: int) -> Refusal | None:
    """Return why a connection may not move the robot, as far as the authority goes."""
    holder = authority.holder
    if holder is None or authority.is_overdue(now):
        return Refusal(VerdictCode.NOT_IN_CONTROL)
    return None if holder.session == session else held_by(holder)


def held_by(holder: Holder) -> Refusal:
    """Return the refusal that names who is in control."""
    return Refusal(VerdictCode.HELD_BY_OTHER, f"{holder.name} is in control")


def stop_refusal(stop: LatchedStop) -> Refusal:
    """Return the refusal that a latched stop is."""
    if stop.is_protective:
        return Refusal(VerdictCode.PROTECTIVE_STOP, f"protective stop: {stop.reason}")
    return Refusal(VerdictCode.STOP_LATCHED, f"software stop by {stop.by.name}: {stop.reason}")


def _feedback_fault(feedback: Feedback, now: int) -> Refusal | None:
    if feedback.broken:
        return Refusal(VerdictCode.NOT_FINITE, "the controller reports a position that is none")
    if feedback.is_fresh(now):
        return None
    age = feedback.age(now)
    text = "" if age is None else f"the last position report is {age / 1e6:.0f} ms old"
    return Refusal(VerdictCode.FEEDBACK_STALE, text)


def _activity_fault(cell: Situation, *, planned: bool) -> Refusal | None:
    if cell.activity in (Activity.PAUSED, Activity.PAUSING):
        return Refusal(VerdictCode.PAUSED)
    if cell.is_busy or not cell.feedback.is_standing:
        return Refusal(VerdictCode.MOVING)
    if cell.activity is Activity.PLANNING and not planned:
        return Refusal(VerdictCode.PLANNING)
    return None


def _controller_fault(feedback: Feedback) -> Refusal | None:
    if not feedback.complaint:
        return None
    text = f"the controller cannot move: {feedback.complaint}"
    return Refusal(VerdictCode.CONTROLLER_NOT_READY, text)


def outside_limits(cell: Situation) -> Refusal | None:
    """Return which joint is reported outside its limits; None where none is."""
    for joint, value in enumerate(cell.feedback.position or ()):
        lower, upper = cell.limits.lower[joint], cell.limits.upper[joint]
        if not lower - _AT_LIMIT <= value <= upper + _AT_LIMIT:
            bound = lower if value < lower else upper
            text = f"joint {joint + 1} stands at {value:.6f}, outside its limit {bound:g}"
            return Refusal(VerdictCode.OUTSIDE_LIMITS, text, joint, value, bound)
    return None
