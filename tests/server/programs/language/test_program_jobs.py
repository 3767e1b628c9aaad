from __future__ import annotations

import asyncio
import gc
import statistics
import time
from dataclasses import dataclass
from functools import cache

import pytest
from rigs.data.large_programs import large_text
from rigs.processes.planning_children import running_pool

from openpendant.server.planning.jobs import JointPathJob, PlanAnswer, ProgramJob
from openpendant.server.planning.pool.planning_pool import CellPlanner, PlanningPool
from openpendant.server.programs.editing.program_tasks import (
    PrintBody,
    ReadSource,
    Task,
    UnpackBody,
    perform,
)
from openpendant.server.programs.language.parser import parse
from openpendant.server.programs.language.program_json import program_to_json

pytestmark = pytest.mark.realtime

MOST_CPU = 0.010
"""CPU time of this thread between two turns: a tick, where a millisecond or two is usual [s]."""

MOST_CPU_AT_FIRST = 0.020
"""The same while the first programs pass, which pay for what is done once only [s]."""

ROUNDS = 3
"""What else the machine does makes one or another dearer, and not most of them."""


@cache
def tasks() -> tuple[Task, ...]:
    largest = large_text()
    body = program_to_json(parse(largest))
    return ReadSource(largest, "text", "main"), PrintBody(body, "main"), UnpackBody(body, "main")


@dataclass
class Watched:
    """What one process did.

    Attributes:
        rounds: of each the results, and the most CPU time between two looks at the clock [s].
        plans: the answers about the same motion of two robots.
    """

    rounds: list[tuple[list[object], float]]
    plans: list[PlanAnswer]


@pytest.fixture(scope="module")
def watched() -> Watched:
    return asyncio.run(_watched())


def test_no_turn_of_the_loop_is_spent_on_the_largest_program(watched: Watched) -> None:
    expected = [perform(task) for task in tasks()]
    assert [results for results, _ in watched.rounds] == [expected] * ROUNDS
    dearest = [longest for _, longest in watched.rounds]
    assert dearest[0] < MOST_CPU_AT_FIRST, dearest
    assert statistics.median(dearest) < MOST_CPU, dearest


def test_one_process_plans_for_several_robots(watched: Watched) -> None:
    first, second = (plan.result for plan in watched.plans)
    assert isinstance(first, tuple)
    assert isinstance(second, tuple)
    assert first[0].duration != second[0].duration


async def _watched() -> Watched:
    async with running_pool() as pool:
        rounds = [await _round(pool.planner_of("ur5")) for _ in range(ROUNDS)]
        return Watched(rounds, [await _plan(pool, robot) for robot in ("ur5", "abb_irb120")])


async def _plan(pool: PlanningPool, robot: str) -> PlanAnswer:
    answers: asyncio.Queue[PlanAnswer] = asyncio.Queue()
    start = (0.0, -1.0, 1.0, 0.1, 0.2, 0.3)
    job = JointPathJob(1, start, (tuple(value + 0.1 for value in start),), 0.5)
    pool.planner_of(robot).submit(job, answers.put_nowait)
    async with asyncio.timeout(60):
        return await answers.get()


async def _round(planner: CellPlanner) -> tuple[list[object], float]:
    asked = tasks()
    answers: list[PlanAnswer] = []
    gc.collect()
    longest, before = 0.0, time.thread_time()
    for number, task in enumerate(asked):
        planner.submit(ProgramJob(number, task), answers.append)
    while len(answers) < len(asked):
        await asyncio.sleep(0.001)
        now = time.thread_time()
        longest, before = max(longest, now - before), now
    return [answer.result for answer in answers], longest
