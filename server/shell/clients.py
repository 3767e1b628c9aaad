"""The client connections of a server: numbered, admitted, and their byte orders remembered.

Owns how many connections there may be at once, which addresses may speak in clear text, and the
byte order in which each ROS-Industrial address is spoken to. Must not know what a message means;
whose a connection is, is `server_core`'s business.
"""

from __future__ import annotations

from collections.abc import Sequence

from openpendant.simplemsg import ByteOrder

from ..access.admission import Admission
from ..access.exposure import clear_text_fault
from ..access.open_access import exposure_of
from ..events.events import Port
from ..refusal import Refusal
from ..settings.cell_settings import CellSettings
from .accept_rate import place_refusal
from .client import Client
from .rejections import Rejections

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
        turned_away: those for which there is no place.
    """

    def __init__(self, settings: Sequence[CellSettings], login: Admission) -> None:
        """Know no connection yet.

        Args:
            settings: of each cell; the most connections are those of the first.
            login: who completed hello.
        """
        self.by_session: dict[int, Client] = {}
        self.turned_away = Rejections()
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
            self.turned_away.turn_away(client, refusal, now)
            return False
        self.by_session[client.session] = client
        return True

    def forget(self, session: int) -> bool:
        """Forget a connection that ended; return False if it was not let in."""
        self.turned_away.forget(session)
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
        self.turned_away.hang_up()
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
