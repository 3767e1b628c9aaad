"""One planning process and the shell round it.

A job goes to a child process on its standard input (`jobs`), the answer comes back on its
standard output as a length-prefixed pickle with its arrays behind it, so that neither side ever
blocks the event loop and the death of either ends the other: the child sees the end of its input,
the server the end of its output. It has one job in hand at a time; who waits for a process is
`planning_pool`'s business.

Run as a module it is the child:
`python -m openpendant.server.planning.pool.planning_process NICENESS ROBOT...`.
"""

from __future__ import annotations

import asyncio
import gc
import logging
import os
import pickle
import signal
import sys
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import partial
from typing import BinaryIO, Protocol

import numpy as np
from numpy.typing import NDArray

from openpendant.simplemsg.verdicts import VerdictCode

from ...refusal import Refusal
from ..jobs import (
    LENGTH,
    PlanAnswer,
    PlanTask,
    SplitAnswer,
    TaskInHand,
    is_search,
    read_question,
    split_answer,
    split_question,
)

log = logging.getLogger("openpendant.server")

NICENESS = 10
"""Least niceness of a process that plans: a plan is computed while nothing else is to be done."""

_BEHIND = 5
"""By so much it is nicer than the server at least, which so comes first on every machine."""

_RESTART_PAUSE = 0.5
_LONGEST_PAUSE = 10.0
_LONGEST_PLAN = 30.0
_LONGEST_WASTE = 1.0  # for what nobody waits for, where others wait

_DISCARDED = 1 << 16
"""Bytes that are thrown away at once of answers that nobody reads."""

_ARRAY_PIECE = 1 << 18
"""Most bytes of an answer's arrays that are copied at once, in a tenth of a millisecond."""

_FAREWELL = 0.5


class Child(Protocol):
    """The used part of an `asyncio.subprocess.Process`."""

    pid: int
    stdin: asyncio.StreamWriter | None
    stdout: asyncio.StreamReader | None

    async def wait(self) -> int:
        """Wait for its end; return its exit code."""

    def kill(self) -> None:
        """Kill it."""


class StartedChild(Child, Protocol):
    """A child that runs before there is a loop."""

    async def join(self) -> Child:
        """Connect it to the running loop."""


class PlanningProcess:
    """Warm, niced child process that plans one job after the other.

    Attributes:
        is_down: True if it could not be started or never got warm, until the next attempt.
    """

    def __init__(
        self,
        robots: Sequence[str],
        on_change: Callable[[], None],
        begun: StartedChild | None = None,
        *,
        name: str = "planning",
        longest: float | None = None,
        niceness: int = NICENESS,
    ) -> None:
        """Make a planner for some robots; `keep_up` starts its process.

        Args:
            on_change: called when it became free, or went down.
            begun: its first process, which runs already; it starts one where left out.
            name: of what it is for, in the log.
            longest: the process is ended where a job takes longer [s], once it is warm; 30 s where
                left out.
            niceness: the least of its processes, that of `begun` left out.
        """
        self._name, self._longest, self._niceness = name, longest, niceness
        self.is_down = False
        self.is_warm = False
        self._robots = robots
        self._on_change = on_change
        self._begun = begun
        self._process: Child | None = None
        self._in_hand: TaskInHand | None = None
        self._is_doomed = False  # killed, though its end was not seen yet
        self._writing: asyncio.Task[None] | None = None

    @property
    def is_free(self) -> bool:
        """True if it would start a job at once, or as soon as it is warm."""
        if self._process is None or self._in_hand is not None or self._is_doomed:
            return False
        # The loop may have seen its input closed some turns before the end of its output, which
        # `keep_up` waits for.
        assert self._process.stdin is not None
        return not self._process.stdin.is_closing()

    @property
    def wasted_on(self) -> int | None:
        """Number of the cell whose withdrawn job it is busy with; None for none."""
        in_hand = self._in_hand
        return in_hand.task.cell if in_hand is not None and in_hand.is_withdrawn else None

    @property
    def is_searching(self) -> bool:
        """True if it is busy with a plan around obstacles, wanted or not."""
        return self._in_hand is not None and is_search(self._in_hand.task.job)

    def give(self, task: PlanTask) -> bool:
        """Give a job to a free process.

        Returns:
            True if it took the job; otherwise it is ended, and free again once another runs.
        """
        assert self._process is not None
        assert self._process.stdin is not None
        head, pieces = split_question(task.robot, task.job)
        try:
            self._process.stdin.write(head)
        except (OSError, RuntimeError) as error:
            # What uvloop does where asyncio drops the bytes: the input is closed.
            log.error("the %s process takes no job: %s", self._name, error)
            _kill(self._process)
            return False
        loop = asyncio.get_running_loop()
        timer = loop.call_later(self._most_time, self._give_up, task)
        self._in_hand = TaskInHand(task, timer, loop.time())
        if pieces:
            self._writing = asyncio.ensure_future(self._write_rest(self._process, pieces))
        return True

    async def _write_rest(self, process: Child, pieces: Sequence[bytes]) -> None:
        """Write what follows a question, a piece in each turn of the loop, as fast as it is read.

        A process that does not take it is ended.
        """
        assert process.stdin is not None
        try:
            for piece in pieces:
                process.stdin.write(piece)
                await process.stdin.drain()
                # A drain where nothing is waited for is no turn of the loop.
                await asyncio.sleep(0)
        except (OSError, RuntimeError) as error:
            log.error("the %s process does not take all of a job: %s", self._name, error)
            _kill(process)

    def _give_up(self, task: PlanTask) -> None:
        """End a process that has not answered for too long; `keep_up` starts another."""
        log.error("%s job %d took more than %g s", self._name, task.job.job_id, self._most_time)
        self._doom()

    @property
    def _most_time(self) -> float:
        """Longest that a job may take now [s]: one that gets warm needs time for that first."""
        if self._longest is None or not self.is_warm:
            return _LONGEST_PLAN
        return self._longest

    def _became_warm(self) -> None:
        """Begin to count the time of a job that was given before."""
        self.is_warm = True
        in_hand = self._in_hand
        if in_hand is not None and self._longest is not None:
            in_hand.timer.cancel()
            loop = asyncio.get_running_loop()
            in_hand.timer = loop.call_later(self._longest, self._give_up, in_hand.task)
        self._be_patient()

    def _doom(self) -> None:
        """End the process, and give it no job until another runs."""
        if self._process is not None:
            self._is_doomed = True
            _kill(self._process)

    def withdraw(self, cell: int, job_id: int) -> None:
        """Withdraw a job of a cell if it is the one in hand: its answer is dropped."""
        in_hand = self._in_hand
        if in_hand is None or (in_hand.task.cell, in_hand.task.job.job_id) != (cell, job_id):
            return
        in_hand.is_withdrawn = True
        self._be_patient()

    def _be_patient(self) -> None:
        """Wait some time before a withdrawn job counts as overdue; it may be done soon."""
        in_hand = self._in_hand
        # A process that gets warm is not ended: a new one costs more time than most plans.
        if in_hand is None or not in_hand.is_withdrawn or not self.is_warm:
            return
        loop = asyncio.get_running_loop()
        in_hand.patience = loop.call_later(_LONGEST_WASTE, self._lose_patience, in_hand)

    def _lose_patience(self, in_hand: TaskInHand) -> None:
        in_hand.is_overdue = True
        self._on_change()

    def cut_short(self) -> None:
        """End a process that is overdue with a withdrawn job; `keep_up` starts another."""
        in_hand = self._in_hand
        if in_hand is None or not in_hand.is_overdue or self._is_doomed:
            return
        job_id = in_hand.task.job.job_id
        log.warning(
            "%s job %d was withdrawn and goes on; its process is replaced", self._name, job_id
        )
        self._doom()

    async def keep_up(self) -> None:
        """Run the process, and another when it ends; until cancelled."""
        pause = _RESTART_PAUSE
        while True:
            try:
                await self._run_once()
                log.error("the %s process ended; starting another", self._name)
            except OSError as error:
                # Out of memory or processes, for example: retried, as the server serves without it.
                log.error("the %s process failed, trying again: %s", self._name, error)
            finally:
                # One that was warm is back at once, and jobs may wait for that.
                was_warm, self.is_warm, self.is_down = self.is_warm, False, not self.is_warm
                self._fail_in_hand()
                self._on_change()
            # A process that never gets warm would otherwise use a whole core for its attempts.
            pause = _RESTART_PAUSE if was_warm else min(2 * pause, _LONGEST_PAUSE)
            await asyncio.sleep(pause)

    async def _run_once(self) -> None:
        begun, self._begun = self._begun, None
        started = _start(self._niceness, self._robots) if begun is None else begun.join()
        self._process = process = await started
        self.is_down = self._is_doomed = False
        self._on_change()
        try:
            await self._read_answers(process)
        finally:
            self._process = None
            if self._writing is not None:
                self._writing.cancel()
            await _end(process)

    async def _read_answers(self, process: Child) -> None:
        assert process.stdout is not None
        while True:
            try:
                (size,) = LENGTH.unpack(await process.stdout.readexactly(LENGTH.size))
                planned = pickle.loads(await process.stdout.readexactly(size))
                if isinstance(planned, SplitAnswer):
                    arrays = [await _read_array(process.stdout, size) for size in planned.sizes]
                    planned = planned.joined(arrays)
            except asyncio.IncompleteReadError:
                return
            if planned is None:
                self._became_warm()
                continue
            in_hand = self._in_hand
            assert in_hand is not None
            if isinstance(planned, PlanAnswer) and not planned.is_final:
                if not in_hand.is_withdrawn:
                    in_hand.task.deliver(planned)
                continue
            self._in_hand = None
            in_hand.end()
            if not in_hand.is_withdrawn:
                if isinstance(planned, PlanAnswer) and isinstance(planned.result, tuple):
                    # Only the start of a motion needs the time that it waited.
                    took = asyncio.get_running_loop().time() - in_hand.given
                    planned = replace(planned, took=took)
                in_hand.task.deliver(planned)
            self._on_change()

    def _fail_in_hand(self) -> None:
        in_hand, self._in_hand = self._in_hand, None
        if in_hand is None:
            return
        in_hand.end()
        if not in_hand.is_withdrawn:
            in_hand.task.fail()


async def _read_array(stdout: asyncio.StreamReader, size: int) -> NDArray[np.uint8]:
    """Read so many bytes, a piece in each turn of the loop: a long motion has tens of millions."""
    # Not zeroed beforehand, which would touch all of its memory in this turn.
    found = np.empty(size, dtype=np.uint8)
    at = 0
    while at < size:
        data = await stdout.read(min(size - at, _ARRAY_PIECE))
        if not data:
            raise asyncio.IncompleteReadError(b"", size - at)
        found[at : at + len(data)] = np.frombuffer(data, dtype=np.uint8)
        at += len(data)
    return found


async def _start(niceness: int, robots: Sequence[str]) -> asyncio.subprocess.Process:
    """Start a child; one that was not waited for to the end is ended, too."""
    starting = asyncio.ensure_future(
        asyncio.create_subprocess_exec(
            *(sys.executable, "-m", __name__, str(niceness), *robots),
            stdin=asyncio.subprocess.PIPE,
            stdout=asyncio.subprocess.PIPE,
        )
    )
    try:
        return await asyncio.shield(starting)
    except asyncio.CancelledError:
        with suppress(OSError):
            await _end(await starting)
        raise


async def _end(process: Child) -> None:
    """End the child by closing its input, by force where it is busy with a plan."""
    assert process.stdin is not None
    process.stdin.close()
    try:
        # Not `wait_for`: that of Python 3.11 swallows a cancellation that comes as the child ends,
        # and `keep_up` would start another child in a server that is going down.
        async with asyncio.timeout(_FAREWELL):
            code = await _exit_code(process)
    except TimeoutError:
        _kill(process)
        code = await _exit_code(process)
    log.info("planning process %d ended with %d", process.pid, code)


async def _exit_code(process: Child) -> int:
    """Wait for the end of a child whose answers nobody reads any more; return its exit code."""
    assert process.stdout is not None
    # A pipe that is full is not closed, even by a kill, and `wait` waits for that.
    while await process.stdout.read(_DISCARDED):
        pass
    return await process.wait()


def _kill(process: Child) -> None:
    """Kill the child, which may have died since the loop looked last."""
    with suppress(ProcessLookupError):
        process.kill()


def give_way(niceness: int) -> None:
    """Make this process so nice, and nicer than the server whose priority it inherited."""
    inherited = os.getpriority(os.PRIO_PROCESS, 0)
    os.setpriority(os.PRIO_PROCESS, 0, max(niceness, inherited + _BEHIND))


def run_child(
    robots: Sequence[str], jobs: BinaryIO, answers: BinaryIO, niceness: int = NICENESS
) -> None:
    """Answer jobs until the server closes the pipe; the body of the child process."""
    give_way(niceness)
    try:
        _answer_jobs(robots, jobs, answers)
    except BrokenPipeError:
        # The server was killed. Python would complain once more when it flushes what is left.
        os._exit(1)


def _answer_jobs(robots: Sequence[str], jobs: BinaryIO, answers: BinaryIO) -> None:
    # The terminal's Ctrl-C goes to the whole group; the server decides when planning ends.
    signal.signal(signal.SIGINT, signal.SIG_IGN)

    from ..worker.job_planner import answer, warm_up

    for robot in robots:
        warm_up(robot)
    # What was imported stays; a process that was forked has had no garbage collected until now.
    gc.freeze()
    gc.enable()
    _send(answers, None)
    while True:
        asked = read_question(jobs)
        if asked is None:
            return
        robot, job = asked
        try:
            planned = answer(robot, job, partial(_send, answers))
        except Exception as error:
            # A fault of ours: the pendant gets a refusal, the process and its libraries stay warm.
            text = f"{type(error).__name__}: {error}"
            planned = PlanAnswer(job.job_id, Refusal(VerdictCode.PLANNER_FAILED, text), 0.0)
        _send(answers, planned)


def _send(answers: BinaryIO, planned: PlanAnswer | None) -> None:
    for piece in split_answer(planned):
        answers.write(piece)
    answers.flush()


def _answers_on_stdout() -> BinaryIO:
    """Return the pipe of the answers; the output of a library must not get between them."""
    answers = os.fdopen(os.dup(sys.stdout.fileno()), "wb")
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())
    return answers


if __name__ == "__main__":
    run_child(sys.argv[2:], sys.stdin.buffer, _answers_on_stdout(), int(sys.argv[1]))
