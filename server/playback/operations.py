"""The management requests about programs, as JSON, and how they are answered.

Owns the fields of each request and of a refused one's answer. What a request does is told by
`program_library` and `dry_run_desk`.
"""

from __future__ import annotations

import json
import unicodedata
from typing import Annotated, Any, Literal, TypeAlias

from pydantic import Field, TypeAdapter

from openpendant.simplemsg import CommType, ReplyCode
from openpendant.simplemsg.pendant import MAX_PENDANT_FRAME, Management
from openpendant.simplemsg.verdicts import VerdictCode

from ..operation_body import OperationBody
from ..outgoing import Outgoing, Send
from ..programs.edits import Edit
from ..programs.errors import ProgramError, ProgramSyntaxError
from ..programs.program import MOST_STATEMENTS
from ..programs.statements import Move
from ..programs.work import ProgramRefused
from ..refusal import Refusal

PREFIX = "programs."
"""How the names of these operations begin."""

MOST_ANSWER = MAX_PENDANT_FRAME - 64
"""Largest body of an answer; the rest of the frame is headers [bytes]."""

MOST_PARTS = 1_000
"""Parts in which a program may be saved."""

Revision = Annotated[int, Field(ge=0, description="the one that the change was made from")]


class ListPrograms(OperationBody):
    """Asks which programs there are, by name."""

    op: Literal["programs.list"]
    first: Annotated[int, Field(ge=0)] = 0
    """How many to leave out at the beginning."""


class CreateProgram(OperationBody):
    """Makes an empty program of this robot."""

    op: Literal["programs.create"]
    name: str
    frame: str = "base"
    tool: str = "flange"


class LoadProgram(OperationBody):
    """Asks for a program, or for a part of it where it is long."""

    op: Literal["programs.load"]
    name: str
    format: Literal["text", "json"] = "text"
    revision: int | None = None
    """An older one, where it is still kept."""
    offset: Annotated[int, Field(ge=0)] = 0
    """Characters to leave out at the beginning."""


class ProgramHistory(OperationBody):
    """Asks which revisions of a program are kept."""

    op: Literal["programs.history"]
    name: str


class SaveProgram(OperationBody):
    """Saves a whole program; one that is too long for a frame comes in parts, in order."""

    op: Literal["programs.save"]
    name: str
    format: Literal["text", "json"] = "text"
    body: str
    expected_revision: Revision
    part: Annotated[int, Field(ge=1, le=MOST_PARTS)] = 1
    parts: Annotated[int, Field(ge=1, le=MOST_PARTS)] = 1


class CheckProgram(OperationBody):
    """Asks whether a text is a program of this robot; saves nothing."""

    op: Literal["programs.check"]
    body: str
    format: Literal["text", "json"] = "text"


class DeleteProgram(OperationBody):
    """Deletes a program; its revisions stay in its history."""

    op: Literal["programs.delete"]
    name: str
    expected_revision: Revision


class RenameProgram(OperationBody):
    """Gives a program another name; calls in other programs are not changed."""

    op: Literal["programs.rename"]
    name: str
    new_name: str
    expected_revision: Revision


class EditProgram(OperationBody):
    """Edits a program by one of the edits."""

    op: Literal["programs.edit"]
    name: str
    expected_revision: Revision
    edit: Annotated[Edit, Field(discriminator="edit")]


class RecordPoint(OperationBody):
    """Adds a point where the robot stands, and the move to it."""

    op: Literal["programs.record"]
    name: str
    expected_revision: Revision
    point: str
    move: Move | None = None
    """A move that names the point; None for the point alone."""
    at: int | None = None
    """The statement that the move is put before, from 0; None to append it."""
    comment: str = ""


class TouchUpPoint(OperationBody):
    """Puts a point where the robot stands now."""

    op: Literal["programs.touch_up"]
    name: str
    expected_revision: Revision
    point: str


class UndoEdit(OperationBody):
    """Takes the last edit back."""

    op: Literal["programs.undo"]
    name: str
    expected_revision: Revision


class RedoEdit(OperationBody):
    """Makes the edit again that was taken back last."""

    op: Literal["programs.redo"]
    name: str
    expected_revision: Revision


class SetBreakpoints(OperationBody):
    """Names the statements of a program to pause before, from 0; none to run through."""

    op: Literal["programs.breakpoints"]
    name: str
    statements: Annotated[
        tuple[Annotated[int, Field(ge=0, lt=MOST_STATEMENTS)], ...], Field(max_length=1_000)
    ]


class StartDryRun(OperationBody):
    """Asks what would happen if a program ran; nothing moves."""

    op: Literal["programs.dry_run"]
    name: str


class DryRunProgress(OperationBody):
    """Asks how far the dry run is that is under way."""

    op: Literal["programs.dry_run_progress"]


Operation: TypeAlias = (
    ListPrograms
    | CreateProgram
    | LoadProgram
    | ProgramHistory
    | SaveProgram
    | CheckProgram
    | DeleteProgram
    | RenameProgram
    | EditProgram
    | RecordPoint
    | TouchUpPoint
    | UndoEdit
    | RedoEdit
    | SetBreakpoints
    | StartDryRun
    | DryRunProgress
)

OPERATION: TypeAdapter[Operation] = TypeAdapter(Annotated[Operation, Field(discriminator="op")])
"""Reads the JSON of a request about programs."""


def author_name(session: int, client: str) -> str:
    """Return what stands beside what a connection saves: its name, or its number."""
    name = unicodedata.normalize("NFC", client).strip()
    return name or f"session {session}"


class Asker:
    """Who asked, and how the answer gets there.

    Attributes:
        session: number of the connection.
        name: as it stands beside what was saved.
        request_id: the asker's own number for it.
    """

    def __init__(self, session: int, request_id: int, name: str) -> None:
        """Take note of one request."""
        self.session = session
        self.name = name
        self.request_id = request_id

    def answer(self, **fields: Any) -> list[Outgoing]:
        """Return the answer to a request that was carried out."""
        return self._reply(fields, ReplyCode.SUCCESS)

    def refuse(self, refusal: Refusal, **fields: Any) -> list[Outgoing]:
        """Return the answer to a request that was not."""
        about = {
            "code": int(refusal.code),
            "text": refusal.sentence,
            "joint": refusal.joint,
            "value": refusal.value,
            "limit": refusal.limit,
        }
        return self._reply(about | fields, ReplyCode.FAILURE)

    def refuse_program(self, error: ProgramError) -> list[Outgoing]:
        """Return the answer that says what is wrong with a program, and where in its text."""
        if isinstance(error, ProgramSyntaxError):
            return self.refuse(error.refusal, line=error.line, column=error.column)
        return self.refuse(error.refusal)

    def refuse_work(self, refused: ProgramRefused) -> list[Outgoing]:
        """As `refuse_program`, of what was wrong where a task was done."""
        if refused.line is None:
            return self.refuse(refused.refusal)
        return self.refuse(refused.refusal, line=refused.line, column=refused.column)

    def _reply(self, fields: dict[str, Any], code: ReplyCode) -> list[Outgoing]:
        body = json.dumps(fields, ensure_ascii=False, separators=(",", ":")).encode()
        if len(body) > MOST_ANSWER:
            text = f"the answer has {len(body)} bytes; accepted by a frame: {MOST_ANSWER}"
            refusal = Refusal(VerdictCode.TOO_LARGE, text, value=len(body), limit=MOST_ANSWER)
            return self.refuse(refusal)
        reply = Management(self.request_id, body, comm_type=CommType.REPLY, reply_code=code)
        return [Send(self.session, reply)]
