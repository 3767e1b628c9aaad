"""The planning processes that all cells of a server share, and who waits for one.

A job goes to a process only when that is free, in the order of `job_queue`, so one that takes long
or dies with its process spoils no other. What nobody waits for any more leaves the queue. Where a
process is busy with it already, its cell gets no other meanwhile; and where others wait, the
process is replaced soon. So a cell that asks for hard plans and drops them delays the others by
about a second, not by as long as a plan may take; only hard plans that are waited for can.
"""

from __future__ import annotations

import asyncio
from collections.abc import Iterable
from itertools import count

from .job_queue import JobQueue
from .jobs import Job
from .process import PlanningProcess
from .task import Deliver, Task

_MOST_PROCESSES = 2
"""Plans take tens of milliseconds; more processes would only hold more memory."""


class PlanningPool:
    """A few warm processes, each able to plan for every robot of the server."""

    def __init__(self, robots: Iterable[str]) -> None:
        """Make a pool; `keep_up` starts its processes.

        Args:
            robots: name or file of the robot of each cell.
        """
        cells = list(robots)
        kinds = list(dict.fromkeys(cells))
        self._numbers = count(1)
        self._waiting = JobQueue()
        self._processes = [
            PlanningProcess(kinds, self.hand_out) for _ in range(min(len(cells), _MOST_PROCESSES))
        ]

    def planner_of(self, robot: str) -> CellPlanner:
        """Return what plans for one more cell, with this robot."""
        return CellPlanner(self, robot, next(self._numbers))

    def submit(self, task: Task) -> None:
        """Plan a job when its cell's turn has come and a process is free."""
        self._waiting.put(task)
        self.hand_out()

    def withdraw(self, cell: int, job_id: int) -> None:
        """Forget a job that nobody waits for; it is not answered any more."""
        if not self._waiting.withdraw(cell, job_id):
            for process in self._processes:
                process.withdraw(cell, job_id)

    def hand_out(self) -> None:
        """Give jobs to free processes, warm ones first; fail them where no process can start."""
        free = [process for process in self._processes if process.is_free]
        free.sort(key=lambda process: process.is_warm)
        while free and (task := self._next()) is not None:
            if free.pop().give(task):
                self._waiting.take(task)
        if all(process.is_down for process in self._processes):
            for task in self._waiting.clear():
                task.fail()
        if self._waiting:
            for process in self._processes:
                process.cut_short()

    def _next(self) -> Task | None:
        wasted = (process.wasted_on for process in self._processes)
        return self._waiting.first([cell for cell in wasted if cell is not None])

    async def keep_up(self) -> None:
        """Run the processes until cancelled."""
        # A group waits for all of them when it is cancelled, so that no child is left behind.
        async with asyncio.TaskGroup() as group:
            for process in self._processes:
                group.create_task(process.keep_up())


class CellPlanner:
    """Plans for one cell with the processes of a pool."""

    def __init__(self, pool: PlanningPool, robot: str, cell: int) -> None:
        """Make it; see `PlanningPool.planner_of`."""
        self._pool = pool
        self._robot = robot
        self._cell = cell

    def submit(self, job: Job, deliver: Deliver) -> None:
        """Plan a job; `deliver` is called with the answer."""
        self._pool.submit(Task(self._robot, job, deliver, self._cell))

    def withdraw(self, job_id: int) -> None:
        """Forget a job; `deliver` is not called any more."""
        self._pool.withdraw(self._cell, job_id)
