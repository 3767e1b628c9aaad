"""Programs started from an interpreter that has imported them already.

Four fifths of what the start of a server costs is importing, and so is most of an emulator's. One
process for each worker of pytest imports both (`multiprocessing` calls it the fork server), and
forks a child that runs a program as `python -m` does: with arguments, environment, folder and
streams of its own, and its own process to be stopped, killed and looked at. Tests of a start, of
promises' figures and of processes that are found by their command start new interpreters.
"""

import asyncio
import atexit
import json
import multiprocessing
import os
import runpy
import signal
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from rigs.clock.busy_machine import SCALE

_IMPORTED = [
    "openpendant.server.cli.serve",
    "openpendant.server.shell.app",
    "openpendant.server.access.open_access",
    "openpendant.controller_emulator.shell.cli",
]

_BEFORE_IMPORTS = {"OPENBLAS_NUM_THREADS": "1"}
"""What a server sets before it imports numpy: a process with threads cannot fork."""

_CONTEXT = multiprocessing.get_context("forkserver")
_CONTEXT.set_forkserver_preload(_IMPORTED)


class WarmProcess:
    """A program that runs, with what tests use of `asyncio.subprocess.Process`."""

    def __init__(self, module: str, *arguments: str, log: Path | None = None) -> None:
        """Start it.

        Args:
            log: takes what it says on its standard error; else that of the tests does.
        """
        said, saying = _CONTEXT.Pipe(duplex=False)
        self._said = said
        self._process = _CONTEXT.Process(
            target=_run,
            args=(module, arguments, dict(os.environ), Path.cwd(), saying, log),
            daemon=True,
        )
        with _environment(_BEFORE_IMPORTS):
            self._process.start()
        saying.close()

    @property
    def pid(self) -> int:
        """Its process id."""
        assert self._process.pid is not None
        return self._process.pid

    @property
    def returncode(self) -> int | None:
        """Its exit code, of a signal the negative number; None while it runs."""
        return self._process.exitcode

    def line(self) -> bytes:
        """Wait for the next line that it says; empty where it has ended."""
        data = bytearray()
        while not data.endswith(b"\n") and (byte := os.read(self._said.fileno(), 1)):
            data += byte
        return bytes(data)

    def send_signal(self, number: int) -> None:
        """Send it a signal, unless it has ended."""
        if self.returncode is None:
            os.kill(self.pid, number)

    def kill(self) -> None:
        """Kill it, unless it has ended."""
        self.send_signal(signal.SIGKILL)

    async def wait(self) -> int:
        """Wait for its end; return its exit code."""
        loop = asyncio.get_running_loop()
        ended = asyncio.Event()
        loop.add_reader(self._process.sentinel, ended.set)
        try:
            await ended.wait()
        finally:
            loop.remove_reader(self._process.sentinel)
        self._process.join()
        assert self.returncode is not None
        return self.returncode

    def end(self, within: float) -> None:
        """Wait for its end without a loop; kill it where that takes longer [s]."""
        self._process.join(within)
        self.kill()
        self._process.join()


def import_besides(*modules: str) -> None:
    """Have the one interpreter import more than the programs, unless it has begun."""
    _CONTEXT.set_forkserver_preload([*_IMPORTED, *modules])


def import_programs() -> None:
    """Have the one interpreter import the programs, unless it has, and wait until it has."""
    with _environment(_BEFORE_IMPORTS):
        process = _CONTEXT.Process(target=int)
        process.start()
    process.join()


@contextmanager
def warm(module: str, *arguments: str) -> Iterator[Callable[[], dict[str, Any]]]:
    """Run a program until the context is left; yields what waits for its ready line."""
    process = WarmProcess(module, *arguments, "--json")

    def ready() -> dict[str, Any]:
        line = process.line()
        assert line, f"{module} ended before it was ready"
        told: dict[str, Any] = json.loads(line)
        return told

    try:
        yield ready
    finally:
        process.send_signal(signal.SIGTERM)
        process.end(10 * SCALE)


@contextmanager
def begun(*command: str) -> Iterator[dict[str, Any]]:
    """Run a program until the context is left; yields what it said when it was ready."""
    with warm(*command) as ready:
        yield ready()


@contextmanager
def _environment(more: Mapping[str, str]) -> Iterator[None]:
    before = {name: os.environ.get(name) for name in more}
    os.environ.update(more)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


def _run(
    module: str,
    arguments: tuple[str, ...],
    environment: dict[str, str],
    folder: Path,
    saying: Connection,
    log: Path | None,
) -> None:
    """Become the program."""
    os.environ.clear()
    os.environ.update(environment)
    os.chdir(folder)
    os.dup2(saying.fileno(), 1)
    saying.close()
    if log is not None:
        written = os.open(log, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o644)
        os.dup2(written, 2)
        os.close(written)
    sys.argv = [module, *arguments]
    try:
        runpy.run_module(module, run_name="__main__", alter_sys=True)
    finally:
        # A child of `multiprocessing` leaves these out.
        atexit._run_exitfuncs()
