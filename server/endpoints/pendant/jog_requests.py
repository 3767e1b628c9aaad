"""Jog requests of pendants: presses, beats, releases, increments, undo, and which key leads out.

Owns the checks of the arguments, the translation of jog messages into questions to the cell, and
who is pressing what. The checks are pure functions, made before anything else is done: values to
the refusal that they deserve, None where they are in order. When a press dies is the rule of
`Press`, whether a jog may start the cell's, how many joints the robot has is `joint_slots`'
business, which frames there are the robot's, and the mathematics are behind `RobotModel`.

Owns the request for the key that leads out of a limit, a singularity or a contact
(`EscapeRequests`), the names of the keys, and what is said of each cause. A pendant may show the
text, or press what the values say.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Container, Sequence
from typing import TYPE_CHECKING, cast

from openpendant.motion.description.limits import JointLimits
from openpendant.motion.errors import MotionError
from openpendant.simplemsg.pendant import (
    JogBeat,
    JogEnd,
    JogSpace,
    JogStart,
    JogStep,
    JogUndo,
    Motion,
)
from openpendant.simplemsg.pendant.management.cell import Retreat, RetreatRequest
from openpendant.simplemsg.verdicts import VerdictCode

from ...cell.execution.setpoint_sources import JogRows, Press, PressCounter
from ...cell.execution.trajectory_execution import UndoPlan, Waypoints
from ...cell.interlocks import check_interlocks
from ...cell.joint_slots import JointSlots
from ...cell.robot_cell import RobotCell
from ...cell.robot_model import RobotModel
from ...control import MotionKind, speed_fault
from ...events.cell_events import MotionRequest
from ...events.effects import Effect
from ...events.management_requests import ReplyTo, handles
from ...planning.jobs import JointPathJob, MotionJob, PoseJob
from ...refusal import NO_JOINT, JsonBody, Refusal, refusal_of
from ...settings.cell_settings import JogSettings
from .notifications import RecentStates

if TYPE_CHECKING:
    from openpendant.motion.jog import EscapeDirection, JogCaps, JogTarget


TOOL_VALUES = 6
"""Along x, y, z and about x, y, z."""

_AXES = ("along x", "along y", "along z", "about x", "about y", "about z")
_FOUR_BYTES = struct.Struct("<f")
_ROUNDED = 1e-6
"""Times that differ by less were the same before they came in 4 bytes [s]."""

_MOST_DIGITS = 9
"""Tell any two 4-byte reals apart (IEEE 754)."""


def count_fault(slots: JointSlots, space: int, count: int) -> Refusal | None:
    """Return why a message with so many values in a space is none for this robot."""
    if space == JogSpace.JOINTS:
        return slots.count_fault(count)
    if space != JogSpace.TOOL:
        return Refusal(VerdictCode.BAD_ARGUMENT, f"space {space}; accepted: 1 joints, 2 tool")
    if count != TOOL_VALUES:
        text = f"{count} values for the tool; accepted: 6, x, y, z and about x, y, z"
        return Refusal(VerdictCode.BAD_ARGUMENT, text, value=count, limit=TOOL_VALUES)
    return None


def shares_fault(space: int, values: Sequence[float]) -> Refusal | None:
    """Return which share of a press is not -1 to 1 of the jog speed; None for none."""
    for index, value in enumerate(values):
        if not -1.0 <= value <= 1.0:
            joint, name = _named(space, index)
            if not math.isfinite(value):
                text = f"the share of {name} is not a finite number"
                return Refusal(VerdictCode.NOT_FINITE, text, joint)
            text = f"the share of {name} is {told(value)}; accepted: -1 to 1"
            limit = math.copysign(1.0, value)
            return Refusal(VerdictCode.BAD_ARGUMENT, text, joint, value, limit)
    return None


def increment_fault(space: int, values: Sequence[float]) -> Refusal | None:
    """Return which increment of a step is no number; None for none."""
    for index, value in enumerate(values):
        if not math.isfinite(value):
            joint, name = _named(space, index)
            text = f"the increment of {name} is not a finite number"
            return Refusal(VerdictCode.NOT_FINITE, text, joint)
    return None


def _named(space: int, index: int) -> tuple[int, str]:
    """Return the index of the joint, -1 for none, and what a value is for."""
    if space == JogSpace.JOINTS:
        return index, f"joint {index + 1}"
    return NO_JOINT, f"the tool {_AXES[index]}"


def told(value: float) -> str:
    """Return a finite number in the fewest digits that mean it, as it came: in 4 bytes or in 8."""
    try:
        is_short = _as_four_bytes(value) == value
    except OverflowError:
        is_short = False
    if not is_short:
        return repr(value)
    for digits in range(1, _MOST_DIGITS):
        text = f"{value:.{digits}g}"
        if _as_four_bytes(float(text)) == value:
            return text
    return f"{value:.{_MOST_DIGITS}g}"


def _as_four_bytes(value: float) -> float:
    rounded: float = _FOUR_BYTES.unpack(_FOUR_BYTES.pack(value))[0]
    return rounded


class JogRequests:
    """All jogging of one cell.

    Attributes:
        states: the state messages that a press may quote.
        pressed: the key that was pressed last; None before the first.
    """

    def __init__(
        self,
        cell: RobotCell,
        settings: JogSettings,
        model: RobotModel,
        older: Container[int] = frozenset(),
    ) -> None:
        """Start with no key pressed.

        Args:
            older: the connections that speak version 2 of the protocol.
        """
        self.states = RecentStates()
        self.pressed: JogStart | None = None
        self._cell = cell
        self._settings = settings
        self._model = model
        self._older = older
        self._presses = PressCounter()
        self._started_with: object = None  # the model of the robot that the last jog began with

    # Presses.

    def start(self, session: int, message: JogStart, now: int) -> Refusal | list[Effect]:
        """Begin a press, or let it take over from another of the same connection.

        A jog is not taken over once frames, tool or scene are others than those it began with: it
        comes to rest, and the next begins in those of now.
        """
        press = self._presses.begin(session, message.press, message.deadline, now)
        if isinstance(press, Refusal):
            return press
        refusal = self._deadline_fault(press) or self.states.fault(message.state_sequence, now)
        if refusal is not None:
            return refusal
        target = self._target(message)
        if isinstance(target, Refusal):
            return target
        self._cell.hold_to_run.judge_press(now)
        running = self._to_take_over(session)
        refusal = check_interlocks(
            self._cell, session, now, MotionKind.JOG, steered=running is not None
        )
        if refusal is None and running is not None and running.press.awaits_release:
            text = "the enabling device (training) was let go before the key; a stop follows"
            refusal = Refusal(VerdictCode.NOT_ENABLED, text)
        if refusal is not None:
            return refusal
        request = MotionRequest(session, message.request_id)
        if running is not None:
            self.pressed = message
            return self._cell.motions.take_over_jog(request, running, target, press, now)
        self._cell.authority.beat(session, now)
        start = self._cell.feedback.standing_at
        rows = JogRows(self._model.begin(start, self._caps()), start, target, press)
        out = self._cell.motions.jog(request, rows, self._settings.lead, now)
        if self._cell.driving.driven_jog is rows:
            self.pressed = message
            self._started_with = self._model.jog_model
        return out

    def _deadline_fault(self, press: Press) -> Refusal | None:
        """Return why a press may not be silent for longer than its enabling device.

        Of version 2 no connection can say how long that may be silent: the longer time counts.
        """
        modes = self._cell.modes
        if press.session in self._older or not modes.needs_enabling():
            return None
        deadline, enabling = press.deadline_ns / 1e9, modes.enabling_deadline(press.session)
        if deadline <= enabling + _ROUNDED:
            return None
        text = (
            f"the press is declared silent after {deadline:g} s, its enabling device (training)"
            f" after {enabling:g} s; accepted: no longer than that, which DECLARE sets"
        )
        return Refusal(VerdictCode.BAD_ARGUMENT, text, value=deadline, limit=enabling)

    def _to_take_over(self, session: int) -> JogRows | None:
        """Return the jog that a new press of a connection may steer; None where there is none."""
        running = self._cell.driving.driven_jog
        if running is None or running.press.session != session:
            return None
        return running if self._started_with is self._model.jog_model else None

    def _caps(self) -> JogCaps:
        modes = self._cell.modes
        cap = modes.tool_speed_cap(self._cell.feedback.mode)
        return self._model.caps(modes.override, self._settings, cap)

    def _target(self, message: JogStart) -> JogTarget | Refusal:
        values = message.values[: message.value_count]
        refusal = count_fault(self._cell.slots, message.space, message.value_count) or shares_fault(
            message.space, values
        )
        if refusal is not None:
            return refusal
        try:
            if message.space == JogSpace.JOINTS:
                return self._model.joints(values)
            return self._model.tool(values, message.frame)
        except MotionError as error:
            return refusal_of(error)

    def beat(self, session: int, message: JogBeat, now: int) -> None:
        """Take a beat; it keeps the authority as well."""
        work = self._cell.driving.work
        if work is not None and work.jog is not None:
            work.jog.press.take_beat(session, message.press, message.beat, now)
        self._cell.authority.beat(session, now)

    def release(self, session: int, press: int, now: int) -> Refusal | None:
        """End a press; the robot ramps to rest."""
        self._cell.hold_to_run.judge_press(now)
        jog = self._cell.driving.driven_jog
        if jog is None or (jog.press.session, jog.press.number) != (session, press):
            return Refusal(VerdictCode.NOTHING_TO_CONTROL, f"press {press} is not held")
        jog.release(JogEnd.RELEASED, now)
        return None

    def closed(self, session: int) -> None:
        """Forget a connection; that the robot stops is the authority's business."""
        self._presses.forget(session)

    def respeed(self, now: int) -> None:
        """Let the override and caps of now rule the jog that is driven; 0 brings it to rest."""
        jog = self._cell.driving.driven_jog
        if jog is None:
            return
        if self._cell.modes.override:
            jog.limit(self._caps())
        else:
            jog.release(JogEnd.STOPPED, now)

    # Increments and undo.

    def step(self, session: int, message: JogStep, now: int) -> Refusal | list[Effect]:
        """Move by one increment."""
        values = message.values[: message.value_count]
        refusal = (
            check_interlocks(self._cell, session, now, MotionKind.JOG)
            or speed_fault(message.speed)
            or count_fault(self._cell.slots, message.space, message.value_count)
            or increment_fault(message.space, values)
        )
        if refusal is not None:
            return refusal
        start = self._cell.feedback.standing_at
        if message.space == JogSpace.TOOL:
            try:
                goal = self._model.stepped_pose(start, values, message.frame)
            except MotionError as error:
                return refusal_of(error)
            job: MotionJob = PoseJob(
                self._cell.motions.new_job_id(),
                start,
                (goal,),
                "base",
                Motion.LIN,
                message.speed * self._settings.joint_speed,
                tool_speed=self._point_speed(),
                tool=self._model.tool_in_flange,
            )
        else:
            target = self._cell.slots.position([a + b for a, b in zip(start, values, strict=True)])
            if isinstance(target, Refusal):
                return target
            job = self._joint_job((target,), message.speed)
        self._cell.authority.beat(session, now)
        request = MotionRequest(session, message.request_id)
        back = UndoPlan(lambda: (start,))
        return self._cell.motions.ask(request, job, MotionKind.JOG, back)

    def undo(self, session: int, message: JogUndo, now: int) -> Refusal | list[Effect]:
        """Move back along the way of the jog that moved last; a second undo has nothing to do.

        An undo that was ended on its way is gone on with where it is asked for again.
        """
        refusal = check_interlocks(self._cell, session, now, MotionKind.JOG) or speed_fault(
            message.speed
        )
        if refusal is not None:
            return refusal
        way = self._cell.motions.way_back
        if isinstance(way, Refusal):
            return way
        self._cell.authority.beat(session, now)
        request = MotionRequest(session, message.request_id)
        back = UndoPlan(lambda: way, is_undo=True)
        return self._cell.motions.ask(
            request, self._joint_job(way, message.speed), MotionKind.JOG, back
        )

    def _joint_job(self, waypoints: Waypoints, speed: float) -> JointPathJob:
        return JointPathJob(
            self._cell.motions.new_job_id(),
            self._cell.feedback.standing_at,
            waypoints,
            speed * self._settings.joint_speed,
            tool_speed=self._point_speed(),
            tool=self._model.tool_in_flange,
        )

    def _point_speed(self) -> float:
        cap = self._cell.modes.tool_speed_cap(self._cell.feedback.mode)
        return min(self._settings.tool_speed, cap or self._settings.tool_speed)


_TOOL_KEYS = ("X", "Y", "Z", "A", "B", "C")


class WayReport(JsonBody):
    """A key that leads out, or several to hold together: names, and what a JOG_START holds."""

    press: str
    """As a person would say it: `joint 3 towards -`, `tool Z+ in base`; several with `and`."""
    space: int
    """1 joints, 2 tool, as in JOG_START."""
    frame: str
    """Empty for joints."""
    values: tuple[float, ...]


class HoldReport(JsonBody):
    """One thing that the robot stands at."""

    reason: str
    """`joint-limit`, `singularity` or `collision`."""
    text: str
    ways: tuple[WayReport, ...]
    """Keys that lead out, the opposite of the last press first; empty where none is known."""


class RetreatReply(JsonBody):
    """All that the robot stands at; empty where it stands free."""

    holds: tuple[HoldReport, ...]


class EscapeRequests:
    """The retreats of one cell."""

    def __init__(self, cell: RobotCell, view: RobotModel, jogs: JogRequests) -> None:
        """Start with no request in progress."""
        self._cell = cell
        self._view = view
        self._jogs = jogs

    @handles(RetreatRequest)
    def _ways_out(self, asked: RetreatRequest, reply: ReplyTo[Retreat], now: int) -> list[Effect]:
        found = self._retreat(now)
        if isinstance(found, Refusal):
            return reply.refuse(found)
        return reply.answer(cast(Retreat, found.model_dump()))

    def _retreat(self, now: int) -> RetreatReply | Refusal:
        feedback = self._cell.feedback
        position = feedback.position
        if position is None or not feedback.is_fresh(now):
            return Refusal(VerdictCode.FEEDBACK_STALE)
        if not feedback.joints_rest:
            return Refusal(VerdictCode.MOVING, "the way out is told once the robot stands")
        found = self._view.escape_directions(position)
        back = self._opposite(position) if found else None
        return RetreatReply(holds=tuple(self._hold(each, back) for each in found))

    def _hold(self, way: EscapeDirection, back: WayReport | None) -> HoldReport:
        ways = [] if back is None else [back]
        if way.rates is not None:
            ways.append(_joint_keys(way.rates, self._cell.limits))
        text = _told(way, self._cell.limits)
        return HoldReport(reason=way.cause.reason, text=text, ways=tuple(ways))

    def _opposite(self, position: Sequence[float]) -> WayReport | None:
        """Return the opposite of the last press of the tool, if that leads out from here."""
        pressed = self._jogs.pressed
        if pressed is None or pressed.space != JogSpace.TOOL:
            return None
        values = tuple(-value for value in pressed.values[: pressed.value_count])
        try:
            is_out = self._view.leads_out(position, values, pressed.frame)
        except MotionError:
            return None  # the frame was removed since
        return _tool_key(values, pressed) if is_out else None


def _joint_keys(values: tuple[float, ...], limits: JointLimits) -> WayReport:
    keys = zip(limits.display_names, values, strict=True)
    named = " and ".join(f"{name} towards {_sign(value)}" for name, value in keys if value)
    return WayReport(press=named, space=JogSpace.JOINTS, frame="", values=values)


def _tool_key(values: tuple[float, ...], pressed: JogStart) -> WayReport:
    keys = zip(_TOOL_KEYS, values, strict=True)
    named = " and ".join(f"{key}{_sign(value)}" for key, value in keys if value)
    press = f"tool {named} in {pressed.frame}"
    return WayReport(press=press, space=JogSpace.TOOL, frame=pressed.frame, values=values)


def _sign(value: float) -> str:
    return "+" if value > 0.0 else "-"


def _told(way: EscapeDirection, limits: JointLimits) -> str:
    """Return what is said of one cause, with its numbers."""
    cause = way.cause
    if cause.pair is not None:
        first, second = cause.pair
        return f"{first} and {second} are {1e3 * cause.value:.1f} mm apart"
    if cause.joint >= 0:
        unit = limits.unit(cause.joint)
        at, limit = f"{cause.value:.4f} {unit}", f"{cause.limit:g} {unit}"
        return f"{limits.display_names[cause.joint]} stands at {at}, its limit is {limit}"
    name = f"the {way.singularity} singularity" if way.singularity else "a singularity"
    if way.rates is None:
        return f"it stands at {name}; a motion of the joints leads out, such as to home"
    if sum(map(abs, way.rates)) > 1.0:
        return f"it stands at {name} and near another, so one joint alone does not lead out"
    return f"it stands at {name}"
