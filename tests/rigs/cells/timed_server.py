"""A server with everything in it as full as it may be, whose turns of the loop are timed.

It is the application without sockets: bytes go into its connections' shells, its store is asked and
its jobs are done at once but not counted, and what the loop's thread spends on each turn is: on a
read, on going on with what was read, on taking back an answer, on the steps of a tick.
"""

from __future__ import annotations

import asyncio
import gc
import json
import pickle
import time
from collections import deque
from collections.abc import Callable
from functools import cache, partial
from pathlib import Path
from typing import Any

from rigs.data.large_programs import large_body
from rigs.data.stored_documents import answer_of, noon

from openpendant.motion.description.robot import serial_robot
from openpendant.motion.errors import MotionError
from openpendant.motion.scene.scene_file import SCENE_SCHEMA, scene_from_data
from openpendant.server.access.access_backend import DeliverChange, DeliverCheck
from openpendant.server.access.accounts import AccountBook, AccountChange
from openpendant.server.access.admission import VerifyJob
from openpendant.server.access.audit import AuditEntry
from openpendant.server.events.events import Port
from openpendant.server.planning.jobs import Deliver, Job, split_question
from openpendant.server.planning.worker.job_planner import answer
from openpendant.server.settings.cell_settings import ControllerPath, make_settings
from openpendant.server.shell.app import App
from openpendant.server.shell.cell_shell import CellParts
from openpendant.server.shell.client_connection import ClientConnection
from openpendant.server.shell.robot_kinematics import RobotKinematics
from openpendant.server.store.documents import DocumentKind
from openpendant.server.store.requests import Answer, Request
from openpendant.server.store.sqlite_store import open_store
from openpendant.simplemsg import (
    PENDANT,
    STANDARD,
    ByteOrder,
    Connection,
    ControllerMode,
    JointFeedback,
    Message,
    Role,
    Status,
    TriState,
    ValidField,
    codec_for,
    joint_array,
)
from openpendant.simplemsg.journal import Journal
from openpendant.simplemsg.pendant import (
    MAX_PENDANT_FRAME,
    PROTOCOL_VERSION,
    Activity,
    Authority,
    AuthorityAction,
    Hello,
    Login,
    LoginKind,
    ResetStop,
)
from openpendant.tools.packets.journals.reenactment import NullTransport

ROBOT = "ur5"
READ = 256 * 1024
"""What asyncio reads of a socket at once, at most [bytes]."""

TICK = 10_000_000

_YES, _NO = TriState.TRUE, TriState.FALSE
_STANDING = Status(_YES, _NO, 0, _NO, _NO, ControllerMode.AUTO, _YES)
PROGRAM = "main"


def ball(number: int) -> dict[str, Any]:
    """An object of the scene, out of the robot's reach."""
    place = [3.0 + number % 20, 3.0 + number // 20, 0.0]
    return {"name": f"o{number}", "shape": {"type": "sphere", "radius": 0.1}, "position": place}


def scene_of(count: int) -> dict[str, Any]:
    return {"schema": SCENE_SCHEMA, "objects": [ball(number) for number in range(count)]}


@cache
def most_objects() -> int:
    """How many objects the robot takes at once."""
    view = RobotKinematics(serial_robot(ROBOT))
    least, most = 1, 1_000
    while least < most:
        count = (least + most + 1) // 2
        try:
            deque(view.scene_steps(scene_from_data(scene_of(count), "scene")), maxlen=0)
            least = count
        except MotionError:
            most = count - 1
    return least


def frames_of(count: int) -> dict[str, Any]:
    placed = {"xyz": [0.1, 0.2, 0.3], "quat": [0.0, 0.0, 0.0, 1.0], "parent": "base"}
    frames = [{"name": f"f{number}", **placed} for number in range(count)]
    return {"schema": "openpendant-frames/1", "frames": frames}


def tools_of(count: int) -> dict[str, Any]:
    placed = {"xyz": [0.0, 0.0, 0.1], "quat": [0.0, 0.0, 0.0, 1.0]}
    tools = [{"name": f"t{number}", **placed} for number in range(count)]
    return {"schema": "openpendant-frames/1", "tools": tools}


class _Jobs:
    """The planning process: asked in the turn that asks, and answered when the rig says."""

    def __init__(self, waiting: deque[Callable[[], Callable[[], None]]]) -> None:
        self._waiting = waiting

    def submit(self, job: Job, deliver: Deliver) -> None:
        head, pieces = split_question(ROBOT, job)

        def done() -> Callable[[], None]:
            _, asked, _ = pickle.loads(head[4:])
            given = pickle.dumps(answer(ROBOT, job if pieces else asked), pickle.HIGHEST_PROTOCOL)
            return lambda: deliver(pickle.loads(given))

        self._waiting.append(done)

    def withdraw(self, job_id: int) -> None:
        """Have it answered all the same: the core ignores it."""


class _Store:
    """The store: its thread's work is not the loop's."""

    def __init__(self, file: Path, waiting: deque[Callable[[], Callable[[], None]]]) -> None:
        self.kept = open_store(file, wall_clock=noon)
        self._waiting = waiting

    def submit(self, request: Request, on_done: Callable[[Answer], None]) -> None:
        self._waiting.append(lambda: partial(on_done, answer_of(self.kept, request)))


class _Access:
    """The accounts, and passwords that are all right."""

    def __init__(self, book: AccountBook, waiting: deque[Callable[[], Callable[[], None]]]) -> None:
        self.single_user = False
        self.book = book
        self._waiting = waiting

    def record(self, entry: AuditEntry) -> None:
        """Forget an entry."""

    def check(self, job: VerifyJob, deliver: DeliverCheck) -> None:
        self._waiting.append(lambda: partial(deliver, True))

    def withdraw(self, job_id: int) -> None:
        """Have it checked all the same: the core ignores the answer."""

    def change(self, change: AccountChange, deliver: DeliverChange) -> None:
        self._waiting.append(lambda: partial(deliver, None))

    async def keep_up(self, on_change: Callable[[], None]) -> None:
        """Read nothing."""


class TimedClient:
    """One pendant or ROS-Industrial client."""

    def __init__(self, server: TimedServer, port: Port, address: str) -> None:
        is_pendant = port is Port.PENDANT
        self.shell: ClientConnection = server.app.connect(port, None if is_pendant else 0)
        self._server = server
        self._most = MAX_PENDANT_FRAME if is_pendant else 1_023
        self.shell.connection_made(_Heard(address))
        transport = self.shell._transport
        assert isinstance(transport, _Heard)
        self.transport = transport
        dialect = PENDANT if is_pendant else STANDARD
        self.wire = Connection(Role.CLIENT, dialect, ByteOrder.LITTLE, max_frame=self._most)
        go_on = self.shell._go_on
        # It is found by this name when it is called.
        vars(self.shell)["_go_on"] = lambda: server.turn("going on", go_on)

    def frame(self, message: Message) -> bytes:
        return self.wire.send(message)

    async def say(self, data: bytes) -> None:
        """Have bytes arrive as the loop would read them; let all that follows happen."""
        for at in range(0, len(data), READ):
            part = data[at : at + READ]
            self._server.turn("a read", partial(self.shell.data_received, part))
            while not self.transport.reads and not self.transport.is_over:
                await self._server.settle(self)
        await self._server.settle(self)

    async def tell(self, *messages: Message) -> None:
        await self.say(b"".join(map(self.frame, messages)))

    def heard(self) -> list[Any]:
        data = bytes(self.transport.written)
        self.transport.written.clear()
        got: list[Any] = list(self.wire.receive(data))
        while self.wire.more:
            got += self.wire.receive(b"")
        return got


class _Heard(NullTransport):
    """Keeps what is written, and whether more is read."""

    def __init__(self, address: str) -> None:
        super().__init__(address)
        self.written = bytearray()
        self.reads = True
        self.is_over = False

    def write(self, data: bytes | bytearray | memoryview) -> None:
        self.written += data

    def is_closing(self) -> bool:
        return self.is_over

    def close(self) -> None:
        self.is_over = True

    def abort(self) -> None:
        self.is_over = True

    def pause_reading(self) -> None:
        self.reads = False

    def resume_reading(self) -> None:
        self.reads = True


class TimedServer:
    """The server.

    Attributes:
        turns: what each turn was and what it cost [ms], since they were cleared.
    """

    def __init__(self, folder: Path, book: AccountBook) -> None:
        self.turns: list[tuple[str, float]] = []
        self.now = 1_000_000_000
        self._waiting: deque[Callable[[], Callable[[], None]]] = deque()
        self._store = _Store(folder / "store.db", self._waiting)
        self._fill_store()
        settings = make_settings({"controller": {"signals": "openpendant"}}, "test")
        parts = CellParts(settings, serial_robot(ROBOT), _Jobs(self._waiting))
        access = _Access(book, self._waiting)
        self.app = App([parts], Journal(), self._store, access, clock=lambda: self.now)
        self.app.take_accounts()
        self._links = self.app.cells[0].links
        for link in self._links.values():
            link.connection_made(NullTransport())
        self._codec = codec_for(STANDARD, ByteOrder.LITTLE)

    def _fill_store(self) -> None:
        save = partial(self._store.kept.save, expected_revision=0, author="ann")
        save(DocumentKind.PROGRAM, PROGRAM, large_body())
        for number in range(300):
            save(DocumentKind.PROGRAM, f"{number:03}{'n' * 50}", large_body(1, 1))
        cell = "cell"
        save(DocumentKind.TOOLS, cell, json.dumps(tools_of(400)))
        save(DocumentKind.FRAMES, cell, json.dumps(frames_of(500)))
        save(DocumentKind.SCENE, cell, json.dumps(scene_of(most_objects() - 6)))

    def revision(self, kind: DocumentKind) -> int:
        """Return the revision of a document that a change has to name."""
        if kind is DocumentKind.PROGRAM:
            return self._store.kept.load(kind, PROGRAM).heading.revision
        environment = self.app.cells[0].core.environment
        assert environment is not None
        if kind is DocumentKind.POSITIONS:
            return environment.positions.revision
        return environment.world.revisions[kind]

    def begin(self) -> None:
        """Go on as a server that runs, whose start the garbage collector looks at no more."""
        asyncio.run(self.settle())
        for _ in range(30):
            self.tick()
        gc.collect()
        gc.freeze()

    def close(self) -> None:
        gc.unfreeze()
        self._store.kept.close()

    def turn(self, what: str, do: Callable[[], object]) -> None:
        """Do something in a turn of the loop, and note what it cost."""
        began = time.thread_time_ns()
        do()
        self.turns.append((what, (time.thread_time_ns() - began) / 1e6))

    async def settle(self, client: TimedClient | None = None) -> None:
        """Let everything happen that was begun, as long as it takes."""
        pending = self.app.cells[0].core._pending
        for _ in range(100_000):
            await asyncio.sleep(0)
            if self._waiting:
                self.turn("an answer", self._waiting.popleft()())
            elif pending._running:
                self.tick()
            elif client is None or not client.shell.has_turn or client.transport.is_over:
                return
        raise AssertionError("it never ends")

    def tick(self) -> None:
        """Have the robot report that it stands where it stood, and run a tick."""
        self.now += TICK
        home = joint_array(serial_robot(ROBOT).home_position)
        nothing = joint_array(())
        state = self._links[ControllerPath.STATE]
        state.data_received(
            self._codec.encode(JointFeedback(0, int(ValidField.ALL), 0.0, home, nothing, nothing))
        )
        state.data_received(self._codec.encode(_STANDING))
        self.turn("a tick", self.app.tick)

    async def pendant(self, name: str | None = None, address: str = "192.0.2.10") -> TimedClient:
        """Return a pendant that has said hello and logged in, where it has a name."""
        cell = self.app.cells[0].core.cell
        while cell.activity is not Activity.IDLE:
            self.tick()  # until what the last one began has ended
        client = TimedClient(self, Port.PENDANT, address)
        await client.tell(Hello(PROTOCOL_VERSION, 0.0, "", "tester"))
        if name is not None:
            await client.tell(Login(1, LoginKind.PASSWORD, name, "a password"))
            await client.tell(Authority(2, AuthorityAction.REQUEST), ResetStop(3))
        client.heard()
        return client
