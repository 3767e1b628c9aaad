"""Connections and what each was granted; whether one may do what it asks.

Owns the rule that a grant belongs to one connection and ends with it: there is no token that
another connection could present (promise 28). `admission` owns how a grant is earned.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from enum import Enum

from openpendant.simplemsg.pendant.roles import (
    LEAST_ROLE,
    PERMISSIONS_OF,
    WITHOUT_LOGIN,
    Permission,
    Role,
)
from openpendant.simplemsg.verdicts import VerdictCode

from ..refusal import Refusal
from .audit import AuditEntry, AuditEvent, Detail
from .exposure import is_loopback


class Basis(Enum):
    """Basis of a grant."""

    SINGLE_USER = "single user"
    ACCOUNT = "account"
    PAIRING = "pairing"


@dataclass(frozen=True, slots=True)
class Granted:
    """Grant of a connection."""

    session: int
    role: Role
    name: str
    basis: Basis


@dataclass(frozen=True, slots=True)
class GrantEnded:
    """A connection's grant ended without its doing: it may now do what anybody may."""

    session: int
    reason: str


@dataclass(slots=True)
class Visitor:
    """A connection that completed hello.

    Attributes:
        session: its number, never used again.
        ended: why its last grant ended; empty where none did.
    """

    session: int
    address: str
    client: str
    cell: str
    grant: Granted | None = None
    checking: bool = False
    ended: str = ""


Record = Callable[[AuditEntry], None]
"""Takes what is to be noted in the audit log; must not block."""


class Visitors:
    """The connections of one process."""

    def __init__(self, record: Record, *, observe_without_login: bool) -> None:
        self._record = record
        self._observe_without_login = observe_without_login
        self._visitors: dict[int, Visitor] = {}

    def __iter__(self) -> Iterator[Visitor]:
        return iter(self._visitors.values())

    def __len__(self) -> int:
        return len(self._visitors)

    def find(self, session: int) -> Visitor | None:
        """Return a connection; None where it has not completed hello, or is gone."""
        return self._visitors.get(session)

    def add(self, visitor: Visitor, now: int) -> None:
        """Take a connection that completed hello."""
        self._visitors[visitor.session] = visitor
        self.note(AuditEvent.CONNECTED, visitor, now, client=visitor.client)

    def remove(self, session: int, now: int) -> None:
        """Forget a connection and its grant."""
        visitor = self._visitors.pop(session, None)
        if visitor is not None:
            self.note(AuditEvent.DISCONNECTED, visitor, now)

    def may(self, session: int, permission: Permission) -> Refusal | None:
        """Return why a connection may not do something; None where it may."""
        visitor = self._visitors.get(session)
        if visitor is None:
            return Refusal(VerdictCode.HELLO_FIRST)
        if permission in WITHOUT_LOGIN:
            return None
        grant = visitor.grant
        if grant is not None and permission in PERMISSIONS_OF[grant.role]:
            return None
        needs = f"{permission.value} needs the role {LEAST_ROLE[permission].value}"
        if grant is None:
            if permission is Permission.OBSERVE and self._may_look_on(visitor):
                return None
            why = f": {visitor.ended}" if visitor.ended else ""
            return Refusal(VerdictCode.LOGIN_NEEDED, f"{needs}; this connection has none{why}")
        text = f"{needs}; {grant.name} is {grant.role.value}"
        return Refusal(VerdictCode.ROLE_TOO_LOW, text)

    def _may_look_on(self, visitor: Visitor) -> bool:
        return self._observe_without_login or is_loopback(visitor.address)

    def end(self, visitor: Visitor, reason: str, now: int) -> GrantEnded:
        """Take back what a connection was granted."""
        self.note(AuditEvent.LOGOUT, visitor, now, reason=reason)
        visitor.grant = None
        visitor.ended = reason
        return GrantEnded(visitor.session, reason)

    def note(self, event: AuditEvent, visitor: Visitor, now: int, **detail: Detail) -> None:
        """Note what a connection did; of one without a login, what it calls itself."""
        grant = visitor.grant
        if grant is None:
            detail.setdefault("client", visitor.client)
        entry = AuditEntry(
            event,
            now,
            who="" if grant is None else grant.name,
            role="" if grant is None else grant.role.value,
            source=visitor.address,
            session=visitor.session,
            cell=visitor.cell,
            detail=detail,
        )
        self._record(entry)
