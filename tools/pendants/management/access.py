"""Who this connection is, who else is connected, and who has an account.

A password or a pairing code is never among these: they have messages of their own, `login`,
`add_account`, `set_password` and `issue_pairing_code`.
"""

from __future__ import annotations

from typing import Literal, TypedDict

from .calls import Request, asks, call
from .devices import Done

RoleName = Literal["viewer", "operator", "programmer", "admin"]


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


class AccessCalls:
    """The operations on connections."""

    @call
    def whoami(self) -> Request[WhoIAm]:
        """Return what this connection was granted."""
        return asks("access.whoami")

    @call
    def logout(self) -> Request[Done]:
        """End what this connection was granted."""
        return asks("access.logout")

    @call
    def sessions(self) -> Request[Sessions]:
        """Return who is connected to this cell."""
        return asks("access.sessions")


class UserCalls:
    """The operations on accounts."""

    @call
    def list(self) -> Request[Users]:
        """Return which accounts there are."""
        return asks("users.list")

    @call
    def remove(self, name: str) -> Request[Done]:
        """Remove an account; whoever is logged in with it is logged out.

        Args:
            name: name of the account.

        Raises:
            Refused: UNKNOWN_ACCOUNT, LAST_ADMIN.
        """
        return asks("users.remove", name=name)

    @call
    def set_role(self, name: str, role: RoleName) -> Request[Done]:
        """Give an account another role, which holds at once.

        Args:
            name: name of the account.
            role: viewer, operator, programmer or admin.

        Raises:
            Refused: UNKNOWN_ACCOUNT, LAST_ADMIN.
        """
        return asks("users.set_role", name=name, role=role)

    @call
    def disable(self, name: str) -> Request[Done]:
        """Keep an account but let nobody log in with it.

        Args:
            name: name of the account.

        Raises:
            Refused: UNKNOWN_ACCOUNT, LAST_ADMIN.
        """
        return asks("users.disable", name=name)

    @call
    def enable(self, name: str) -> Request[Done]:
        """Let an account be used again.

        Args:
            name: name of the account.

        Raises:
            Refused: UNKNOWN_ACCOUNT.
        """
        return asks("users.enable", name=name)
