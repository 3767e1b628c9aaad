"""The gate of the pendant face: may this connection ask this, now and for the first time?

Owns the order of the questions (role, then order of the frames) and what of the answers is noted
in the audit log. Which permission a request needs is `permissions`' table, who has it `grants`',
and what is a repetition `request_order`'s.
"""

from __future__ import annotations

from openpendant.simplemsg import Message

from ..refusal import Refusal
from .admission import Login
from .audit import AuditEvent, Detail
from .permissions import change_of, is_in_order, permission_of
from .request_order import RequestOrder


class RequestGate:
    """What each request of a cell's pendants passes before anybody looks at it."""

    def __init__(self, login: Login) -> None:
        """Have let nobody through.

        Args:
            login: who the connections are.
        """
        self._login = login
        self._order = RequestOrder()

    def refusal(self, session: int, message: Message, now: int) -> Refusal | None:
        """Return why a connection may not ask something, and note it; None where it may."""
        permission = permission_of(message)
        if permission is None:
            return None
        refusal = self._login.may(session, permission)
        if refusal is None and is_in_order(message):
            refusal = self._order.take(session, getattr(message, "request_id", 0))
        if refusal is not None:
            wanted, code = permission.value, int(refusal.code)
            self._note(AuditEvent.REFUSED, session, now, wanted=wanted, code=code)
            return refusal
        change = change_of(message)
        if change:
            self._note(AuditEvent.CHANGE_ASKED, session, now, operation=change)
        return None

    def turned_down(self, session: int, message: Message, refusal: Refusal, now: int) -> None:
        """Note that a request which could move the robot was let in and refused after all."""
        if not is_in_order(message):
            return
        about: dict[str, Detail] = {
            "wanted": type(message).PLACE.name,
            "request": getattr(message, "request_id", 0),
            "code": int(refusal.code),
            "text": refusal.sentence,
        }
        self._note(AuditEvent.REFUSED, session, now, **about)

    def closed(self, session: int) -> None:
        """Forget a connection that ended."""
        self._order.forget(session)

    def _note(self, event: AuditEvent, session: int, now: int, **detail: Detail) -> None:
        visitor = self._login.visitors.find(session)
        if visitor is not None:
            self._login.visitors.note(event, visitor, now, **detail)
