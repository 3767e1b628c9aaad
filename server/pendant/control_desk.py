"""Stops, modes and speeds as pendants ask for them, and pause, resume and program stop.

Owns what such a request acts on: the program that runs, else the motion of the cell. Whether it is
permitted is the cell's rule.
"""

from __future__ import annotations

from openpendant.simplemsg import CommType
from openpendant.simplemsg.pendant import (
    MotionControl,
    MotionControlAction,
    ResetStop,
    SetMode,
    SetSpeed,
    SoftwareStop,
)
from openpendant.simplemsg.verdicts import VerdictCode

from ..authority import Holder
from ..cell_motions import CellMotions
from ..jog.desk import JogDesk
from ..outgoing import Outgoing, Send
from ..playback.desk import ProgramDesk
from ..readiness import permission
from ..recording.desk import RecordingDesk
from ..refusal import Refusal
from ..robot_cell import RobotCell
from .listeners import Listeners
from .replies import REASON_BYTES, cut, verdict


class ControlDesk:
    """Stops, modes and speeds of one cell, for its pendants.

    Attributes:
        recordings: loads what is to be played; None where the cell has none.
    """

    def __init__(
        self, cell: RobotCell, listeners: Listeners, jogs: JogDesk, programs: ProgramDesk
    ) -> None:
        """Make a desk for one cell.

        Args:
            cell: the cell.
            listeners: the connections.
            jogs: told of a new speed.
            programs: runs programs.
        """
        self._cell = cell
        self._listeners = listeners
        self._jogs = jogs
        self._programs = programs
        self.recordings: RecordingDesk | None = None

    def software_stop(self, session: int, message: SoftwareStop, now: int) -> list[Outgoing]:
        """Stop the robot; the stop leaves before the verdict, and a topic has none."""
        by = self._listeners[session].holder
        out = self._cell.software_stop(by, cut(message.reason, REASON_BYTES), now)
        if message.comm_type == CommType.REQUEST:
            out.append(Send(session, verdict(message.request_id)))
        return out

    def reset_stop(self, session: int, message: ResetStop, now: int) -> Refusal | list[Outgoing]:
        """Unlatch the stop; whoever asked hears the verdict before the news."""
        reset = self._cell.reset_stop(self._listeners[session].holder, now)
        if isinstance(reset, Refusal):
            return reset
        return [Send(session, verdict(message.request_id)), *reset]

    def set_mode(self, session: int, message: SetMode, now: int) -> Refusal | list[Outgoing]:
        """Set the mode of operation; what stops because of it stops before the verdict."""
        out = self._cell.set_mode(self._listeners[session].holder, message.mode, now)
        return _then_verdict(out, session, message.request_id)

    def set_speed(self, session: int, message: SetSpeed, now: int) -> Refusal | list[Outgoing]:
        """Set speed override and cap; a jog that is driven follows at once, and 0 pauses."""
        by = self._listeners[session].holder
        refusal = self._cell.motions.set_speed(by, message.override, message.tool_speed, now)
        if refusal is not None:
            return refusal
        self._jogs.respeed(now)
        return _then_verdict(self._programs.respeed(by, now), session, message.request_id)

    def motion_control(
        self, session: int, message: MotionControl, now: int
    ) -> Refusal | list[Outgoing]:
        """Pause, resume or end what runs; a resume tells what keeps the robot at rest even so."""
        by = self._listeners[session].holder
        running = self._programs if self._programs.is_under_way else self._cell.motions
        out: list[Outgoing] | Refusal | None
        note = ""
        match message.action:
            case MotionControlAction.PAUSE:
                out = running.pause(by, now)
            case MotionControlAction.RESUME:
                out = running.resume(by, now)
                note = self._cell.motions.hold
            case MotionControlAction.PROGRAM_STOP:
                out = self._program_stop(running, by, now)
            case _:
                text = f"action {message.action}; accepted: 1 pause, 2 resume, 3 program stop"
                return Refusal(VerdictCode.BAD_ARGUMENT, text)
        return _then_verdict(out, session, message.request_id, note)

    def _program_stop(
        self, running: ProgramDesk | CellMotions, by: Holder, now: int
    ) -> Refusal | list[Outgoing]:
        """End what runs, and what is loaded to be played, which does not run yet."""
        out = running.program_stop(by, now)
        if self.recordings is None or permission(self._cell.authority, by.session, now) is not None:
            return out
        dropped = self.recordings.drop(Refusal(VerdictCode.PROGRAM_STOPPED))
        if isinstance(out, Refusal):
            return dropped or out
        return dropped + out


def _then_verdict(
    out: list[Outgoing] | Refusal | None, session: int, request_id: int, note: str = ""
) -> Refusal | list[Outgoing]:
    """Return what follows from a request that was carried out, and the verdict behind it."""
    if isinstance(out, Refusal):
        return out
    return [*(out or ()), Send(session, verdict(request_id, note=note))]
