"""The planning process: another is started when it ends, and no job stays without an answer."""

from __future__ import annotations

import asyncio
import logging
import os
import signal
import time
from collections.abc import AsyncIterator, Awaitable, Callable, Coroutine
from contextlib import asynccontextmanager, suppress
from importlib.util import find_spec
from typing import Any

import pytest

from openpendant.server.event_loop import EventLoop, loop_factory
from openpendant.server.planning import process as planning_process
from openpendant.server.planning.jobs import JointPathJob
from openpendant.server.planning.pool import PlanningPool
from openpendant.server.planning.process import PlanningProcess, Task
from openpendant.server.refusal import Refusal
from openpendant.simplemsg.verdicts import VerdictCode

JOB = JointPathJob(1, (0.0,), ((1.0,),), 0.5)
PLANNED = ("ur5", JOB, 0)
FAILED = Refusal(VerdictCode.PLANNER_FAILED)

Ask = Callable[[int], Awaitable[list[Any]]]

WARM = r"printf '\004\000\000\000\200\004N.';"
"""The pickled None of a planning process that is warm, behind its length; for a shell."""

ECHO = f"{WARM} exec cat"
"""A planning process whose answer is what it is sent, without the seconds that a real one takes."""

MUTE = f"{WARM} exec cat >/dev/null"
"""One that never answers."""

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

turns_after_the_death = pytest.mark.parametrize("turns", range(6))


def test_a_process_that_cannot_be_started_is_logged_and_tried_again(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    attempts = 0

    async def refuse(*_: Any, **__: Any) -> None:
        nonlocal attempts
        attempts += 1
        if attempts == 3:
            raise asyncio.CancelledError
        raise BlockingIOError(11, "Resource temporarily unavailable")

    monkeypatch.setattr(asyncio, "create_subprocess_exec", refuse)
    monkeypatch.setattr(planning_process, "_RESTART_PAUSE", 0.001)
    with caplog.at_level(logging.ERROR), pytest.raises(asyncio.CancelledError):
        asyncio.run(PlanningProcess(["ur5"], lambda: None).keep_up())
    assert [record.levelname for record in caplog.records] == ["ERROR", "ERROR"]
    assert "temporarily unavailable" in caplog.text


class Children:
    """Starts shell commands in place of planning processes, and kills them."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.command = ECHO
        self.started: list[asyncio.subprocess.Process] = []
        self._start = asyncio.create_subprocess_exec
        monkeypatch.setattr(asyncio, "create_subprocess_exec", self._start_another)
        monkeypatch.setattr(planning_process, "_RESTART_PAUSE", 0.001)

    async def _start_another(self, *_: str, **pipes: int) -> asyncio.subprocess.Process:
        self.started.append(await self._start("sh", "-c", self.command, **pipes))  # type: ignore[arg-type]
        return self.started[-1]

    def kill(self) -> None:
        """Kill all, and come back when they are dead; the loop has seen nothing of it yet."""
        for child in self.started:
            os.kill(child.pid, signal.SIGKILL)
            with suppress(ChildProcessError):  # where a thread of the loop was the first to ask
                os.waitid(os.P_PID, child.pid, os.WEXITED | os.WNOWAIT)


@pytest.fixture
def children(monkeypatch: pytest.MonkeyPatch) -> Children:
    return Children(monkeypatch)


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


@asynccontextmanager
async def planning(processes: int) -> AsyncIterator[Ask]:
    """A pool that is kept up; yields what has it plan some jobs and returns the answers."""
    pool = PlanningPool(["ur5"] * processes)
    keeper = asyncio.create_task(pool.keep_up())
    answers: asyncio.Queue[Any] = asyncio.Queue()

    async def ask(jobs: int) -> list[Any]:
        for _ in range(jobs):
            pool.submit(Task("ur5", JOB, answers.put_nowait))
        return [await answers.get() for _ in range(jobs)]

    try:
        yield ask
        assert not keeper.done()
    finally:
        keeper.cancel()
        await asyncio.gather(keeper, return_exceptions=True)


async def turn(times: int) -> None:
    for _ in range(times):
        await asyncio.sleep(0)


def outlast(seconds: float) -> None:
    """Keep the loop from turning for longer than a timer; that is due in the next turn then."""
    time.sleep(2 * seconds)


@pytest.mark.realtime
@pytest.mark.parametrize("processes", [1, 2])
@turns_after_the_death
@on_both_loops
def test_a_job_given_to_a_process_just_killed_is_answered_and_planning_goes_on(
    loop: EventLoop, turns: int, processes: int, children: Children
) -> None:
    async def test() -> None:
        async with planning(processes) as ask:
            await ask(2 * processes)
            children.kill()
            await turn(turns)
            for answer in await ask(2 * processes):
                assert answer == PLANNED or answer.result == FAILED
            assert await ask(1) == [PLANNED]

    assert run(loop, test()) == []


@pytest.mark.realtime
@on_both_loops
def test_a_job_that_cannot_be_written_waits_for_the_next_process(
    loop: EventLoop, children: Children, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(_: bytes) -> None:
        raise RuntimeError("the handler is closed")

    async def test() -> None:
        async with planning(1) as ask:
            await ask(1)
            monkeypatch.setattr(children.started[0].stdin, "write", refuse)
            assert await ask(1) == [PLANNED]
            assert len(children.started) == 2

    assert run(loop, test()) == []


@pytest.mark.realtime
@turns_after_the_death
@on_both_loops
def test_a_process_that_dies_just_before_it_took_too_long_is_no_fault(
    loop: EventLoop, turns: int, children: Children, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(planning_process, "_LONGEST_PLAN", 0.01)
    children.command = MUTE

    async def test() -> None:
        async with planning(1) as ask:
            asked = asyncio.ensure_future(ask(1))
            while not children.started:
                await turn(1)
            children.kill()
            await turn(turns)
            outlast(0.01)
            assert [answer.result for answer in await asked] == [FAILED]

    assert run(loop, test()) == []


@pytest.mark.realtime
@pytest.mark.parametrize("turns", range(6))
@on_both_loops
def test_a_child_that_is_still_being_started_at_the_end_is_ended(
    loop: EventLoop, turns: int, children: Children
) -> None:
    async def test() -> None:
        keeper = asyncio.create_task(PlanningProcess(["ur5"], lambda: None).keep_up())
        await turn(turns)
        keeper.cancel()
        await asyncio.gather(keeper, return_exceptions=True)
        assert [child.returncode for child in children.started] == [0] * (turns > 0)

    assert run(loop, test()) == []
