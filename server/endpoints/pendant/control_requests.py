"""Control requests of pendants: motion authority, stops, modes, speeds, and control of a program.

The authority is taken, taken over and given back. Owns who is told of such a request; who may have
the authority is the cell's rule, and how long a lease lives is `authority`'s.

Owns what a stop, a change of mode or speed, a pause, a resume or a program stop acts on: the
program that runs, else the motion of the cell. Whether it is permitted is the cell's rule.
"""

from __future__ import annotations

from openpendant.simplemsg import CommType
from openpendant.simplemsg.pendant import (
    Authority,
    AuthorityAction,
    AuthorityReason,
    MotionControl,
    MotionControlAction,
    ResetStop,
    SetMode,
    SetSpeed,
    SoftwareStop,
)
from openpendant.simplemsg.pendant.roles import Permission
from openpendant.simplemsg.verdicts import VerdictCode

from ...cell.cell_motions import CellMotions
from ...cell.interlocks import permission
from ...cell.robot_cell import RobotCell
from ...control import Holder
from ...events.effects import Effect, Send
from ...events.replies import REASON_BYTES, authority_wanted, cut, verdict
from ...programs.execution.program_executor import ProgramExecutor
from ...recording.recording_service import RecordingService
from ...refusal import Refusal
from .access_requests import AccessRequests
from .jog_requests import JogRequests
from .notifications import Listener, Listeners


class AuthorityRequests:
    """The motion authority of one cell, for its pendants."""

    def __init__(self, cell: RobotCell, listeners: Listeners) -> None:
        """Start with no request in progress."""
        self._cell = cell
        self._listeners = listeners

    def authority(self, session: int, message: Authority, now: int) -> Refusal | list[Effect]:
        """Give the authority, take it over or take it back."""
        match message.action:
            case AuthorityAction.REQUEST:
                return self._take(session, message.request_id, now)
            case AuthorityAction.FORCE:
                return self._take(session, message.request_id, now, force=True)
            case AuthorityAction.RELEASE:
                change = self._cell.authority.release(session, AuthorityReason.RELEASED)
                if change is None:
                    return Refusal(VerdictCode.NOT_IN_CONTROL)
                gone = self._cell.authority_gone(change, now)
                return [*gone, Send(session, verdict(message.request_id))]
        text = f"action {message.action}; accepted: 1 request, 2 release, 3 take over"
        return Refusal(VerdictCode.BAD_ARGUMENT, text)

    def follow(self, listener: Listener, access: AccessRequests, now: int) -> list[Effect]:
        """End the authority of a pendant that is somebody else now, or may not move any more."""
        session, holder = listener.session, self._cell.authority.holder
        if holder is None or holder.session != session:
            return []
        if holder == listener.holder and access.may(session, Permission.MOVE):
            return []
        # Whoever is still logged in by that name has lost the role alone.
        is_in = "" != access.name_of(session, "") == holder.client
        reason = AuthorityReason.ROLE_LOST if is_in else AuthorityReason.LOGGED_OUT
        change = self._cell.authority.release(session, reason)
        return self._cell.authority_gone(change, now)

    def _take(
        self, session: int, request_id: int, now: int, *, force: bool = False
    ) -> list[Effect]:
        """Give the authority to a pendant; where another has it, tell that one who asks."""
        reply_to = self._listeners[session].holder
        before = self._cell.authority.holder
        taken = self._cell.take_authority(reply_to, now, beats=True, force=force)
        if not isinstance(taken, Refusal):
            # A take-over stops what moves, and the stop leaves first.
            return [*taken, Send(session, verdict(request_id))]
        out: list[Effect] = [Send(session, verdict(request_id, taken))]
        if before is not None and before.session in self._listeners:
            out.append(Send(before.session, authority_wanted(reply_to)))
        return out


class ControlRequests:
    """Stops, modes and speeds of one cell, for its pendants."""

    def __init__(
        self,
        cell: RobotCell,
        listeners: Listeners,
        jogs: JogRequests,
        programs: ProgramExecutor,
        recordings: RecordingService | None,
    ) -> None:
        """Start with no request in progress.

        Args:
            recordings: loads what is to be played; None where the cell has none.
        """
        self._cell = cell
        self._listeners = listeners
        self._jogs = jogs
        self._programs = programs
        self._recordings = recordings

    def software_stop(self, session: int, message: SoftwareStop, now: int) -> list[Effect]:
        """Stop the robot; the stop leaves before the verdict, and a topic has none."""
        by = self._listeners[session].holder
        out = self._cell.software_stop(by, cut(message.reason, REASON_BYTES), now)
        if message.comm_type == CommType.REQUEST:
            out.append(Send(session, verdict(message.request_id)))
        return out

    def reset_stop(self, session: int, message: ResetStop, now: int) -> Refusal | list[Effect]:
        """Unlatch the stop; whoever asked gets the verdict before the notification."""
        reset = self._cell.reset_stop(self._listeners[session].holder, now)
        if isinstance(reset, Refusal):
            return reset
        return [Send(session, verdict(message.request_id)), *reset]

    def set_mode(self, session: int, message: SetMode, now: int) -> Refusal | list[Effect]:
        """Set the mode of operation; what stops because of it stops before the verdict."""
        out = self._cell.set_mode(self._listeners[session].holder, message.mode, now)
        return _then_verdict(out, session, message.request_id)

    def set_speed(self, session: int, message: SetSpeed, now: int) -> Refusal | list[Effect]:
        """Set speed override and cap; a jog that is driven follows at once, and 0 pauses."""
        by = self._listeners[session].holder
        refusal = self._cell.motions.set_speed(by, message.override, message.tool_speed, now)
        if refusal is not None:
            return refusal
        self._jogs.respeed(now)
        return _then_verdict(self._programs.respeed(by, now), session, message.request_id)

    def motion_control(
        self, session: int, message: MotionControl, now: int
    ) -> Refusal | list[Effect]:
        """Pause, resume or end what runs; a resume tells what keeps the robot at rest even so."""
        by = self._listeners[session].holder
        running = self._programs if self._programs.is_under_way else self._cell.motions
        out: list[Effect] | Refusal | None
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
        self, running: ProgramExecutor | CellMotions, by: Holder, now: int
    ) -> Refusal | list[Effect]:
        """End what runs, and what is loaded to be played, which does not run yet."""
        out = running.program_stop(by, now)
        if (
            self._recordings is None
            or permission(self._cell.authority, by.session, now) is not None
        ):
            return out
        dropped = self._recordings.drop(Refusal(VerdictCode.PROGRAM_STOPPED))
        if isinstance(out, Refusal):
            return dropped or out
        return dropped + out


def _then_verdict(
    out: list[Effect] | Refusal | None, session: int, request_id: int, note: str = ""
) -> Refusal | list[Effect]:
    """Return what follows from a request that was carried out, and the verdict behind it."""
    if isinstance(out, Refusal):
        return out
    return [*(out or ()), Send(session, verdict(request_id, note=note))]
