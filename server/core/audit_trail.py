"""Audit trail of a cell: who moved, stopped, changed what, and when, as entries of the audit log.

Owns which event is noted and in what words. It watches and never decides; logins and refusals are
noted by `access` itself.
"""

from __future__ import annotations

from openpendant.simplemsg.pendant import AuthorityReason
from openpendant.simplemsg.verdicts import VerdictCode

from ..access.admission import Admission
from ..access.audit import AuditEntry, AuditEvent, Detail
from ..access.request_gate import Record, Visitor
from ..cell.robot_cell import RobotCell
from ..control import Holder
from ..events.cell_events import (
    AuthorityTransferred,
    CellEvent,
    MotionEnded,
    MotionRefused,
    MotionRequest,
    MotionStarted,
    OperatingModeChanged,
    ProgramEnded,
    ProgramStarted,
    StopLatchChanged,
    UncommandedMotionSeen,
)
from ..refusal import Refusal
from ..store.documents import Heading


class AuditTrail:
    """Notes what happens in one cell."""

    def __init__(self, record: Record, login: Admission, cell: RobotCell, name: str) -> None:
        """Watch a cell."""
        self._record = record
        self._login = login
        self._cell = cell
        self._name = name
        self._holder: Holder | None = None
        self._program: ProgramStarted | None = None

    def on_cell_event(self, cell_event: CellEvent, now: int) -> None:
        """Note what happened."""
        match cell_event:
            case AuthorityTransferred():
                self._authority(cell_event, now)
            case MotionStarted(request=request):
                event = AuditEvent.MOTION_BEGAN
                if self._cell.driving.driven_jog is not None:
                    event = AuditEvent.JOG_BEGAN
                self._of_request(event, request, now, at=self._place())
            case MotionRefused(request=request, refusal=refusal):
                code, text = int(refusal.code), refusal.sentence
                self._of_request(AuditEvent.REFUSED, request, now, code=code, text=text)
            case MotionEnded(request=request):
                event = AuditEvent.MOTION_ENDED if cell_event.jog is None else AuditEvent.JOG_ENDED
                told = cell_event.refusal or Refusal(VerdictCode.ACCEPTED)
                text = "" if cell_event.refusal is None else told.sentence
                about: dict[str, Detail] = {"code": int(told.code), "text": text}
                self._of_request(event, request, now, **about, at=self._place())
            case StopLatchChanged(stop=None, by=by):
                self._note(AuditEvent.RESET, by, now)
            case StopLatchChanged(stop=stop, by=by) if stop is not None:
                is_protective = stop.is_protective
                self._note(AuditEvent.STOP, by, now, reason=stop.reason, protective=is_protective)
            case OperatingModeChanged(mode=mode, by=by):
                self._note(AuditEvent.MODE, by, now, mode=mode.name.lower())
            case ProgramStarted(name=name, revision=revision, by=by):
                self._program = cell_event
                self._note(AuditEvent.PROGRAM_BEGAN, by, now, program=name, revision=revision)
            case ProgramEnded():
                self._program_ended(cell_event, now)
            case UncommandedMotionSeen(motion=motion):
                text, at = motion.sentence, self._place()
                self._note(AuditEvent.MOVED_UNCOMMANDED, None, now, text=text, at=at)

    def _place(self) -> str:
        """Return where the joints are, rad or m in the controller's order; empty while unknown."""
        position = self._cell.feedback.position or ()
        return " ".join(f"{value:.4f}" for value in position)

    def _authority(self, transferred: AuthorityTransferred, now: int) -> None:
        holder, reason = transferred.change.holder, transferred.change.reason
        if holder is None:
            how = reason.name.lower().replace("_", " ")
            self._note(AuditEvent.AUTHORITY_ENDED, self._holder, now, reason=how)
        elif reason is AuthorityReason.TAKEN_OVER:
            self._note(AuditEvent.AUTHORITY_FORCED, holder, now)
        else:
            self._note(AuditEvent.AUTHORITY_TAKEN, holder, now)
        self._holder = holder

    def _program_ended(self, ended: ProgramEnded, now: int) -> None:
        run, refusal = ended.run, ended.refusal
        detail: dict[str, Detail] = {"program": run.name, "revision": run.revision}
        detail["code"] = int(VerdictCode.ACCEPTED if refusal is None else refusal.code)
        detail["text"] = "" if refusal is None else refusal.sentence
        self._note(AuditEvent.PROGRAM_ENDED, run.by, now, **detail)
        self._program = None

    def _of_request(
        self, event: AuditEvent, request: MotionRequest, now: int, **detail: Detail
    ) -> None:
        by = self._holder
        if by is None or by.session != request.session:
            by = Holder(request.session, "")
        more: dict[str, Detail] = {"request": request.request_id}
        if self._program is not None:
            more["program"] = self._program.name
        self._note(event, by, now, **more, **detail)

    def saved(self, heading: Heading, now: int) -> None:
        """Note that a document was changed."""
        detail: dict[str, Detail] = {
            "kind": heading.kind.value,
            "document": heading.name,
            "revision": heading.revision,
            "deleted": heading.deleted,
        }
        self._record(
            AuditEntry(
                AuditEvent.DOCUMENT_CHANGED,
                now,
                who=heading.saved_by,
                cell=self._name,
                detail=detail,
            )
        )

    def _note(self, event: AuditEvent, by: Holder | None, now: int, **detail: Detail) -> None:
        """Note what somebody did, under a name that a login proved, else under none."""
        session = 0 if by is None else by.session
        visitor = self._login.visitors.find(session)
        if visitor is not None and not self._had_another_name(by, visitor):
            self._login.visitors.note(event, visitor, now, **detail)
            return
        entry = AuditEntry(
            event,
            now,
            who="" if by is None else by.client,
            source="" if visitor is None else visitor.address,
            session=session,
            cell=self._name,
            detail=detail,
        )
        self._record(entry)

    def _had_another_name(self, by: Holder | None, visitor: Visitor) -> bool:
        """Return True if somebody got the authority by a login that he has no more.

        What ends because of that was still his.
        """
        # Whoever ran a program had it when that began.
        runner = None if self._program is None else self._program.by
        if by is None or by not in (self._holder, runner):
            return False
        return visitor.grant is None or visitor.grant.name != by.name
