"""Jog requests of pendants: presses, beats, releases, increments, undo.

Owns the checks of the arguments, the translation of jog messages into questions to the cell, and
who is pressing what. The checks are pure functions, made before anything else is done: values to
the refusal that they deserve, None where they are in order. When a press dies is `press`' rule,
whether a jog may start the cell's, how many joints the robot has is `joint_slots`' business, which
frames there are the robot's, and the mathematics are behind `RobotModel`.
"""

from __future__ import annotations

import math
import struct
from collections import deque
from collections.abc import Sequence
from typing import TYPE_CHECKING

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
from openpendant.simplemsg.verdicts import VerdictCode

from ...cell.execution.setpoint_sources import JogRows, PressCounter
from ...cell.execution.trajectory_execution import UndoPlan, Waypoints
from ...cell.joint_slots import JointSlots
from ...cell.robot_cell import RobotCell
from ...cell.robot_model import RobotModel
from ...control.modes import MotionKind
from ...events.cell_events import MotionRequest
from ...events.effects import Effect
from ...planning.jobs import JointPathJob, MotionJob, PoseJob, speed_fault
from ...refusal import NO_JOINT, Refusal, refusal_of
from ...settings.cell_settings import JogSettings

if TYPE_CHECKING:
    from openpendant.motion.jog import JogCaps, JogTarget

TOOL_VALUES = 6
"""Along x, y, z and about x, y, z."""

_AXES = ("along x", "along y", "along z", "about x", "about y", "about z")
_FOUR_BYTES = struct.Struct("<f")
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
    """Judge the shares of a press, each -1 to 1 of the jog speed; the faulty one is named."""
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
    """Judge the increments of a step: each must be a number; the faulty one is named."""
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


RECENT_NS = 500_000_000
"""A press must quote a state message that is no older than this."""


class RecentStates:
    """The state messages of the last half second, so that a press can quote one."""

    def __init__(self) -> None:
        self._sent: deque[tuple[int, int]] = deque()

    def sent(self, sequence: int, now: int) -> None:
        """Note a state message that left."""
        self._sent.append((sequence, now))
        while now - self._sent[0][1] > RECENT_NS:
            self._sent.popleft()

    def fault(self, sequence: int, now: int) -> Refusal | None:
        """Return why a press must not quote this message."""
        for number, at in self._sent:
            if number == sequence and now - at <= RECENT_NS:
                return None
        newest = self._sent[-1][0] if self._sent else 0
        text = f"the press quotes state {sequence}; the newest is {newest}"
        return Refusal(VerdictCode.PRESS_STALE, text)


class JogRequests:
    """All jogging of one cell.

    Attributes:
        states: the state messages that a press may quote.
        pressed: the key that was pressed last; None before the first.
    """

    def __init__(self, cell: RobotCell, settings: JogSettings, model: RobotModel) -> None:
        """Start with no key pressed."""
        self.states = RecentStates()
        self.pressed: JogStart | None = None
        self._cell = cell
        self._settings = settings
        self._model = model
        self._presses = PressCounter()
        self._begun_with: object = None  # the model of the robot that the last jog began with

    # Presses.

    def start(self, session: int, message: JogStart, now: int) -> Refusal | list[Effect]:
        """Begin a press, or let it take over from another of the same connection.

        A jog is not taken over once frames, tool or scene are others than those it began with: it
        comes to rest, and the next begins in those of now.

        Returns:
            Why it is refused, or what follows; the verdict comes as news.
        """
        press = self._presses.begin(session, message.press, message.deadline, now)
        if isinstance(press, Refusal):
            return press
        refusal = self.states.fault(message.state_sequence, now)
        if refusal is not None:
            return refusal
        target = self._target(message)
        if isinstance(target, Refusal):
            return target
        running = self._to_take_over(session)
        refusal = self._cell.check(session, now, MotionKind.JOG, steered=running is not None)
        if refusal is not None:
            return refusal
        request = MotionRequest(session, message.request_id)
        if running is not None:
            self.pressed = message
            return self._cell.motions.take_over_jog(request, running, target, press, now)
        self._cell.authority.beat(session, now)
        start = self._cell.standing_at
        rows = JogRows(self._model.begin(start, self._caps()), start, target, press)
        out = self._cell.motions.jog(request, rows, self._settings.lead, now)
        if self._cell.driving.driven_jog is rows:
            self.pressed = message
            self._begun_with = self._model.jog_model
        return out

    def _to_take_over(self, session: int) -> JogRows | None:
        """Return the jog that a new press of a connection may steer; None where there is none."""
        running = self._cell.driving.driven_jog
        if running is None or running.press.session != session:
            return None
        return running if self._begun_with is self._model.jog_model else None

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
        """End a press; the robot ramps to rest.

        Returns:
            Why there is nothing to release.
        """
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
        """Move by one increment.

        Returns:
            Why it is refused, or what follows; the verdict comes as news.
        """
        values = message.values[: message.value_count]
        refusal = (
            self._cell.check(session, now, MotionKind.JOG)
            or speed_fault(message.speed)
            or count_fault(self._cell.slots, message.space, message.value_count)
            or increment_fault(message.space, values)
        )
        if refusal is not None:
            return refusal
        start = self._cell.standing_at
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

        Returns:
            Why it is refused, or what follows; the verdict comes as news.
        """
        refusal = self._cell.check(session, now, MotionKind.JOG) or speed_fault(message.speed)
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
            self._cell.standing_at,
            waypoints,
            speed * self._settings.joint_speed,
            tool_speed=self._point_speed(),
            tool=self._model.tool_in_flange,
        )

    def _point_speed(self) -> float:
        cap = self._cell.modes.tool_speed_cap(self._cell.feedback.mode)
        return min(self._settings.tool_speed, cap or self._settings.tool_speed)
