"""Shell commands in place of planning processes, without the seconds that a real one takes."""

import asyncio
import os
import signal
from collections.abc import AsyncIterator, Callable, Coroutine
from contextlib import asynccontextmanager, suppress
from importlib.util import find_spec
from typing import Any

import pytest

from openpendant.server.planning.jobs import JointPathJob
from openpendant.server.planning.pool import planning_process
from openpendant.server.planning.pool.planning_pool import PlanningPool
from openpendant.server.settings.cell_settings import EventLoop
from openpendant.server.shell.server_process import loop_factory

JOB = JointPathJob(1, (0.0,), ((1.0,),), 0.5)

WARM = r"printf '\004\000\000\000\200\004N.';"
"""The pickled None of a planning process that is warm, behind its length; for a shell."""

ECHO = f"{WARM} exec cat"
"""A planning process whose answer is what it is sent, without the seconds that a real one takes."""

MUTE = f"{WARM} exec cat >/dev/null"
"""One that never answers."""

BUSY = f"{WARM} exec sleep 60"
"""One that is busy with its first job for a minute."""

FLOOD = r"printf '\000\000\000\177'; while head -c 200000 /dev/zero; do sleep 0.01; done"
"""One in the middle of an answer of 2 GB, as its length says."""

on_both_loops = pytest.mark.parametrize(
    "loop",
    [
        "asyncio",
        pytest.param(
            "uvloop",
            marks=pytest.mark.skipif(
                find_spec("uvloop") is None,
                reason="uvloop is not installed: the extra 'fast' of openpendant adds it",
            ),
        ),
    ],
)


class Children:
    """Starts shell commands in place of planning processes, and kills them.

    Attributes:
        command: what is started.
        arguments: what was to be started in its place, each time.
    """

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.command = ECHO
        self.arguments: list[tuple[str, ...]] = []
        self.started: list[asyncio.subprocess.Process] = []
        self._start = asyncio.create_subprocess_exec
        monkeypatch.setattr(asyncio, "create_subprocess_exec", self._start_another)
        monkeypatch.setattr(planning_process, "_RESTART_PAUSE", 0.001)

    async def _start_another(self, *given: str, **pipes: int) -> asyncio.subprocess.Process:
        self.arguments.append(given)
        self.started.append(await self._start("sh", "-c", self.command, **pipes))  # type: ignore[arg-type]
        return self.started[-1]

    def kill(self) -> None:
        """Kill all, and come back when they are dead; the loop has seen nothing of it yet."""
        for child in self.started:
            os.kill(child.pid, signal.SIGKILL)
            with suppress(ChildProcessError):  # where a thread of the loop was the first to ask
                os.waitid(os.P_PID, child.pid, os.WEXITED | os.WNOWAIT)


@asynccontextmanager
async def running_pool(processes: int = 1) -> AsyncIterator[PlanningPool]:
    """Keep up a pool of processes for an UR5, to the end of the test."""
    pool = PlanningPool(["ur5"] * processes)
    keeper = asyncio.create_task(pool.keep_up())
    try:
        yield pool
        assert not keeper.done()
    finally:
        keeper.cancel()
        await asyncio.gather(keeper, return_exceptions=True)


async def until(holds: Callable[[], bool]) -> None:
    """Come back in the very turn in which something holds."""
    while not holds():  # noqa: ASYNC110 - what is waited for tells nobody
        await asyncio.sleep(0)


def run(loop: EventLoop, test: Coroutine[Any, Any, None]) -> list[dict[str, Any]]:
    """Run a test on a loop; return what the loop caught in its callbacks."""
    caught: list[dict[str, Any]] = []

    async def watched() -> None:
        asyncio.get_running_loop().set_exception_handler(lambda _, context: caught.append(context))
        async with asyncio.timeout(30):
            await test

    with asyncio.Runner(loop_factory=loop_factory(loop)) as runner:
        runner.run(watched())
    return caught
