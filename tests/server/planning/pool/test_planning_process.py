from __future__ import annotations

import asyncio
import logging
import time
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager
from typing import Any

import pytest
from rigs.processes.planning_children import (
    FLOOD,
    JOB,
    MUTE,
    Children,
    on_both_loops,
    run,
    running_pool,
    until,
)

from openpendant.server.planning.jobs import PlanTask
from openpendant.server.planning.pool import planning_process
from openpendant.server.planning.pool.planning_process import PlanningProcess
from openpendant.server.refusal import Refusal
from openpendant.server.settings.cell_settings import EventLoop
from openpendant.simplemsg.verdicts import VerdictCode as V

PLANNED = ("ur5", JOB, 0)
FAILED = Refusal(V.PLANNER_FAILED)

Ask = Callable[[int], Awaitable[list[Any]]]

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


@asynccontextmanager
async def planning(processes: int) -> AsyncIterator[Ask]:
    answers: asyncio.Queue[Any] = asyncio.Queue()

    async def ask(jobs: int) -> list[Any]:
        for _ in range(jobs):
            pool.submit(PlanTask("ur5", JOB, answers.put_nowait))
        return [await answers.get() for _ in range(jobs)]

    async with running_pool(processes) as pool:
        yield ask


async def turn(times: int) -> None:
    for _ in range(times):
        await asyncio.sleep(0)


def outlast(seconds: float) -> None:
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
            await until(lambda: bool(children.started))
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


@pytest.mark.realtime
@turns_after_the_death
@on_both_loops
def test_a_server_that_goes_down_as_its_planner_dies_starts_no_other(
    loop: EventLoop, turns: int, children: Children
) -> None:
    """A cancellation that was lost left the server waiting for the new one without end."""

    async def test() -> None:
        planner = PlanningProcess(["ur5"], lambda: None)
        keeper = asyncio.create_task(planner.keep_up())
        await until(lambda: planner.is_warm)
        children.kill()
        await until(lambda: children.started[0].returncode is not None)
        await turn(turns)
        keeper.cancel()
        done, _ = await asyncio.wait([keeper], timeout=5)
        assert done

    assert run(loop, test()) == []


@pytest.mark.realtime
@on_both_loops
def test_an_answer_that_nobody_reads_holds_up_no_end(loop: EventLoop, children: Children) -> None:
    children.command = FLOOD

    async def test() -> None:
        planner = PlanningProcess(["ur5"], lambda: None)
        keeper = asyncio.create_task(planner.keep_up())
        await asyncio.sleep(0.3)  # more has come by then than the loop reads ahead
        keeper.cancel()
        done, _ = await asyncio.wait([keeper], timeout=5)
        assert done

    assert run(loop, test()) == []
