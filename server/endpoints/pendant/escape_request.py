"""Which key leads out of a limit, a singularity or a contact, for whoever asks.

Owns the request, the names of the keys, and what is said of each cause. Which way leads out is the
mathematics' answer (`RobotModel`); a pendant may show the text, or press what the values say.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, cast

from openpendant.motion.description.limits import JointLimits
from openpendant.motion.errors import MotionError
from openpendant.simplemsg.pendant import JogSpace, JogStart
from openpendant.simplemsg.pendant.management.cell import Retreat, RetreatRequest
from openpendant.simplemsg.verdicts import VerdictCode

from ...cell.robot_cell import RobotCell
from ...cell.robot_model import RobotModel
from ...events.effects import Effect
from ...events.management_handlers import handles
from ...events.reply_to import ReplyTo
from ...refusal import JsonBody, Refusal
from .jog_requests import JogRequests

if TYPE_CHECKING:
    from openpendant.motion.jog import EscapeDirection

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
        """Start with no request in progress.

        Args:
            cell: the cell.
            view: the mathematics of its robot.
            jogs: knows which key was pressed last.
        """
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
            ways.append(_joint_keys(way.rates))
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


def _joint_keys(values: tuple[float, ...]) -> WayReport:
    named = " and ".join(
        f"joint {joint + 1} towards {_sign(value)}" for joint, value in enumerate(values) if value
    )
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
        return f"joint {cause.joint + 1} stands at {at}, its limit is {limit}"
    name = f"the {way.singularity} singularity" if way.singularity else "a singularity"
    if way.rates is None:
        return f"it stands at {name}; a motion of the joints leads out, such as to home"
    if sum(map(abs, way.rates)) > 1.0:
        return f"it stands at {name} and near another, so one joint alone does not lead out"
    return f"it stands at {name}"
