"""Operations on connections: what one was granted, and who else is connected.

A password or a pairing code is never among these: they have messages of their own, whose fields are
declared secret.
"""

from __future__ import annotations

from typing import TypedDict

from ..roles import Permission
from .declaration import Request, operation
from .replies import Done


class WhoIAm(TypedDict):
    """What this connection was granted.

    Attributes:
        session: its number.
        name: name of the account or guest; empty where nobody logged in.
        role: viewer, operator, programmer or admin; empty likewise.
        basis: why: a password, a pairing code, or this machine's only user; empty likewise.
        permissions: what it may ask for.
    """

    session: int
    name: str
    role: str
    basis: str
    permissions: list[str]


class Session(TypedDict):
    """One connection.

    Attributes:
        session: its number.
        client: name of the pendant.
        address: where it comes from.
        name: name of the account or guest; empty where nobody logged in.
        role: likewise.
    """

    session: int
    client: str
    address: str
    name: str
    role: str


class Sessions(TypedDict):
    """Who is connected to this cell.

    Attributes:
        sessions: all that said hello.
    """

    sessions: list[Session]


@operation("access.whoami", needs=None)
class WhoAmI(Request[WhoIAm]):
    """Return what this connection was granted."""


@operation("access.logout", needs=None)
class Logout(Request[Done]):
    """End what this connection was granted."""


@operation("access.sessions", needs=Permission.PAIR_GUESTS)
class ListSessions(Request[Sessions]):
    """Return who is connected to this cell."""
