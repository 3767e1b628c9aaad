"""Client connections of a server: numbered, admitted or rejected, and their byte orders remembered.

Owns how many connections there may be at once, which addresses may speak in clear text, and the
byte order in which each ROS-Industrial address is spoken to. Must not know what a message means;
whose a connection is, is `server_core`'s business.

Owns the moment between a connection without a place and its end (promises 20 and 21): a pendant is
told why and when to come again, then closed. An answer has to wait for the hello, whose bytes tell
the order in which to write it; closing before it came would lose the answer as well, because the
system then resets the connection. Such a connection belongs to no cell, takes no place, and
whatever else it says is not read.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from openpendant.simplemsg import Arrival, ByteOrder, CommType, Connection, Message
from openpendant.simplemsg.pendant import Hello
from openpendant.simplemsg.verdicts import VerdictCode

from ..access.admission import Admission
from ..access.exposure import clear_text_fault
from ..access.open_access import exposure_of
from ..events.events import Port
from ..events.replies import verdict
from ..refusal import Refusal
from ..settings.cell_settings import CellSettings


class Client(Protocol):
    """One accepted connection; a `ClientConnection` is one.

    Attributes:
        cell: number of the cell whose port that is; None for the pendant port of all.
    """

    session: int
    port: Port
    cell: int | None
    address: str
    wire: Connection

    def send(self, message: Message) -> None:
        """Write a message."""

    def write(self, frame: bytes) -> None:
        """Write a frame that was encoded for this conversation."""

    def failed(self, error: Exception) -> None:
        """Take note of what went wrong with a message to it, for `check_deadlines`."""

    def is_clogged(self) -> bool:
        """Return True if the client reads too slowly for another state message."""

    def check_deadlines(self, now: int) -> None:
        """Cut off a client whose frame never ends or who never reads.

        Raises:
            Exception: what went wrong with a message to it.
        """

    def hold(self) -> None:
        """Let wait what it sends, but for what stops or keeps alive."""

    def release(self) -> None:
        """Go on with what waits."""

    def close(self, reason: str) -> None:
        """Close after what was written has left."""

    def abort(self, reason: str) -> None:
        """Close at once; what was not written is lost."""


MOST_STRANGERS = 64
"""Pendants that have not said hello, at once."""

STOP_PLACES = 8
"""Places that only pendants get: whoever wants to stop a robot finds one free of ROS-I clients."""

_AGAIN_WHEN_FULL = 5
"""Advice to whom all places are taken [s]: some may have left by then."""

_AGAIN_WHEN_STRANGE = 2
"""Advice to whom strangers take the places [s]: by then these have said hello, or are gone."""


def place_refusal(
    connections: int, strangers: int, max_connections: int, *, is_pendant: bool
) -> Refusal | None:
    """Return why there is no place for one more connection; None where there is.

    Its value is how long to wait before coming again [s].

    Args:
        strangers: pendants among them that have not said hello.
        max_connections: how many there may be, as configured.
    """
    if connections >= max_connections:
        return _no_place(f"more than {max_connections} connections", _AGAIN_WHEN_FULL)
    places = max(max_connections - STOP_PLACES, 1)
    if not is_pendant and connections >= places:
        text = f"more than {places} connections; the last {STOP_PLACES} are for pendants"
        return _no_place(text, _AGAIN_WHEN_FULL)
    if is_pendant and strangers >= MOST_STRANGERS:
        text = f"more than {MOST_STRANGERS} pendants that did not say hello yet"
        return _no_place(text, _AGAIN_WHEN_STRANGE)
    return None


def _no_place(why: str, again: int) -> Refusal:
    return Refusal(VerdictCode.NO_PLACE, f"{why}; come again in {again} s", value=again)


MOST_TURNED_AWAY = 32
"""So many wait for their answer at once; any more are closed without one. Connections are taken so
slowly that there are fewer, unless TLS was agreed on with many at the same time."""

_HEARING_NS = 30_000_000
"""The hello has to come so soon. Asked each tick, so that all end within 50 ms."""


@dataclass(frozen=True, slots=True, eq=False)
class _Waiting:
    """A connection that is to hear why.

    Attributes:
        until: when it is closed without an answer [ns].
    """

    client: Client
    refusal: Refusal
    until: int


class Rejections:
    """The connections that are about to be closed because there is no place."""

    def __init__(self) -> None:
        """Turn nobody away yet."""
        self._waiting: dict[int, _Waiting] = {}

    def reject(self, client: Client, refusal: Refusal, now: int) -> None:
        """End a connection; a pendant is told why if its hello comes soon.

        ROS-Industrial has no message for it, so that its clients are closed at once.

        Args:
            client: a connection that is in no list.
        """
        if client.port is not Port.PENDANT or len(self._waiting) >= MOST_TURNED_AWAY:
            client.abort(refusal.sentence)
            return
        self._waiting[client.session] = _Waiting(client, refusal, now + _HEARING_NS)

    def receive(self, session: int, received: Arrival) -> None:
        """Answer a hello; anything else ends the connection without a word."""
        waiting = self._waiting.pop(session, None)
        if waiting is None:
            return
        if isinstance(received, Hello) and received.comm_type == CommType.REQUEST:
            waiting.client.send(verdict(0, waiting.refusal))
        waiting.client.close(waiting.refusal.sentence)

    def forget(self, session: int) -> None:
        """Forget a connection that ended."""
        self._waiting.pop(session, None)

    def check_deadlines(self, now: int) -> None:
        """Close those whose hello did not come in time."""
        for session, waiting in list(self._waiting.items()):
            if now >= waiting.until:
                del self._waiting[session]
                waiting.client.abort(waiting.refusal.sentence)

    def hang_up(self) -> None:
        """Close all that wait."""
        for waiting in self._waiting.values():
            waiting.client.abort(waiting.refusal.sentence)
        self._waiting.clear()


MOST_ORDERS = 256
"""Addresses without a connection whose byte order is remembered; of more the oldest go."""

READ_AHEAD = 512 * 1024
"""Bytes of a client that are read and looked through for a STOP before their turn has come."""

STRANGERS_READ_AHEAD = 64 * 1024
"""The same of a pendant that has not logged in; a frame is not larger."""


class Clients:
    """All client connections of a server.

    Attributes:
        rejections: those for which there is no place.
    """

    def __init__(self, settings: Sequence[CellSettings], login: Admission) -> None:
        """Know no connection yet.

        Args:
            settings: of each cell; the most connections are those of the first.
        """
        self.by_session: dict[int, Client] = {}
        self.rejections = Rejections()
        self._settings = settings
        self._login = login
        self._orders: dict[tuple[int | None, str], ByteOrder] = {}
        self._last_session = 0

    def next_session(self) -> int:
        """Return the number of a new connection."""
        self._last_session += 1
        return self._last_session

    def admit(self, client: Client, now: int) -> bool:
        """Let a new connection in, or turn it away; return True if it is in."""
        fault = self._clear_text_fault(client)
        if fault is not None:
            client.abort(fault)
            return False
        refusal = self._place_refusal(client.port)
        if refusal is not None:
            self.rejections.reject(client, refusal, now)
            return False
        self.by_session[client.session] = client
        return True

    def forget(self, session: int) -> bool:
        """Forget a connection that ended; return False if it was not let in."""
        self.rejections.forget(session)
        return self.by_session.pop(session, None) is not None

    def _place_refusal(self, port: Port) -> Refusal | None:
        """Return why there is no place for one more connection; None where there is."""
        pendants = sum(client.port is Port.PENDANT for client in self.by_session.values())
        return place_refusal(
            len(self.by_session),
            pendants - len(self._login.visitors),
            self._settings[0].listen.max_connections,
            is_pendant=port is Port.PENDANT,
        )

    def _clear_text_fault(self, client: Client) -> str | None:
        """Return why an address may not speak in clear text to the port of a cell."""
        if client.cell is None:
            return None
        fault = clear_text_fault(exposure_of(self._settings[client.cell]), client.address)
        return None if fault is None else fault.sentence

    def read_ahead(self, client: Client) -> int:
        """Return how many bytes of a client may wait for their turn.

        The ports of ROS-Industrial know no login; whoever may connect there may move the robot.
        """
        is_known = client.port is not Port.PENDANT or self._login.grant_of(client.session)
        return READ_AHEAD if is_known else STRANGERS_READ_AHEAD

    def hang_up(self, reason: str) -> None:
        """Close every connection."""
        self.rejections.hang_up()
        for client in list(self.by_session.values()):
            client.close(reason)

    # The byte order of ROS-Industrial connections.

    def state_byte_order(self, client: Client) -> ByteOrder:
        """Return the byte order for a state connection: the address's own, else configured."""
        configured = self._settings[client.cell or 0].ros_i.byte_order
        default = ByteOrder.LITTLE if configured == "little" else ByteOrder.BIG
        return self._orders.get((client.cell, client.address), default)

    def learn_byte_order(self, motion: Client) -> None:
        """Note what a motion connection spoke; a state connection in the other order is closed.

        The client connects again and is then spoken to in its own order; going on in the wrong one
        could make the reference client read a length of millions.
        """
        order = motion.wire.byte_order or ByteOrder.LITTLE
        self._remember(motion, order)
        for client in list(self.by_session.values()):
            mismatch = client.wire.byte_order is not order
            is_same = (client.cell, client.address) == (motion.cell, motion.address)
            if client.port is Port.ROS_STATE and is_same and mismatch:
                client.close("its motion connection speaks the other byte order")

    def _remember(self, motion: Client, order: ByteOrder) -> None:
        """Note an address as the newest; forget the oldest that have no connection."""
        self._orders.pop((motion.cell, motion.address), None)
        self._orders[motion.cell, motion.address] = order
        if len(self._orders) <= MOST_ORDERS:
            return
        here = {(client.cell, client.address) for client in self.by_session.values()}
        absent = [known for known in self._orders if known not in here]
        for known in absent[: max(len(absent) - MOST_ORDERS, 0)]:
            del self._orders[known]
