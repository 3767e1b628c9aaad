"""All cells of one server process behind one pendant port, as a pure core.

Owns which cell a connection belongs to. A pendant names its cell in its hello and stays there for
good; until then it is the guest of any cell that serves, whose pendant face knows the rules of a
conversation that has not begun. Knows nothing else of what cells do.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from openpendant.simplemsg import Arrival, CommType, Message
from openpendant.simplemsg.pendant import PROTOCOL_VERSION, Hello
from openpendant.simplemsg.verdicts import VerdictCode

from .core import Port, ServerCore
from .outgoing import Close, Outgoing, Send
from .pendant.replies import verdict
from .refusal import Refusal

_LISTED_BYTES = 90
"""How much of a refusal's text may be names of cells; all of it has to fit a message."""


class Routed(NamedTuple):
    """What a cell wants done.

    Attributes:
        cell: its number, from 0.
        outgoing: what is to be done, in order.
    """

    cell: int
    outgoing: list[Outgoing]


class Cells:
    """The cells of a server, and whose each connection is.

    Attributes:
        cores: the core of each cell.
    """

    def __init__(self, cores: Sequence[ServerCore]) -> None:
        """Join cells of different names."""
        self.cores = tuple(cores)
        self._numbers = {core.name: number for number, core in enumerate(cores)}
        self._home: dict[int, int] = {}
        self._guests: dict[int, str] = {}

    def opened(
        self, session: int, port: Port, address: str, now: int, cell: int | None = None
    ) -> Routed:
        """A client connected.

        Args:
            session: number of the connection, unique among all cells.
            port: what it was accepted for.
            address: the peer's address.
            now: monotonic time, ns.
            cell: whose port it is; None for the pendant port, which belongs to all.
        """
        home = self._doorkeeper() if cell is None else cell
        if cell is None and len(self.cores) > 1:
            self._guests[session] = address
        self._home[session] = home
        return Routed(home, self.cores[home].opened(session, port, address, now))

    def _doorkeeper(self) -> int:
        """Return a cell that serves; the first where none does."""
        serving = (number for number, core in enumerate(self.cores) if core.fault is None)
        return next(serving, 0)

    def closed(self, session: int, now: int) -> Routed:
        """A client's connection ended, by itself or by us; a second call does nothing."""
        self._guests.pop(session, None)
        home = self._home.pop(session, None)
        if home is None:
            return Routed(0, [])
        return Routed(home, self.cores[home].closed(session, now))

    def stop_first(self, session: int, stop: Message, now: int) -> Routed | None:
        """A client's STOP has arrived; None where it may not stop yet (`ServerCore.stop_first`)."""
        home = self._home.get(session)
        if home is None:
            return None
        out = self.cores[home].stop_first(session, stop, now)
        return None if out is None else Routed(home, out)

    def receive(self, session: int, received: Arrival, now: int) -> Routed:
        """A client sent a message."""
        home = self._home.get(session)
        if home is None:
            return Routed(0, [])
        if session in self._guests and _names_a_cell(received):
            assert isinstance(received, Hello)
            return self._introduce(session, received, now)
        return Routed(home, self.cores[home].receive(session, received, now))

    def _introduce(self, session: int, hello: Hello, now: int) -> Routed:
        """Hand a guest over to the cell that its hello names."""
        host, address = self._home[session], self._guests.pop(session)
        wanted = self._numbers.get(hello.cell)
        refusal = self._unknown(hello.cell) if wanted is None else self.cores[wanted].fault
        if wanted == host and refusal is None:
            return Routed(host, self.cores[host].receive(session, hello, now))
        # A guest holds nothing, so nothing follows from its leaving.
        self.cores[host].closed(session, now)
        if wanted is None or refusal is not None:
            assert refusal is not None
            del self._home[session]
            answer = Send(session, verdict(0, refusal))
            return Routed(host, [answer, Close(session, refusal.sentence)])
        self._home[session] = wanted
        core = self.cores[wanted]
        came = core.opened(session, Port.PENDANT, address, now)
        return Routed(wanted, [*came, *core.receive(session, hello, now)])

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

    def skipped(self, session: int) -> None:
        """A client read too slowly for a state message."""
        home = self._home.get(session)
        if home is not None:
            self.cores[home].skipped(session)

    @property
    def is_moving(self) -> bool:
        """Whether any robot moves, as far as anyone knows."""
        return any(core.is_moving for core in self.cores)


def _names_a_cell(received: Arrival) -> bool:
    """Tell whether this is a hello that can be read; the pendant face refuses any other."""
    if not isinstance(received, Hello) or received.comm_type != CommType.REQUEST:
        return False
    return received.protocol_version == PROTOCOL_VERSION
