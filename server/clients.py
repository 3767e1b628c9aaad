"""The client connections of a server: numbered, let in, and handed on to their cells.

Owns how many connections there may be at once, which addresses may speak in clear text, and the
byte order in which each ROS-Industrial address is spoken to. Must not know what a message means;
whose a connection is, is `cells`' business.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from openpendant.simplemsg import Arrival, ByteOrder, Message
from openpendant.simplemsg.journal import Journal

from .accept_rate import place_refusal
from .access.admission import Login
from .access.exposure import clear_text_fault
from .access.opening import exposure_of
from .cells import Cells, Routed
from .client_connection import ClientConnection
from .core import Port
from .refusal import Refusal
from .settings import CellSettings
from .turned_away import TurnedAway

MOST_ORDERS = 256
"""Addresses without a connection whose byte order is remembered; of more the oldest go."""

READ_AHEAD = 512 * 1024
"""Bytes of a client that are read and looked through for a STOP before their turn has come."""

STRANGERS_READ_AHEAD = 64 * 1024
"""The same of a pendant that has not logged in; a frame is not larger."""


class Clients:
    """All client connections of a server.

    Attributes:
        by_session: the connections by their numbers.
        journal: tells the time of the event at hand.
    """

    def __init__(
        self,
        router: Cells,
        settings: Sequence[CellSettings],
        login: Login,
        journal: Journal,
        perform: Callable[[Routed], None],
        misheard: Callable[[int, int, Exception, int], None],
    ) -> None:
        """Know no connection yet.

        Args:
            router: the cells.
            settings: of each cell; the most connections are those of the first.
            login: who completed hello.
            journal: the time and the record.
            perform: carries out what a cell wants done.
            misheard: told where we failed on a client: cell, connection, fault, time.
        """
        self.by_session: dict[int, ClientConnection] = {}
        self.journal = journal
        self._router = router
        self._settings = settings
        self._login = login
        self._perform = perform
        self._misheard = misheard
        self._orders: dict[tuple[int | None, str], ByteOrder] = {}
        self._turned_away = TurnedAway()
        self._next_session = 1

    def admit(self, client: ClientConnection) -> None:
        """Number a new connection and tell its cell; turn it away where it may not be here."""
        client.session = self._next_session
        self._next_session += 1
        more: dict[str, Any] = {} if client.cell is None else {"cell": client.cell}
        now = self.journal.begin(
            "opened", client.session, port=client.port.name, address=client.address, **more
        )
        try:
            self._let_in(client, now)
        except Exception as error:
            self.failed(client, error, now)

    def _let_in(self, client: ClientConnection, now: int) -> None:
        fault = self._clear_text_fault(client)
        if fault is not None:
            client.abort(fault)
            return
        refusal = self._place_refusal(client.port)
        if refusal is not None:
            self._turned_away.turn_away(client, refusal, now)
            return
        self.by_session[client.session] = client
        self._perform(
            self._router.opened(client.session, client.port, client.address, now, client.cell)
        )

    def _place_refusal(self, port: Port) -> Refusal | None:
        """Return why there is no place for one more connection; None where there is."""
        pendants = sum(client.port is Port.PENDANT for client in self.by_session.values())
        return place_refusal(
            len(self.by_session),
            pendants - len(self._login.visitors),
            self._settings[0].listen.max_connections,
            is_pendant=port is Port.PENDANT,
        )

    def _clear_text_fault(self, client: ClientConnection) -> str | None:
        """Return why an address may not speak in clear text to the port of a cell."""
        if client.cell is None:
            return None
        fault = clear_text_fault(exposure_of(self._settings[client.cell]), client.address)
        return None if fault is None else fault.sentence

    def stop_first(self, session: int, stop: Message, now: int) -> bool:
        """Let a client's STOP act before its turn; tell whether the client may stop yet."""
        routed = self._router.stop_first(session, stop, now)
        if routed is None:
            return False
        self._perform(routed)
        return True

    def read_ahead(self, client: ClientConnection) -> int:
        """Return how many bytes of a client may wait for their turn.

        The ports of ROS-Industrial know no login; whoever may connect there may move the robot.
        """
        is_known = client.port is not Port.PENDANT or self._login.grant_of(client.session)
        return READ_AHEAD if is_known else STRANGERS_READ_AHEAD

    def receive(self, session: int, received: Arrival, now: int) -> None:
        """Hand a client's message to its cell."""
        if session not in self.by_session:
            self._turned_away.receive(session, received)
            return
        routed = self._router.receive(session, received, now)
        if routed.outgoing:
            self._perform(routed)

    def failed(self, client: ClientConnection, error: Exception, now: int) -> None:
        """End a connection that we failed on, and stop its robot; everybody else goes on.

        Args:
            client: the connection.
            error: the fault of ours.
            now: monotonic time, ns.
        """
        home = self._router.home_of(client.session)
        self._misheard(client.cell or 0 if home is None else home, client.session, error, now)
        # Its cell may not know it yet.
        client.close("a fault of the server")

    def dismiss(self, client: ClientConnection) -> None:
        """Tell its cell that a connection ended."""
        self._turned_away.forget(client.session)
        if self.by_session.pop(client.session, None) is not None:
            now = self.journal.begin("closed", client.session)
            home = self._router.home_of(client.session) or 0
            try:
                self._perform(self._router.closed(client.session, now))
            except Exception as error:
                self._misheard(home, client.session, error, now)

    def check_deadlines(self, now: int) -> None:
        """Close the connections that read or write too slowly."""
        self._turned_away.check_deadlines(now)
        for client in list(self.by_session.values()):
            try:
                client.check_deadlines(now)
            except Exception as error:
                self.failed(client, error, now)

    def hang_up(self, reason: str) -> None:
        """Close every connection."""
        self._turned_away.hang_up()
        for client in list(self.by_session.values()):
            client.close(reason)

    # The byte order of ROS-Industrial connections.

    def state_byte_order(self, client: ClientConnection) -> ByteOrder:
        """Return the byte order for a state connection: the address's own, else configured."""
        configured = self._settings[client.cell or 0].ros_i.byte_order
        default = ByteOrder.LITTLE if configured == "little" else ByteOrder.BIG
        return self._orders.get((client.cell, client.address), default)

    def learn_byte_order(self, motion: ClientConnection) -> None:
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

    def _remember(self, motion: ClientConnection, order: ByteOrder) -> None:
        """Note an address as the newest; forget the oldest that have no connection."""
        self._orders.pop((motion.cell, motion.address), None)
        self._orders[motion.cell, motion.address] = order
        if len(self._orders) <= MOST_ORDERS:
            return
        here = {(client.cell, client.address) for client in self.by_session.values()}
        absent = [known for known in self._orders if known not in here]
        for known in absent[: max(len(absent) - MOST_ORDERS, 0)]:
            del self._orders[known]
