"""The process for questions on kinematics and shapes, and the line of these questions.

Such a question takes a millisecond or less, and somebody who drags a ghost of the robot waits for
it: behind plans it would wait for seconds, and on the event loop it would hold up the robots. So it
has a process of its own, started by the first question, which keeps about 110 MB from then on.

Owns the order: connections take turns, so that one that asks much delays another by no more than
one question of each. Of one connection's inverse kinematics only the newest waits, since the page
that asked has moved on; an older one is answered `SUPERSEDED`. What the process had in hand when it
died is asked once more, because a process that was killed says nothing about the question.
"""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, replace

from openpendant.simplemsg.pendant.management.kinematics import InverseKinematics
from openpendant.simplemsg.verdicts import VerdictCode

from ...refusal import Refusal
from ..jobs import KinematicsQuestion, PlanAnswer, PlanTask, ShapesQuestion
from .planning_process import PlanningProcess

_LONGEST_ANSWER = 5.0
"""Longest that an answer may take [s]; the dearest takes a tenth of it on a busy machine."""

_NICENESS = 0
"""That of an ordinary program: who asked waits for the answer, and the questions are bounded."""


class QuestionLine:
    """Questions of several connections, each connection's in their order."""

    def __init__(self) -> None:
        # By connection, in the order of their turns; none is empty.
        self._waiting: dict[int, deque[PlanTask]] = {}

    def __bool__(self) -> bool:
        """True if a question waits."""
        return bool(self._waiting)

    def put(self, task: PlanTask) -> PlanTask | None:
        """Add a question; return the older one whose place it takes, if any."""
        tasks = self._waiting.setdefault(_session(task), deque())
        if _is_inverse(task):
            for place, older in enumerate(tasks):
                if _is_inverse(older):
                    tasks[place] = task
                    return older
        tasks.append(task)
        return None

    def put_back(self, task: PlanTask) -> None:
        """Add a question that was taken already, before all others."""
        tasks = self._waiting.pop(_session(task), deque())
        tasks.appendleft(task)
        self._waiting = {_session(task): tasks, **self._waiting}

    def first(self) -> PlanTask | None:
        """Return the next question; it stays in the line until it is taken."""
        return next((tasks[0] for tasks in self._waiting.values()), None)

    def take(self, task: PlanTask) -> None:
        """Remove the first question; its connection's turn comes again behind all others."""
        tasks = self._waiting.pop(_session(task))
        tasks.popleft()
        if tasks:
            self._waiting[_session(task)] = tasks

    def withdraw(self, cell: int, job_id: int) -> bool:
        """Remove a question of a cell; return True if it waited."""
        for session, tasks in self._waiting.items():
            for task in tasks:
                if (task.cell, task.job.job_id) == (cell, job_id):
                    tasks.remove(task)
                    if not tasks:
                        del self._waiting[session]
                    return True
        return False

    def clear(self) -> list[PlanTask]:
        """Remove all questions and return them."""
        tasks = [task for tasks in self._waiting.values() for task in tasks]
        self._waiting.clear()
        return tasks


def _session(task: PlanTask) -> int:
    assert isinstance(task.job, KinematicsQuestion | ShapesQuestion)
    return task.job.session


def _is_inverse(task: PlanTask) -> bool:
    return isinstance(task.job, KinematicsQuestion) and isinstance(
        task.job.asked, InverseKinematics
    )


@dataclass(frozen=True, slots=True)
class _Question(PlanTask):
    """A question that is in the hands of the process.

    Attributes:
        pool: is told where the process died with it.
        is_again: it was lost once before.
    """

    pool: QuestionPool | None = None
    is_again: bool = False

    def fail(self) -> None:
        """Take note that no answer will come of this process."""
        assert self.pool is not None
        self.pool.lost(self)


class QuestionPool:
    """The one process for questions of all cells of a server."""

    def __init__(self, robots: Sequence[str]) -> None:
        """Make a pool; `keep_up` starts its process once there is a question.

        Args:
            robots: names or files of the robots that are asked about.
        """
        self._line = QuestionLine()
        self._process = PlanningProcess(
            robots,
            self.hand_out,
            name="questions",
            longest=_LONGEST_ANSWER,
            niceness=_NICENESS,
        )
        self._has_begun = asyncio.Event()

    def submit(self, task: PlanTask) -> None:
        """Answer a question when its connection's turn has come and the process is free."""
        older = self._line.put(_Question(task.robot, task.job, task.deliver, task.cell, self))
        if older is not None:
            _refuse(older, VerdictCode.SUPERSEDED)
        self._has_begun.set()
        self.hand_out()

    def withdraw(self, cell: int, job_id: int) -> bool:
        """Withdraw a question, which is not answered any more; return True if it waited."""
        if self._line.withdraw(cell, job_id):
            return True
        self._process.withdraw(cell, job_id)
        return False

    def lost(self, question: _Question) -> None:
        """Ask once more what a process died with; refuse what another died with before."""
        if question.is_again:
            _refuse(question, VerdictCode.PLANNER_FAILED)
        else:
            self._line.put_back(replace(question, is_again=True))

    def hand_out(self) -> None:
        """Give a free process its next question; fail all if no process can start."""
        if self._process.is_free and (task := self._line.first()) is not None:
            if self._process.give(task):
                self._line.take(task)
        if self._process.is_down:
            for task in self._line.clear():
                _refuse(task, VerdictCode.PLANNER_FAILED)
        if self._line:
            self._process.cut_short()

    async def keep_up(self) -> None:
        """Run the process from the first question on, until cancelled."""
        await self._has_begun.wait()
        await self._process.keep_up()


def _refuse(task: PlanTask, code: VerdictCode) -> None:
    """Refuse a question, in a later turn of the loop: what it follows from is not done yet."""
    answer = PlanAnswer(task.job.job_id, Refusal(code), 0.0)
    asyncio.get_running_loop().call_soon(task.deliver, answer)
