"""The pool of planning processes that all cells of a server share, and the queue of their jobs.

Owns the order: cells take turns, so that the many jobs of one delay no other cell by more than one
job. A check of the rest of a motion in progress (`WayCheckJob`) goes before all turns, because that
robot is held until the answer is there; one for each cell between two turns, as otherwise a scene
that changes again and again would block all planning. The number of waiting jobs is bounded by the
cells: each has at most one motion, one such check and one dry run waiting, and a few tasks about
programs; and by the connections, each of which has at most one body that is read (`ReadBody`).

Plans around obstacles wait apart too, and go behind everything else: a search may take seconds. All
processes but one may be busy with such plans at a time, so that a motion that is asked for
meanwhile finds the other; where there is one process only, it waits for the search.

Bodies wait apart, in turns between cells and within a cell between connections, and where other
jobs wait as well every second job is a body. So a motion waits for no more than one body, however
many connections send one, and a body for no more than one plan.

A job goes to a process only when that is free, so one that takes long or dies with its process
spoils no other. A job that nobody waits for any more leaves the queue. Where a process is busy with
it already, its cell gets no other meanwhile; and where others wait, the process is replaced soon.
So a cell that asks for long plans and drops them delays the others by about 1 s, not by the
duration of a plan; only long plans that somebody waits for can do that.

Questions on kinematics and shapes are never among these jobs: `question_pool` has a process of
their own.
"""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Collection, Iterable, Sequence
from itertools import chain, count, islice, repeat

from ..jobs import (
    Deliver,
    Job,
    KinematicsQuestion,
    PlanTask,
    ReadBody,
    ShapesQuestion,
    WayCheckJob,
    is_search,
)
from .forked_child import ForkedChild
from .planning_process import PlanningProcess
from .question_pool import QuestionPool


class JobQueue:
    """Queue of jobs of several cells, each cell's in their order except scene checks and bodies."""

    def __init__(self) -> None:
        # By cell, in the order of their turns; none is empty.
        self._cells: dict[int, deque[PlanTask]] = {}
        self._bodies: dict[int, deque[PlanTask]] = {}
        self._searches: dict[int, deque[PlanTask]] = {}
        self._owes_body = False  # the last job that was taken was none, and one waited
        self._looked: set[int] = set()  # cells whose look went first since the last turn

    def __bool__(self) -> bool:
        """True if a job waits."""
        return bool(self._cells or self._bodies or self._searches)

    def put(self, task: PlanTask) -> None:
        """Add a job."""
        waiting = self._cells
        if _is_body(task):
            waiting = self._bodies
        elif is_search(task.job):
            waiting = self._searches
        tasks = waiting.setdefault(task.cell, deque())
        if _is_look(task):
            tasks.appendleft(task)
        else:
            tasks.append(task)

    def first(self, barred: Collection[int], *, may_search: bool = True) -> PlanTask | None:
        """Return the next job; it stays in the queue until it is taken.

        Args:
            barred: numbers of the cells that get no turn; their scene checks still go.
            may_search: whether a plan around obstacles may go, where nothing else waits.
        """
        fronts = [tasks[0] for tasks in self._cells.values()]
        for task in fronts:
            if _is_look(task) and task.cell not in self._looked:
                return task
        plans = (task for task in fronts if _is_look(task) or task.cell not in barred)
        bodies = (tasks[0] for cell, tasks in self._bodies.items() if cell not in barred)
        plan, body = next(plans, None), next(bodies, None)
        if plan is None and body is None and may_search:
            searches = (tasks[0] for cell, tasks in self._searches.items() if cell not in barred)
            return next(searches, None)
        return body if plan is None or (self._owes_body and body is not None) else plan

    def take(self, task: PlanTask) -> None:
        """Remove the first job; it uses its cell's turn, except a scene check before all turns."""
        if _is_body(task):
            self._owes_body = False
            _rotate(self._bodies, task.cell)
            return
        if is_search(task.job):
            _rotate(self._searches, task.cell)
            return
        self._owes_body = bool(self._bodies)
        tasks = self._cells[task.cell]
        if _is_look(task) and task.cell not in self._looked:
            self._looked.add(task.cell)
            tasks.popleft()
            if not tasks:
                del self._cells[task.cell]
        else:
            self._looked.clear()
            _rotate(self._cells, task.cell)

    def withdraw(self, cell: int, job_id: int) -> bool:
        """Remove a job of a cell; return True if it waited."""
        for waiting in (self._cells, self._bodies, self._searches):
            tasks = waiting.get(cell, ())
            left = deque(task for task in tasks if task.job.job_id != job_id)
            if len(left) == len(tasks):
                continue
            if left:
                waiting[cell] = left
            else:
                del waiting[cell]
            return True
        return False

    def clear(self) -> list[PlanTask]:
        """Remove all jobs and return them."""
        waiting = (*self._cells.values(), *self._bodies.values(), *self._searches.values())
        tasks = [task for tasks in waiting for task in tasks]
        self._cells.clear()
        self._bodies.clear()
        self._searches.clear()
        self._looked.clear()
        return tasks


def _rotate(waiting: dict[int, deque[PlanTask]], cell: int) -> None:
    """Remove a cell's first job; its turn comes again behind all others."""
    tasks = waiting.pop(cell)
    tasks.popleft()
    if tasks:
        waiting[cell] = tasks


def _is_look(task: PlanTask) -> bool:
    return isinstance(task.job, WayCheckJob)


def _is_body(task: PlanTask) -> bool:
    return isinstance(task.job, ReadBody)


_MOST_PROCESSES = 2
"""Number of processes: plans take tens of milliseconds, and each process holds memory."""


def processes_for(robots: Sequence[str]) -> tuple[list[str], int]:
    """Return the robots that each process plans for, and how many processes there are.

    Args:
        robots: name or file of the robot of each cell.
    """
    return list(dict.fromkeys(robots)), min(len(robots), _MOST_PROCESSES)


class PlanningPool:
    """Pool of a few warm processes, each able to plan for every robot of the server."""

    def __init__(self, robots: Sequence[str], begun: Iterable[ForkedChild] = ()) -> None:
        """Make a pool; `keep_up` starts its processes.

        Args:
            robots: name or file of the robot of each cell.
            begun: processes that run already; it starts what is missing of them.
        """
        kinds, wanted = processes_for(robots)
        self._numbers = count(1)
        self._waiting = JobQueue()
        self._questions = QuestionPool(kinds)
        self._processes = [
            PlanningProcess(kinds, self.hand_out, child)
            for child in islice(chain(begun, repeat(None)), wanted)
        ]

    def planner_of(self, robot: str) -> CellPlanner:
        """Return the planner of one more cell, with this robot."""
        return CellPlanner(self, robot, next(self._numbers))

    def submit(self, task: PlanTask) -> None:
        """Plan a job when its cell's turn has come and a process is free."""
        if isinstance(task.job, KinematicsQuestion | ShapesQuestion):
            self._questions.submit(task)
            return
        self._waiting.put(task)
        self.hand_out()

    def withdraw(self, cell: int, job_id: int) -> None:
        """Withdraw a job; it is not answered any more."""
        if not (self._questions.withdraw(cell, job_id) or self._waiting.withdraw(cell, job_id)):
            for process in self._processes:
                process.withdraw(cell, job_id)

    def hand_out(self) -> None:
        """Give jobs to free processes, warm ones first; fail the jobs if no process can start."""
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

    def _next(self) -> PlanTask | None:
        wasted = (process.wasted_on for process in self._processes)
        searching = sum(process.is_searching for process in self._processes)
        return self._waiting.first(
            [cell for cell in wasted if cell is not None],
            may_search=searching < max(len(self._processes) - 1, 1),
        )

    async def keep_up(self) -> None:
        """Run the processes until cancelled."""
        # A group waits for all of them when it is cancelled, so that no child is left behind.
        async with asyncio.TaskGroup() as group:
            for process in self._processes:
                group.create_task(process.keep_up())
            group.create_task(self._questions.keep_up())


class CellPlanner:
    """Planner of one cell that uses the processes of a pool."""

    def __init__(self, pool: PlanningPool, robot: str, cell: int) -> None:
        self._pool = pool
        self._robot = robot
        self._cell = cell

    def submit(self, job: Job, deliver: Deliver) -> None:
        """Plan a job; `deliver` is called with the answer."""
        self._pool.submit(PlanTask(self._robot, job, deliver, self._cell))

    def withdraw(self, job_id: int) -> None:
        """Withdraw a job; `deliver` is not called any more."""
        self._pool.withdraw(self._cell, job_id)
