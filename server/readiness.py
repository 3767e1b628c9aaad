"""What must hold before a robot moves: the conditions, in the order in which they are mended.

Owns the chain and its order: to mend one breaks none before it. A reset and a change of mode demand
that enabling devices are pressed anew, and a joint outside its limits comes back in a mode of its
own; so limits, mode, stop and enabling come in that order. `RobotCell` asks for the first condition
that is broken; the question "why is it not moving?" is answered with all of them. Two of them are
found elsewhere and handed in for that answer: a role is asked for before a request gets here, and a
motion is held to the scene by its planner. Decides nothing else and changes nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from enum import Enum
from typing import TYPE_CHECKING, NamedTuple, Protocol

from openpendant.motion.limits import JointLimits
from openpendant.simplemsg import ControllerMode
from openpendant.simplemsg.pendant import Activity, LinkState, OperatingMode, ProgramState
from openpendant.simplemsg.verdicts import VerdictCode

from .authority import Authority, Holder
from .driving.feedback import Feedback
from .news import LatchedStop
from .operating_mode import MotionKind, OperatingModes
from .playback.running_program import RunningProgram
from .refusal import Refusal

if TYPE_CHECKING:
    from .cell_motions import CellMotions

PASSING = (VerdictCode.MOVING, VerdictCode.PLANNING, VerdictCode.CHANGE_WHILE_MOVING)
"""Obstacles that end by themselves, so that a face that keeps what was sent may wait for it."""

_AT_LIMIT = 1e-3
"""Reports are rounded to four bytes, and a joint at rest on its limit may overshoot a hair."""


class Condition(Enum):
    """One link of the chain, named as an operator would."""

    SERVER = "the server is not going down"
    LINK = "the controller is connected"
    FEEDBACK = "the controller reports positions, freshly"
    ROLE = "whoever wants to move it is logged in where that is asked for, with a role that may"
    AUTHORITY = "whoever wants to move it has the motion authority"
    LIMITS = "every joint is inside its limits"
    MODE = "the mode of operation allows it"
    STOP = "no stop is latched"
    ENABLING = "the enabling device (training) is held where the mode asks for it"
    CONTROLLER = "the controller can move"
    OVERRIDE = "the speed override is above 0"
    SCENE = "frames, tools and scene are in force, and the robot touches nothing"
    PROGRAM = "no program is under way"
    STANDING = "nothing else moves or is planned, and frames and tools do not change"


class Finding(NamedTuple):
    """One condition and why it is broken; None where it holds."""

    condition: Condition
    refusal: Refusal | None


class Asked(NamedTuple):
    """What is found elsewhere, for the whole answer; a motion that begins has passed the role.

    Attributes:
        role: returns why the role of a connection does not let it move the robot.
        contact: returns what the robot touches where it stands; asked last, because it takes long.
    """

    role: Callable[[int], Refusal | None]
    contact: Callable[[], Refusal | None]


class Situation(Protocol):
    """What the conditions look at; a `RobotCell`."""

    authority: Authority
    feedback: Feedback
    limits: JointLimits
    modes: OperatingModes
    motions: CellMotions
    stop: LatchedStop | None
    program: RunningProgram | None
    awaited: str
    unread: str

    @property
    def motion_activity(self) -> Activity:
        """What is done with a motion of ours; IDLE between those of a program."""

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
    asked: Asked | None = None,
) -> Iterator[Finding]:
    """Yield every condition for a motion of a connection, in order.

    Args:
        cell: the cell.
        kind: what the motion is for.
        session: who wants it.
        now: monotonic time, ns.
        planned: the motion is the one that is being planned, which is then no obstacle.
        steered: the motion is the jog that is driven, which is then no obstacle either.
        asked: what is found elsewhere; None to look at the cell alone.
    """
    modes, controller = cell.modes, cell.mode
    recovers = _recovers(cell, kind)
    yield from _connection(cell, now)
    if asked is not None:
        yield Finding(Condition.ROLE, asked.role(session))
    yield Finding(Condition.AUTHORITY, permission(cell.authority, session, now))
    yield Finding(Condition.LIMITS, None if recovers else outside_limits(cell))
    yield Finding(Condition.MODE, modes.forbids(kind, controller))
    yield _stop(cell)
    yield Finding(Condition.ENABLING, modes.not_enabled(session, controller, now))
    yield _controller(cell)
    held = planned and _is_paused(cell.program)
    yield Finding(Condition.OVERRIDE, None if held else modes.override_fault())
    unread = None if recovers else _unread(cell)
    contact = None if unread is not None or asked is None else asked.contact()
    yield Finding(Condition.SCENE, unread or contact)
    yield Finding(Condition.PROGRAM, _program_fault(cell.program, kind))
    if not steered:
        yield _standing(cell, now, planned=planned)


def _program_fault(program: RunningProgram | None, kind: MotionKind) -> Refusal | None:
    """Return why nothing but a program may move the robot; paused, it is still under way."""
    if program is None or kind is MotionKind.PROGRAM:
        return None
    doing = "is being loaded"
    if not program.is_loading:
        doing = f"{_DOING.get(program.state, 'is under way')} at line {program.line}"
    text = f"program {program.name!r} {doing}; accepted: another motion after a program stop"
    return Refusal(VerdictCode.PROGRAM_RUNNING, text)


_DOING = {
    ProgramState.RUNNING: "runs",
    ProgramState.PAUSED: "is paused",
    ProgramState.STEPPED: "is paused after a step",
    ProgramState.AT_BREAKPOINT: "is paused at a breakpoint",
}


def _is_paused(program: RunningProgram | None) -> bool:
    """Tell whether a program will not leave the start of what is planned for it."""
    return program is not None and program.is_paused


def _recovers(cell: Situation, kind: MotionKind) -> bool:
    """Tell whether a motion may start outside the limits: a jog that leads back inside.

    A controller with its own selector has no recovery mode of ours, so any jog may there.
    """
    if kind is not MotionKind.JOG:
        return False
    return not cell.modes.is_ours or cell.modes.mode(cell.mode) is OperatingMode.RECOVERY


def examine_cell(cell: Situation, now: int) -> Iterator[Finding]:
    """Yield the conditions that are the same whoever asks, in order."""
    yield from _connection(cell, now)
    yield _stop(cell)
    yield _controller(cell)
    yield Finding(Condition.OVERRIDE, cell.modes.override_fault())
    yield Finding(Condition.SCENE, _unread(cell))
    yield _standing(cell, now, planned=False)


def _unread(cell: Situation) -> Refusal | None:
    """Return why nobody knows which tool the robot holds, or what stands around it."""
    return Refusal(VerdictCode.BAD_DOCUMENT, cell.unread) if cell.unread else None


def _connection(cell: Situation, now: int) -> Iterator[Finding]:
    closing = Refusal(VerdictCode.SHUTTING_DOWN) if cell.is_closing else None
    yield Finding(Condition.SERVER, closing)
    down = cell.link_state(now) is LinkState.DOWN
    yield Finding(Condition.LINK, Refusal(VerdictCode.CONTROLLER_DOWN) if down else None)
    yield Finding(Condition.FEEDBACK, _feedback_fault(cell.feedback, now))


def _stop(cell: Situation) -> Finding:
    return Finding(Condition.STOP, None if cell.stop is None else stop_refusal(cell.stop))


def _controller(cell: Situation) -> Finding:
    # Some controllers say of themselves, while they move, that no motion is possible; what ends
    # a motion of ours is its own business.
    return Finding(Condition.CONTROLLER, None if cell.is_busy else _controller_fault(cell.feedback))


def _standing(cell: Situation, now: int, *, planned: bool) -> Finding:
    return Finding(Condition.STANDING, _activity_fault(cell, now, planned=planned))


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


def _activity_fault(cell: Situation, now: int, *, planned: bool) -> Refusal | None:
    activity = cell.motion_activity
    if activity in (Activity.PAUSED, Activity.PAUSING):
        hold = cell.motions.hold
        return Refusal(VerdictCode.PAUSED, f"a motion stands on its path: {hold}" if hold else "")
    if cell.feedback.position is None:
        return Refusal(VerdictCode.FEEDBACK_STALE, "nobody knows whether the robot stands")
    if cell.is_busy or not cell.feedback.is_standing:
        return Refusal(VerdictCode.MOVING)
    if not cell.feedback.is_fresh(now):
        text = "the robot stood when it was last heard of; nobody knows whether it still does"
        return Refusal(VerdictCode.FEEDBACK_STALE, text)
    if cell.awaited:
        return Refusal(VerdictCode.CHANGE_WHILE_MOVING, f"no motion begins while {cell.awaited}")
    if activity is Activity.PLANNING and not planned:
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
