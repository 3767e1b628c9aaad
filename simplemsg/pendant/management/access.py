"""Operations on connections and accounts: what a connection was granted, and who has an account.

A password or a pairing code is never among these: they have messages of their own, whose fields are
declared secret.
"""

from __future__ import annotations

from typing import Annotated, Literal, TypeAlias, TypedDict

from ..roles import Permission, Role
from .declaration import Done, ReadAs, Request, operation


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


RoleName: TypeAlias = Literal["viewer", "operator", "programmer", "admin"]


class User(TypedDict):
    """One account.

    Attributes:
        name: name of the account.
        role: what it may do.
        disabled: whether nobody may log in with it.
    """

    name: str
    role: RoleName
    disabled: bool


class UnreadableUser(TypedDict):
    """A document that should be an account and cannot be read: nobody logs in with it.

    Attributes:
        name: its name.
        problem: what is wrong with it.
    """

    name: str
    problem: str


class Users(TypedDict):
    """Which accounts there are.

    Attributes:
        users: by name.
        unreadable: what should be accounts and cannot be read, by name; they can be removed.
    """

    users: list[User]
    unreadable: list[UnreadableUser]


@operation("users.list", needs=Permission.MANAGE_USERS)
class ListUsers(Request[Users]):
    """Return which accounts there are."""


@operation("users.remove", needs=Permission.MANAGE_USERS)
class RemoveUser(Request[Done]):
    """Remove an account; whoever is logged in with it is logged out.

    Raises:
        Refused: UNKNOWN_ACCOUNT, LAST_ADMIN.
    """

    name: str
    """name of the account."""


@operation("users.set_role", needs=Permission.MANAGE_USERS)
class SetUserRole(Request[Done]):
    """Give an account another role, which holds at once.

    Raises:
        Refused: UNKNOWN_ACCOUNT, LAST_ADMIN.
    """

    name: str
    """name of the account."""
    role: Annotated[RoleName, ReadAs(Role)]
    """viewer, operator, programmer or admin."""


@operation("users.disable", needs=Permission.MANAGE_USERS)
class DisableUser(Request[Done]):
    """Keep an account but let nobody log in with it.

    Raises:
        Refused: UNKNOWN_ACCOUNT, LAST_ADMIN.
    """

    name: str
    """name of the account."""


@operation("users.enable", needs=Permission.MANAGE_USERS)
class EnableUser(Request[Done]):
    """Let an account be used again.

    Raises:
        Refused: UNKNOWN_ACCOUNT.
    """

    name: str
    """name of the account."""
