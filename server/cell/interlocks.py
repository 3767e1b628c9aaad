"""Motion interlocks: what must hold before a robot moves, in the order in which it is mended.

Owns the chain and its order: to mend one breaks none before it. A reset and a change of mode
demand that enabling devices are pressed anew, and a joint outside its limits comes back in a mode
of its own; so limits, mode, stop and enabling come in that order. Whoever begins a motion asks for
the first condition that is broken; the question "why is it not moving?" is answered with all of
them. Two of them are found elsewhere and handed in for that answer: a role is asked for before a
request gets here, and a motion is held to the scene by its planner.

Owns what ends a program from outside, whether it is loaded, runs or waits, and which conditions
must hold on while no motion of it is under way: a motion has its own watch. Decides nothing else
and changes nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from enum import Enum
from typing import NamedTuple, Protocol

from openpendant.motion.description.limits import JointLimits
from openpendant.simplemsg.pendant import Activity, OperatingMode, ProgramState
from openpendant.simplemsg.verdicts import VerdictCode

from ..control import Holder, MotionAuthority, MotionKind, OperatingModes
from ..events.cell_events import (
    AuthorityTransferred,
    CellEvent,
    Interruption,
    OperatingModeChanged,
    RunningProgram,
    StopLatch,
    StopLatchChanged,
)
from ..refusal import Refusal
from .execution.feedback import Feedback, lost

PASSING = (VerdictCode.MOVING, VerdictCode.PLANNING, VerdictCode.CHANGE_WHILE_MOVING)
"""Obstacles that end by themselves, so that an endpoint that keeps what was sent may wait."""

_UNDRIVEN = (Activity.IDLE, Activity.PLANNING)
"""With any other activity a motion of ours is under way or being stopped."""

_AT_LIMIT = 1e-3
"""Reports are rounded to four bytes, and a joint at rest on its limit may overshoot a hair."""


class InterlockKind(Enum):
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


class Interlock(NamedTuple):
    """One condition and why it is broken; None where it holds."""

    condition: InterlockKind
    refusal: Refusal | None


class InterlockQuery(NamedTuple):
    """Facts that the interlocks do not find themselves; a motion that begins has passed the role.

    Attributes:
        role: returns why the role of a connection does not let it move the robot.
        contact: what the robot touches where it stands; None for nothing.
    """

    role: Callable[[int], Refusal | None]
    contact: Refusal | None


class Holdable(Protocol):
    """Motions that something may hold on their path."""

    @property
    def hold(self) -> str:
        """What holds the motion; empty for nothing."""


class Driven(Protocol):
    """The motion of ours that is under way."""

    is_linked: bool

    @property
    def activity(self) -> Activity:
        """What is done with it; IDLE between those of a program."""


class Situation(Protocol):
    """The view of a `RobotCell` that the conditions need."""

    authority: MotionAuthority
    feedback: Feedback
    limits: JointLimits
    modes: OperatingModes
    stop: StopLatch | None
    program: RunningProgram | None
    awaited: str
    unread: str
    unbuilt: str

    @property
    def motions(self) -> Holdable:
        """The motions of ours."""

    @property
    def driving(self) -> Driven:
        """The motion of ours that is under way."""

    @property
    def is_closing(self) -> bool:
        """Whether the server is going down."""


def examine_motion(
    cell: Situation,
    kind: MotionKind,
    session: int,
    now: int,
    *,
    planned: bool = False,
    steered: bool = False,
    asked: InterlockQuery | None = None,
) -> Iterator[Interlock]:
    """Yield every condition for a motion of a connection, in order.

    Args:
        planned: the motion is the one that is being planned, which is then no obstacle.
        steered: the motion is the jog that is driven, which is then no obstacle either.
        asked: what is found elsewhere; None to look at the cell alone.
    """
    modes, controller = cell.modes, cell.feedback.mode
    is_fresh, activity = cell.feedback.is_fresh(now), cell.driving.activity
    recovers = _recovers(cell, kind)
    yield from _connection(cell, is_fresh, now)
    if asked is not None:
        yield Interlock(InterlockKind.ROLE, asked.role(session))
    yield Interlock(InterlockKind.AUTHORITY, permission(cell.authority, session, now))
    yield Interlock(InterlockKind.LIMITS, None if recovers else outside_limits(cell))
    yield Interlock(InterlockKind.MODE, modes.forbids(kind, controller))
    yield _stop(cell)
    yield Interlock(InterlockKind.ENABLING, modes.not_enabled(session, now))
    yield _controller(cell, activity)
    held = planned and _is_paused(cell.program)
    yield Interlock(InterlockKind.OVERRIDE, None if held else modes.override_fault())
    unread = None if recovers else _unread(cell)
    if cell.unbuilt and kind is MotionKind.JOG and not planned:
        # Whatever is planned sees what was added; a jog would not yet.
        text = f"no jog begins while {cell.unbuilt}"
        unread = unread or Refusal(VerdictCode.CHANGE_WHILE_MOVING, text)
    contact = None if asked is None else asked.contact
    yield Interlock(InterlockKind.SCENE, unread or contact)
    yield Interlock(InterlockKind.PROGRAM, _program_fault(cell.program, kind))
    if not steered:
        fault = _activity_fault(cell, activity, is_fresh=is_fresh, planned=planned)
        yield Interlock(InterlockKind.STANDING, fault)


def check_interlocks(
    cell: Situation,
    session: int,
    now: int,
    kind: MotionKind = MotionKind.MOVE,
    *,
    planned: bool = False,
    steered: bool = False,
) -> Refusal | None:
    """Return why a connection may not start a motion now; None where it may."""
    chain = examine_motion(cell, kind, session, now, planned=planned, steered=steered)
    return next((found.refusal for found in chain if found.refusal), None)


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
    """Return True if a program will not leave the start of what is planned for it."""
    return program is not None and program.is_paused


def _recovers(cell: Situation, kind: MotionKind) -> bool:
    """Return True if a motion may start outside the limits: a jog that leads back inside.

    A controller with its own selector has no recovery mode of ours, so any jog may there.
    """
    if kind is not MotionKind.JOG:
        return False
    return not cell.modes.is_ours or cell.modes.mode(cell.feedback.mode) is OperatingMode.RECOVERY


def examine_cell(cell: Situation, now: int) -> Iterator[Interlock]:
    """Yield the conditions that are the same whoever asks, in order."""
    is_fresh, activity = cell.feedback.is_fresh(now), cell.driving.activity
    yield from _connection(cell, is_fresh, now)
    yield _stop(cell)
    yield _controller(cell, activity)
    yield Interlock(InterlockKind.OVERRIDE, cell.modes.override_fault())
    yield Interlock(InterlockKind.SCENE, _unread(cell))
    fault = _activity_fault(cell, activity, is_fresh=is_fresh, planned=False)
    yield Interlock(InterlockKind.STANDING, fault)


def _unread(cell: Situation) -> Refusal | None:
    """Return why nobody knows which tool the robot holds, or what stands around it."""
    return Refusal(VerdictCode.BAD_DOCUMENT, cell.unread) if cell.unread else None


def _connection(cell: Situation, is_fresh: bool, now: int) -> Iterator[Interlock]:
    closing = Refusal(VerdictCode.SHUTTING_DOWN) if cell.is_closing else None
    yield Interlock(InterlockKind.SERVER, closing)
    down = None if cell.driving.is_linked else Refusal(VerdictCode.CONTROLLER_DOWN)
    yield Interlock(InterlockKind.LINK, down)
    yield Interlock(InterlockKind.FEEDBACK, _feedback_fault(cell.feedback, is_fresh, now))


def _stop(cell: Situation) -> Interlock:
    return Interlock(InterlockKind.STOP, None if cell.stop is None else stop_refusal(cell.stop))


def _controller(cell: Situation, activity: Activity) -> Interlock:
    # Some controllers say of themselves, while they move, that no motion is possible; what ends
    # a motion of ours is its own business.
    fault = _controller_fault(cell.feedback) if activity in _UNDRIVEN else None
    return Interlock(InterlockKind.CONTROLLER, fault)


def permission(authority: MotionAuthority, session: int, now: int) -> Refusal | None:
    """Return why a connection may not move the robot, as far as the authority goes."""
    holder = authority.holder
    if holder is None or authority.is_overdue(now):
        return Refusal(VerdictCode.NOT_IN_CONTROL)
    return None if holder.session == session else held_by(holder)


def held_by(holder: Holder) -> Refusal:
    """Return the refusal that names who is in control."""
    return Refusal(VerdictCode.HELD_BY_OTHER, f"{holder.name} is in control")


def stop_refusal(stop: StopLatch) -> Refusal:
    """Return the refusal that a latched stop is."""
    code = VerdictCode.PROTECTIVE_STOP if stop.is_protective else VerdictCode.STOP_LATCHED
    return Refusal(code, stop.sentence)


def _feedback_fault(feedback: Feedback, is_fresh: bool, now: int) -> Refusal | None:
    if feedback.broken:
        return Refusal(VerdictCode.NOT_FINITE, "the controller reports a position that is none")
    if is_fresh:
        return None
    age = feedback.age(now)
    text = "" if age is None else f"the last position report is {age / 1e6:.0f} ms old"
    return Refusal(VerdictCode.FEEDBACK_STALE, text)


def _activity_fault(
    cell: Situation, activity: Activity, *, is_fresh: bool, planned: bool
) -> Refusal | None:
    if activity in (Activity.PAUSED, Activity.PAUSING):
        hold = cell.motions.hold
        return Refusal(VerdictCode.PAUSED, f"a motion stands on its path: {hold}" if hold else "")
    if cell.feedback.position is None:
        return Refusal(VerdictCode.FEEDBACK_STALE, "nobody knows whether the robot stands")
    if activity not in _UNDRIVEN or not cell.feedback.is_standing:
        return Refusal(VerdictCode.MOVING)
    if not is_fresh:
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


def ending(event: CellEvent, by: Holder) -> Refusal | None:
    """Return why an event ends a program; None where it goes on."""
    match event:
        case Interruption(refusal=refusal):
            return refusal
        case StopLatchChanged(stop=StopLatch() as stop):
            return stop_refusal(stop)
        case OperatingModeChanged(mode=mode):
            text = f"the mode changed to {mode.name.lower().replace('_', ' ')}"
            return Refusal(VerdictCode.MODE_CHANGED, text)
        case AuthorityTransferred(change=change) if change.holder != by:
            return Refusal(VerdictCode.AUTHORITY_LOST)
    return None


def broken_condition(cell: Situation, by: Holder, now: int) -> Refusal | None:
    """Return why a program that will move by itself, once it has waited, may not; else None."""
    if cell.modes.needs_enabling() and not cell.modes.is_enabled(by.session, now):
        return Refusal(VerdictCode.ENABLING_LOST)
    return lost(cell.feedback, now)
