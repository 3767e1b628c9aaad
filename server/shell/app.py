"""Server as a program: builds the parts, joins them, runs the one timer.

The only place that knows all parts and the clock. Each cell's shell carries out what its core
returns and `clients` knows the connections; this one ticks every cell to absolute deadlines, and
owns the order in which the parts begin and end.
"""

from __future__ import annotations

import asyncio
import logging
import ssl
import time
from collections.abc import AsyncIterator, Callable, Mapping, Sequence
from contextlib import AsyncExitStack, asynccontextmanager, suppress
from functools import partial

from openpendant.simplemsg import __version__
from openpendant.simplemsg.journal import Journal

from ..access.access_backend import AccessBackend
from ..access.admission import Admission
from ..access.arrivals import AddressRates
from ..access.audit import AuditEntry, AuditEvent
from ..access.gateways import Gateway, Gateways
from ..access.lockout import SECOND_NS
from ..access.open_access import exposure_of
from ..access.pairing import PairingCodes
from ..access.passwords import Secret
from ..access.request_gate import Granted
from ..core.cell_core import CellCore
from ..core.server_core import ServerCore
from ..endpoints.pendant.access_requests import CoreAccess, Identity
from ..events.events import TICK, ShutDown, WatchdogStopped
from ..planning.pool.forked_child import ForkedChild
from ..planning.pool.planning_pool import PlanningPool
from ..plans.plan_space import PlanSpace
from ..settings.cell_settings import ControllerPath
from ..store.store_client import StoreClient
from ..watchdog.watchdog_process import Watchdog
from .cell_shell import CellParts, CellShell, Outbox, backends
from .client_connection import ClientConnection
from .clients import Clients
from .controller_connection import ControllerConnection
from .inbox import Inbox, Observations, loop_time
from .listening import Listening, Ports, listen_for, unasked_ports
from .loop_share import LoopShare
from .loop_timing import LoopLog, next_deadline
from .robot_kinematics import RobotKinematics

log = logging.getLogger("openpendant.server")

_REST_DEADLINE = 2.0


class App:
    """A running server.

    Attributes:
        clients: the connections of pendants and of ROS-Industrial.
        connect: makes the protocol of a connection that was accepted for a port, of a cell.
        overruns: ticks that were left out because the loop was late by more than a period.
    """

    def __init__(
        self,
        served: Sequence[CellParts],
        journal: Journal,
        store: StoreClient,
        access: AccessBackend,
        watchdog: Watchdog | None = None,
        tls: ssl.SSLContext | None = None,
        planners: Sequence[ForkedChild] = (),
        gateway_secrets: Mapping[str, Secret] | None = None,
        clock: Callable[[], int] = loop_time,
    ) -> None:
        """Join the parts.

        Args:
            served: the cells, one or more; what they share is taken from the first.
            watchdog: stops the robots where this process freezes; nobody does where left out.
            tls: encrypts the pendant port; nothing does where left out.
            planners: planning processes that run already.
            gateway_secrets: of the gateways that the settings name, by their names; one whose
                secret is missing is not believed.
            clock: the monotonic time of events [ns]; the running loop's where left out.
        """
        self._store = store
        self._watchdog = watchdog
        self._access = access
        self._tls = tls
        self._journal = journal
        self._observations = Observations(journal)
        self.overruns = 0
        self._period = 1.0 / served[0].settings.tick_rate
        self._served = served
        unplanned = [each.settings.robot for each in served if each.planner is None]
        self._pool = PlanningPool(unplanned, planners) if unplanned else None
        self.login = self._login(gateway_secrets or {})
        core_access = CoreAccess(self.login, self._access.record)
        apart = self._observations.is_read_apart
        shared = core_access, apart, PlanSpace()
        self._router = ServerCore([_core(each, *shared) for each in served])
        self._settings = [each.settings for each in served]
        self._rates = AddressRates()
        self.clients = Clients(self._settings, self.login, self._is_within_rate)
        self.cells: list[CellShell] = []
        self.inbox = Inbox(journal, self._router, self.cells, self.clients, clock)
        self._share = LoopShare()
        self.connect = partial(ClientConnection, self.inbox, self._observations, share=self._share)
        self.cells += [self._shell(number) for number in range(len(served))]
        self._listening: Listening | None = None
        self._unasked: list[int] = []
        self._next_tick = 0.0
        self._loop_log = LoopLog(round(self._period * 1e9))
        self._resting: asyncio.Event | None = None

    def _shell(self, number: int) -> CellShell:
        served, core = self._served[number], self._router.cores[number]
        planner = served.planner
        if planner is None:
            assert self._pool is not None
            planner = self._pool.planner_of(served.settings.robot)
        label = "" if len(self._served) == 1 else f"{number + 1}/"
        link = served.settings.controller
        paths = [ControllerPath.MOTION, ControllerPath.STATE]
        if link.stop_connection:
            paths.append(ControllerPath.STOP)
        with_shell = self.inbox, self._observations
        links = {
            path: ControllerConnection(*with_shell, number, label, path, link) for path in paths
        }
        outbox = Outbox(
            *(self._journal, core.name, label, links, self.clients.by_session, planner),
            access=self._access,
            submit=backends(planner, self._store, self._access, self.inbox.measure),
            answered=partial(self.inbox.answered, number),
            plans=served.plans,
            watch=None if self._watchdog is None else self._tell_watchdog,
        )
        return CellShell(core, label, links, outbox)

    def _login(self, secrets: Mapping[str, Secret]) -> Admission:
        """Make the login of all cells."""
        first = self._served[0].settings
        numbers = {each.settings.name: str(at) for at, each in enumerate(self._served, 1)}
        codes = PairingCodes(
            round(first.access.pairing_minutes * 60 * SECOND_NS),
            lambda cell, is_typed: self._observations.is_paired(numbers[cell], is_typed),
        )
        return Admission(
            self._access.book,
            single_user_host=self._is_single_user,
            record=self._access.record,
            observe_without_login=first.access.observe_without_login,
            pairing=codes,
            max_connections=first.listen.max_connections,
            gateways=Gateways(
                [Gateway.of(each, secrets.get(each.name)) for each in first.gateways],
                self._access.record,
                self._observations.is_gateway,
            ),
        )

    def _is_within_rate(self, session: int, source: str, now: int) -> bool:
        """Count a connection for the rate of the address that a gateway stated."""
        return self._observations.is_within_rate(session, self._rates.is_within(source, now))

    @property
    def _is_single_user(self) -> bool:
        """Whether without accounts whoever is on this machine may do everything."""
        return self._access.single_user and exposure_of(self._served[0].settings).is_local

    def take_accounts(self) -> None:
        """Follow the accounts, which were read anew."""
        book, single_user = self._access.book, self._access.single_user
        now = self.inbox.accounts_read(book, single_user=single_user)
        self.login.single_user_host = self._is_single_user
        for change in self.login.accounts_changed(book, now):
            what = f"is {change.role.value}" if isinstance(change, Granted) else change.reason
            log.info("session %d: %s", change.session, what)
            self.inbox.regranted(change.session, now)
        if self.login.is_guarded:
            self._end_unasked()

    def _end_unasked(self) -> None:
        """End what knows no login and was not asked for; whoever moves by it is stopped."""
        self.clients.end_unasked()
        if self._listening is None or not self._unasked:
            return
        for port in self._unasked:
            self._listening.stop(port)
        log.warning(
            "there are accounts now: the ROS-Industrial ports (%s) are closed, because they know no"
            " login; to have them all the same give them numbers in [listen]",
            ", ".join(str(port) for port in self._unasked),
        )
        self._unasked = []

    # Time.

    def tick(self) -> int:
        """Run one control tick of every cell; return its time [ns]."""
        now = self.inbox.tick()
        # The beat goes with the time that the cores judge a freeze by: what the watchdog finds too
        # long they find too long as well, however a delay is spread over ticks.
        watchdog = self._watchdog
        stopped = 0 if watchdog is None else watchdog.beat(*self._watched())
        for number, cell in enumerate(self.cells):
            has_stopped = bool(stopped >> number & 1)
            if self._observations.has_stopped(f"{cell.label}watchdog", has_stopped):
                cell.deliver(WatchdogStopped(), now)
        for cell in self.cells:
            cell.deliver(TICK, now)
        self.inbox.check_deadlines(now)
        self._tell_watchdog()
        return now

    def _watched(self) -> tuple[list[bool], list[bool]]:
        """Return of each cell whether its robot may move, and is said to be emulated."""
        moving = [cell.core.may_move for cell in self.cells]
        for cell, may_move in zip(self.cells, moving, strict=True):
            cell.outbox.is_watched = may_move
        return moving, [cell.core.cell.feedback.says_emulated for cell in self.cells]

    def _tell_watchdog(self) -> None:
        """Tell the watchdog what may move now."""
        if self._watchdog is not None:
            self._watchdog.update(*self._watched())

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
            late = asyncio.get_running_loop().time() - self._next_tick
            self._share.ticked(round(late * 1e9))
            now = self.tick()
            line = self._loop_log.tick(now, computed, self.inbox.longest_gap())
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
            self._listening = listening = Listening(
                lambda: self.login.is_guarded, self._rates, self.login.gateways.has
            )
            stack.callback(listening.close)
            ports = await listen_for(
                *(self._settings, listening, self.connect, self._tls),
                is_guarded=self.login.is_guarded,
            )
            self._unasked = [] if self.login.is_guarded else unasked_ports(self._settings, ports)
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
        now = self.inbox.shut_down()
        for cell in self.cells:
            cell.deliver(ShutDown(), now)

    def hang_up(self) -> None:
        """Close every connection."""
        self.inbox.hang_up()
        self.clients.hang_up("the server is going down")
        for cell in self.cells:
            cell.hang_up()

    async def _come_to_rest(self) -> None:
        self.shut_down()
        self._resting = asyncio.Event()
        with suppress(TimeoutError):
            async with asyncio.timeout(_REST_DEADLINE):
                await self._resting.wait()


def _core(
    served: CellParts,
    access: CoreAccess,
    is_read_apart: Callable[[int], bool],
    plan_space: PlanSpace,
) -> CellCore:
    settings, robot = served.settings, served.robot
    display = f"{robot.manufacturer} {robot.model}".strip()
    identity = Identity(settings.name, robot.name, f"openpendant {__version__}", display)
    mathematics = RobotKinematics(robot)
    about = settings, robot.limits, identity, mathematics
    return CellCore(*about, mathematics, access, is_read_apart, plan_space)
