"""Sender of a management request, and the route of its reply."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any, Generic, TypeVar, cast

from openpendant.simplemsg import CommType, ReplyCode
from openpendant.simplemsg.pendant import MAX_PENDANT_FRAME, Management
from openpendant.simplemsg.verdicts import VerdictCode

from ..programs.editing.program_tasks import ProgramRefused
from ..programs.language.program_errors import ProgramError, ProgramSyntaxError
from ..refusal import Refusal
from .effects import Effect, Send

Answer = TypeVar("Answer", contravariant=True)

MOST_ANSWER = MAX_PENDANT_FRAME - 64
"""Largest body of an answer; the rest of the frame is headers [bytes]."""


class ReplyTo(Generic[Answer]):
    """Sender of one request; makes its reply, a JSON object with the keys of `Answer`.

    Attributes:
        session: number of the connection.
        name: of the author, as saved with a change.
        request_id: the client's own number for the request.
    """

    def __init__(self, session: int, request_id: int, name: str) -> None:
        """Take note of one request."""
        self.session = session
        self.name = name
        self.request_id = request_id

    def answer(self, body: Answer) -> list[Effect]:
        """Return the answer to a request that was carried out."""
        return self._reply(cast(Mapping[str, Any], body), ReplyCode.SUCCESS)

    def refuse(self, refusal: Refusal, **fields: Any) -> list[Effect]:
        """Return the answer to a request that was refused."""
        about = {
            "code": int(refusal.code),
            "text": refusal.sentence,
            "joint": refusal.joint,
            "value": refusal.value,
            "limit": refusal.limit,
        }
        return self._reply(about | fields, ReplyCode.FAILURE)

    def refuse_program(self, error: ProgramError) -> list[Effect]:
        """Return the answer that says what is wrong with a program, and where in its text."""
        if isinstance(error, ProgramSyntaxError):
            return self.refuse(error.refusal, line=error.line, column=error.column)
        return self.refuse(error.refusal)

    def refuse_work(self, refused: ProgramRefused) -> list[Effect]:
        """Return the refusal of a program task, with the place in the text where it has one."""
        if refused.line is None:
            return self.refuse(refused.refusal)
        return self.refuse(refused.refusal, line=refused.line, column=refused.column)

    def _reply(self, fields: Mapping[str, Any], code: ReplyCode) -> list[Effect]:
        body = json.dumps(fields, ensure_ascii=False, separators=(",", ":")).encode()
        if len(body) > MOST_ANSWER:
            text = f"the answer has {len(body)} bytes; accepted by a frame: {MOST_ANSWER}"
            refusal = Refusal(VerdictCode.TOO_LARGE, text, value=len(body), limit=MOST_ANSWER)
            return self.refuse(refusal)
        reply = Management(self.request_id, body, comm_type=CommType.REPLY, reply_code=code)
        return [Send(self.session, reply)]
