"""The server as a program: builds the parts, joins them, runs the one timer.

The only place that knows all parts and the clock. It carries out what the core returns and decides
nothing itself.
"""

from __future__ import annotations

import asyncio
import logging
import os
from collections.abc import AsyncIterator, Sequence
from contextlib import AsyncExitStack, asynccontextmanager, suppress
from dataclasses import dataclass
from functools import partial

import numpy as np

from openpendant.motion.kinematics import Kinematics
from openpendant.motion.robot import SerialRobot
from openpendant.simplemsg import ByteOrder, __version__
from openpendant.simplemsg.journal import Journal

from .client_connection import ClientConnection
from .controller_connection import ControllerConnection
from .controller_path import ControllerPath
from .core import Port, ServerCore
from .jobs import Planned
from .outgoing import (
    Answer,
    Close,
    DropLink,
    Forward,
    ForwardStop,
    Keep,
    Outgoing,
    Plan,
    Send,
    Spread,
)
from .pendant_face import Identity
from .plan_record import plan_to_json
from .plan_store import PlanStore
from .planning_process import Planner, PlanningProcess
from .settings import CellSettings

log = logging.getLogger("openpendant.server")

BACKLOG = 32
"""asyncio accepts up to this many connections in one turn of the loop; more would delay ticks."""

_REST_DEADLINE = 2.0


@dataclass(frozen=True, slots=True)
class Ports:
    """The ports that the server listens on.

    Attributes:
        pendant: pendant protocol.
        ros_motion: ROS-Industrial motion.
        ros_state: ROS-Industrial state.
    """

    pendant: int
    ros_motion: int
    ros_state: int


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


class KinematicsView:
    """Where the tool is, by the robot's kinematics."""

    def __init__(self, robot: SerialRobot) -> None:
        """Build the model of a robot."""
        self._kinematics = Kinematics(robot)

    def tool_pose(self, position: Sequence[float]) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Return x, y, z [m] and quaternion x, y, z, w of the tool in the base frame."""
        pose = self._kinematics.forward(position)
        return tuple(pose.position.tolist()), tuple(pose.quaternion.tolist())

    def tool_speed(self, position: Sequence[float], velocity: Sequence[float]) -> float:
        """Return the speed of the tool point [m/s]."""
        linear = self._kinematics.jacobian(position)[:3] @ np.asarray(velocity)
        return float(np.sqrt(linear @ linear))


class App:
    """A running server.

    Attributes:
        core: the pure core.
        journal: tells the time of the event at hand.
        links: the connections to the controller.
        ports: where it listens, once it does.
        overruns: ticks that were skipped because the loop was late.
    """

    def __init__(
        self,
        settings: CellSettings,
        robot: SerialRobot,
        planner: Planner | None = None,
        plans: PlanStore | None = None,
        journal: Journal | None = None,
    ) -> None:
        """Join the parts.

        Args:
            settings: the cell's configuration.
            robot: the robot.
            planner: who plans; a planning process where left out.
            plans: where motions are kept; nowhere where left out.
            journal: the time and the record; the loop's time and no record where left out.
        """
        self.settings = settings
        self.journal = journal or Journal(loop_time)
        identity = Identity(settings.name, robot.name, f"openpendant {__version__}")
        self.core = ServerCore(settings, robot.limits, identity, KinematicsView(robot))
        self.ports: Ports | None = None
        self.overruns = 0
        self._plans = plans
        self._planning = None if planner else PlanningProcess(settings.robot)
        self._planner: Planner = planner or self._need_process()
        self._clients: dict[int, ClientConnection] = {}
        self._orders: dict[str, ByteOrder] = {}
        self._next_session = 1
        link = settings.controller
        paths = [ControllerPath.MOTION, ControllerPath.STATE]
        if link.stop_connection:
            paths.append(ControllerPath.STOP)
        self.links = {path: ControllerConnection(self, path, link) for path in paths}
        self._next_tick = 0.0
        self._resting: asyncio.Event | None = None

    def _need_process(self) -> PlanningProcess:
        assert self._planning is not None
        return self._planning

    def perform(self, outgoing: list[Outgoing]) -> None:
        """Carry out what the core asked for, in order."""
        for item in outgoing:
            match item:
                case Send(session=session, message=message):
                    client = self._clients.get(session)
                    if client is not None:
                        client.send(message)
                case Forward(message=message):
                    self.links[ControllerPath.MOTION].send(message)
                case ForwardStop(message=message):
                    for path in (ControllerPath.STOP, ControllerPath.MOTION):
                        if path in self.links:
                            self.links[path].send(message)
                case Answer(path=path, message=message):
                    self.links[path].send(message)
                case Spread():
                    self._spread(item)
                case Close(session=session, reason=reason):
                    client = self._clients.get(session)
                    if client is not None:
                        client.close(reason)
                case DropLink(reason=reason):
                    self.links[ControllerPath.MOTION].drop(reason)
                case Plan(job=job):
                    if self.journal.is_kept:
                        self.journal.out("planner", repr(job).encode())
                    self._planner.submit(job, self.take_plan)
                case Keep(motion=motion):
                    if self._plans is not None:
                        self._plans.keep(motion)

    def take_plan(self, planned: Planned) -> None:
        """Hand the planner's answer to the core."""
        record = plan_to_json(planned) if self.journal.is_kept else {}
        now = self.journal.begin("planned", planned.job_id, **record)
        self.perform(self.core.planned(planned, now))

    def _spread(self, item: Spread) -> None:
        """Encode once for each wire form, write to all, skip those that read too slowly."""
        frames: dict[tuple[Port, ByteOrder | None], bytes] = {}
        for session in item.sessions:
            client = self._clients.get(session)
            if client is None:
                continue
            if client.is_clogged():
                self.core.skipped(session)
                continue
            form = (client.port, client.wire.byte_order)
            frame = frames.get(form)
            if frame is None:
                frame = frames[form] = client.wire.send(item.message)
            client.write(frame)

    def admit(self, client: ClientConnection) -> None:
        """Number a new connection and tell the core; turn it away where there are too many."""
        client.session = self._next_session
        self._next_session += 1
        now = self.journal.begin(
            "opened", client.session, port=client.port.name, address=client.address
        )
        if len(self._clients) >= self.settings.listen.max_connections:
            client.abort(f"more than {self.settings.listen.max_connections} connections")
            return
        self._clients[client.session] = client
        self.perform(self.core.opened(client.session, client.port, client.address, now))

    def dismiss(self, client: ClientConnection) -> None:
        """Tell the core that a connection ended."""
        if self._clients.pop(client.session, None) is not None:
            now = self.journal.begin("closed", client.session)
            self.perform(self.core.closed(client.session, now))

    def state_byte_order(self, address: str) -> ByteOrder:
        """Return the byte order for a state connection: the address's own, else configured."""
        configured = self.settings.ros_i.byte_order
        default = ByteOrder.LITTLE if configured == "little" else ByteOrder.BIG
        return self._orders.get(address, default)

    def learn_byte_order(self, address: str, order: ByteOrder) -> None:
        """Note what a motion connection spoke; a state connection in the other order is closed.

        The client connects again and is then spoken to in its own order; going on in the wrong one
        could make the reference client read a length of millions.
        """
        self._orders[address] = order
        for client in list(self._clients.values()):
            mismatch = client.wire.byte_order is not order
            if client.port is Port.ROS_STATE and client.address == address and mismatch:
                client.close("its motion connection speaks the other byte order")

    def tick(self) -> None:
        """Run one control tick."""
        now = self.journal.begin("tick")
        self.perform(self.core.tick(now))
        for client in list(self._clients.values()):
            client.check_deadlines(now)

    def _on_timer(self) -> None:
        """Run a control tick and set the timer to the next absolute deadline."""
        self.tick()
        if self._resting is not None and not self.core.cell.is_moving:
            self._resting.set()
        loop = asyncio.get_running_loop()
        period = 1.0 / self.settings.tick_rate
        self._next_tick += period
        late = loop.time() - self._next_tick
        if late > 0:
            skipped = int(late / period) + 1
            self.overruns += skipped
            self._next_tick += skipped * period
        self._timer = loop.call_at(self._next_tick, self._on_timer)

    async def _listen(self, stack: AsyncExitStack) -> Ports:
        loop = asyncio.get_running_loop()
        listen = self.settings.listen
        numbers = {}
        for port, number in (
            (Port.PENDANT, listen.pendant_port),
            (Port.ROS_MOTION, listen.ros_motion_port),
            (Port.ROS_STATE, listen.ros_state_port),
        ):
            factory = partial(ClientConnection, self, port)
            try:
                server = await loop.create_server(factory, listen.host, number, backlog=BACKLOG)
            except OSError as error:
                # asyncio puts the address into `strerror`; the system's own words are short.
                reason = os.strerror(error.errno) if error.errno and error.errno > 0 else str(error)
                raise ListenFailed(listen.host, number, reason) from None
            stack.callback(server.close)
            numbers[port] = server.sockets[0].getsockname()[1]
        return Ports(numbers[Port.PENDANT], numbers[Port.ROS_MOTION], numbers[Port.ROS_STATE])

    @asynccontextmanager
    async def running(self) -> AsyncIterator[Ports]:
        """Listen, connect and tick for as long as the context is open.

        Leaving it stops the robot first, waits until it is seen at rest (at most 2 s), then closes
        every connection.

        Yields:
            The ports that it listens on.

        Raises:
            ListenFailed: a port cannot be bound.
        """
        loop = asyncio.get_running_loop()
        async with AsyncExitStack() as stack:
            self.ports = await self._listen(stack)
            keepers = [link.keep_up() for link in self.links.values()]
            if self._planning is not None:
                keepers.append(self._planning.keep_up())
            tasks = [loop.create_task(keeper) for keeper in keepers]
            self._next_tick = loop.time()
            self._on_timer()
            try:
                yield self.ports
            finally:
                await self._come_to_rest()
                self._timer.cancel()
                for task in tasks:
                    task.cancel()
                await asyncio.gather(*tasks, return_exceptions=True)
                self.hang_up()
                with suppress(asyncio.CancelledError):
                    await asyncio.sleep(0)

    def shut_down(self) -> None:
        """Have the robot stopped because the server is going down."""
        self.perform(self.core.shut_down(self.journal.begin("shut-down")))

    def hang_up(self) -> None:
        """Close every connection."""
        self.journal.begin("hang-up")
        for client in list(self._clients.values()):
            client.close("the server is going down")
        for link in self.links.values():
            link.end()

    async def _come_to_rest(self) -> None:
        self.shut_down()
        self._resting = asyncio.Event()
        with suppress(TimeoutError):
            async with asyncio.timeout(_REST_DEADLINE):
                await self._resting.wait()


def loop_time() -> int:
    """Return the running loop's monotonic time [ns]."""
    return int(asyncio.get_running_loop().time() * 1e9)
