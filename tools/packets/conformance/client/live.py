"""A scripted controller on TCP that judges whoever connects to it.

Owns the sockets, the clock, and how long a scenario is watched. What the controller says and does
is `controller`'s, what the client's behaviour is worth is `judge`'s.
"""

from __future__ import annotations

import asyncio
import socket
from collections import Counter
from collections.abc import AsyncIterator, Awaitable, Callable, Sequence
from contextlib import asynccontextmanager
from functools import partial

from ...console import PacketToolError
from ...live.endpoints import in_short
from ...trace import Entry
from .controller import Act, Action, ClientLinkId, Do, ScriptedController, Write
from .setup import TRIGGERED, Mutation, Purpose, Scenario

LEAD_IN = 0.6
"""So long a client sees the reports of a scenario before it is asked to move [s]."""

QUIET = 0.5
"""A scenario is over once neither client nor robot did anything for so long [s]."""

LONGEST = 20.0
"""No scenario is watched longer after its first point [s]."""

SHORTEST_NS = 10_000
"""The timer is never set to less."""

STEP = 0.05
"""Period of the test whether a scenario is over [s]."""

MAX_LINKS = 64
"""More connections than this at a time are turned away."""

Trigger = Callable[[Scenario], Awaitable[None]]


class ClientLink(asyncio.Protocol):
    """One connection of the client."""

    def __init__(self, controller: LiveController, purpose: Purpose) -> None:
        self._controller = controller
        self._purpose = purpose
        self._id: ClientLinkId | None = None
        self.transport: asyncio.Transport | None = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Tell the controller; called by the loop."""
        assert isinstance(transport, asyncio.Transport)
        sock = transport.get_extra_info("socket")
        if sock.family in (socket.AF_INET, socket.AF_INET6):
            sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self.transport = transport
        self._id = self._controller.admit(self, self._purpose)
        if self._id is None:
            transport.abort()

    def data_received(self, data: bytes) -> None:
        """Hand on what came; called by the loop."""
        if self._id is not None:
            self._controller.received(self._id, data)

    def connection_lost(self, error: Exception | None) -> None:
        """Tell the controller; called by the loop."""
        if self._id is not None:
            self._controller.dismiss(self._id)


class LiveController:
    """Shell of the scripted controller: sockets, timer, and the bytes between client and core."""

    def __init__(self, core: ScriptedController, host: str, ports: dict[Purpose, int]) -> None:
        self.ports = dict(ports)
        self._core = core
        self._host = host
        self._links: dict[ClientLinkId, ClientLink] = {}
        self._numbers: Counter[Purpose] = Counter()
        self._servers: list[asyncio.Server] = []
        self._timer: asyncio.TimerHandle | None = None
        self._returning: asyncio.Task[None] | None = None

    @staticmethod
    def now() -> int:
        """Return the loop's monotonic time [ns]."""
        return round(asyncio.get_running_loop().time() * 1e9)

    @property
    def was_connected(self) -> bool:
        """True once a client was connected."""
        return bool(self._numbers)

    @asynccontextmanager
    async def listening(self) -> AsyncIterator[dict[Purpose, int]]:
        """Listen and tick for as long as the context is open.

        Raises:
            PacketToolError: a port cannot be listened on.
        """
        try:
            await self._listen()
            self._schedule()
            yield self.ports
        finally:
            if self._timer is not None:
                self._timer.cancel()
            if self._returning is not None:
                await asyncio.gather(self._returning, return_exceptions=True)
            self._go_away()
            await asyncio.sleep(0)

    async def _listen(self) -> None:
        loop = asyncio.get_running_loop()
        for purpose, port in self.ports.items():
            factory = partial(ClientLink, self, purpose)
            try:
                server = await loop.create_server(factory, self._host, port)
            except (OSError, UnicodeError) as error:
                where = f"{self._host} port {port}"
                raise PacketToolError(f"cannot listen on {where}: {in_short(error)}") from None
            self._servers.append(server)
            self.ports[purpose] = server.sockets[0].getsockname()[1]

    def _go_away(self) -> None:
        for server in self._servers:
            server.close()
        self._servers.clear()
        for link in list(self._links.values()):
            if link.transport is not None:
                link.transport.close()
        self._links.clear()

    def admit(self, link: ClientLink, purpose: Purpose) -> ClientLinkId | None:
        """Number a new connection and tell the core; turn it away where there are too many."""
        if len(self._links) >= MAX_LINKS:
            return None
        self._numbers[purpose] += 1
        number = ClientLinkId(purpose, self.ports[purpose], self._numbers[purpose])
        self._links[number] = link
        self._core.connected(number, self.now())
        return number

    def received(self, link: ClientLinkId, data: bytes) -> None:
        """Hand bytes to the core."""
        self._perform(self._core.received(link, data, self.now()))
        self._schedule()

    def dismiss(self, link: ClientLinkId) -> None:
        """Tell the core that a connection is gone."""
        self._links.pop(link, None)
        self._core.disconnected(link, self.now())

    def _schedule(self) -> None:
        loop = asyncio.get_running_loop()
        if self._timer is not None:
            self._timer.cancel()
        # Never at once: a timer that fires a rounding error too early would be set again for ever.
        due = max(self._core.next_due(), self.now() + SHORTEST_NS)
        self._timer = loop.call_at(due / 1e9, self._tick)

    def _tick(self) -> None:
        self._perform(self._core.due(self.now()))
        self._schedule()

    def _perform(self, actions: Sequence[Action]) -> None:
        for action in actions:
            match action:
                case Write(link=number, data=data):
                    link = self._links.get(number)
                    if link is not None and link.transport is not None:
                        link.transport.write(data)
                case Do(act=Act.AWAY):
                    self._go_away()
                case Do(act=Act.BACK):
                    self._returning = asyncio.get_running_loop().create_task(self._listen())
                case Do(act=act, link=gone) if gone is not None:
                    self._end(gone, act)

    def _end(self, number: ClientLinkId, act: Act) -> None:
        link = self._links.pop(number, None)
        if link is None or link.transport is None:
            return
        if act is Act.RESET:
            # SO_LINGER of zero seconds makes the kernel send RST instead of FIN.
            sock = link.transport.get_extra_info("socket")
            sock.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, bytes([1, 0, 0, 0, 0, 0, 0, 0]))
            link.transport.abort()
        else:
            link.transport.close()

    async def play(self, scenario: Scenario, trigger: Trigger, wait: float) -> list[Entry]:
        """Play one scenario; return its trace. A first point is waited for so long [s]."""
        core = self._core
        core.begin(scenario, self.now())
        self._schedule()
        await asyncio.sleep(LEAD_IN)
        core.note(TRIGGERED, self.now())
        asking = asyncio.ensure_future(trigger(scenario))
        try:
            await self._watch(scenario, wait)
        finally:
            if not asking.done():
                asking.cancel()
            await asyncio.gather(asking, return_exceptions=True)
        return core.trace

    async def _watch(self, scenario: Scenario, wait: float) -> None:
        """Return once the scenario has shown what it can."""
        core = self._core
        if scenario.mutation in (Mutation.NOT_POSSIBLE, Mutation.NOT_READY):
            wait = min(wait, scenario.lasts)
        if await _until(lambda: core.began is not None, wait):
            await _until(lambda: self._is_over(scenario), LONGEST)

    def _is_over(self, scenario: Scenario) -> bool:
        core, now = self._core, self.now()
        quiet = now - core.last_received >= QUIET * 1e9 and not core.moves(now)
        if core.mutated_at is None:
            return quiet
        return quiet and now - core.mutated_at >= scenario.lasts * 1e9


async def _until(holds: Callable[[], bool], longest: float) -> bool:
    """Wait for a condition; return True if it holds in time [s]."""
    for _ in range(round(longest / STEP)):
        if holds():
            return True
        await asyncio.sleep(STEP)
    return holds()
