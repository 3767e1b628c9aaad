"""Messages of login, accounts and the pairing of guests."""

from enum import IntEnum
from typing import Annotated

from ..declaration import Int, Message, Reply, Text, message
from .places import from_server, to_server


class LoginKind(IntEnum):
    """How a connection shows who it is."""

    PASSWORD = 1
    PAIRING = 2


class AccountRole(IntEnum):
    """What an account may do; each role may do all that the ones before it may."""

    AS_IT_IS = 0
    VIEWER = 1
    OPERATOR = 2
    PROGRAMMER = 3
    ADMIN = 4


class PairingAction(IntEnum):
    """What a `Pairing` request wants."""

    ISSUE = 1
    WITHDRAW = 2


@message(to_server(65007, "login", "Shows who is at the pendant, by password or pairing code."))
class Login(Message):
    """LOGIN: only where the server asks for it; a software stop never does."""

    request_id: Annotated[int, Int("chosen by the pendant")]
    kind: Annotated[int, Int("1 password, 2 pairing code", values=LoginKind)]
    name: Annotated[str, Text("account, or the name of a guest")]
    secret: Annotated[str, Text("password or pairing code", size=128, secret=True)]


@message(to_server(65008, "set_account", "Adds an account, or gives one another password."))
class SetAccount(Message):
    """SET_ACCOUNT: for admins; the verdict comes when the account is saved."""

    request_id: Annotated[int, Int("chosen by the pendant")]
    role: Annotated[
        int,
        Int(
            "of a new account: 1 viewer, 2 operator, 3 programmer, 4 admin; 0 for a new password",
            values=AccountRole,
        ),
    ]
    name: Annotated[str, Text("the account")]
    secret: Annotated[str, Text("its new password", size=128, secret=True)]


@message(
    to_server(
        65009,
        "pairing",
        "Asks for a pairing code of the cell, or ends it and the guests that it let in.",
        reply="pairing; verdict for a refusal and for an end",
    )
)
class Pairing(Message):
    """PAIRING: for admins."""

    request_id: Annotated[int, Int("chosen by the pendant")]
    action: Annotated[int, Int("1 issue, 2 withdraw", values=PairingAction)]


@message(
    from_server(65009, "pairing", "Tells the pairing code to whoever asked for it.", is_reply=True)
)
class PairingReply(Reply):
    """PAIRING reply."""

    request_id: Annotated[int, Int("of the request")]
    lifetime: Annotated[int, Int("the code ends so long after this reply", "s")]
    code: Annotated[str, Text("as a teacher shows it", size=8, secret=True)]
