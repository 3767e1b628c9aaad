"""The management requests about who is connected and who has an account, as JSON.

Owns the fields of each request and of its answer. No secret is ever among them: a password or a
pairing code has a message of its own, whose field is declared secret.
"""

from __future__ import annotations

from typing import Annotated, Literal, TypeAlias

from pydantic import Field, TypeAdapter

from ..pendant.management_bodies import Body
from .roles import Role

PREFIXES = ("access.", "users.")
"""How the names of these operations begin."""


class WhoAmI(Body):
    """Asks what this connection was granted."""

    op: Literal["access.whoami"]


class Logout(Body):
    """Ends what this connection was granted."""

    op: Literal["access.logout"]


class ListSessions(Body):
    """Asks who is connected to this cell."""

    op: Literal["access.sessions"]


class ListUsers(Body):
    """Asks which accounts there are."""

    op: Literal["users.list"]


class RemoveUser(Body):
    """Removes an account; whoever is logged in with it is logged out."""

    op: Literal["users.remove"]
    name: str


class SetUserRole(Body):
    """Gives an account another role, which holds at once."""

    op: Literal["users.set_role"]
    name: str
    role: Role


class DisableUser(Body):
    """Keeps an account but lets nobody log in with it, or lets them again."""

    op: Literal["users.disable", "users.enable"]
    name: str


AccessOperation: TypeAlias = (
    WhoAmI | Logout | ListSessions | ListUsers | RemoveUser | SetUserRole | DisableUser
)

ACCESS_OPERATION: TypeAdapter[AccessOperation] = TypeAdapter(
    Annotated[AccessOperation, Field(discriminator="op")]
)
"""Reads the JSON of a request about access."""
