"""Pending program tasks of a cell, and the callbacks that wait for them.

Owns where a task is done: a small one at once, any other in the planning process, so that no
program holds up the event loop, and with it every robot of the server. Its answer is an event with
a time.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

from openpendant.simplemsg.verdicts import VerdictCode

from ...events.effects import Effect
from ...events.pending import Pending, Steps
from ...events.reply_to import ReplyTo
from ...planning.jobs import ProgramJob
from ...refusal import Refusal
from ..editing.program_tasks import RESULTS, Done, ProgramRefused, Task, perform
from ..language.program_errors import ProgramError

MOST_WAITING = 16
"""Greatest number of tasks of one cell that wait for the planning process."""

_T = TypeVar("_T")


class ProgramWork:
    """Tasks of one cell."""

    def __init__(self, new_job_id: Callable[[], int], pending: Pending) -> None:
        self._new_job_id = new_job_id
        self._pending = pending
        self._waiting = 0

    def done(self, task: Task) -> Steps[Done | ProgramRefused]:
        """Carry out a task, at once where it is small; return its result."""
        if task.is_small:
            return perform(task)
        if self._waiting >= MOST_WAITING:
            text = f"{self._waiting} programs are being read or written; at most that many"
            busy = Refusal(VerdictCode.STORE_BUSY, text, value=MOST_WAITING, limit=MOST_WAITING)
            return ProgramRefused(busy)
        self._waiting += 1
        planned = yield ProgramJob(self._new_job_id(), task)
        self._waiting -= 1
        result = planned.result
        if isinstance(result, RESULTS):
            return result
        refusal = result if isinstance(result, Refusal) else Refusal(VerdictCode.PLANNER_FAILED)
        return ProgramRefused(refusal)

    def run(
        self, steps: Steps[_T], then: Callable[[_T, int], list[Effect]], now: int
    ) -> list[Effect]:
        """Start work of several steps; `then` gets what it returns."""
        return self._pending.run(steps, then, now)

    def have(
        self,
        task: Task,
        then: Callable[[Done, int], list[Effect]],
        reply_to: ReplyTo[Any],
        now: int,
    ) -> list[Effect]:
        """Carry out a task; refuse the request if the program is at fault."""

        def done(result: Done | ProgramRefused, now: int) -> list[Effect]:
            if isinstance(result, ProgramRefused):
                return reply_to.refuse_work(result)
            try:
                return then(result, now)
            except ProgramError as error:
                return reply_to.refuse_program(error)

        return self._pending.run(self.done(task), done, now)
