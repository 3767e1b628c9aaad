"""Planning processes forked from the server while it starts; they share what it has imported.

A planning process needs most of what the server has imported already. One that is started as a new
interpreter imports it again: two thirds of its start-up, and memory of its own for all of it. Owns
when a fork is safe: before the server has a thread or an event loop. Where it has one, and wherever
a process that ended is replaced, `planning_process` starts a new interpreter.

`ForkedChild` is what the server has of such a process, with the part of the interface of
`asyncio.subprocess.Process` that `planning_process` uses.
"""

from __future__ import annotations

import asyncio
import os
import signal
import sys
import traceback
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress

from .planning_process import run_child

_STANDARD_STREAMS = 3


class ForkedChild:
    """A planning process that was forked, its two pipes, and its end.

    Attributes:
        stdin: takes jobs; None until `join`.
        stdout: gives answers; None until `join`.
        returncode: as `asyncio.subprocess.Process` has it; None while its end was not seen.
    """

    def __init__(self, pid: int, jobs: int, answers: int) -> None:
        """Take over a process and the descriptors of the server's ends of its pipes."""
        self.pid = pid
        self.stdin: asyncio.StreamWriter | None = None
        self.stdout: asyncio.StreamReader | None = None
        self.returncode: int | None = None
        self.pipes = [jobs, answers]
        self._ended: asyncio.Future[int] | None = None

    async def join(self) -> ForkedChild:
        """Connect its pipes and its end to the running loop."""
        loop = asyncio.get_running_loop()
        self._ended = loop.create_future()
        watched = os.pidfd_open(self.pid)
        loop.add_reader(watched, self._reap, watched)
        jobs, answers = self.pipes
        self.pipes = []
        stdin, protocol = await loop.connect_write_pipe(_reading_nothing, os.fdopen(jobs, "wb", 0))
        self.stdin = asyncio.StreamWriter(stdin, protocol, None, loop)
        stdout = asyncio.StreamReader()
        reading = asyncio.StreamReaderProtocol(stdout)
        await loop.connect_read_pipe(lambda: reading, os.fdopen(answers, "rb", 0))
        self.stdout = stdout
        return self

    def _reap(self, watched: int) -> None:
        """Take down its end, which its descriptor has told."""
        assert self._ended is not None
        asyncio.get_running_loop().remove_reader(watched)
        os.close(watched)
        self.returncode = os.waitstatus_to_exitcode(os.waitpid(self.pid, 0)[1])
        if not self._ended.done():
            self._ended.set_result(self.returncode)

    async def wait(self) -> int:
        """Wait for its end; return its exit code, of a signal the negative number."""
        assert self._ended is not None
        # One that is not waited for to the end is still waited for by the next.
        return await asyncio.shield(self._ended)

    def kill(self) -> None:
        """Kill it, unless its end was seen."""
        if self.returncode is None:
            os.kill(self.pid, signal.SIGKILL)

    def end(self) -> None:
        """Make sure that nothing of it is left, at the server's end."""
        for pipe in self.pipes:
            os.close(pipe)
        if self.returncode is None:
            self.kill()
            # Where a loop has closed, its end was not taken down.
            self.returncode = os.waitstatus_to_exitcode(os.waitpid(self.pid, 0)[1])


def _reading_nothing() -> asyncio.StreamReaderProtocol:
    """Return the protocol of a pipe that is only written: it tells when to write on."""
    return asyncio.StreamReaderProtocol(asyncio.StreamReader())


@contextmanager
def forked_children(robots: Sequence[str], wanted: int) -> Iterator[list[ForkedChild]]:
    """Fork planning processes, and leave nothing of them when the context ends.

    Args:
        robots: names or files of the robots that each can plan for.
        wanted: how many; there are fewer, or none, where a fork is not safe or not possible.
    """
    children: list[ForkedChild] = []
    try:
        with suppress(OSError):  # out of processes or descriptors: the pool tries later
            while len(children) < wanted and _may_fork():
                child = _fork(robots, children)
                if child is None:
                    break
                children.append(child)
        yield children
    finally:
        for child in children:
            child.end()


def _may_fork() -> bool:
    """Return True if nothing of this process goes on that a fork would cut off."""
    if not hasattr(os, "pidfd_open"):
        return False
    try:
        asyncio.get_running_loop()
    except RuntimeError:
        # The threads of libraries count, too, so that Python's own list is not enough.
        return len(os.listdir("/proc/self/task")) == 1
    return False


def _fork(robots: Sequence[str], others: Sequence[ForkedChild]) -> ForkedChild | None:
    """Fork a process; return None where its pipes would take the place of a standard stream."""
    pipes = [*os.pipe(), *os.pipe()]
    jobs, to_child, from_child, answers = pipes
    pid = -1
    # Ctrl-C is the server's business; the child ignores it as soon as it is one.
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        if min(pipes) < _STANDARD_STREAMS:
            return None
        pid = os.fork()
        if pid == 0:
            signal.signal(signal.SIGINT, signal.SIG_IGN)
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
        if pid < 0:
            for pipe in pipes:
                os.close(pipe)
    if pid == 0:
        # The server's ends of every pipe: a pipe ends only where nobody else holds its end.
        of_server = [to_child, from_child, *(pipe for each in others for pipe in each.pipes)]
        _end_with(lambda: _plan(robots, jobs, answers, of_server))
    os.close(jobs)
    os.close(answers)
    return ForkedChild(pid, to_child, from_child)


def _end_with(body: Callable[[], None]) -> None:
    """Run the body of a child and end it, without what the server does at its own end."""
    code = 1
    try:
        body()
        code = 0
    except BaseException:
        traceback.print_exc()
        sys.stderr.flush()
    finally:
        os._exit(code)


def _plan(robots: Sequence[str], jobs: int, answers: int, of_server: Sequence[int]) -> None:
    for pipe in of_server:
        os.close(pipe)
    # The server's input and output are its own: who waits for their end waits for the server.
    nothing = os.open(os.devnull, os.O_RDONLY)
    os.dup2(nothing, 0)
    os.close(nothing)
    os.dup2(2, 1)
    run_child(robots, os.fdopen(jobs, "rb"), os.fdopen(answers, "wb"))
