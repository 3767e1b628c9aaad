"""Pendants for which there is no place: told why and when to come again, then closed.

Owns the moment between a connection without a place and its end (promises 20 and 21). An answer has
to wait for the hello, whose bytes tell the order in which to write it; closing before it came would
lose the answer as well, because the system then resets the connection. Such a connection belongs to
no cell, takes no place, and whatever else it says is not read.
"""

from __future__ import annotations

from dataclasses import dataclass

from openpendant.simplemsg import Arrival, CommType
from openpendant.simplemsg.pendant import Hello

from ..events.events import Port
from ..events.replies import verdict
from ..refusal import Refusal
from .client import Client

MOST_TURNED_AWAY = 32
"""So many wait for their answer at once; any more are closed without one. Connections are taken so
slowly that there are fewer, unless TLS was agreed on with many at the same time."""

_HEARING_NS = 30_000_000
"""The hello has to come so soon. Asked each tick, so that all end within 50 ms."""


@dataclass(frozen=True, slots=True, eq=False)
class _Waiting:
    """A connection that is to hear why.

    Attributes:
        client: the connection.
        refusal: why there is no place for it.
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

    def turn_away(self, client: Client, refusal: Refusal, now: int) -> None:
        """End a connection; a pendant is told why if its hello comes soon.

        ROS-Industrial has no message for it, so that its clients are closed at once.

        Args:
            client: a connection that is in no list.
            refusal: why.
            now: monotonic time, ns.
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
