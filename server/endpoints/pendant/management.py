"""Management requests of pendants: each is given to who handles it.

Owns the handlers of the operations that are about the cell as a whole, the table of all handlers
of a cell, and under which name an asker is noted.
"""

from __future__ import annotations

import json
import unicodedata
from typing import Any, cast

from pydantic import ConfigDict

from openpendant.motion.errors import MotionError
from openpendant.simplemsg import CommType, ReplyCode
from openpendant.simplemsg.pendant import Management
from openpendant.simplemsg.pendant.management import cell as op
from openpendant.simplemsg.pendant.management.declaration import Request

from ...cell.robot_cell import RobotCell
from ...cell.why import why
from ...environment import CellEnvironment
from ...events.effects import Effect, Send
from ...events.management_body import is_of_topic, unknown
from ...events.management_handlers import Handler, handlers_of, handles
from ...events.reply_to import ReplyTo
from ...programs.language.program_errors import ProgramError
from ...programs.program_service import ProgramService
from ...refusal import JsonBody, Refusal, refusal_of
from ...settings.cell_settings import CellSettings
from .access_requests import AccessRequests
from .escape_request import EscapeRequests
from .listeners import Listeners
from .snapshot import ServedCells, snapshot


class Failure(JsonBody):
    """A refused management request."""

    model_config = ConfigDict(extra="forbid", frozen=True, use_attribute_docstrings=True)

    code: int
    """Entry of the catalogue."""
    text: str
    """One sentence with the numbers."""
    joint: int = -1
    """Index of the joint at fault, -1 for none."""
    value: float = 0.0
    """The value at fault, SI."""
    limit: float = 0.0
    """The limit that it breaks, SI."""
    line: int | None = None
    """Where a program's text is wrong, from 1; left out where none is."""
    column: int | None = None
    """Likewise."""


class ManagementRequests:
    """The management requests of one cell."""

    def __init__(
        self,
        cell: RobotCell,
        settings: CellSettings,
        listeners: Listeners,
        access: AccessRequests,
        programs: ProgramService,
        served: ServedCells,
        retreats: EscapeRequests,
    ) -> None:
        """Start without the environment of the cell.

        Args:
            cell: the cell.
            settings: its configuration.
            listeners: the connections.
            access: answers what is about access.
            programs: answers what is about programs.
            served: all cells of the server.
            retreats: tells which key leads out of what holds a jog.
        """
        self._cell = cell
        self._settings = settings
        self._listeners = listeners
        self._served = served
        self._access = access
        self._around: CellEnvironment | None = None
        self._handlers = handlers_of(self, access, retreats) | dict(programs.handlers)

    def surround(self, around: CellEnvironment) -> None:
        """Answer requests about the cell's surroundings too."""
        self._around = around
        self._handlers |= handlers_of(around.desk, around.recordings)

    def answer(
        self,
        session: int,
        message: Management,
        operation: str,
        asked: Request[Any] | Refusal,
        now: int,
    ) -> list[Effect]:
        """Have a request answered by whom it is about, at once or later.

        Args:
            session: who asks.
            message: the message.
            operation: what its body names; empty for nothing.
            asked: the request that its body holds, or what is wrong with it.
            now: monotonic time, ns.
        """
        reply = self.reply_to(session, message)
        if isinstance(asked, Refusal):
            return reply.refuse(asked) if is_of_topic(operation) else _failed(asked, reply)
        handler = self._handlers.get(type(asked))
        if handler is None:
            return _failed(unknown(operation), reply)
        return carry_out(handler, asked, reply, now)

    def reply_to(self, session: int, message: Management) -> ReplyTo[Any]:
        """Return who asks, under the name that stands beside what it saves."""
        name = unicodedata.normalize("NFC", self._listeners[session].client).strip()
        return ReplyTo(session, message.request_id, name or f"session {session}")

    # The cell as a whole.

    @handles(op.SnapshotRequest)
    def _snapshot(
        self, asked: op.SnapshotRequest, reply: ReplyTo[op.Snapshot], now: int
    ) -> list[Effect]:
        found = snapshot(self._cell, self._settings, now, self._around)
        return reply.answer(cast(op.Snapshot, found.model_dump(mode="json")))

    @handles(op.CellsRequest)
    def _cells(
        self, asked: op.CellsRequest, reply: ReplyTo[op.ServedCells], now: int
    ) -> list[Effect]:
        return reply.answer(cast(op.ServedCells, self._served.model_dump(mode="json")))

    @handles(op.WhyRequest)
    def _why(self, asked: op.WhyRequest, reply: ReplyTo[op.Why], now: int) -> list[Effect]:
        contact = None if self._around is None else self._around.contact
        role = self._access.move_fault
        name = self._settings.name
        found = why(self._cell, name, asked, reply.session, now, contact, role)
        return reply.answer(cast(op.Why, found.model_dump(mode="json")))


def _failed(refusal: Refusal, reply: ReplyTo[Any]) -> list[Effect]:
    """Refuse what is about no topic; such answers have blanks behind commas and colons."""
    failure = Failure(code=refusal.code, text=refusal.text).model_dump(exclude_none=True)
    body = json.dumps(failure).encode()
    request_id, code = reply.request_id, ReplyCode.FAILURE
    told = Management(request_id, body, comm_type=CommType.REPLY, reply_code=code)
    return [Send(reply.session, told)]


def carry_out(handler: Handler, asked: Request[Any], reply: ReplyTo[Any], now: int) -> list[Effect]:
    """Carry out a request; an error of motion or of a program refuses it."""
    try:
        return handler(asked, reply, now)
    except MotionError as error:
        return reply.refuse(refusal_of(error))
    except ProgramError as error:
        return reply.refuse_program(error)
