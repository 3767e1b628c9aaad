"""A room in one server process: 30 robots that all jog, each with a pendant that listens at 100 Hz.

Half of the pendants jog all joints at once, a quarter the tool along the base, a quarter along its
own axis; each sample says so, and is none unless nine tenths of the state messages show motion.
The emulated controllers are two other processes, the pendants a third. The idle control is a 100 Hz
timer of this process, which does nothing else meanwhile: what the machine does to it, it does to
the server as well.

Where uvloop is installed, there is the same room again with server and controllers on it; its clock
tells how late a tick is in whole milliseconds. Pendants and idle control stay as they are.
"""

from __future__ import annotations

import asyncio
import json
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from threading import Thread
from typing import Any

from .peers import process
from .table import Benchmark, Bound, Judged, MissingRequirement, Sides

ROBOTS = 30
WINDOW = 8.0
"""Length of one sample [s]."""

SERVER, PEERS = 0, 1
"""Places of the server, and of emulators and pendants: nobody shall wait for who wakes it."""

_EMULATORS = 2
_ROBOT = "ur5"
_TIMEOUT = 120.0


def benchmarks() -> list[Benchmark]:
    """Return how late the ticks are and what the server takes of a processor."""
    late = Bound(10.0, judged=Judged.VALUE)
    share = Bound(80.0, aim=60.0, judged=Judged.VALUE)
    rows: list[Benchmark] = []
    for event_loop, title in (("asyncio", "cells"), ("uvloop", "cells on uvloop")):
        name, room = f"{title}: {ROBOTS} jogs and listeners", partial(_room, event_loop)
        rows += [
            Benchmark(f"{name}, tick p99 late", "ms", partial(room, "late_p99"), late, 3),
            Benchmark(f"{name}, processor of the server", "%", partial(room, "cpu"), share, 3),
        ]
    return rows


@contextmanager
def _room(event_loop: str, figure: str) -> Iterator[Sides]:
    if find_spec(event_loop) is None:
        raise MissingRequirement(f"{event_loop} is not installed")
    with running_room(ROBOTS, event_loop) as (server, cells):
        idle = 0.0

        def subject() -> float:
            nonlocal idle
            account, idle = observed(server, cells, WINDOW)
            if account["jogging"] < 90.0 or account["moving"] < 90.0:
                raise RuntimeError(f"the robots did not jog: {account}")
            del account["slots"]  # one line shall hold the rest
            print(f"  {account}", file=sys.stderr)
            return float(account[figure])

        yield Sides(subject, (lambda: idle) if figure == "late_p99" else None)


@contextmanager
def running_room(
    robots: int,
    event_loop: str = "asyncio",
    *,
    is_pinned: bool = True,
    jog_lead: float = 0.05,
    is_unhurried: bool = False,
) -> Iterator[tuple[dict[str, Any], list[str]]]:
    """Run emulated robots and one server for all of them.

    Args:
        is_unhurried: controllers and watchdog wait as long for what is late as a server can ask
            for: on a machine whose processors the robots take nearly whole.
    """
    with ExitStack() as stack:
        controllers: list[dict[str, int]] = []
        for part in range(_EMULATORS):
            count = robots * (part + 1) // _EMULATORS - robots * part // _EMULATORS
            ready: dict[str, Any] = stack.enter_context(
                process(
                    *("openpendant.controller_emulator", "--robot", _ROBOT, "--json"),
                    *("--motion-port", "0", "--state-port", "0", "--count", str(count)),
                    *("--event-loop", event_loop),
                    place=PEERS if is_pinned else None,
                    first=True,
                )
            )
            controllers += ready.get("controllers", [ready])
        folder = stack.enter_context(tempfile.TemporaryDirectory(prefix="openpendant-bench-"))
        cells = [f"robot {number}" for number in range(1, robots + 1)]
        file = Path(folder) / "room.toml"
        file.write_text(
            _room_file(cells, controllers, jog_lead, is_unhurried=is_unhurried), encoding="utf-8"
        )
        command = ["openpendant.server", "--json", "--config", str(file)]
        command += ["--event-loop", event_loop]
        server = stack.enter_context(process(*command, place=SERVER if is_pinned else None))
        yield server, cells


def _room_file(
    cells: list[str], controllers: list[dict[str, int]], jog_lead: float, *, is_unhurried: bool
) -> str:
    patience = "points_in_flight = 4"
    if is_unhurried:
        patience = "points_in_flight = 8, lead = 0.25, reply_deadline = 2.0"
    tables = "".join(
        f'[[cells]]\nname = "{name}"\nrobot = "{_ROBOT}"\n'
        f'modes.initial = "manual_reduced"\njog.lead = {jog_lead}\n'
        f"controller = {{motion_port = {at['motion']}, state_port = {at['state']},"
        f" {patience}}}\n"
        for name, at in zip(cells, controllers, strict=True)
    )
    watchdog = "watchdog.deadline = 1.0\n" if is_unhurried else ""
    return f"listen.pendant_port = 0\n{watchdog}{tables}"


def observed(
    server: dict[str, Any], cells: list[str], seconds: float
) -> tuple[dict[str, Any], float]:
    """Have all pendants jog; return their account, and the idle timer's 99th percentile [ms]."""
    command = [sys.executable, "-m", "openpendant.tools.bench.jogging_pendants"]
    command += [str(server["pendant"]), str(server["pid"]), str(seconds), str(PEERS), *cells]
    idle = _IdleTimer()
    thread = Thread(target=idle.run)
    thread.start()
    try:
        done = subprocess.run(
            command, capture_output=True, text=True, timeout=_TIMEOUT, check=False
        )
    finally:
        idle.is_over = True
        thread.join()
    if done.returncode:
        raise RuntimeError(done.stderr)
    account: dict[str, Any] = json.loads(done.stdout)
    return account, idle.late_p99


class _IdleTimer:
    """A timer at 100 Hz that has nothing to do.

    Attributes:
        late_p99: of a hundred ticks one was later [ms].
    """

    def __init__(self) -> None:
        self.is_over = False
        self.late_p99 = 0.0

    def run(self) -> None:
        """Tick until told to end."""
        asyncio.run(self._ticks())

    async def _ticks(self) -> None:
        now: Callable[[], float] = asyncio.get_running_loop().time
        begin, late = now(), list[float]()
        while not self.is_over:
            due = begin + (len(late) + 1) / 100
            await asyncio.sleep(due - now())
            late.append(now() - due)
        self.late_p99 = sorted(late)[len(late) * 99 // 100] * 1e3
