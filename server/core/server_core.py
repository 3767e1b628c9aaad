"""All cells of one server process behind one pendant port, as a pure core.

Owns which cell a connection belongs to, and so which core an event of it is for. A pendant names
its cell in its hello and stays there for good; until then it is the guest of any cell that serves,
whose pendant endpoint knows the rules of a conversation that has not begun. Knows nothing else of
what cells do.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeAlias

from openpendant.simplemsg import Arrival, CommType
from openpendant.simplemsg.pendant import PROTOCOL_VERSIONS, Hello
from openpendant.simplemsg.verdicts import VerdictCode

from ..events.events import (
    ClientEvent,
    Closed,
    Event,
    Misdirected,
    Opened,
    Port,
    Received,
    Regranted,
)
from ..refusal import Refusal
from .cell_core import CellCore

_LISTED_BYTES = 90
"""How much of a refusal's text may be names of cells; all of it has to fit a message."""


Routes: TypeAlias = Sequence[tuple[int, Event]]
"""Events, each with the number of the cell that it is for."""


class ServerCore:
    """The cells of a server, and whose each connection is."""

    def __init__(self, cores: Sequence[CellCore]) -> None:
        """Join cells of different names."""
        self.cores = tuple(cores)
        self._numbers = {core.name: number for number, core in enumerate(cores)}
        self._home: dict[int, int] = {}
        self._guests: dict[int, str] = {}

    def route(self, event: ClientEvent | Regranted, cell: int | None = None) -> Routes:
        """Return which cells an event of a connection is for, and what to hand them, in order.

        Args:
            cell: of a new connection whose port it is; None for the pendant port of all.
        """
        session = event.session
        if isinstance(event, Received):
            if session in self._guests and _names_a_cell(event.message):
                return self._introduced(session, event)
        elif isinstance(event, Opened):
            self._home[session] = self._hosting_cell() if cell is None else cell
            if cell is None and len(self.cores) > 1:
                self._guests[session] = event.address
        elif isinstance(event, Closed):
            self._guests.pop(session, None)
            home = self._home.pop(session, None)
            return () if home is None else ((home, event),)
        home = self._home.get(session)
        return () if home is None else ((home, event),)

    def _hosting_cell(self) -> int:
        """Return a cell that serves; the first where none does."""
        serving = (number for number, core in enumerate(self.cores) if core.fault is None)
        return next(serving, 0)

    def _introduced(self, session: int, event: Received) -> Routes:
        """Hand a guest over to the cell that its hello names."""
        hello = event.message
        assert isinstance(hello, Hello)
        host, address = self._home[session], self._guests.pop(session)
        wanted = self._numbers.get(hello.cell)
        refusal = self._unknown(hello.cell) if wanted is None else self.cores[wanted].fault
        if wanted is None or refusal is not None:
            assert refusal is not None
            del self._home[session]
            return ((host, Misdirected(session, refusal)),)
        self._home[session] = wanted
        if wanted == host:
            return ((host, event),)
        # A guest holds nothing, so nothing follows from its leaving.
        came = Opened(session, Port.PENDANT, address)
        return (host, Closed(session)), (wanted, came), (wanted, event)

    def _unknown(self, name: str) -> Refusal:
        wanted = f"no cell {name!r}" if name else "name a cell"
        return Refusal(VerdictCode.UNKNOWN_CELL, f"{wanted}; here: {self._listing()}")

    def _listing(self) -> str:
        """Return as many names as fit, and how many more there are."""
        listed: list[str] = []
        for name in self._numbers:
            if len(", ".join([*listed, name]).encode()) > _LISTED_BYTES:
                break
            listed.append(name)
        more = len(self._numbers) - len(listed)
        return ", ".join(listed) + (f" and {more} more" if more else "")

    def home_of(self, session: int) -> int | None:
        """Return the number of the cell that a connection belongs to; None where it is gone."""
        return self._home.get(session)

    def may_stop(self, session: int) -> bool:
        """Return True if a STOP of a client may act before its turn."""
        home = self._home.get(session)
        return home is not None and self.cores[home].may_stop(session)

    def settled(self, session: int) -> int | None:
        """Return the number of the cell that a connection stays with; None while that is open."""
        return None if session in self._guests else self._home.get(session)

    @property
    def is_moving(self) -> bool:
        """Whether any robot moves, as far as anyone knows."""
        return any(core.is_moving for core in self.cores)


def _names_a_cell(received: Arrival) -> bool:
    """Return True if this is a hello that can be read; the pendant endpoint refuses any other."""
    if not isinstance(received, Hello) or received.comm_type != CommType.REQUEST:
        return False
    return received.protocol_version in PROTOCOL_VERSIONS
