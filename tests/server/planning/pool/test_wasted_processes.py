from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Any

import pytest
from rigs.processes.planning_children import (
    BUSY,
    ECHO,
    JOB,
    Children,
    on_both_loops,
    run,
    running_pool,
    until,
)

from openpendant.server.planning.jobs import PlanTask
from openpendant.server.planning.pool import planning_process
from openpendant.server.planning.pool.planning_pool import PlanningPool
from openpendant.server.settings.cell_settings import EventLoop


@asynccontextmanager
async def busy_process(children: Children) -> AsyncIterator[tuple[PlanningPool, list[Any]]]:
    """A pool whose only process is busy with a job of cell 1, and what is delivered.

    Any process after that echoes what it is sent.
    """
    children.command = BUSY
    answers: list[Any] = []
    async with running_pool() as pool:
        pool.submit(PlanTask("ur5", JOB, answers.append, 1))
        # Warm, or else nothing is cut short.
        await until(lambda: pool._processes[0].is_warm)
        children.command = ECHO
        yield pool, answers


@pytest.mark.realtime
@pytest.mark.parametrize("is_first", [True, False])
@on_both_loops
def test_a_process_busy_with_a_withdrawn_job_is_replaced_where_another_cell_waits(
    loop: EventLoop, is_first: bool, children: Children, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(planning_process, "_LONGEST_WASTE", 0.01)

    async def test() -> None:
        async with busy_process(children) as (pool, answers):
            if is_first:
                pool.submit(PlanTask("ur5", JOB, answers.append, 2))
            pool.withdraw(1, JOB.job_id)
            if not is_first:
                await asyncio.sleep(0.05)
                assert len(children.started) == 1, "nobody waited"
                pool.submit(PlanTask("ur5", JOB, answers.append, 2))
            await until(lambda: bool(answers))
            assert [(robot, job) for robot, job, _ in answers] == [("ur5", JOB)]
            assert len(children.started) == 2

    assert run(loop, test()) == []


@pytest.mark.realtime
@pytest.mark.parametrize("job_id", [JOB.job_id, 4711])
def test_a_process_keeps_on_at_a_job_that_somebody_waits_for(
    job_id: int, children: Children, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(planning_process, "_LONGEST_WASTE", 0.0)

    async def test() -> None:
        async with busy_process(children) as (pool, answers):
            pool.submit(PlanTask("ur5", JOB, answers.append, 2))
            pool.withdraw(3, job_id)
            pool.withdraw(1, 4711)
            await asyncio.sleep(0.05)
            assert len(children.started) == 1
            assert answers == []

    assert run("asyncio", test()) == []


@pytest.mark.realtime
def test_the_answer_to_a_withdrawn_job_is_not_delivered_and_its_process_goes_on(
    children: Children,
) -> None:
    async def test() -> None:
        dropped: list[Any] = []
        answers: asyncio.Queue[Any] = asyncio.Queue()
        async with running_pool() as pool:
            await until(lambda: pool._processes[0].is_warm)
            pool.submit(PlanTask("ur5", JOB, dropped.append, 1))
            pool.withdraw(1, JOB.job_id)
            pool.submit(PlanTask("ur5", JOB, answers.put_nowait, 2))
            await answers.get()
            assert dropped == []
            assert len(children.started) == 1

    assert run("asyncio", test()) == []
