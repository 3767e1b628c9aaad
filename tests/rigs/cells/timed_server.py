"""A server with everything in it as full as it may be, whose turns of the loop are timed.

It is the application without sockets: bytes go into its connections' shells, its store is asked and
its jobs are done at once but not counted, and what the loop's thread spends on each turn is: on a
read, on going on with what was read, on taking back an answer, on the steps of a tick. Its robot
stands, whatever it is told; its controller has signals.
"""

from __future__ import annotations

import asyncio
import gc
import json
import math
import pickle
import time
from collections import deque
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from functools import cache, partial
from pathlib import Path
from typing import Any

from rigs.data.full_cell import FRAMES, MAIN, TOOLS, ball, frames_of, kept_programs, tools_of
from rigs.data.large_programs import large_body
from rigs.data.stored_documents import answer_of, noon

from openpendant.controller_emulator.core.signals import DigitalSignals
from openpendant.motion.description.robot import serial_robot
from openpendant.motion.errors import MotionError
from openpendant.motion.frames.frame_tree import MOST_FRAMES
from openpendant.motion.scene.scene_file import SCENE_SCHEMA, scene_from_data
from openpendant.server.access.access_backend import DeliverChange, DeliverCheck
from openpendant.server.access.accounts import AccountBook, AccountChange
from openpendant.server.access.admission import VerifyJob
from openpendant.server.access.audit import AuditEntry
from openpendant.server.environment import CellEnvironment
from openpendant.server.events.events import Port
from openpendant.server.planning.jobs import (
    LENGTH,
    CertifiedTrajectory,
    Deliver,
    Job,
    JointPathJob,
    MotionJob,
    PlanFacts,
    PlanJob,
    SplitAnswer,
    split_answer,
    split_question,
)
from openpendant.server.planning.worker.job_planner import answer
from openpendant.server.refusal import Refusal
from openpendant.server.scene.signals import MOST_SIGNALS
from openpendant.server.scene.trace import MOST_POINTS
from openpendant.server.settings.cell_settings import ControllerPath, make_settings
from openpendant.server.shell.app import App
from openpendant.server.shell.cell_shell import CellParts
from openpendant.server.shell.client_connection import ClientConnection
from openpendant.server.shell.robot_kinematics import RobotKinematics
from openpendant.server.store.documents import DocumentKind
from openpendant.server.store.recording_format import (
    new_document,
    pack_rows,
    rows_in_a_chunk,
    write_document,
)
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
    Unasked,
    ValidField,
    codec_for,
    joint_array,
    refused,
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
    ReadSignals,
    ResetStop,
    WriteOutputs,
)
from openpendant.tools.packets.journals.reenactment import NullTransport

ROBOT = "ur5"
READ = 256 * 1024
"""What asyncio reads of a socket at once, at most [bytes]."""

TICK = 10_000_000

ROOM = 6
"""Objects that the scene has room for."""

_YES, _NO = TriState.TRUE, TriState.FALSE
_STANDING = Status(_YES, _NO, 0, _NO, _NO, ControllerMode.AUTO, _YES)


@cache
def longest_plan() -> tuple[CertifiedTrajectory, PlanFacts]:
    """A turn of the first joint that takes two minutes, whose numbers have all their digits."""
    robot = serial_robot(ROBOT)
    home = robot.home_position
    goal = (home[0] + 1.2345, *(value + 0.012345 for value in home[1:]))
    speed = 1.2345 / 119.0 / robot.limits.velocity[0]
    motion = JointPathJob(0, home, (goal,), speed)
    made = answer(ROBOT, PlanJob(1, home, motion))
    assert isinstance(made.result, tuple)
    assert made.facts is not None
    return CertifiedTrajectory(*made.result), made.facts


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


def recorded(count: int, gap: float = 0.0) -> bytes:
    """Rows of a robot that goes to and fro, one each 10 ms.

    Args:
        gap: 1.0 to say of each row that there is a gap before it.
    """
    home = serial_robot(ROBOT).home_position
    rows = ((at / 100, home[0] + 0.2 * math.sin(at / 200), *home[1:], gap) for at in range(count))
    return pack_rows(rows)


class _StateLink(NullTransport):
    """The far end of the state connection: a controller that has as many signals as are read."""

    def __init__(self) -> None:
        super().__init__()
        self.answers = bytearray()
        self._wire = Connection(Role.SERVER, PENDANT, ByteOrder.LITTLE)
        self._signals = DigitalSignals(MOST_SIGNALS, MOST_SIGNALS)

    def write(self, data: bytes | bytearray | memoryview) -> None:
        received = self._wire.receive(bytes(data))
        while received:
            for asked in received:
                assert isinstance(asked, Message)
                if isinstance(asked, ReadSignals | WriteOutputs):
                    answer = self._signals.answer(asked)
                    assert answer is not None, "the server asks, and sends nothing else"
                else:
                    answer = refused(asked)
                self.answers += self._wire.send(answer)
            received = self._wire.receive(b"") if self._wire.more else []


class _Jobs:
    """The planning process: asked in the turn that asks, and answered when the rig says."""

    def __init__(self, waiting: deque[Callable[[], Callable[[], None]]]) -> None:
        self.motions = 0
        self._waiting = waiting

    def submit(self, job: Job, deliver: Deliver) -> None:
        self.motions += isinstance(job, MotionJob)
        question, pieces = split_question(ROBOT, job)

        def done() -> Callable[[], None]:
            _, asked, _ = pickle.loads(question[LENGTH.size :])
            head, *arrays = split_answer(answer(ROBOT, job if pieces else asked))
            # Their bytes are read in turns of their own.
            given = [bytearray(array) for array in arrays]

            def taken() -> None:
                planned = pickle.loads(head[LENGTH.size :])
                deliver(planned.joined(given) if isinstance(planned, SplitAnswer) else planned)

            return taken

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
        """Return what was told since the last time, also of frames that others have made."""
        data = bytes(self.transport.written)
        self.transport.written.clear()
        got: list[Any] = list(self.wire.receive(data))
        while self.wire.more:
            got += self.wire.receive(b"")
        return [each.message if isinstance(each, Unasked) else each for each in got]


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
        most_objects: objects of the scene that the robot takes at once.
        most_frames: user frames that there may be beside the tools and the robot's own.
        most_tools: likewise, tools.
    """

    def __init__(
        self, folder: Path, book: AccountBook, objects: int | None = None, programs: int = 300
    ) -> None:
        """Fill a server.

        Args:
            objects: how many are in the scene; nearly as many as may be where left out.
            programs: how many are stored beside the large one.
        """
        self.turns: list[tuple[str, float]] = []
        self.now = 1_000_000_000
        own = len(RobotKinematics(serial_robot(ROBOT)).frames.frames)
        self.most_objects = most_objects() - ROOM
        self.most_frames, self.most_tools = MOST_FRAMES - TOOLS - own, MOST_FRAMES - FRAMES - own
        self._objects = self.most_objects if objects is None else objects
        self._waiting: deque[Callable[[], Callable[[], None]]] = deque()
        self._store = _Store(folder / "store.db", self._waiting)
        self._fill_store(programs)
        settings = make_settings({"controller": {"signals": "openpendant"}}, "test")
        self._jobs = _Jobs(self._waiting)
        parts = CellParts(settings, serial_robot(ROBOT), self._jobs)
        access = _Access(book, self._waiting)
        self.app = App([parts], Journal(), self._store, access, clock=lambda: self.now)
        self.app.take_accounts()
        self._links = self.app.cells[0].links
        self._controller, self._motion = _StateLink(), _Heard("")
        ends = {ControllerPath.STATE: self._controller, ControllerPath.MOTION: self._motion}
        for path, link in self._links.items():
            link.connection_made(ends.get(path, NullTransport()))
        self._codec = codec_for(STANDARD, ByteOrder.LITTLE)

    def _fill_store(self, programs: int) -> None:
        save = partial(self._store.kept.save, expected_revision=0, author="ann")
        save(DocumentKind.PROGRAM, MAIN, large_body())
        for name, body in kept_programs(large_body()).items() if programs else ():
            save(DocumentKind.PROGRAM, name, body)
        for number in range(programs):
            save(DocumentKind.PROGRAM, f"{number:03}{'n' * 50}", large_body(1, 1))
        cell = "cell"
        save(DocumentKind.TOOLS, cell, json.dumps(tools_of(TOOLS)))
        save(DocumentKind.FRAMES, cell, json.dumps(frames_of(FRAMES)))
        save(DocumentKind.SCENE, cell, json.dumps(scene_of(self._objects)))
        if programs:
            self._fill_recordings()

    def _fill_recordings(self) -> None:
        """Keep some of which what is said is known, and one, cut off, that has to be counted."""
        limits = serial_robot(ROBOT).limits
        made = new_document(ROBOT, limits.names, 0.01)
        most = rows_in_a_chunk(len(made.columns))
        rows = {f"{number:03}{'n' * 50}": recorded(10) for number in range(100)}
        rows |= {"kept": recorded(6_000), "cut off": recorded(most, gap=1.0)}
        for name, data in rows.items():
            about = {"finished": True, "samples": len(data) // (8 * len(made.columns))}
            document = made if name == "cut off" else made.model_copy(update=about)
            body = write_document(document)
            kind = DocumentKind.RECORDING
            self._store.kept.save(kind, name, body, expected_revision=0, author="ann")
            self._store.kept.append_chunk(name, 0, data)

    # What a frame has to be made with.

    def revision(self, kind: DocumentKind, name: str = "") -> int:
        """Return the revision that a change has to name; 0 of what there is not."""
        if name:
            headings = self._store.kept.headings(kind)
            found = [each.revision for each in headings if each.name == name and not each.deleted]
            return found[0] if found else 0
        if kind is DocumentKind.POSITIONS:
            return self._environment.positions.revision
        return self._environment.world.revisions[kind]

    def kept(self, name: str) -> str:
        """Return the JSON of a program."""
        return self._store.kept.load(DocumentKind.PROGRAM, name).body

    def somebody(self) -> int:
        """Connect another pendant; return the number of its session."""
        client = TimedClient(self, Port.PENDANT, "192.0.2.11")
        client.shell.data_received(client.frame(Hello(PROTOCOL_VERSION, 0.0, "", "somebody")))
        return client.shell.session

    @property
    def _environment(self) -> CellEnvironment:
        environment = self.app.cells[0].core.environment
        assert environment is not None
        return environment

    def plan(self) -> int:
        """Return the number of a plan that is kept, as long as a plan may be."""
        plans = self.app.cells[0].core.pendants.plans
        home = serial_robot(ROBOT).home_position
        made = plans._book.begin((0, "the rig"), "ptp", "", home, plans._basis(), self.now)
        certified, facts = longest_plan()
        assert not isinstance(plans._book.keep(made, certified, facts, 0.1, self.now), Refusal)
        return made.number

    def begin(self) -> None:
        """Go on as a server that runs, whose start the garbage collector looks at no more."""
        asyncio.run(self.settle())
        asyncio.run(self._tick_often(1_010))  # as long as it is known where a frame was
        gc.collect()
        gc.freeze()

    async def _tick_often(self, count: int) -> None:
        for _ in range(count):
            self.tick()
            # What a turn of a busy machine has left is handled in the next.
            await asyncio.sleep(0)

    def _fill_trace(self) -> None:
        """Have the tool been everywhere."""
        trace = self._environment.trace
        while len(trace.points) < MOST_POINTS:
            number = len(trace.points)
            trace.add((0.4, 0.1 * (number % 2), 0.001 * number))

    @property
    def planned(self) -> int:
        """How many motions a planning process was asked for."""
        return self._jobs.motions

    @property
    def moved(self) -> bool:
        """Whether a set-point has left for the controller."""
        return len(self._motion.written) > 0

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
            elif pending._running or self._controller.answers:
                self.tick()
            elif client is None or not client.shell.has_turn or client.transport.is_over:
                return
        raise AssertionError("it never ends")

    def tick(self) -> None:
        """Have the controller answer and report that the robot stands, and run a tick."""
        self.now += TICK
        answers, self._controller.answers = self._controller.answers, bytearray()
        state = self._links[ControllerPath.STATE]
        if answers:
            self.turn("answers of the controller", partial(state.data_received, bytes(answers)))
        home = joint_array(serial_robot(ROBOT).home_position)
        nothing = joint_array(())
        state.data_received(
            self._codec.encode(JointFeedback(0, int(ValidField.ALL), 0.0, home, nothing, nothing))
        )
        state.data_received(self._codec.encode(_STANDING))
        self.turn("a tick", self.app.tick)

    def guest(self, address: str = "192.0.2.10") -> TimedClient:
        """Return a pendant that has not said hello."""
        return TimedClient(self, Port.PENDANT, address)

    async def pendant(self, name: str | None = None, address: str = "192.0.2.10") -> TimedClient:
        """Return a pendant that has said hello and logged in, where it has a name."""
        cell = self.app.cells[0].core.cell
        self._fill_trace()
        while cell.activity is not Activity.IDLE:
            self.tick()  # until what the last one began has ended
        client = TimedClient(self, Port.PENDANT, address)
        await client.tell(Hello(PROTOCOL_VERSION, 0.0, "", "tester"))
        if name is not None:
            await client.tell(Login(1, LoginKind.PASSWORD, name, "a password"))
            await client.tell(Authority(2, AuthorityAction.REQUEST), ResetStop(3))
        client.heard()
        return client

    @asynccontextmanager
    async def others(self, count: int) -> AsyncIterator[None]:
        """Have other pendants connected: a third strangers, the others logged in."""
        clients = []
        for number in range(count):
            address = f"198.51.100.{number // 10}"
            clients.append(await self.pendant((None, "vera", "otto")[number % 3], address))
        yield
        for client in clients:
            client.shell.connection_lost(None)
        await self.settle()
