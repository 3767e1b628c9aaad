"""Emulators, a server of one cell or two and its pendants on one virtual loop, keeping journals.

Nothing of the machine gets into a journal: ports, the wall clock and what planning took are the
same in every run. So is the journal, but for how much a server that was held up reads at once.
"""

import asyncio
from collections.abc import AsyncIterator, Callable, Coroutine, Sequence
from contextlib import AsyncExitStack, asynccontextmanager
from dataclasses import dataclass, field, replace
from enum import Enum, auto
from functools import partial
from pathlib import Path
from typing import Any, cast

from rigs.data.stored_documents import answer_of, noon
from rigs.processes.app_on_loop import clients_of

from openpendant.controller_emulator.shell.build import build_controller
from openpendant.controller_emulator.shell.service import EmulatorPorts, Service, loop_time
from openpendant.controller_emulator.shell.settings import EmulatorSettings
from openpendant.motion.description.robot import serial_robot
from openpendant.server.access.access_backend import ProcessAccess
from openpendant.server.access.accounts import AccountBook
from openpendant.server.planning.jobs import Deliver, Job
from openpendant.server.planning.worker.job_planner import answer
from openpendant.server.settings.cell_settings import CellSettings, make_settings, settings_as_data
from openpendant.server.shell import inbox as server_inbox
from openpendant.server.shell.app import App
from openpendant.server.shell.cell_shell import CellParts
from openpendant.server.store.requests import Answer, Request
from openpendant.server.store.sqlite_store import open_store
from openpendant.server.watchdog.watchdog_process import Watchdog
from openpendant.simplemsg import __version__
from openpendant.simplemsg.journal import Journal, Part, spelled
from openpendant.tools.pendants.client import PendantClient

ROBOT = "ur5"
HOST = "127.0.0.1"
STARTED = noon()
PLAN_TIME = 0.01
"""What the journal says planning took, whatever it took [s]."""

_PLANNING = 0.03
_STORING = 0.005


class Lines:
    def __init__(self) -> None:
        self._parts: list[str] = []

    def write(self, *parts: Part) -> None:
        self._parts += map(spelled, parts)

    @property
    def content(self) -> bytes:
        return "".join(self._parts).encode("ascii")


class Answers:
    """What the server was asked elsewhere; while it is held up, no answer gets through."""

    def __init__(self) -> None:
        self._is_held = False
        self._held: list[Callable[[], None]] = []

    def later(self, delay: float, deliver: Callable[[], None]) -> asyncio.TimerHandle:
        return asyncio.get_running_loop().call_later(delay, self._deliver, deliver)

    def hold(self) -> None:
        self._is_held = True

    def let_go(self) -> None:
        """Deliver what has come meanwhile."""
        self._is_held = False
        while self._held:
            self._held.pop(0)()

    def _deliver(self, deliver: Callable[[], None]) -> None:
        if self._is_held:
            self._held.append(deliver)
        else:
            deliver()


class PlannerOnTheLoop:
    """Plans at once, and delivers as late as a planning process would."""

    def __init__(self, answers: Answers) -> None:
        self._answers = answers
        self._deliveries: dict[int, asyncio.TimerHandle] = {}

    def submit(self, job: Job, deliver: Deliver) -> None:
        planned = answer(ROBOT, job)
        pinned = replace(planned, plan_time=PLAN_TIME, took=PLAN_TIME if planned.took else 0.0)
        later = self._answers.later(_PLANNING, partial(deliver, pinned))
        self._deliveries[job.job_id] = later

    def withdraw(self, job_id: int) -> None:
        self._deliveries[job_id].cancel()


class StoreOnTheLoop:
    """The real store in a file, asked at once; its answers come as late as its thread's would."""

    def __init__(self, file: Path, answers: Answers) -> None:
        self._store = open_store(file, wall_clock=noon)
        self._answers = answers

    def submit(self, request: Request, on_done: Callable[[Answer], None]) -> None:
        self._answers.later(_STORING, partial(on_done, answer_of(self._store, request)))

    def close(self) -> None:
        self._store.close()


class WatchdogOnTheLoop:
    """A watchdog that stops nothing by itself.

    Attributes:
        stopped: which cells it says in the next beat that it has stopped, a bit each.
    """

    def __init__(self) -> None:
        self.stopped = 0

    def beat(self, moving: Sequence[bool], emulated: Sequence[bool]) -> int:
        told, self.stopped = self.stopped, 0
        return told

    def update(self, moving: Sequence[bool], emulated: Sequence[bool]) -> None:
        """Nothing is watched here."""


class Heard(Enum):
    """What a server that was held up can notice first."""

    CLIENTS = auto()
    CONTROLLER = auto()
    ANSWERS = auto()
    TICK = auto()


class OlderClient(PendantClient):
    """A client that speaks version 2: what was recorded says how that is answered."""

    _version = 2


@dataclass
class RecordedCell:
    """The processes of a conversation.

    Attributes:
        answers: of its planner and its store.
        ros_ports: motion and state port of its first cell.
        left_over: what has to end before the loop does.
    """

    services: list[Service]
    app: App
    watchdog: WatchdogOnTheLoop
    answers: Answers
    pendant_port: int
    ros_ports: tuple[int, int]
    left_over: list[asyncio.Task[None]] = field(default_factory=list)

    async def pendant(
        self, client: str = "pendant", *, state_rate: float = 10.0, **options: Any
    ) -> PendantClient:
        """Return a pendant that sees a robot that can move."""
        pendant = await OlderClient.connect(
            HOST, self.pendant_port, client=client, state_rate=state_rate, **options
        )
        if not options:
            await pendant.wait_until(lambda state: state.motion_possible == 1)
        return pendant

    async def hold_up_server(self, seconds: float, first: Heard) -> None:
        """Let time pass in which everybody but the server is run.

        Args:
            seconds: how long.
            first: what it notices first of all that came meanwhile.
        """
        app = self.app
        clients = [client._transport for client in clients_of(app).values()]
        links = [link._transport for cell in app.cells for link in cell.links.values()]
        app._timer.cancel()
        for transport in clients + links:
            cast(asyncio.ReadTransport, transport).pause_reading()
        self.answers.hold()
        await asyncio.sleep(seconds)
        resume: dict[Heard, Callable[[], None]] = {
            Heard.CLIENTS: partial(_resume, clients),
            Heard.CONTROLLER: partial(_resume, links),
            Heard.ANSWERS: self.answers.let_go,
            Heard.TICK: app._run_tick,
        }
        resume.pop(first)()
        for _ in range(5):
            await asyncio.sleep(0)
        for rest in resume.values():
            rest()

    def afterwards(self, work: Coroutine[Any, Any, None]) -> None:
        """Have something go on while the server goes down, and wait for its end behind that."""
        self.left_over.append(asyncio.get_running_loop().create_task(work))


@asynccontextmanager
async def recorded_cell(
    folder: Path, journals: dict[str, Lines], *, cells: int = 1, **tables: object
) -> AsyncIterator[RecordedCell]:
    """Run everything until the context is left.

    Args:
        journals: gets the journals of the server and of the first emulator.
    """
    async with AsyncExitStack() as stack:
        services, settings, noted = [], [], []
        for number in range(cells):
            service = _emulator(journals["emulator"] if number == 0 else None, stack)
            ports = await service.start()
            stack.push_async_callback(service.close)
            services.append(service)
            own = {"name": f"cell{number + 1}"} if cells > 1 else {}
            settings.append(_settings(ports, **own, **tables))
            noted.append(
                _settings(EmulatorPorts(12000 + 10 * number, 12002 + 10 * number), **own, **tables)
            )
        answers, file = Answers(), folder / "store.db"
        store = StoreOnTheLoop(file, answers)
        stack.callback(store.close)
        access = ProcessAccess(file, AccountBook(), single_user=True, audit=None)
        stack.callback(access.close)
        watchdog, journal = WatchdogOnTheLoop(), Journal()
        served = [
            CellParts(each, serial_robot(ROBOT), PlannerOnTheLoop(answers)) for each in settings
        ]
        app = App(served, journal, store, access, cast(Watchdog, watchdog))
        about = [settings_as_data(each) for each in noted]
        now, told = server_inbox.loop_time(), about[0] if cells == 1 else {"cells": about}
        _keep(journal, journals["server"], "server", now, told)
        stack.callback(journal.end)
        listening = await stack.enter_async_context(app.running())
        ros = listening.ros[settings[0].name]
        assert ros.motion is not None
        assert ros.state is not None
        ports_of_ros = ros.motion, ros.state
        cell = RecordedCell(services, app, watchdog, answers, listening.pendant, ports_of_ros)
        yield cell
    await asyncio.gather(*cell.left_over)
    # What the ends of the connections have put off.
    await asyncio.sleep(0.01)


def _emulator(journal: Lines | None, stack: AsyncExitStack) -> Service:
    settings = EmulatorSettings.model_validate({"motion_port": 0, "state_port": 0, "rate": 50})
    kept, now = Journal(), loop_time(asyncio.get_running_loop())
    if journal is not None:
        _keep(kept, journal, "emulator", now, settings.model_dump(mode="json"))
        stack.callback(kept.end)
    return Service(build_controller(settings, now), settings, journal=kept)


def _resume(transports: Sequence[asyncio.Transport | None]) -> None:
    for transport in transports:
        cast(asyncio.ReadTransport, transport).resume_reading()


def _settings(ports: EmulatorPorts, **tables: Any) -> CellSettings:
    controller = {
        "motion_port": ports.motion,
        "state_port": ports.state,
        "signals": "openpendant",
        "state_period": 0.02,
    }
    listen = {"pendant_port": 0, "ros_motion_port": 0, "ros_state_port": 0}
    values = {"robot": ROBOT, "tick_rate": 50, "controller": controller, "listen": listen, **tables}
    return make_settings(values, "a conversation")


def _keep(journal: Journal, lines: Lines, kind: str, now: int, settings: dict[str, Any]) -> None:
    about = {"version": __version__, "settings": settings}
    journal.keep(lines, _fail, now, kind=kind, started=STARTED, **about)


def _fail(error: OSError) -> None:
    raise error
