"""A job on its way to a planning process, and what takes it there."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from openpendant.simplemsg.verdicts import VerdictCode

from ..refusal import Refusal
from .jobs import Job, Planned

Deliver = Callable[[Planned], None]


class Planner(Protocol):
    """Takes the jobs of a cell and delivers answers later; tests supply one that answers soon."""

    def submit(self, job: Job, deliver: Deliver) -> None:
        """Plan a job; `deliver` is called with the answer."""

    def withdraw(self, job_id: int) -> None:
        """Take note that nobody waits for the answer to a job, which need not come any more."""


@dataclass(frozen=True, slots=True)
class Task:
    """A job on its way.

    Attributes:
        robot: name or file of the robot that it is for.
        job: what to plan.
        deliver: called with the answer.
        cell: number of the cell that it is for; cells take turns.
    """

    robot: str
    job: Job
    deliver: Deliver
    cell: int = 0

    def fail(self) -> None:
        """Answer that no plan will come."""
        self.deliver(Planned(self.job.job_id, Refusal(VerdictCode.PLANNER_FAILED), 0.0))


class Timer(Protocol):
    """What runs out if it is not cancelled; an `asyncio.TimerHandle`, say."""

    def cancel(self) -> None:
        """Stop it."""


@dataclass(slots=True)
class TaskInHand:
    """A job that a process is busy with.

    Attributes:
        task: the job.
        timer: ends the process where no answer comes.
        given: when the process was given it, by the loop's clock [s].
        is_withdrawn: nobody waits for the answer.
        patience: runs out some time after that; None until then, and until the process is warm.
        is_overdue: it ran out.
    """

    task: Task
    timer: Timer
    given: float = 0.0
    is_withdrawn: bool = False
    patience: Timer | None = None
    is_overdue: bool = False

    def end(self) -> None:
        """Stop the timers."""
        self.timer.cancel()
        if self.patience is not None:
            self.patience.cancel()
