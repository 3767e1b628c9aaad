"""Messages before hello: whose connection a gateway has, and the lobby where a cell is chosen."""

from enum import IntEnum
from typing import Annotated

from ..declaration import Int, Message, Reply, Tail, Text
from .places import from_server, to_server


class Encrypted(IntEnum):
    """Whether a browser came to the gateway by TLS."""

    NO = 0
    YES = 1


@to_server(
    65050,
    "forwarded",
    "Says for whom a gateway opened this connection; always the very first frame.",
    reply="header only",
    since=3,
)
class Forwarded(Message):
    """FORWARDED: from a gateway that the server's configuration names; refused, it is closed."""

    gateway: Annotated[str, Text("name of the gateway in the server's configuration")]
    secret: Annotated[str, Text("its secret, 32 bytes in hexadecimal", size=64, secret=True)]
    address: Annotated[str, Text("address of the browser, IPv4 or IPv6, without a port", size=64)]
    is_encrypted: Annotated[int, Int("1 if the browser came by TLS, else 0", values=Encrypted)]


@to_server(
    65052,
    "lobby",
    "Asks which cells there are, before or after hello; once a second.",
    reply="lobby; verdict for a refusal",
    since=3,
)
class Lobby(Message):
    """LOBBY: needs no role, and before hello no version."""

    request_id: Annotated[int, Int("chosen by the pendant")]


@from_server(65052, "lobby", "Tells which cells there are.", is_reply=True, since=3)
class LobbyReply(Reply):
    """LOBBY reply; its object is the answer to the operation `cells`."""

    request_id: Annotated[int, Int("of the request")]
    body: Annotated[bytes, Tail("one JSON object, UTF-8")]
