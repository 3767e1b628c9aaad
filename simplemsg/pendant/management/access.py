"""Operations on connections and accounts: what a connection was granted, and who has an account.

A password or a pairing code is never among these: they have messages of their own, whose fields are
declared secret.
"""

from __future__ import annotations

from typing import Annotated, Literal, NotRequired, TypeAlias, TypedDict

from ..roles import Permission, Role
from .declaration import Count, Done, ReadAs, Request, operation


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
        enabling_deadline: its enabling device (training) counts as let go after so long a silence
            [s]; an older server says nothing of it.
    """

    session: int
    client: str
    address: str
    name: str
    role: str
    enabling_deadline: NotRequired[float]


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


StandingName: TypeAlias = Literal[
    "account", "pairing", "single user", "ros-industrial", "stranger", "stop"
]


class ConnectionReport(TypedDict):
    """One connection of the server, to whichever cell.

    Attributes:
        session: its number.
        address: where it comes from.
        standing: as what it has its place: an account or a pairing code, this machine's only user,
            ROS-Industrial, a stranger who has not logged in, or a stranger who may only stop.
        client: name of the pendant; empty where it has not said hello.
        cell: name of its cell; likewise.
        name: name of the account or guest; empty where nobody logged in.
        role: likewise.
        since: how long it has been open [s].
        frames: frames that it sent in the last second.
        bytes: bytes that it sent in the last second.
        cost: share of one processor core that the server spent on it in the last second, 0 to 1.
    """

    session: int
    address: str
    standing: StandingName
    client: str
    cell: str
    name: str
    role: str
    since: float
    frames: int
    bytes: int
    cost: float


class Bar(TypedDict):
    """One barred address.

    Attributes:
        address: the address, or the /64 network of one of IPv6.
        remaining: for how much longer [s].
    """

    address: str
    remaining: float


class Connections(TypedDict):
    """Who is connected to the server, in the order of the numbers.

    Attributes:
        connections: at most a hundred.
        more: how many follow; ask again with the last number as `after`.
        barred: addresses of which nobody may do more than stop, the soonest to be free first.
    """

    connections: list[ConnectionReport]
    more: int
    barred: list[Bar]


class ClosedConnections(TypedDict):
    """What was closed.

    Attributes:
        closed: how many connections.
    """

    closed: int


@operation("access.connections", needs=Permission.MANAGE_USERS)
class ListConnections(Request[Connections]):
    """Return every connection of the server with its address, standing, rate and cost."""

    after: Annotated[int, Count(0)] = 0
    """only connections with a greater number."""


@operation("access.close", needs=Permission.MANAGE_USERS)
class CloseConnection(Request[Done]):
    """Close a connection at once, of whatever cell; what it moves is stopped.

    Raises:
        Refused: UNKNOWN_CONNECTION; BAD_ARGUMENT for one's own.
    """

    session: Annotated[int, Count(1)]
    """its number."""


@operation("access.bar", needs=Permission.MANAGE_USERS)
class BarAddress(Request[ClosedConnections]):
    """Let nobody of an address in, not even to stop, and close what is open from there.

    A bar ends by itself, and with the server.

    Raises:
        Refused: BAR_REFUSED for this machine, for one's own address, and for one from which an
            admin is logged in; BAD_ARGUMENT.
    """

    address: str
    """of IPv4, or of IPv6 for its whole /64 network."""
    minutes: Annotated[int, Count(1, 1440)] = 60
    """for so long, at most a day."""


@operation("access.unbar", needs=Permission.MANAGE_USERS)
class UnbarAddress(Request[Done]):
    """Let an address in again.

    Raises:
        Refused: BAD_ARGUMENT where it is not barred.
    """

    address: str
    """as it was barred, or as `access.connections` shows it."""


class ServerExposure(TypedDict):
    """What a gateway has to know before other machines may reach the server through it.

    Attributes:
        logins_demanded: whether who comes from another machine has to log in to do more than stop.
        tls: whether the pendant port is encrypted.
    """

    logins_demanded: bool
    tls: bool


@operation("access.exposure", needs=None, since=3)
class ReadExposure(Request[ServerExposure]):
    """Return whether logins are demanded of other machines, and whether the port is encrypted."""


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
