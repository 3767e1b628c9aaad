"""The planning processes that all cells of a server share, and who waits for one.

Owns the queue: a job goes to a process only when that is free, so one that takes long or dies with
its process delays or spoils no other.
"""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Iterable

from .jobs import Job
from .process import Deliver, PlanningProcess, Task

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
        self._waiting: deque[Task] = deque()
        self._processes = [
            PlanningProcess(kinds, self.hand_out) for _ in range(min(len(cells), _MOST_PROCESSES))
        ]

    def planner_of(self, robot: str) -> RobotPlanner:
        """Return what plans for one robot."""
        return RobotPlanner(self, robot)

    def submit(self, task: Task) -> None:
        """Plan a job as soon as a process is free."""
        self._waiting.append(task)
        self.hand_out()

    def hand_out(self) -> None:
        """Give jobs to free processes, warm ones first; fail them where no process can start."""
        free = [process for process in self._processes if process.is_free]
        free.sort(key=lambda process: process.is_warm)
        while self._waiting and free:
            if free.pop().give(self._waiting[0]):
                self._waiting.popleft()
        if all(process.is_down for process in self._processes):
            failed, self._waiting = self._waiting, deque()
            for task in failed:
                task.fail()

    async def keep_up(self) -> None:
        """Run the processes until cancelled."""
        # A group waits for all of them when it is cancelled, so that no child is left behind.
        async with asyncio.TaskGroup() as group:
            for process in self._processes:
                group.create_task(process.keep_up())


class RobotPlanner:
    """Plans for one robot with the processes of a pool."""

    def __init__(self, pool: PlanningPool, robot: str) -> None:
        """Make it; see `PlanningPool.planner_of`."""
        self._pool = pool
        self._robot = robot

    def submit(self, job: Job, deliver: Deliver) -> None:
        """Plan a job; `deliver` is called with the answer."""
        self._pool.submit(Task(self._robot, job, deliver))
