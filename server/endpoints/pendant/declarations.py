"""Declarations of pendants: what a connection of version 3 wants beyond its hello (DECLARE).

Owns their bounds, and that no deadline changes under a key that is held: not while the connection
moves the robot. What a deadline means is the rule of `OperatingModes` and `HoldToRun`.
"""

from __future__ import annotations

import math
from dataclasses import replace

from openpendant.simplemsg.pendant import Declare, Notices
from openpendant.simplemsg.verdicts import VerdictCode

from ...cell.execution.setpoint_sources import LONGEST_DEADLINE, SHORTEST_DEADLINE
from ...cell.robot_cell import RobotCell
from ...events.effects import Effect, Send
from ...events.replies import verdict
from ...refusal import Refusal
from .access_requests import AccessRequests
from .notifications import Listeners


def deadline_fault(deadline: float) -> Refusal | None:
    """Return why an enabling device may not be silent for so long [s]; None where it may."""
    if deadline == 0.0 or SHORTEST_DEADLINE <= deadline <= LONGEST_DEADLINE:
        return None
    if not math.isfinite(deadline):
        return Refusal(VerdictCode.NOT_FINITE, "the enabling deadline is not a finite number")
    accepted = f"0 for the cell's own, or {SHORTEST_DEADLINE:g} to {LONGEST_DEADLINE:g}"
    text = f"enabling deadline {deadline:g} s; accepted: {accepted}"
    return Refusal(VerdictCode.BAD_ARGUMENT, text, value=deadline, limit=LONGEST_DEADLINE)


class Declarations:
    """What the connections of one cell declared."""

    def __init__(self, cell: RobotCell, listeners: Listeners, access: AccessRequests) -> None:
        """Start with nothing declared."""
        self._cell = cell
        self._listeners = listeners
        self._access = access

    def declare(self, session: int, message: Declare, now: int) -> Refusal | list[Effect]:
        """Take note of what a pendant wants; the verdict's value is the ramp time [s]."""
        refusal = deadline_fault(message.enabling_deadline) or _notices_fault(message.notices)
        refusal = refusal or _language_fault(message.language)
        if refusal is None and self._moves(session):
            refusal = Refusal(VerdictCode.MOVING, "this connection moves the robot")
        if refusal is not None:
            return refusal
        modes = self._cell.modes
        modes.declare(session, message.enabling_deadline)
        self._listeners[session].wants_notices = message.notices == Notices.WANTED
        self._access.declared(
            session, message.language, modes.enabling_deadline(session), message.notices, now
        )
        ramp_time = self._cell.hold_to_run.ramp_time
        return [Send(session, replace(verdict(message.request_id), value=ramp_time))]

    def _moves(self, session: int) -> bool:
        """Return True while a motion of a connection is planned or driven, or its program runs."""
        cell = self._cell
        work, program = cell.driving.work, cell.program
        if work is not None and work.request.session == session:
            return True
        is_running = program is not None and not program.is_paused
        return is_running and cell.authority.is_held_by(session)


def _notices_fault(notices: int) -> Refusal | None:
    if notices in list(Notices):
        return None
    text = f"notices {notices}; accepted: 0 or 1"
    return Refusal(VerdictCode.BAD_ARGUMENT, text, value=notices, limit=1)


def _language_fault(language: str) -> Refusal | None:
    if language.isprintable():
        return None
    text = f"language {language!r}; accepted: printable characters, as en or de"
    return Refusal(VerdictCode.BAD_ARGUMENT, text)
