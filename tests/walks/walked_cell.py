"""A whole server with an emulated robot and one pendant on a virtual loop, to walk through.

Owns the world round the product: sockets, a planner and a store that answer when they are told to,
a pendant's hands, and by which frame a walk knows each of them. A run repeats to the byte.
"""

import asyncio
import json
import socket
from collections import deque
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from functools import partial
from itertools import repeat
from types import FrameType
from typing import Any, TypeVar

from rigs.cells.memory_store import MemoryStore
from rigs.data.stored_documents import answer_of
from rigs.processes.bare_app import bare_app
from rigs.processes.judged_server import HOST, ROBOT, running_emulator
from walks.tracer import OnFrame

from openpendant.motion.description.robot import serial_robot
from openpendant.server.events.events import TICK
from openpendant.server.planning.jobs import Deliver, Job
from openpendant.server.planning.worker.job_planner import answer
from openpendant.server.settings.cell_settings import make_settings
from openpendant.server.shell.cell_shell import CellParts
from openpendant.server.store.requests import Answer, Request
from openpendant.simplemsg import PENDANT, ByteOrder, Connection, Message, Role, pendant
from openpendant.simplemsg.verdicts import VerdictCode

_M = TypeVar("_M", bound=Message)

BEAT = 0.04
"""Between two beats of the pendant's hands [s]."""

_SETTLED = 0.1
"""After this time nothing new happens of itself [s]."""

_PATIENCE = 20_000
"""What is waited for comes within this time [ms]."""


class WaitingPlanner:
    """Keeps its jobs until it is told to answer."""

    def __init__(self) -> None:
        self.jobs: deque[tuple[Job, Deliver]] = deque()

    def submit(self, job: Job, deliver: Deliver) -> None:
        self.jobs.append((job, deliver))

    def withdraw(self, job_id: int) -> None:
        """Keep the job: an answer that nobody waits for is ignored."""

    def planned(self) -> Callable[[], None]:
        """Plan the oldest job; return what delivers the plan."""
        job, deliver = self.jobs.popleft()
        planned = answer(ROBOT, job)
        return lambda: deliver(planned)


class WaitingStore:
    """Keeps its requests until it is told to answer."""

    def __init__(self) -> None:
        self.store = MemoryStore()
        self.requests: deque[tuple[Request, Callable[[Answer], None]]] = deque()

    def submit(self, request: Request, on_done: Callable[[Answer], None]) -> None:
        self.requests.append((request, on_done))

    def answered(self) -> Callable[[], None]:
        """Do what the oldest request asks for; return what delivers the answer."""
        request, on_done = self.requests.popleft()
        return partial(on_done, answer_of(self.store, request))

    def answer_all(self) -> None:
        """Do all that is asked for, and deliver the answers."""
        while self.requests:
            self.answered()()


class Hands:
    """A pendant's connection, its beats and what it was told.

    Attributes:
        press: number of the press that is kept alive; 0 where none is.
    """

    def __init__(self, sock: socket.socket) -> None:
        self.got: list[Message] = []
        self.press = 0
        self.port: int = sock.getsockname()[1]
        self._sock = sock
        self._wire = Connection(
            Role.CLIENT, PENDANT, ByteOrder.LITTLE, max_frame=pendant.MAX_PENDANT_FRAME
        )
        self._beat = 0
        self._request = 0

    def request(self) -> int:
        """Return a fresh request number."""
        self._request += 1
        return self._request

    def frame(self, message: Message) -> bytes:
        """Return the bytes of a message, which are to be sent next."""
        return self._wire.send(message)

    async def send(self, *messages: Message) -> None:
        await self.send_frame(b"".join(map(self.frame, messages)))

    async def send_frame(self, data: bytes) -> None:
        await asyncio.get_running_loop().sock_sendall(self._sock, data)

    def next_beat(self) -> pendant.JogBeat:
        """Return the next beat of the press."""
        self._beat += 1
        return pendant.JogBeat(self.press, self._beat)

    async def listen(self) -> None:
        """Take what comes; runs until cancelled."""
        loop = asyncio.get_running_loop()
        while data := await loop.sock_recv(self._sock, 65_536):
            self.got += [each for each in self._wire.receive(data) if isinstance(each, Message)]

    async def keep_on(self) -> None:
        """Send beats and squeeze the enabling device; runs until cancelled."""
        while True:
            beats = [self.next_beat()] if self.press else []
            await self.send(
                pendant.AuthorityBeat(), pendant.Enabling(pendant.EnablingPosition.HELD), *beats
            )
            await asyncio.sleep(BEAT)

    def all(self, kind: type[_M]) -> list[_M]:
        return [message for message in self.got if isinstance(message, kind)]

    async def until(self, holds: Callable[[], object]) -> None:
        """Wait until something holds."""
        for _ in range(_PATIENCE):
            if holds():
                return
            await asyncio.sleep(0.001)
        raise AssertionError(f"not within {_PATIENCE} ms; heard last: {self.got[-3:]}")

    async def accepted(self, message: Message) -> None:
        """Send a request and wait until it is accepted."""
        request = getattr(message, "request_id", 0)

        def verdicts() -> list[int]:
            return [each.code for each in self.all(pendant.Verdict) if each.request_id == request]

        await self.send(message)
        await self.until(verdicts)
        assert verdicts() == [VerdictCode.ACCEPTED], self.got[-3:]

    def manage(self, operation: str, **fields: Any) -> pendant.Management:
        """Return a management request."""
        return pendant.Management(self.request(), json.dumps({"op": operation, **fields}).encode())

    @property
    def state(self) -> pendant.State:
        return self.all(pendant.State)[-1]


class WalkedCell:
    """One running server."""

    def __init__(
        self, shell: object, planner: WaitingPlanner, store: WaitingStore, motion_port: int
    ) -> None:
        self.planner = planner
        self.store = store
        self.hands: Hands
        self._shell = shell
        self._motion_port = motion_port
        self._beating: asyncio.Task[None] | None = None

    def keep_on(self) -> None:
        """Have the hands beat and squeeze from now on."""
        self._beating = asyncio.get_running_loop().create_task(self.hands.keep_on())

    def keep_off(self) -> None:
        """Have the hands do nothing by themselves any more."""
        if self._beating is not None:
            self._beating.cancel()
            self._beating = None

    # By which frames a walk knows the world.

    def asks_planner(self, frame: FrameType) -> bool:
        """Return True if a planner is given a job."""
        return _is_method(frame, "submit", self.planner)

    def asks_store(self, frame: FrameType) -> bool:
        """Return True if the store is given a request."""
        return _is_method(frame, "submit", self.store)

    def writes_to_controller(self, frame: FrameType) -> bool:
        """Return True if bytes are given to a connection to the controller's motion port."""
        return _is_write_to(self._motion_port, frame)

    def writes_to_pendant(self, frame: FrameType) -> bool:
        """Return True if bytes are given to the pendant's connection."""
        return _is_write_to(self.hands.port, frame)

    def ticks(self, frame: FrameType) -> bool:
        """Return True if a tick of the cell begins."""
        return _is_method(frame, "deliver", self._shell) and frame.f_locals["event"] is TICK

    def is_told(self, frame: FrameType) -> bool:
        """Return True if a round of three reports of the controller comes in."""
        return frame.f_code.co_name == "data_received" and _frames(frame.f_locals["data"]) == 3


def _is_method(frame: FrameType, name: str, owner: object) -> bool:
    return frame.f_code.co_name == name and frame.f_locals.get("self") is owner


def _is_write_to(port: int, frame: FrameType) -> bool:
    if frame.f_code.co_name != "write":
        return False
    transport = frame.f_locals.get("self")
    if not isinstance(transport, asyncio.WriteTransport):
        return False
    peer: tuple[str, int] = transport.get_extra_info("peername")
    return peer[1] == port


def _frames(data: bytes) -> int:
    """Return how many whole frames there are, each behind its length."""
    count = at = 0
    while at < len(data):
        at += 4 + int.from_bytes(data[at : at + 4], "little")
        count += 1
    return count if at == len(data) else 0


def receives(data: bytes) -> OnFrame:
    """Return what takes the frame in which these bytes come in."""

    def takes(frame: FrameType) -> bool:
        return frame.f_code.co_name == "data_received" and frame.f_locals.get("data") == data

    return takes


@asynccontextmanager
async def walked_cell(*, state_rate: float = 0.0) -> AsyncIterator[WalkedCell]:
    """Run a server with one pendant until the context is left.

    Args:
        state_rate: how often the pendant is told the state [Hz]; never where left out.
    """
    loop = asyncio.get_running_loop()
    async with running_emulator() as emulator:
        link = {"motion_port": emulator.motion_port, "state_port": emulator.state_port}
        ports = {"pendant_port": 0, "ros_motion_port": 0, "ros_state_port": 0}
        settings = make_settings({"robot": ROBOT, "controller": link, "listen": ports}, "test")
        planner, store = WaitingPlanner(), WaitingStore()
        app = bare_app([CellParts(settings, serial_robot(ROBOT), planner)], store=store)
        # A slow moment, in which a turn uses up the clients' share, is no part of any walk.
        app.connect = partial(app.connect, processor_time=repeat(0).__next__)
        cell = WalkedCell(app.cells[0], planner, store, emulator.motion_port)
        async with app.running() as bound:
            await asyncio.sleep(_SETTLED)
            cell.store.answer_all()  # what a cell asks for at its start
            with socket.socket() as sock:
                sock.setblocking(False)
                await loop.sock_connect(sock, (HOST, bound.pendant))
                cell.hands = Hands(sock)
                listening = loop.create_task(cell.hands.listen())
                await cell.hands.send(
                    pendant.Hello(pendant.PROTOCOL_VERSION, state_rate, "", "walker")
                )
                try:
                    await asyncio.sleep(_SETTLED)
                    cell.store.answer_all()  # and at a hello
                    yield cell
                finally:
                    cell.keep_off()
                    listening.cancel()
            await asyncio.sleep(0.05)
