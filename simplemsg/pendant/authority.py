"""Messages of the motion authority: its request, its renewal and its changes."""

from enum import IntEnum
from typing import Annotated

from ..declaration import Int, Message, Text, Topic, message
from .places import from_server, to_server


class AuthorityAction(IntEnum):
    """What an `Authority` request wants."""

    REQUEST = 1
    RELEASE = 2
    FORCE = 3


class AuthorityReason(IntEnum):
    """Why the motion authority changed hands."""

    GRANTED = 1
    RELEASED = 2
    EXPIRED = 3
    CONNECTION_LOST = 4
    TAKEN_OVER = 5
    LOGGED_OUT = 6
    ROLE_LOST = 7


@message(to_server(65005, "authority", "Requests, releases or takes over the motion authority."))
class Authority(Message):
    """AUTHORITY."""

    request_id: Annotated[int, Int("chosen by the pendant")]
    action: Annotated[int, Int("1 request, 2 release, 3 take over by role", values=AuthorityAction)]


@message(
    to_server(
        65006,
        "authority_beat",
        "Keeps the motion authority; send one each second while holding it.",
        reply="none",
    )
)
class AuthorityBeat(Topic):
    """AUTHORITY_BEAT: an empty body."""


@message(from_server(65021, "authority_changed", "The motion authority changed hands."))
class AuthorityChanged(Topic):
    """AUTHORITY_CHANGED: to every connection of the cell."""

    holder: Annotated[int, Int("session that holds it now, 0 for nobody")]
    reason: Annotated[
        int,
        Int(
            "1 granted, 2 released, 3 expired, 4 connection lost, 5 taken over, 6 logged out,"
            " 7 role lost",
            values=AuthorityReason,
        ),
    ]
    client: Annotated[str, Text("name of the new holder's pendant")]


@message(from_server(65023, "authority_wanted", "Somebody asked for the authority that you hold."))
class AuthorityWanted(Topic):
    """AUTHORITY_WANTED: to its holder alone."""

    session: Annotated[int, Int("who asked")]
    client: Annotated[str, Text("name of that pendant")]
