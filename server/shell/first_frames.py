"""First frames: connections from a gateway's address, before anybody knows whose they are.

Such a connection belongs to no cell and counts for no address until its first frame has come, which
takes at most 2 s (promise 41). A FORWARDED that is believed makes it one of the address that is
stated there; with any other frame it is one of its socket's own address, where other programs come
from that address, too. Where only a gateway does, it is refused.

Owns that moment and its bound; what is believed is `gateways`' business.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from openpendant.simplemsg import (
    Arrival,
    CommType,
    HeaderOnly,
    Malformed,
    Overtaken,
    Received,
    ReplyCode,
    WaitingStop,
    accepted,
)
from openpendant.simplemsg.pendant import PROTOCOL_VERSION, Forwarded, Hello
from openpendant.simplemsg.verdicts import VerdictCode, in_version_2

from ..access.admission import Admission
from ..access.exposure import is_loopback
from ..access.gateways import Forwarder, Origin
from ..access.lockout import SECOND_NS, source_of
from ..events.replies import verdict
from ..refusal import Refusal
from .client import Client

FIRST_FRAME_NS = 2 * SECOND_NS
"""The first frame has to come so soon."""

MOST_AWAITED = 64
"""So many connections are awaited at once; of more the one that has been silent longest goes."""

UNREADABLE = "what it says cannot be read"
"""Why a FORWARDED is refused whose frame is not as declared."""

IsWithinRate = Callable[[int, str, int], bool]
"""Takes a session, what its address is charged to and the time [ns]; returns whether one more
connection of that address may be let in, and counts it."""


@dataclass(frozen=True, slots=True)
class Introduced:
    """A connection whose first frame has come.

    Attributes:
        forwarder: the gateway that stated its address; None where that is the socket's.
    """

    client: Client
    forwarder: Forwarder | None = None


class FirstFrames:
    """The connections whose first frame is awaited."""

    def __init__(self, login: Admission, is_within_rate: IsWithinRate, most_ns: int) -> None:
        """Await nobody yet.

        Args:
            is_within_rate: asked where addresses are told apart.
            most_ns: a first frame is awaited for at most so long [ns].
        """
        self._login = login
        self._is_within_rate = is_within_rate
        self._most_ns = min(most_ns, FIRST_FRAME_NS)
        self._awaited: dict[int, tuple[Client, int]] = {}

    def __contains__(self, session: int) -> bool:
        """Return True if the first frame of a connection is awaited."""
        return session in self._awaited

    def await_of(self, client: Client, now: int) -> None:
        """Await the first frame of a new connection."""
        if len(self._awaited) >= MOST_AWAITED:
            longest, _ = self._awaited.pop(next(iter(self._awaited)))
            longest.abort(f"more than {MOST_AWAITED} connections of gateways have said nothing")
        self._awaited[client.session] = client, now + self._most_ns

    def take(self, session: int, received: Arrival, now: int) -> Introduced | None:
        """Take the first frame of a connection; return the connection where it may go on."""
        client, _ = self._awaited.pop(session)
        message = _message_of(received)
        if isinstance(message, Forwarded) and message.comm_type == CommType.REQUEST:
            origin = self._login.gateways.origin(client.address, message, now)
            if isinstance(origin, Refusal):
                _refuse(client, origin)
                return None
            return self._forwarded(client, message, origin, now)
        if is_malformed_forward(message):
            refusal = self._login.gateways.refuse(client.address, UNREADABLE, now)
            _refuse(client, refusal)
            return None
        if not self._login.gateways.is_alone_at(client.address):
            return Introduced(client)
        refusal = Refusal(VerdictCode.FORWARD_FIRST)
        if getattr(message, "comm_type", None) == CommType.REQUEST:
            client.send(verdict(getattr(message, "request_id", 0), _as_known(message, refusal)))
        client.close(refusal.sentence)
        return None

    def _forwarded(
        self, client: Client, message: Forwarded, origin: Origin, now: int
    ) -> Introduced | None:
        """Go on as a connection of the address that was stated."""
        source = source_of(origin.address)
        client.address = origin.address
        if self._login.is_guarded and not is_loopback(origin.address):
            if not self._is_within_rate(client.session, source, now):
                client.abort(f"more connections of {source} than are let in")
                return None
        client.send(accepted(message))
        return Introduced(client, origin.forwarder)

    def forget(self, session: int) -> bool:
        """Forget a connection that ended; return True if its first frame was awaited."""
        return self._awaited.pop(session, None) is not None

    def check_deadlines(self, now: int) -> None:
        """End the connections that said nothing in time."""
        for session, (client, until) in list(self._awaited.items()):
            if now >= until:
                del self._awaited[session]
                client.abort("no first frame in time")

    def hang_up(self, reason: str) -> None:
        """Close all that are awaited."""
        for client, _ in self._awaited.values():
            client.close(reason)
        self._awaited.clear()


def is_malformed_forward(received: object) -> bool:
    """Return True if this would be a FORWARDED, and cannot be read."""
    if not isinstance(received, Malformed) or received.comm_type != CommType.REQUEST:
        return False
    return received.msg_type == Forwarded.PLACE.msg_type


def _message_of(received: Arrival) -> Received:
    """Return what came, whether a stop has overtaken it or was found before its turn."""
    match received:
        case Overtaken(received=overtaken):
            return overtaken
        case WaitingStop(message=stop):
            return stop
    return received


def _refuse(client: Client, refusal: Refusal) -> None:
    """Refuse a FORWARDED by a bare header and end the connection."""
    client.send(HeaderOnly(Forwarded.PLACE.msg_type, reply_code=ReplyCode.FAILURE))
    client.close(refusal.sentence)


def _as_known(message: object, refusal: Refusal) -> Refusal:
    """Return a refusal by a code that whoever sent a first frame knows."""
    if isinstance(message, Hello) and message.protocol_version < PROTOCOL_VERSION:
        return Refusal(VerdictCode(in_version_2(refusal.code)), refusal.sentence)
    return refusal
