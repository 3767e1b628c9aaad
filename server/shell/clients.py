"""Client connections of a server: numbered, admitted or rejected, and their byte orders remembered.

Owns that what `places` decides is done, which addresses may speak in clear text, and the byte order
in which each ROS-Industrial address is spoken to. Must not know what a message means; whose a
connection is, is `server_core`'s business.

Owns the moment between a connection without a place and its end (promises 20 and 21): a pendant is
told why and when to come again, then closed. An answer has to wait for the hello, whose bytes tell
the order in which to write it; closing before it came would lose the answer as well, because the
system then resets the connection. Such a connection belongs to no cell, takes no place, and
whatever else it says is not read. A connection on the place of its address for a stop belongs to
its cell like any other, but nothing of it goes there beside a hello and a stop.

A connection from a gateway's address waits for its first frame before all that (`first_frames`).

Owns how much of the loop each connection takes: counted by the connections, and compared once a
second.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from openpendant.simplemsg import (
    Arrival,
    ByteOrder,
    CommType,
    Message,
    Overtaken,
    WaitingStop,
)
from openpendant.simplemsg.pendant import Hello, SoftwareStop
from openpendant.simplemsg.verdicts import VerdictCode

from ..access.admission import Admission
from ..access.arrivals import AddressRates
from ..access.connection_loads import ConnectionLoad, LoadQuestion
from ..access.exposure import clear_text_fault, unasked_fault
from ..access.gateways import Forwarder
from ..access.lockout import SECOND_NS
from ..access.open_access import exposure_of
from ..access.places import STOP_PLACE_NS, PlaceGiven
from ..events.events import Port
from ..events.replies import sent_away, verdict
from ..refusal import Refusal
from ..settings.cell_settings import CellSettings
from .client import Client
from .first_frames import FirstFrames, IsWithinRate

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


_DISPLACED = Refusal(
    VerdictCode.NO_PLACE, "who came later has this place; log in to keep one", value=1
)


class StopPlaces:
    """The connections on which nothing but a stop is taken.

    Attributes:
        until: when each is closed [ns], by its number, in the order in which they came.
    """

    def __init__(self) -> None:
        """Have nobody on such a place."""
        self.until: dict[int, int] = {}
        self._refusals: dict[int, Refusal] = {}

    def take(self, session: int, until: int, refusal: Refusal) -> None:
        """Take a connection.

        Args:
            until: when it is closed [ns].
            refusal: of all that it asks beside a stop.
        """
        self.until[session] = until
        self._refusals[session] = refusal

    def forget(self, session: int) -> None:
        """Forget a connection that ended."""
        self.until.pop(session, None)
        self._refusals.pop(session, None)

    def admitted(self, client: Client, received: Arrival) -> Arrival | None:
        """Return what of a message goes to the cell; anything asked beside it ends the connection.

        A hello asks for no state.
        """
        message = received.received if isinstance(received, Overtaken) else received
        match message:
            case Hello():
                return replace(message, state_rate=0.0)
            case SoftwareStop() | WaitingStop():
                return message
            case Message(comm_type=CommType.TOPIC | CommType.REPLY):
                return None
        refusal = self._refusals[client.session]
        client.send(verdict(getattr(message, "request_id", 0), refusal))
        client.close(refusal.sentence)
        return None

    def overdue(self, now: int) -> list[int]:
        """Return the connections whose time is over, and forget them."""
        ended = [session for session, until in self.until.items() if now >= until]
        for session in ended:
            self.forget(session)
        return ended


MOST_ORDERS = 256
"""Addresses without a connection whose byte order is remembered; of more the oldest go."""

READ_AHEAD = 512 * 1024
"""Bytes of a client that are read and looked through for a STOP before their turn has come."""

STRANGERS_READ_AHEAD = 64 * 1024
"""The same of a pendant that has not logged in; a frame is not larger."""


_NOTHING = (0, 0, 0)


def _by_own_rates() -> IsWithinRate:
    rates = AddressRates()
    return lambda session, source, now: rates.is_within(source, now)


class Clients:
    """All client connections of a server.

    Attributes:
        rejections: those for which there is no place.
        stop_places: those that may only stop.
        first_frames: those from the address of a gateway that have said nothing yet.
        loads_due: when `count_loads` is to be called again [ns].
    """

    def __init__(
        self,
        settings: Sequence[CellSettings],
        login: Admission,
        is_within_rate: IsWithinRate | None = None,
    ) -> None:
        """Know no connection yet.

        Args:
            settings: of each cell.
            is_within_rate: asked of each address that a gateway states, where addresses are told
                apart; by rates of their own where left out.
        """
        self.by_session: dict[int, Client] = {}
        self.rejections = Rejections()
        self.stop_places = StopPlaces()
        self.first_frames = FirstFrames(
            login,
            is_within_rate or _by_own_rates(),
            round(settings[0].pendants.hello_deadline * SECOND_NS),
        )
        self._settings = settings
        self._login = login
        self._orders: dict[tuple[int | None, str], ByteOrder] = {}
        self._last_session = 0
        self._counted: tuple[int, dict[int, tuple[int, int, int]]] = (0, {})
        self._counted_before = self._counted
        self.loads_due = 0

    def next_session(self) -> int:
        """Return the number of a new connection."""
        self._last_session += 1
        return self._last_session

    def is_awaited(self, client: Client) -> bool:
        """Return True if the first frame of a new connection is to say whose it is."""
        return client.port is Port.PENDANT and self._login.gateways.has(client.address)

    def admit(self, client: Client, now: int, forwarder: Forwarder | None = None) -> bool:
        """Let a new connection in, or turn it away; return True if it is in.

        Args:
            forwarder: the gateway that stated its address; None where that is the socket's.
        """
        fault = self._clear_text_fault(client)
        if fault is not None:
            client.abort(fault)
            return False
        decided = self._login.places.opened(
            client.session,
            client.address,
            now,
            is_pendant=client.port is Port.PENDANT,
            by_standing=self._login.is_guarded,
            forwarder=forwarder,
        )
        if not isinstance(decided, PlaceGiven):
            self.rejections.reject(client, decided, now)
            return False
        for given_up in decided.given_up:
            self._displace(given_up)
        self.by_session[client.session] = client
        if decided.but_stop is not None:
            self.stop_places.take(client.session, now + STOP_PLACE_NS, decided.but_stop)
        return True

    def _displace(self, session: int) -> None:
        """End a connection whose place another one got, at once: it may not be one that reads."""
        client = self.by_session.get(session)
        if client is None:
            return
        if self._login.visitors.find(session) is not None:
            client.send(sent_away(_DISPLACED))
        client.abort(_DISPLACED.sentence)

    def forget(self, session: int) -> bool:
        """Forget a connection that ended; return False if it was turned away."""
        if self.first_frames.forget(session):
            return True
        self.rejections.forget(session)
        self.stop_places.forget(session)
        self._login.places.closed(session)
        return self.by_session.pop(session, None) is not None

    def _clear_text_fault(self, client: Client) -> str | None:
        """Return why an address may not speak in clear text to the port of a cell."""
        if client.cell is None:
            return None
        settings = self._settings[client.cell]
        is_motion = client.port is Port.ROS_MOTION
        wanted = settings.listen.ros_motion_port if is_motion else settings.listen.ros_state_port
        fault = unasked_fault(wanted, is_guarded=self._login.is_guarded)
        fault = fault or clear_text_fault(exposure_of(settings), client.address)
        return None if fault is None else fault.sentence

    def end_unasked(self) -> None:
        """End the connections to ROS-Industrial ports that nobody asked for; there are accounts."""
        for client in list(self.by_session.values()):
            fault = self._clear_text_fault(client)
            if fault is not None:
                client.abort(fault)

    def read_ahead(self, client: Client) -> int:
        """Return how many bytes of a client may wait for their turn.

        The ports of ROS-Industrial know no login; whoever may connect there may move the robot.
        """
        is_known = client.port is not Port.PENDANT or self._login.grant_of(client.session)
        return READ_AHEAD if is_known else STRANGERS_READ_AHEAD

    def hang_up(self, reason: str) -> None:
        """Close every connection."""
        self.rejections.hang_up()
        self.first_frames.hang_up(reason)
        for client in list(self.by_session.values()):
            client.close(reason)

    # Connections on the place of their address for a stop.

    def admitted_for_stop(self, session: int, received: Arrival) -> Arrival | None:
        """Return what of a message goes to the cell."""
        return self.stop_places.admitted(self.by_session[session], received)

    def has_stopped(self, session: int, received: Arrival) -> None:
        """Close a connection that may only stop, once it has: the next of its address may want to.

        A stop in front of the hello was none.
        """
        is_stop = isinstance(received, SoftwareStop | WaitingStop)
        if is_stop and self._login.visitors.find(session) is not None:
            self.by_session[session].close("it has stopped, and may do nothing else here")

    def end_stop_places(self, now: int) -> None:
        """Close those that neither stopped nor went in time."""
        for session in self.stop_places.overdue(now):
            client = self.by_session.get(session)
            if client is not None:
                client.abort("did not stop in time, and may do nothing else here")

    # What each connection takes.

    def count_loads(self, now: int) -> None:
        """Note what each connection took so far; to be called once a second."""
        counted = {
            session: (client.load.frames, client.load.received, client.load.cost_ns)
            for session, client in self.by_session.items()
        }
        self._counted_before, self._counted = self._counted, (now, counted)
        self.loads_due = now + SECOND_NS

    def loads(self, question: LoadQuestion) -> dict[int, ConnectionLoad]:
        """Return what connections took in the last second that was counted."""
        (began, before), (ended, after) = self._counted_before, self._counted
        share = SECOND_NS / max(ended - began, SECOND_NS)
        found = {}
        for session in question.sessions:
            pairs = zip(after.get(session, _NOTHING), before.get(session, _NOTHING), strict=True)
            client = self.by_session.get(session)
            unread = 0 if client is None else client.unread
            frames, received, cost_ns = (round((new - old) * share) for new, old in pairs)
            found[session] = ConnectionLoad(frames, received, cost_ns, unread)
        return found

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
