"""Inbox of a server: every event comes in by it, gets its time, and goes on to its cell's core.

Owns the time of an event, one reading of the clock for all that follows from it, the longest time
between two events, and in which cell one happens. Notes each where a journal is kept: bytes before
they are decoded, so that a rerun covers their decoding as well. Decides nothing about what an event
means.

Owns what the shell asks of the operating system (`Observations`), with each answer that counts
noted. A rerun asks nobody: it finds in the journal what the world answered then.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any, Protocol

from openpendant.simplemsg import Arrival, Message
from openpendant.simplemsg.journal import Journal

from ..access.accounts import AccountBook
from ..access.connection_loads import ConnectionLoad, LoadQuestion
from ..access.gateways import Forwarder
from ..core.server_core import ServerCore
from ..events.effects import BACKENDS, Ask
from ..events.events import (
    Answered,
    ClientEvent,
    Closed,
    Event,
    Opened,
    PathChanged,
    Received,
    Regranted,
    StopReceived,
)
from ..journal.event_records import ANSWERED, PasswordNumbers, answer_to_record
from .client import Client
from .clients import Clients
from .loop_timing import Gap


class Observations:
    """Observations of the operating system and the watchdog, and the frames that leave."""

    def __init__(self, journal: Journal) -> None:
        """Note answers in a journal."""
        self._journal = journal

    def is_gone(self, link: str | int, transport: asyncio.BaseTransport) -> bool:
        """Return True if the loop has closed a transport by itself, on an error of the kernel."""
        return self._noted("gone", link, transport.is_closing())

    def is_clogged(self, session: int, is_behind: bool) -> bool:
        """Return whether a client is behind with what was written to it."""
        return self._noted("clogged", session, is_behind)

    def is_flooded(self, link: str | int, is_behind: bool) -> bool:
        """Return whether a client or a controller is so far behind that it is cut off."""
        return self._noted("flooded", link, is_behind)

    def is_paired(self, cell: str, is_typed: bool) -> bool:
        """Return whether the code that was typed is the one of a cell, which no journal holds."""
        return self._noted("paired", cell, is_typed)

    def has_stopped(self, link: str, has_stopped: bool) -> bool:
        """Return whether the watchdog has sent a STOP to a robot."""
        return self._noted("stopped", link, has_stopped)

    def is_gateway(self, gateway: int, is_right: bool) -> bool:
        """Return whether a secret was that of a gateway, which no journal holds."""
        return self._noted("gateway", gateway, is_right)

    def is_within_rate(self, session: int, is_within: bool) -> bool:
        """Return whether the address that a gateway stated is within its rate of connections.

        What came from there past the gateway counts as well, and stands in no journal.
        """
        return self._noted("rate", session, is_within)

    def turn_ended(self, link: str | int, taken: int, is_over: bool) -> bool:
        """Return whether a connection has had its share of the processor in this turn of the loop.

        Args:
            taken: frames that were taken in it.
        """
        return self._noted("turn", f"{link}/{taken}", is_over)

    def is_read_apart(self, session: int) -> bool:
        """Return True: a large body is read beside the loop, but in journals of older servers."""
        return self._noted("apart", session, True)

    def _noted(self, question: str, link: str | int, answer: bool) -> bool:
        return self._journal.answer(question, link, answer) if self._journal.is_kept else answer

    def sent(self, link: str | int, frame: bytes) -> None:
        """Note a frame that leaves on a connection, without its secrets."""
        if self._journal.is_kept:
            self._journal.out(link, frame)


def loop_time() -> int:
    """Return the running loop's monotonic time [ns]."""
    return int(asyncio.get_running_loop().time() * 1e9)


class EventTaker(Protocol):
    """Takes the events of one cell; a `CellShell` does.

    Attributes:
        label: begins the names of its links in the journal.
    """

    label: str

    def deliver(self, event: Event, now: int) -> None:
        """Hand an event to the core, and carry out what follows."""

    def client_failed(self, session: int, error: Exception, now: int) -> None:
        """Stop the robot and part with a client that we failed on."""


class Inbox:
    """The one entrance for everything that happens to a server.

    Attributes:
        wire_bytes: notes bytes that came on a link, secrets masked; returns the time [ns].
    """

    def __init__(
        self,
        journal: Journal,
        server: ServerCore,
        cells: Sequence[EventTaker],
        clients: Clients,
        clock: Callable[[], int],
    ) -> None:
        """Join the parts.

        Args:
            cells: the shell of each cell; they may come later, but before any event.
            clock: the monotonic time [ns].
        """
        self.clients = clients
        # Each byte comes by here, so no other function of ours is called for it.
        self.wire_bytes: Callable[[str | int, bytes], int] = partial(self._begin, "in")
        self._clock = clock
        self._event_time = 0
        self._event: tuple[str, str | int, bytes] = ("", "", b"")
        self._longest = Gap()
        self._journal = journal
        self._server = server
        self._cells = cells
        self._settled: dict[int, EventTaker] = {}
        self._password_numbers = PasswordNumbers()

    @property
    def is_noted(self) -> bool:
        """Whether events are written down, so that it pays to mask secrets."""
        return self._journal.is_kept

    def longest_gap(self) -> Gap:
        """Return the longest time between two events since this was asked last."""
        gap, self._longest = self._longest, Gap()
        return gap

    def _begin(self, event: str, link: str | int = "", data: bytes = b"", **more: Any) -> int:
        """Begin to handle an event, noted with all that repeats it; return its time [ns]."""
        before, now = self._event_time, self._clock()
        if now - before > self._longest.lasted and before:
            self._longest = Gap(now - before, *self._event)
        self._event_time, self._event = now, (event, link, data)
        if self._journal.is_kept:
            self._journal.begin(now, event, link, data, more)
        return now

    # Clients.

    def opened(self, client: Client) -> None:
        """Number a new connection and tell its cell; turn it away where it may not be here."""
        client.session = self.clients.next_session()
        more: dict[str, Any] = {} if client.cell is None else {"cell": client.cell}
        now = self._begin(
            "opened", client.session, port=client.port.name, address=client.address, **more
        )
        try:
            if self.clients.is_awaited(client):
                self.clients.first_frames.await_of(client, now)
                return
        except Exception as error:
            self.client_failed(client, error, now)
            return
        self._let_in(client, None, now)

    def _let_in(self, client: Client, forwarder: Forwarder | None, now: int) -> None:
        """Tell its cell of a connection; turn it away where it may not be here."""
        try:
            is_admitted = self.clients.admit(client, now, forwarder)
        except Exception as error:
            self.client_failed(client, error, now)
            return
        if is_admitted:
            event = Opened(client.session, client.port, client.address)
            self._route(event, now, client.cell)

    def stop_first(self, session: int, stop: Message, now: int) -> bool:
        """Let a client's STOP act before its turn; return False if the client may not stop yet."""
        if not self._server.may_stop(session):
            return False
        self._route(StopReceived(session, stop), now)
        return True

    def received(self, session: int, message: Arrival, now: int) -> None:
        """Hand a client's message to its cell."""
        event = Received(session, message)
        cell = self._settled.get(session)
        if cell is not None:
            cell.deliver(event, now)
        elif session in self.clients.first_frames:
            self._received_first(session, message, now)
        elif session not in self.clients.by_session:
            self.clients.rejections.receive(session, message)
        elif session in self.clients.stop_places.until:
            self._received_for_stop(session, message, now)
        else:
            self._route(event, now)
            home = self._server.settled(session)
            if home is not None:
                self._settled[session] = self._cells[home]

    def _received_first(self, session: int, message: Arrival, now: int) -> None:
        """Let a connection in by what it says first, and take that where it is no FORWARDED."""
        introduced = self.clients.first_frames.take(session, message, now)
        if introduced is None:
            return
        self._let_in(introduced.client, introduced.forwarder, now)
        if introduced.forwarder is None:
            self.received(session, message, now)

    def _received_for_stop(self, session: int, message: Arrival, now: int) -> None:
        """Hand a stop, or the hello in front of it, to the cell; nothing else of such a client."""
        admitted = self.clients.admitted_for_stop(session, message)
        if admitted is not None:
            self._route(Received(session, admitted), now)
            self.clients.has_stopped(session, admitted)

    def closed(self, client: Client) -> None:
        """Tell its cell that a connection ended."""
        if self.clients.forget(client.session):
            now = self._begin("closed", client.session)
            self._settled.pop(client.session, None)
            self._route(Closed(client.session), now)

    def client_failed(self, client: Client, error: Exception, now: int) -> None:
        """End a connection that we failed on, and stop its robot; everybody else goes on."""
        home = self._server.home_of(client.session)
        cell = self._cells[client.cell or 0 if home is None else home]
        cell.client_failed(client.session, error, now)
        # Its cell may not know it yet.
        client.close("a fault of the server")

    def check_deadlines(self, now: int) -> None:
        """Close the connections that read or write too slowly."""
        self.clients.rejections.check_deadlines(now)
        self.clients.first_frames.check_deadlines(now)
        if self.clients.stop_places.until:
            self.clients.end_stop_places(now)
        if now >= self.clients.loads_due:
            self.clients.count_loads(now)
        for client in list(self.clients.by_session.values()):
            try:
                client.check_deadlines(now)
            except Exception as error:
                self.client_failed(client, error, now)

    def _route(self, event: ClientEvent, now: int, cell: int | None = None) -> None:
        for number, each in self._server.route(event, cell):
            self._cells[number].deliver(each, now)

    # Controllers.

    def entrance(self, cell: int) -> Callable[[Event, int], None]:
        """Return what takes the events of one cell that are within one of these: its messages."""
        return self._cells[cell].deliver

    def path_changed(self, cell: int, link: str, event: PathChanged) -> None:
        """Tell a cell that a connection to its controller came or went."""
        now = self._begin("up" if event.up else "down", link)
        self._cells[cell].deliver(event, now)

    # The server's own parts.

    def answered(self, cell: int, asked: Ask, answer: object) -> None:
        """Tell a cell the answer to a question of it."""
        taker = self._cells[cell]
        record = answer_to_record(asked, answer) if self._journal.is_kept else {}
        event = ANSWERED[BACKENDS[type(asked.question)]]
        now = self._begin(event, f"{taker.label}{asked.id}", **record)
        taker.deliver(Answered(asked, answer), now)

    def measure(
        self, question: LoadQuestion, deliver: Callable[[Mapping[int, ConnectionLoad]], None]
    ) -> None:
        """Tell what connections take of the loop; in a later turn."""
        asyncio.get_running_loop().call_soon(deliver, self.clients.loads(question))

    def accounts_read(self, book: AccountBook, *, single_user: bool) -> int:
        """Note accounts that are in force from now on; return the time [ns]."""
        record: dict[str, Any] = {}
        if self._journal.is_kept:
            record = self._password_numbers.book_to_json(book, single_user=single_user)
        return self._begin("accounts", **record)

    def regranted(self, session: int, now: int) -> None:
        """Tell its cell that a connection may do other things from now on."""
        for number, event in self._server.route(Regranted(session)):
            self._cells[number].deliver(event, now)

    def tick(self) -> int:
        """Begin a control tick; return its time [ns]."""
        return self._begin("tick")

    def shut_down(self) -> int:
        """Begin the end of the server; return the time [ns]."""
        return self._begin("shut-down")

    def hang_up(self) -> None:
        """Note that every connection is closed because the server goes down."""
        self._begin("hang-up")
