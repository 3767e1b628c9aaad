"""The server as a program: builds the parts, joins them, runs the one timer.

The only place that knows all parts and the clock. Each cell's shell carries out what its core
returns and `clients` knows the connections; this one ticks every cell to absolute deadlines, and
owns the order in which the parts begin and end.
"""

from __future__ import annotations

import asyncio
import logging
import ssl
import time
from collections.abc import AsyncIterator, Sequence
from contextlib import AsyncExitStack, asynccontextmanager, suppress
from functools import partial

from openpendant.simplemsg import __version__
from openpendant.simplemsg.journal import Journal

from .access.admission import Login
from .access.audit import AuditEntry, AuditEvent
from .access.desk import CoreAccess
from .access.door import AbsentAccess, AccessDoor
from .access.grants import Granted
from .access.lockout import SECOND_NS
from .access.opening import exposure_of
from .access.pairing import PairingCodes
from .access.record import PasswordNumbers
from .cell_shell import CellShell, ServedCell
from .cells import Cells, Routed
from .client_connection import ClientConnection
from .clients import Clients
from .core import ServerCore
from .listening import Listening
from .loop_log import LoopLog
from .pendant.greeting import Identity
from .planning.pool import PlanningPool
from .ports import Ports, listen_for
from .robot_mathematics import RobotMathematics
from .store.door import AbsentStore, StoreDoor
from .tick_deadlines import next_deadline
from .watchdog.process import Watchdog

log = logging.getLogger("openpendant.server")

_REST_DEADLINE = 2.0


class App:
    """A running server.

    Attributes:
        cells: the shell of each cell.
        clients: the connections of pendants and of ROS-Industrial.
        journal: tells the time of the event at hand.
        overruns: ticks that were left out because the loop was late by more than a period.
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
        self._period = 1.0 / served[0].settings.tick_rate
        self._served = served
        unplanned = [each.settings.robot for each in served if each.planner is None]
        self._pool = PlanningPool(unplanned) if unplanned else None
        self.login = self._login()
        core_access = CoreAccess(self.login, self._access.record)
        names = tuple((each.settings.name, each.robot.name) for each in served)
        self._router = Cells([_core(each, names, core_access) for each in served])
        self._settings = [each.settings for each in served]
        self.clients = Clients(
            self._router,
            self._settings,
            self.login,
            self.journal,
            self._perform,
            self._misheard,
        )
        self.cells = [self._shell(number) for number in range(len(served))]
        self._next_tick = 0.0
        self._loop_log = LoopLog(round(self._period * 1e9))
        self._resting: asyncio.Event | None = None

    def _shell(self, number: int) -> CellShell:
        served = self._served[number]
        planner = served.planner
        if planner is None:
            assert self._pool is not None
            planner = self._pool.planner_of(served.settings.robot)
        label = "" if len(self._served) == 1 else f"{number + 1}/"
        core = self._router.cores[number]
        clients = self.clients.by_session
        return CellShell(
            served,
            core,
            planner,
            self.journal,
            clients,
            self._store,
            self._access,
            label,
            self._tell_watchdog,
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

    def _misheard(self, cell: int, session: int, error: Exception, now: int) -> None:
        self.cells[cell].misheard(session, error, now)

    # Time.

    def tick(self) -> None:
        """Run one control tick of every cell."""
        now = self.journal.begin("tick")
        # The beat goes with the time that the cores judge a freeze by: what the watchdog finds too
        # long they find too long as well, however a delay is spread over ticks.
        watchdog = self._watchdog
        stopped = 0 if watchdog is None else watchdog.beat(*self._watched())
        for number, cell in enumerate(self.cells):
            if self.journal.answer("stopped", f"{cell.label}watchdog", bool(stopped >> number & 1)):
                cell.core.watchdog_stopped()
        for cell in self.cells:
            cell.tick(now)
        self.clients.check_deadlines(now)
        self._tell_watchdog()

    def _watched(self) -> tuple[list[bool], list[bool]]:
        """Return of each cell whether its robot may move, and is said to be emulated."""
        moving = [cell.core.may_move for cell in self.cells]
        for cell, may_move in zip(self.cells, moving, strict=True):
            cell.is_watched = may_move
        return moving, [cell.core.cell.says_emulated for cell in self.cells]

    def _tell_watchdog(self) -> None:
        """Tell the watchdog what may move now."""
        if self._watchdog is not None:
            self._watchdog.news(*self._watched())

    def _on_timer(self) -> None:
        """Run a control tick, of a late one after what has arrived meanwhile was read.

        A tick judges silence: of pendants, of the controller, of whoever owes an answer. What they
        said while the loop was away waits in the sockets, and may not be counted against them.
        """
        loop = asyncio.get_running_loop()
        if loop.time() - self._next_tick <= self._period:
            self._run_tick()
            return
        # All that waits is found in the next turn of the loop and handled behind what was set in
        # this one, so that only in the turn after that all of it has been. On uvloop as well.
        self._timer: asyncio.Handle = loop.call_soon(self._once_more)

    def _once_more(self) -> None:
        self._timer = asyncio.get_running_loop().call_soon(self._run_tick)

    def _run_tick(self) -> None:
        """Run a control tick and set the timer to the next absolute deadline."""
        try:
            computed = time.thread_time_ns()
            self.tick()
            line = self._loop_log.tick(self.journal.now, computed, self.journal.longest_gap())
            if line:
                log.warning("%s", line)
            if self._resting is not None and not self._router.is_moving:
                self._resting.set()
        finally:
            self._set_timer()

    def _set_timer(self) -> None:
        loop = asyncio.get_running_loop()
        self._next_tick, left_out = next_deadline(self._next_tick, loop.time(), self._period)
        self.overruns += left_out
        self._timer = loop.call_at(self._next_tick, self._on_timer)

    # From start to end.

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
            listening = Listening()
            stack.callback(listening.close)
            connect = partial(ClientConnection, self.clients)
            ports = await listen_for(self._settings, listening, connect, self._tls)
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
                    nothing = [False] * len(self.cells)
                    self._watchdog.beat(nothing, nothing)
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
        self.clients.hang_up("the server is going down")
        for cell in self.cells:
            cell.hang_up()

    async def _come_to_rest(self) -> None:
        self.shut_down()
        self._resting = asyncio.Event()
        with suppress(TimeoutError):
            async with asyncio.timeout(_REST_DEADLINE):
                await self._resting.wait()


def _core(served: ServedCell, cells: tuple[tuple[str, str], ...], access: CoreAccess) -> ServerCore:
    settings, robot = served.settings, served.robot
    identity = Identity(settings.name, robot.name, f"openpendant {__version__}", cells)
    mathematics = RobotMathematics(robot)
    return ServerCore(settings, robot.limits, identity, mathematics, mathematics, access)


def loop_time() -> int:
    """Return the running loop's monotonic time [ns]."""
    return int(asyncio.get_running_loop().time() * 1e9)
