"""What pendants ask and are told about the controller: what it can do, and how far it is known.

Owns the answer of `controller.describe`, when CONTROLLER_CHANGED is sent, and which requests are
refused because the controller's dialect cannot carry them out.
"""

from __future__ import annotations

from typing import cast

from openpendant.simplemsg.pendant import (
    Capability,
    ControllerChanged,
    ControllerIdentity,
    JogStart,
    JogStep,
    JogUndo,
    MotionControl,
    MotionControlAction,
    Prepare,
    Preparedness,
    SetSpeed,
)
from openpendant.simplemsg.pendant.management import controller as op
from openpendant.simplemsg.verdicts import VerdictCode

from ...cell.execution.tracking import tracking_tolerances
from ...cell.interlocks import permission
from ...cell.robot_cell import RobotCell
from ...events.effects import Effect
from ...events.management_requests import ReplyTo, handles
from ...refusal import Refusal
from ...settings.cell_settings import CellSettings
from ...uplinks.declaration import Declaration, JogSupport, PauseSupport
from .notifications import Listeners

_PREPARED = Preparedness.NOT_NEEDED
"""No dialect has anything to be prepared yet, so PREPARE is refused and its capability off."""

_IDENTITY = ControllerIdentity.UNVERIFIED
"""The server compares nothing of the controller with the cell's robot yet."""


def offered(declaration: Declaration, capabilities: Capability) -> Capability:
    """Return capabilities without those that the controller cannot carry out."""
    if declaration.jog is JogSupport.NONE:
        capabilities &= ~Capability.JOG
    if declaration.pause is PauseSupport.NONE:
        capabilities &= ~Capability.PAUSE
    return capabilities


class ControllerRequests:
    """The controller of one cell, for its pendants."""

    def __init__(self, cell: RobotCell, settings: CellSettings, listeners: Listeners) -> None:
        """Take the controller for one of which nothing is known yet."""
        self._cell = cell
        self._settings = settings
        self._listeners = listeners
        self._declaration = cell.declaration
        self._changes = 1
        self._known_emulated = cell.is_known_emulated

    def changed(self) -> list[Effect]:
        """Tell every connection where something else is known of the controller than before."""
        known = self._cell.is_known_emulated
        if known is self._known_emulated:
            return []
        self._known_emulated = known
        self._changes += 1
        told = ControllerChanged(
            prepared=_PREPARED,
            identity=_IDENTITY,
            is_emulated=int(known),
            declaration=self._changes,
        )
        return self._listeners.to_all(told)

    def unable(self, message: object) -> Refusal | None:
        """Return why the controller cannot carry out a request of its kind, whoever asks."""
        match message:
            case JogStart() if self._declaration.jog is not JogSupport.CONTINUOUS:
                takes = self._declaration.jog.value
                text = f"{self._declaration.dialect} takes no jog by a held key, but {takes}"
                return Refusal(VerdictCode.JOG_INCREMENTS_ONLY, text)
            case JogStep() | JogUndo() if self._declaration.jog is JogSupport.NONE:
                text = f"{self._declaration.dialect} takes no jog and no increment"
                return Refusal(VerdictCode.JOG_INCREMENTS_ONLY, text)
            case MotionControl(action=MotionControlAction.PAUSE) | SetSpeed(override=0):
                return self._no_pause()
        return None

    def _no_pause(self) -> Refusal | None:
        if self._declaration.pause is not PauseSupport.NONE:
            return None
        text = f"{self._declaration.dialect} pauses nothing on its path; a stop would end it"
        return Refusal(VerdictCode.CANNOT_PAUSE, text)

    def prepare(self, session: int, message: Prepare, now: int) -> Refusal:
        """Refuse to prepare a controller that has nothing to be prepared."""
        fault = permission(self._cell.authority, session, now)
        if fault is not None:
            return fault
        text = f"a controller of the dialect {self._declaration.dialect} has nothing to prepare"
        return Refusal(VerdictCode.BAD_ARGUMENT, text, value=message.action)

    @handles(op.DescribeController)
    def _describe(
        self, asked: op.DescribeController, reply: ReplyTo[op.ControllerDeclaration], now: int
    ) -> list[Effect]:
        cell, told, limits = self._cell, self._declaration, self._cell.limits
        link, says_emulated = self._settings.controller, self._cell.feedback.says_emulated
        tolerances = tracking_tolerances(link, limits, says_emulated=says_emulated)
        turning = zip(tolerances.path, limits.prismatic, strict=True)
        paths = (path for path, slides in turning if not slides)
        # Its own ramp is unknown here, but no joint may brake more gently than its limits allow.
        ramp = max(v / a for v, a in zip(limits.velocity, limits.acceleration, strict=True))
        found = {
            "declaration": self._changes,
            "dialect": told.dialect,
            "emulated": cell.is_known_emulated,
            "says_emulated": says_emulated,
            "prepared": _PREPARED.name.lower().replace("_", " "),
            "identity": _IDENTITY.name.lower(),
            "feeding": told.feeding.value,
            "jog": told.jog.value,
            "pause": told.pause.value,
            "override": told.override,
            "points": told.points,
            "in_flight": told.in_flight,
            "most_points": told.most_points,
            "lead": told.lead,
            "jog_lead": self._settings.jog.lead,
            "interpolation": told.interpolation,
            "path_tolerance": told.path_tolerance,
            "angle_tolerance": told.angle_tolerance,
            "speed_enforced_by": told.speed_enforced_by,
            "second_stop": told.second_stop,
            "link_loss_stops": told.link_loss_stops,
            "residual_motion": told.residual_delay + ramp,
            "blind_motion": told.blind_delay + ramp,
            "freeze_protection": told.freeze_protection.value,
            "ramp_time": self._cell.hold_to_run.ramp_time,
            "following": told.following,
            "following_tolerance": next(paths, link.path_tolerance),
            "lag": tolerances.lag,
            "noise": tolerances.noise,
            "state_period": told.state_period,
            "fresh_age": told.fresh_age,
            "abort_age": told.abort_age,
            "start_tolerance": told.start_tolerance,
            "prepare": [],
            "identify": list(told.identify),
            "signals": told.signals,
            "reply_deadlines": dict(told.reply_deadlines),
        }
        return reply.answer(cast(op.ControllerDeclaration, found))
