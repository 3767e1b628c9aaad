"""Tasks about programs over the real pipe: what the event loop spends on the largest of them."""

from __future__ import annotations

import asyncio
import gc
import statistics
import time
from contextlib import suppress

import pytest
from large_programs import large_text

from openpendant.server.planning.jobs import Planned, ProgramJob
from openpendant.server.planning.pool import CellPlanner, PlanningPool
from openpendant.server.programs.document import program_to_json
from openpendant.server.programs.parser import parse
from openpendant.server.programs.work import PrintBody, ReadSource, Task, UnpackBody, perform

LARGEST = large_text()
BODY = program_to_json(parse(LARGEST))
MOST_CPU = 0.010
"""CPU time of this thread between two turns: a tick, where a millisecond or two is usual [s]."""

MOST_CPU_AT_FIRST = 0.020
"""The same while the first programs pass, which pay for what is done once only [s]."""

ROUNDS = 3
"""What else the machine does makes one or another dearer, and not most of them."""

TASKS: list[Task] = [
    ReadSource(LARGEST, "text", "main"),
    PrintBody(BODY, "main"),
    UnpackBody(BODY, "main"),
]


@pytest.mark.realtime
def test_no_turn_of_the_loop_is_spent_on_the_largest_program() -> None:
    expected = [perform(task) for task in TASKS]
    rounds = asyncio.run(_watched())
    assert [results for results, _ in rounds] == [expected] * ROUNDS
    dearest = [longest for _, longest in rounds]
    assert dearest[0] < MOST_CPU_AT_FIRST, dearest
    assert statistics.median(dearest) < MOST_CPU, dearest


async def _watched() -> list[tuple[list[object], float]]:
    """Return what each round did, and its most CPU time between two looks at the clock [s]."""
    pool = PlanningPool(["ur5"])
    keeping = asyncio.create_task(pool.keep_up())
    try:
        return [await _round(pool.planner_of("ur5")) for _ in range(ROUNDS)]
    finally:
        keeping.cancel()
        with suppress(asyncio.CancelledError):
            await keeping


async def _round(planner: CellPlanner) -> tuple[list[object], float]:
    answers: list[Planned] = []
    gc.collect()
    longest, before = 0.0, time.thread_time()
    for number, task in enumerate(TASKS):
        planner.submit(ProgramJob(number, task), answers.append)
    while len(answers) < len(TASKS):
        await asyncio.sleep(0.001)
        now = time.thread_time()
        longest, before = max(longest, now - before), now
    return [answer.result for answer in answers], longest
