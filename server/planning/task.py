"""Planning tasks: jobs on their way to a planning process, and their form in its pipe.

A job goes through the pipe as a question: the length of a pickle, the pickle, and behind it the
samples of a recording, whose size is in the pickle. These may be tens of megabytes, so nothing here
joins or copies them as a whole on the event loop: `planning_process` writes them a piece at a time,
and the loop does other work in between.
"""

from __future__ import annotations

import pickle
import struct
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import BinaryIO, Protocol

from openpendant.simplemsg.verdicts import VerdictCode

from ..refusal import Refusal
from .jobs import Job, PlanAnswer, RecordingJob

LENGTH = struct.Struct("<I")
"""Length prefix of each pickle, in both directions."""


def split_question(robot: str, job: Job) -> tuple[bytes, Sequence[bytes]]:
    """Return what is written at once, and the pieces that follow it."""
    pieces: Sequence[bytes] = ()
    if isinstance(job, RecordingJob):
        pieces, job = job.samples, replace(job, samples=())
    data = pickle.dumps((robot, job, sum(map(len, pieces))))
    return LENGTH.pack(len(data)) + data, pieces


def read_question(pipe: BinaryIO) -> tuple[str, Job] | None:
    """Return robot and job of the next question; None where the pipe ends before. Blocks."""
    head = pipe.read(LENGTH.size)
    if len(head) < LENGTH.size:
        return None
    (length,) = LENGTH.unpack(head)
    data = pipe.read(length)
    if len(data) < length:
        return None
    robot, job, size = pickle.loads(data)
    samples = pipe.read(size)
    if len(samples) < size:
        return None
    if isinstance(job, RecordingJob):
        job = replace(job, samples=(samples,))
    return robot, job


Deliver = Callable[[PlanAnswer], None]


class Planner(Protocol):
    """Interface that takes the jobs of a cell and delivers answers later."""

    def submit(self, job: Job, deliver: Deliver) -> None:
        """Plan a job; `deliver` is called with the answer."""

    def withdraw(self, job_id: int) -> None:
        """Withdraw a job: its answer is not needed any more."""


@dataclass(frozen=True, slots=True)
class PlanTask:
    """A job with its receiver, until it is answered.

    Attributes:
        robot: name or file of the robot that it is for.
        cell: number of the cell that it is for; cells take turns.
    """

    robot: str
    job: Job
    deliver: Deliver
    cell: int = 0

    def fail(self) -> None:
        """Answer that no plan will come."""
        self.deliver(PlanAnswer(self.job.job_id, Refusal(VerdictCode.PLANNER_FAILED), 0.0))


class Timer(Protocol):
    """Timer that can be cancelled, such as an `asyncio.TimerHandle`."""

    def cancel(self) -> None:
        """Stop it."""


@dataclass(slots=True)
class TaskInHand:
    """A job that a process is busy with.

    Attributes:
        timer: ends the process where no answer comes.
        given: when the process was given it, by the loop's clock [s].
        is_withdrawn: nobody waits for the answer.
        patience: runs out some time after that; None until then, and until the process is warm.
        is_overdue: it ran out.
    """

    task: PlanTask
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
