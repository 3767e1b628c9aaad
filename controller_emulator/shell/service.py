"""Emulator service on TCP: two listening ports and one timer round the controller's core.

Owns sockets, the clock, the time of an event (one reading of it for all that follows) and the order
in which the core is called; decides nothing about motion. All runs on one event loop, so no two
calls of the core overlap.
"""

from __future__ import annotations

import asyncio
import logging
import math
import os
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any, NamedTuple

from openpendant.simplemsg import (
    PENDANT,
    ByteOrder,
    Connection,
    Message,
    Received,
    Role,
    codec_for,
)
from openpendant.simplemsg.journal import Journal
from openpendant.simplemsg.pendant import OperatorAction

from ..core.controller import EmulatedController, Outgoing
from ..float32 import NANOSECONDS
from ..interpolation.segment import State
from .links import EmulatorLink, LinkEvents
from .places import EmulatorNewcomer, EmulatorPlaces
from .settings import EmulatorSettings

LEAST_TICK_RATE = 100
"""The timer runs at least this often [Hz], whatever the rate of reports."""

_ACCEPT_BACKLOG = 32
"""Connections that wait in the system's queue of each port; so many are taken in a turn."""

_AWAY = 30_000_000
"""A process in which nothing happened for so long, whatever its timer, was not run [ns]."""

_MOST_ORDERS = 64
"""Addresses whose byte order is kept; of more the oldest goes."""

log = logging.getLogger("openpendant.emulator")


class EmulatorPorts(NamedTuple):
    """The TCP ports in use."""

    motion: int
    state: int


class EmulatorListenFailed(Exception):
    """A port cannot be listened on."""

    def __init__(self, host: str, port: int, reason: str) -> None:
        super().__init__(f"cannot listen on {host} port {port}: {reason}")
        self.host = host
        self.port = port
        self.reason = reason


class Service:
    """One emulator on TCP: its ports, its timer, and the messages between links and core.

    Attributes:
        began: the loop's time at which `start` ended [s]; reports count from it.
    """

    def __init__(
        self,
        controller: EmulatedController,
        settings: EmulatorSettings,
        *,
        on_report: Callable[[float, State], None] | None = None,
        due: Callable[[int], list[OperatorAction]] | None = None,
        journal: Journal | None = None,
        clock: Callable[[], int] | None = None,
    ) -> None:
        """Make a service that is not listening yet; needs a running loop.

        Args:
            on_report: called with the time [s] since `start` and the motion, at the report rate.
            due: asked every tick which operator events are due at a time [ns].
            clock: the monotonic time of events [ns]; the loop's where left out.
        """
        self.controller = controller
        self._settings = settings
        self._on_report = on_report
        self._due = due
        self._loop = asyncio.get_running_loop()
        self.journal = journal or Journal()
        self._clock = clock or partial(loop_time, self._loop)
        self._event_time = 0
        self._servers: list[asyncio.Server] = []
        self._motion_links: dict[int, EmulatorLink] = {}
        self._state_links: dict[int, EmulatorLink] = {}
        self._links_made = 0
        self._places = EmulatorPlaces(self._addresses, self._clock)
        self._state_order = ByteOrder[settings.byte_order.upper()]
        self._codec = codec_for(PENDANT, self._state_order, settings.real_size)
        self._codecs = {order: codec_for(PENDANT, order, settings.real_size) for order in ByteOrder}
        self._orders: dict[str, ByteOrder] = {}
        self._ticks_per_report = math.ceil(LEAST_TICK_RATE / settings.rate)
        self._period = 1 / (settings.rate * self._ticks_per_report)
        self._ticks = 0
        self._rounds = 0
        self.began = 0.0
        self._alive = 0  # when anything happened last [ns]
        self._deadline = 0.0
        self._timer: asyncio.Handle | None = None

    @property
    def now(self) -> int:
        """The clock's time [ns]; what follows from one event happens at the time of that event."""
        return self._clock()

    @property
    def state_links(self) -> tuple[EmulatorLink, ...]:
        """The links on the state port, oldest first."""
        return tuple(self._state_links.values())

    async def start(self) -> EmulatorPorts:
        """Listen on both ports and start the timer.

        Raises:
            EmulatorListenFailed: a port cannot be used; nothing is left open then.
        """
        settings = self._settings
        try:
            ports = [
                await self._listen(self.motion_link, settings.motion_port),
                await self._listen(self.state_link, settings.state_port),
            ]
        except EmulatorListenFailed:
            await self.close()
            raise
        self.began = self._deadline = self._loop.time()
        self._schedule()
        return EmulatorPorts(*ports)

    async def close(self) -> None:
        """Stop listening, drop all links and the timer."""
        if self._timer is not None:
            self._timer.cancel()
        for server in self._servers:
            server.close()
        self.close_links()
        for server in self._servers:
            await server.wait_closed()
        self._servers.clear()

    def begin(self, event: str, link: int | str = "", data: bytes = b"", **more: Any) -> int:
        """Begin to handle an event, noted with all that repeats it; return its time [ns]."""
        self._event_time = now = self._clock()
        if self.journal.is_kept:
            self.journal.begin(now, event, link, data, more)
        return now

    def close_links(self) -> None:
        """Drop all links; the controller goes off."""
        self.begin("hang-up")
        for link in [*self._motion_links.values(), *self._state_links.values()]:
            link.abort()

    def _look(self, now: int) -> int:
        """Note the time of an event; report to the controller if the process was frozen."""
        if self._alive and now - self._alive > _AWAY:
            self.controller.was_away(self._alive, now)
        self._alive = now
        return now

    def operate(self, action: OperatorAction) -> None:
        """Carry out an operator's action."""
        now = self._look(self.begin("operate", int(action)))
        self._dispatch(self.controller.operate(action, now))
        self._tell_change()

    async def _listen(self, factory: Callable[[], EmulatorLink], port: int) -> int:
        host = self._settings.host
        try:
            newcomer = partial(EmulatorNewcomer, self._places, factory)
            server = await self._loop.create_server(newcomer, host, port, backlog=_ACCEPT_BACKLOG)
        except (OSError, UnicodeError) as error:  # UnicodeError: no name that could be looked up
            raise EmulatorListenFailed(host, port, _in_short(error)) from None
        self._servers.append(server)
        bound: int = server.sockets[0].getsockname()[1]
        return bound

    def motion_link(self) -> EmulatorLink:
        """Return a link of the motion port that is about to be connected."""
        events = LinkEvents(
            partial(self.begin, "in"),
            self._motion_opened,
            self._learn_order,
            self._motion_received,
            self._motion_closed,
        )
        return self._link(events)

    def state_link(self) -> EmulatorLink:
        """Return a link of the state port that is about to be connected."""
        events = LinkEvents(
            partial(self.begin, "in"),
            self._state_opened,
            self._learn_order,
            self._state_received,
            self._state_closed,
        )
        return self._link(events)

    def _link(self, events: LinkEvents) -> EmulatorLink:
        self._links_made += 1
        connection = Connection(Role.SERVER, PENDANT, real_size=self._settings.real_size)
        return EmulatorLink(self._links_made, connection, events, self.journal)

    def _addresses(self) -> Iterator[str]:
        """Return the address of every link."""
        for links in (self._motion_links, self._state_links):
            yield from (link.address for link in links.values())

    def _has_room(self, links: dict[int, EmulatorLink]) -> bool:
        return len(links) < self._settings.max_connections

    def _motion_opened(self, link: EmulatorLink) -> bool:
        now = self.begin("opened", link.number, port="motion", address=link.address)
        if not self._has_room(self._motion_links):
            return False
        self._motion_links[link.number] = link
        self.controller.connected(link.number, now)
        return True

    def _motion_received(self, link: EmulatorLink, message: Received) -> None:
        now = self._look(self._event_time)
        self._dispatch(self.controller.handle(link.number, message, now))
        self._tell_change()

    def _motion_closed(self, link: EmulatorLink) -> None:
        now = self._look(self.begin("closed", link.number))
        del self._motion_links[link.number]
        self._dispatch(self.controller.disconnected(link.number, now))
        self._tell_change()

    def _state_opened(self, link: EmulatorLink) -> bool:
        self.begin("opened", link.number, port="state", address=link.address)
        if not self._has_room(self._state_links):
            return False
        link.topic_order = self._orders.get(link.address, self._state_order)
        self._state_links[link.number] = link
        return True

    def _learn_order(self, link: EmulatorLink, order: ByteOrder) -> None:
        """Note the order of an address's first request on either port, for its state links.

        A listener that was told in the other order is closed, so that it connects again and is told
        rightly: the stock client's listener never says a word by itself.
        """
        self._orders.pop(link.address, None)
        self._orders[link.address] = order
        if len(self._orders) > _MOST_ORDERS:
            del self._orders[next(iter(self._orders))]
        for listener in list(self._state_links.values()):
            if listener.address != link.address or listener.topic_order is order:
                continue
            before, listener.topic_order = listener.topic_order, order
            if listener is link:
                continue
            log.warning(
                "%s speaks %s endian: its state link, told in %s endian, is closed to come again"
                " (--byte-order %s says so from the start)",
                *(link.address, order.name.lower(), before.name.lower(), order.name.lower()),
            )
            listener.close()

    def _state_received(self, link: EmulatorLink, message: Received) -> None:
        reply = self.controller.answer(message, self._event_time)
        if reply is not None:
            link.send(reply)

    def _state_closed(self, link: EmulatorLink) -> None:
        self.begin("closed", link.number)
        del self._state_links[link.number]

    def _dispatch(self, outgoing: Outgoing) -> None:
        for number, message in outgoing:
            link = self._motion_links.get(number)
            if link is not None:
                link.send(message)

    def _tell_change(self) -> None:
        """Send a changed STATUS at once, not with the next round."""
        status = self.controller.status_change(self._event_time)
        if status is not None:
            self._broadcast([status])

    def _broadcast(self, messages: list[Message]) -> None:
        if not self._state_links:
            return
        frames: dict[ByteOrder, bytes] = {}
        for link in list(self._state_links.values()):
            order = link.topic_order
            if order not in frames:
                frames[order] = b"".join(map(self._codecs[order].encode, messages))
            link.send_state(frames[order], self._event_time)

    def _schedule(self) -> None:
        """Set the timer to the next absolute deadline; a missed one is skipped, not run late."""
        late = self._loop.time() - self._deadline
        missed = max(0, math.floor(late / self._period))
        self._ticks += missed
        self._deadline += (missed + 1) * self._period
        self._timer = self._loop.call_at(self._deadline, self._on_timer)

    def _on_timer(self) -> None:
        """Advance the core; a late tick runs after the messages that arrived meanwhile.

        A point that waits in a socket must not be missed by a buffer that runs dry.
        """
        if self._loop.time() - self._deadline <= self._period:
            self._run_tick()
            return
        # In the next turn of the loop all that waits is found, and handled behind what was set in
        # this one: so the turn after that. On uvloop as well.
        self._timer = self._loop.call_soon(self._once_more)

    def _once_more(self) -> None:
        self._timer = self._loop.call_soon(self._run_tick)

    def _run_tick(self) -> None:
        if self._due is not None:
            for action in self._due(self.now):
                self.operate(action)
        self.tick(self._ticks + 1)
        self._schedule()

    def tick(self, number: int) -> None:
        """Let time pass and report.

        Args:
            number: of this tick since the start, missed ones counted.
        """
        now = self._look(self.begin("tick", number))
        self._ticks = number
        self._dispatch(self.controller.advance(now))
        rounds = self._ticks // self._ticks_per_report
        if rounds > self._rounds:
            self._rounds = rounds
            self._report(now)
        else:
            self._tell_change()
        for link in [*self._motion_links.values(), *self._state_links.values()]:
            link.check_deadlines(now)

    def _report(self, now: int) -> None:
        self._broadcast(self.controller.state_messages(now))
        if self._on_report is not None:
            self._on_report(now / NANOSECONDS - self.began, self.controller.motion(now))


def loop_time(loop: asyncio.AbstractEventLoop) -> int:
    """Return a loop's monotonic time [ns]."""
    return round(loop.time() * NANOSECONDS)


def _in_short(error: OSError | UnicodeError) -> str:
    # asyncio puts the address into `strerror`; the system's own words are short.
    number = error.errno if isinstance(error, OSError) else None
    return os.strerror(number) if number is not None and number > 0 else str(error)
