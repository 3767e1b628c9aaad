"""The jobs that wait for a planning process, and whose turn it is.

Owns the order: cells take turns, so that the many jobs of one delay no other cell by more than one
job. Before all turns goes a look along the way of a robot that moves already, because that robot
is held until the answer is there; of each cell one between two turns, or else a scene that changes
again and again would let nobody plan. How much waits is bounded by those who ask: a cell has one
motion, one look and one dry run waiting at most, and a few tasks about programs.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Collection

from .task import Task
from .way_check_job import WayCheckJob


class JobQueue:
    """Jobs of several cells, each cell's in the order in which they came but for its looks."""

    def __init__(self) -> None:
        """Make one where nothing waits."""
        self._cells: dict[int, deque[Task]] = {}  # in the order of their turns; none is empty
        self._looked: set[int] = set()  # cells whose look went first since the last turn

    def __bool__(self) -> bool:
        """Whether anything waits."""
        return bool(self._cells)

    def put(self, task: Task) -> None:
        """Let a job wait."""
        tasks = self._cells.setdefault(task.cell, deque())
        if _is_look(task):
            tasks.appendleft(task)
        else:
            tasks.append(task)

    def first(self, barred: Collection[int]) -> Task | None:
        """Return the job that is next; it goes on waiting until it is taken.

        Args:
            barred: numbers of the cells whose turn is not to come, but for their looks.
        """
        fronts = [tasks[0] for tasks in self._cells.values()]
        for task in fronts:
            if _is_look(task) and task.cell not in self._looked:
                return task
        for task in fronts:
            if _is_look(task) or task.cell not in barred:
                return task
        return None

    def take(self, task: Task) -> None:
        """Remove the job that was first; but for a look before all turns, its cell had its turn."""
        tasks = self._cells[task.cell]
        tasks.popleft()
        if _is_look(task) and task.cell not in self._looked:
            self._looked.add(task.cell)
        else:
            self._looked.clear()
            del self._cells[task.cell]
            self._cells[task.cell] = tasks
        if not tasks:
            del self._cells[task.cell]

    def withdraw(self, cell: int, job_id: int) -> bool:
        """Remove a job of a cell; return whether it waited."""
        tasks = self._cells.get(cell, ())
        left = deque(task for task in tasks if task.job.job_id != job_id)
        if len(left) == len(tasks):
            return False
        if left:
            self._cells[cell] = left
        else:
            del self._cells[cell]
        return True

    def clear(self) -> list[Task]:
        """Remove all jobs and return them."""
        tasks = [task for tasks in self._cells.values() for task in tasks]
        self._cells.clear()
        self._looked.clear()
        return tasks


def _is_look(task: Task) -> bool:
    return isinstance(task.job, WayCheckJob)
