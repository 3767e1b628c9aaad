"""Tasks about programs over the real pipe: what the event loop spends on the largest of them."""

from __future__ import annotations

import asyncio
import gc
import time
from contextlib import suppress

import pytest
from large_programs import large_text

from openpendant.server.planning.jobs import Planned, ProgramJob
from openpendant.server.planning.pool import PlanningPool
from openpendant.server.programs.document import program_to_json
from openpendant.server.programs.parser import parse
from openpendant.server.programs.work import PrintBody, ReadSource, Task, UnpackBody, perform

LARGEST = large_text()
BODY = program_to_json(parse(LARGEST))
MOST_CPU = 0.010
"""CPU time of this thread between two turns: a tick, where a millisecond or two is usual [s]."""


TASKS: list[Task] = [
    ReadSource(LARGEST, "text", "main"),
    PrintBody(BODY, "main"),
    UnpackBody(BODY, "main"),
]


@pytest.mark.realtime
def test_no_turn_of_the_loop_is_spent_on_the_largest_program() -> None:
    results, longest = asyncio.run(_watched())
    assert results == [perform(task) for task in TASKS]
    assert longest < MOST_CPU


async def _watched() -> tuple[list[object], float]:
    """Return what was done, and the most CPU time between two looks at the clock [s]."""
    pool = PlanningPool(["ur5"])
    keeping = asyncio.create_task(pool.keep_up())
    planner, answers = pool.planner_of("ur5"), list[Planned]()
    gc.collect()
    longest, before = 0.0, time.thread_time()
    try:
        for number, task in enumerate(TASKS):
            planner.submit(ProgramJob(number, task), answers.append)
        while len(answers) < len(TASKS):
            await asyncio.sleep(0.001)
            now = time.thread_time()
            longest, before = max(longest, now - before), now
        return [answer.result for answer in answers], longest
    finally:
        keeping.cancel()
        with suppress(asyncio.CancelledError):
            await keeping
