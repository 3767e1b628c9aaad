"""What a cell has done to its programs, and who waits for it.

Owns where a task is done: a small one at once, any other in the planning process, so that no
program holds up the event loop, and with it every robot of the server. Its answer is an event with
a time.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

from openpendant.simplemsg.verdicts import VerdictCode

from ..outgoing import Outgoing, Plan
from ..planning.jobs import Planned, ProgramJob
from ..programs.errors import ProgramError
from ..programs.work import RESULTS, Done, ProgramRefused, Task, perform
from ..refusal import Refusal
from .operations import Asker

MOST_WAITING = 16
"""Tasks of one cell that may wait for the planning process."""

ThenDone: TypeAlias = Callable[[Done | ProgramRefused, int], list[Outgoing]]
"""Takes a result and the time [ns]; returns what follows."""


class ProgramWork:
    """The tasks of one cell."""

    def __init__(self, new_job_id: Callable[[], int]) -> None:
        """Begin with none.

        Args:
            new_job_id: numbers the jobs of the cell.
        """
        self._new_job_id = new_job_id
        self._waiting: dict[int, ThenDone] = {}

    def ask(self, task: Task, then: ThenDone, now: int) -> list[Outgoing]:
        """Have a task done; `then` gets its result, on this call stack where it is small."""
        if task.is_small:
            return then(perform(task), now)
        if len(self._waiting) >= MOST_WAITING:
            text = f"{len(self._waiting)} programs are being read or written; at most that many"
            busy = Refusal(VerdictCode.STORE_BUSY, text, value=MOST_WAITING, limit=MOST_WAITING)
            return then(ProgramRefused(busy), now)
        job = ProgramJob(self._new_job_id(), task)
        self._waiting[job.job_id] = then
        return [Plan(job)]

    def have(
        self, task: Task, then: Callable[[Done, int], list[Outgoing]], asker: Asker, now: int
    ) -> list[Outgoing]:
        """As `ask`; what is wrong with the program, then or later, is told to whoever asked."""

        def done(result: Done | ProgramRefused, now: int) -> list[Outgoing]:
            if isinstance(result, ProgramRefused):
                return asker.refuse_work(result)
            try:
                return then(result, now)
            except ProgramError as error:
                return asker.refuse_program(error)

        return self.ask(task, done, now)

    def planned(self, planned: Planned, now: int) -> list[Outgoing] | None:
        """Take an answer of the planning process; None where it is to no task."""
        then = self._waiting.pop(planned.job_id, None)
        if then is None:
            return None
        result = planned.result
        if isinstance(result, RESULTS):
            return then(result, now)
        refusal = result if isinstance(result, Refusal) else Refusal(VerdictCode.PLANNER_FAILED)
        return then(ProgramRefused(refusal), now)
