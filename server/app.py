"""The server as a program: builds the parts, joins them, runs the one timer.

The only place that knows all parts and the clock. Each cell's shell carries out what its core
returns; this one listens, numbers the connections and ticks every cell to absolute deadlines.
"""

from __future__ import annotations

import asyncio
import logging
import os
import ssl
from collections.abc import AsyncIterator, Sequence
from contextlib import AsyncExitStack, asynccontextmanager, suppress
from dataclasses import dataclass
from functools import partial
from typing import Any

from openpendant.simplemsg import ByteOrder, Received, __version__
from openpendant.simplemsg.journal import Journal

from .access.admission import Login
from .access.audit import AuditEntry, AuditEvent
from .access.desk import CoreAccess
from .access.door import AbsentAccess, AccessDoor
from .access.exposure import clear_text_fault
from .access.grants import Granted
from .access.lockout import SECOND_NS
from .access.opening import exposure_of
from .access.pairing import PairingCodes
from .access.record import PasswordNumbers
from .cell_shell import CellShell, ServedCell
from .cells import Cells, Routed
from .client_connection import ClientConnection
from .core import Port, ServerCore
from .pendant.face import Identity
from .planning.pool import PlanningPool
from .robot_mathematics import RobotMathematics
from .store.door import AbsentStore, StoreDoor
from .watchdog.process import Watchdog

log = logging.getLogger("openpendant.server")

BACKLOG = 32
"""asyncio accepts up to this many connections in one turn of the loop; more would delay ticks."""

_REST_DEADLINE = 2.0

_HANDSHAKE_DEADLINE = 2.0
"""TLS has to be agreed on by then, and taken leave of [s]; as long as hello may take."""


@dataclass(frozen=True, slots=True)
class RosPorts:
    """Where one cell listens for ROS-Industrial; None for nowhere.

    Attributes:
        motion: motion connections.
        state: state connections.
    """

    motion: int | None
    state: int | None


@dataclass(frozen=True, slots=True)
class Ports:
    """The ports that the server listens on.

    Attributes:
        pendant: pendant protocol, for all cells.
        ros: ROS-Industrial, by the name of the cell.
    """

    pendant: int
    ros: dict[str, RosPorts]


class ListenFailed(Exception):
    """A port cannot be listened on.

    Attributes:
        host: the address.
        port: the TCP port.
        reason: why, in the words of the system.
    """

    def __init__(self, host: str, port: int, reason: str) -> None:
        super().__init__(f"cannot listen on {host} port {port}: {reason}")
        self.host = host
        self.port = port
        self.reason = reason


class App:
    """A running server.

    Attributes:
        cells: the shell of each cell.
        journal: tells the time of the event at hand.
        overruns: ticks that were skipped because the loop was late.
    """

    def __init__(
        self,
        served: Sequence[ServedCell],
        journal: Journal | None = None,
        store: StoreDoor | None = None,
        watchdog: Watchdog | None = None,
        access: AccessDoor | None = None,
        tls: ssl.SSLContext | None = None,
    ) -> None:
        """Join the parts.

        Args:
            served: the cells, one or more; what they share is taken from the first.
            journal: the time and the record; the loop's time and no record where left out.
            store: keeps the documents of all cells; nothing is kept where left out.
            watchdog: stops the robots where this process freezes; nobody does where left out.
            access: accounts and audit log; none where left out.
            tls: encrypts the pendant port; nothing does where left out.
        """
        self._store = store or AbsentStore()
        self._watchdog = watchdog
        self._access = access or AbsentAccess()
        self._tls = tls
        self._password_numbers = PasswordNumbers()
        self.journal = journal or Journal(loop_time)
        self.overruns = 0
        self._listen_at = served[0].settings.listen
        self._period = 1.0 / served[0].settings.tick_rate
        self._served = served
        unplanned = [each.settings.robot for each in served if each.planner is None]
        self._pool = PlanningPool(unplanned) if unplanned else None
        self._clients: dict[int, ClientConnection] = {}
        self.login = self._login()
        core_access = CoreAccess(self.login, self._access.record)
        self._router = Cells([_core(each, core_access) for each in served])
        self.cells = [self._shell(number) for number in range(len(served))]
        self._orders: dict[tuple[int | None, str], ByteOrder] = {}
        self._next_session = 1
        self._next_tick = 0.0
        self._resting: asyncio.Event | None = None

    def _shell(self, number: int) -> CellShell:
        served = self._served[number]
        planner = served.planner
        if planner is None:
            assert self._pool is not None
            planner = self._pool.planner_of(served.settings.robot)
        label = "" if len(self._served) == 1 else f"{number + 1}/"
        core = self._router.cores[number]
        return CellShell(
            served, core, planner, self.journal, self._clients, self._store, self._access, label
        )

    def _login(self) -> Login:
        """Make the login of all cells."""
        first = self._served[0].settings
        numbers = {each.settings.name: str(at) for at, each in enumerate(self._served, 1)}
        codes = PairingCodes(
            round(first.access.pairing_minutes * 60 * SECOND_NS),
            lambda cell, is_typed: self.journal.answer("paired", numbers[cell], is_typed),
        )
        return Login(
            self._access.book,
            single_user_host=self._is_single_user,
            record=self._access.record,
            observe_without_login=first.access.observe_without_login,
            pairing=codes,
        )

    @property
    def _is_single_user(self) -> bool:
        """Whether without accounts whoever is on this machine may do everything."""
        return self._access.single_user and exposure_of(self._served[0].settings).is_local

    def take_accounts(self) -> None:
        """Follow the accounts, which were read anew."""
        book, single_user = self._access.book, self._access.single_user
        kept = self.journal.is_kept
        record = self._password_numbers.book_to_json(book, single_user=single_user) if kept else {}
        now = self.journal.begin("accounts", **record)
        self.login.single_user_host = self._is_single_user
        for change in self.login.accounts_changed(book, now):
            what = f"is {change.role.value}" if isinstance(change, Granted) else change.reason
            log.info("session %d: %s", change.session, what)
            number = self._router.home_of(change.session)
            if number is not None:
                self.cells[number].regrant(change.session, now)

    def _perform(self, routed: Routed) -> None:
        self.cells[routed.cell].perform(routed.outgoing)

    # Connections.

    def admit(self, client: ClientConnection) -> None:
        """Number a new connection and tell its cell; turn it away where there are too many."""
        client.session = self._next_session
        self._next_session += 1
        more: dict[str, Any] = {} if client.cell is None else {"cell": client.cell}
        now = self.journal.begin(
            "opened", client.session, port=client.port.name, address=client.address, **more
        )
        if len(self._clients) >= self._listen_at.max_connections:
            client.abort(f"more than {self._listen_at.max_connections} connections")
            return
        if client.cell is not None:
            exposure = exposure_of(self._served[client.cell].settings)
            fault = clear_text_fault(exposure, client.address)
            if fault is not None:
                client.abort(fault.sentence)
                return
        self._clients[client.session] = client
        self._perform(
            self._router.opened(client.session, client.port, client.address, now, client.cell)
        )

    def receive(self, session: int, received: Received, now: int) -> None:
        """Hand a client's message to its cell."""
        self._perform(self._router.receive(session, received, now))

    def dismiss(self, client: ClientConnection) -> None:
        """Tell its cell that a connection ended."""
        if self._clients.pop(client.session, None) is not None:
            now = self.journal.begin("closed", client.session)
            self._perform(self._router.closed(client.session, now))

    def state_byte_order(self, client: ClientConnection) -> ByteOrder:
        """Return the byte order for a state connection: the address's own, else configured."""
        configured = self._served[client.cell or 0].settings.ros_i.byte_order
        default = ByteOrder.LITTLE if configured == "little" else ByteOrder.BIG
        return self._orders.get((client.cell, client.address), default)

    def learn_byte_order(self, motion: ClientConnection) -> None:
        """Note what a motion connection spoke; a state connection in the other order is closed.

        The client connects again and is then spoken to in its own order; going on in the wrong one
        could make the reference client read a length of millions.
        """
        order = motion.wire.byte_order or ByteOrder.LITTLE
        self._orders[motion.cell, motion.address] = order
        for client in list(self._clients.values()):
            mismatch = client.wire.byte_order is not order
            is_same = (client.cell, client.address) == (motion.cell, motion.address)
            if client.port is Port.ROS_STATE and is_same and mismatch:
                client.close("its motion connection speaks the other byte order")

    # Time.

    def tick(self) -> None:
        """Run one control tick of every cell."""
        now = self.journal.begin("tick")
        for cell in self.cells:
            cell.tick(now)
        for client in list(self._clients.values()):
            client.check_deadlines(now)
        if self._watchdog is not None:
            self._watchdog.beat([core.may_move for core in self._router.cores])

    def _on_timer(self) -> None:
        """Run a control tick and set the timer to the next absolute deadline."""
        try:
            self.tick()
            if self._resting is not None and not self._router.is_moving:
                self._resting.set()
        finally:
            self._set_timer()

    def _set_timer(self) -> None:
        loop = asyncio.get_running_loop()
        self._next_tick += self._period
        late = loop.time() - self._next_tick
        if late > 0:
            skipped = int(late / self._period) + 1
            self.overruns += skipped
            self._next_tick += skipped * self._period
        self._timer = loop.call_at(self._next_tick, self._on_timer)

    # From start to end.

    async def _listen(self, stack: AsyncExitStack) -> Ports:
        pendant = await self._bind(stack, Port.PENDANT, self._listen_at.pendant_port)
        assert pendant is not None
        ros = {}
        for number, served in enumerate(self._served):
            listen = served.settings.listen
            ros[served.settings.name] = RosPorts(
                await self._bind(stack, Port.ROS_MOTION, listen.ros_motion_port, number),
                await self._bind(stack, Port.ROS_STATE, listen.ros_state_port, number),
            )
        return Ports(pendant, ros)

    async def _bind(
        self, stack: AsyncExitStack, port: Port, number: int | None, cell: int | None = None
    ) -> int | None:
        """Listen on a port until the stack is closed; return its number, None where it is off.

        Raises:
            ListenFailed: it cannot be bound.
        """
        if number is None:
            return None
        loop, host = asyncio.get_running_loop(), self._listen_at.host
        factory = partial(ClientConnection, self, port, cell)
        try:
            tls = self._tls if port is Port.PENDANT else None
            server = await loop.create_server(
                factory,
                host,
                number,
                backlog=BACKLOG,
                ssl=tls,
                ssl_handshake_timeout=None if tls is None else _HANDSHAKE_DEADLINE,
                ssl_shutdown_timeout=None if tls is None else _HANDSHAKE_DEADLINE,
            )
        except OSError as error:
            # asyncio puts the address into `strerror`; the system's own words are short.
            reason = os.strerror(error.errno) if error.errno and error.errno > 0 else str(error)
            raise ListenFailed(host, number, reason) from None
        stack.callback(server.close)
        bound: int = server.sockets[0].getsockname()[1]
        return bound

    @asynccontextmanager
    async def running(self) -> AsyncIterator[Ports]:
        """Listen, connect and tick for as long as the context is open.

        Leaving it stops all robots first, waits until they are seen at rest (at most 2 s), then
        closes every connection.

        Yields:
            The ports that it listens on.

        Raises:
            ListenFailed: a port cannot be bound.
        """
        loop = asyncio.get_running_loop()
        async with AsyncExitStack() as stack:
            self.take_accounts()
            self._note(AuditEvent.SERVER_STARTED)
            stack.callback(self._note, AuditEvent.SERVER_STOPPED)
            ports = await self._listen(stack)
            keepers = [link.keep_up() for cell in self.cells for link in cell.links.values()]
            if self._pool is not None:
                keepers.append(self._pool.keep_up())
            keepers.append(self._access.keep_up(self.take_accounts))
            tasks = [loop.create_task(keeper) for keeper in keepers]
            self._next_tick = loop.time()
            self._on_timer()
            try:
                yield ports
            finally:
                await self._come_to_rest()
                self._timer.cancel()
                if self._watchdog is not None:
                    # Nothing moves any more, whoever still holds an authority.
                    self._watchdog.beat([False] * len(self.cells))
                for task in tasks:
                    task.cancel()
                await asyncio.gather(*tasks, return_exceptions=True)
                self.hang_up()
                with suppress(asyncio.CancelledError):
                    await asyncio.sleep(0)

    def _note(self, event: AuditEvent) -> None:
        self._access.record(AuditEntry(event, loop_time(), detail={"version": __version__}))

    def shut_down(self) -> None:
        """Have every robot stopped because the server is going down."""
        now = self.journal.begin("shut-down")
        for cell in self.cells:
            cell.shut_down(now)

    def hang_up(self) -> None:
        """Close every connection."""
        self.journal.begin("hang-up")
        for client in list(self._clients.values()):
            client.close("the server is going down")
        for cell in self.cells:
            cell.hang_up()

    async def _come_to_rest(self) -> None:
        self.shut_down()
        self._resting = asyncio.Event()
        with suppress(TimeoutError):
            async with asyncio.timeout(_REST_DEADLINE):
                await self._resting.wait()


def _core(served: ServedCell, access: CoreAccess) -> ServerCore:
    settings, robot = served.settings, served.robot
    identity = Identity(settings.name, robot.name, f"openpendant {__version__}")
    mathematics = RobotMathematics(robot)
    return ServerCore(settings, robot.limits, identity, mathematics, mathematics, access)


def loop_time() -> int:
    """Return the running loop's monotonic time [ns]."""
    return int(asyncio.get_running_loop().time() * 1e9)
