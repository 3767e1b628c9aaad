"""Workers of a test run: processes forked from one that has collected the tests.

Owns who runs which test (`--workers=N`), and that all is told by the process that began them, as if
it had run the tests. With pytest-xdist, each worker imports and collects all tests by itself and
its messages are written in Python: 15,000 tests took 28 s more of the processor's time.
"""

import multiprocessing
import os
import signal
import traceback
import warnings
from collections import deque
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from itertools import groupby
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from typing import Any

import pytest
from _pytest.capture import CaptureManager
from _pytest.junitxml import LogXML

_FORK = multiprocessing.get_context("fork")

_Bunch = deque[int]
"""Tests that one worker runs one after the other, by their places in the list of all."""


def add_options(parser: pytest.Parser) -> None:
    """Add `--workers` and `--deal-tests` to the command line of pytest."""
    parser.addoption(
        "--workers", type=int, default=0, metavar="N", help="run tests in so many processes"
    )
    parser.addoption(
        "--deal-tests",
        action="store_true",
        help="deal tests out to the workers one by one, not in whole files",
    )


def configure(config: pytest.Config) -> None:
    """Have workers run the tests where they are asked for; `--pdb` needs the terminal itself."""
    if (count := config.getoption("--workers")) and not config.getoption("usepdb"):
        plugin = Workers(count, whole_files=not config.getoption("--deal-tests"))
        config.pluginmanager.register(plugin, "workers")


class Workers:
    """Plugin of pytest: deals the tests out, and tells what comes of them."""

    def __init__(self, count: int, *, whole_files: bool) -> None:
        """Start none until the tests are collected.

        Args:
            whole_files: what the tests of a file share is built once.
        """
        self._count = count
        self._whole_files = whole_files

    @pytest.hookimpl(tryfirst=True)
    def pytest_runtestloop(self, session: pytest.Session) -> object:
        """Run the tests, unless pytest's own loop has a reason to run none."""
        config = session.config
        if session.testsfailed or config.getoption("collectonly") or not session.items:
            return None
        if (reporter := config.pluginmanager.get_plugin("terminalreporter")) is not None:
            reporter.showfspath = False  # files of several workers take turns
        with _Crew(session, self._bunches(session.items)) as crew:
            crew.run(self._count)
        if session.shouldfail:
            raise session.Failed(session.shouldfail)
        if session.shouldstop:
            raise session.Interrupted(session.shouldstop)
        return True

    def _bunches(self, items: list[pytest.Item]) -> deque[_Bunch]:
        places = range(len(items))
        if not self._whole_files:
            return deque(deque([place]) for place in places)
        return deque(deque(bunch) for _, bunch in groupby(places, lambda at: items[at].path))


@dataclass(eq=False, slots=True)
class _Worker:
    """A worker, as the process that began it knows it.

    Attributes:
        left: what it has been dealt and not told of; it runs them in this order.
    """

    process: BaseProcess
    connection: Connection
    left: _Bunch


class _Crew:
    """All workers of a run, and what is not dealt out yet."""

    def __init__(self, session: pytest.Session, bunches: deque[_Bunch]) -> None:
        self._session = session
        self._config = session.config
        self._bunches = bunches
        self._workers: dict[Connection, _Worker] = {}

    def __enter__(self) -> "_Crew":
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        """Wait until all have taken down what they began; kill them where that is cut short."""
        processes = [worker.process for worker in self._workers.values()]
        try:
            # Whoever interrupts this process by its terminal interrupts the workers, too.
            if kind is not KeyboardInterrupt:
                for process in processes:
                    if process.pid is not None and process.is_alive():
                        os.kill(process.pid, signal.SIGINT)
            for process in processes:
                process.join()
        finally:
            for process in processes:
                process.kill()

    def run(self, count: int) -> None:
        """Deal all out to so many workers, until there is a reason to end early."""
        while self._workers or self._bunches:
            while self._bunches and len(self._workers) < count:
                self._start()
            for connection in wait(list(self._workers)):
                assert isinstance(connection, Connection)
                self._hear(self._workers[connection])
                if self._session.shouldfail or self._session.shouldstop:
                    return

    def _start(self) -> None:
        ours, theirs = _FORK.Pipe()
        process = _FORK.Process(target=_work, args=(self._session, theirs))
        process.start()
        theirs.close()
        self._workers[ours] = _Worker(process, ours, deque())

    def _hear(self, worker: _Worker) -> None:
        """Take one message of a worker, or that it has ended."""
        try:
            kind, told = worker.connection.recv()
        except (EOFError, ConnectionResetError):
            self._ended(worker)
            return
        match kind:
            case "asks":
                bunch = self._bunches.popleft() if self._bunches else None
                worker.left.extend(bunch or ())
                with suppress(BrokenPipeError):  # it has died; that is heard next
                    worker.connection.send(bunch)
            case "ran":
                self._tell(self._session.items[worker.left.popleft()], told)
            case "warned":
                self._config.hook.pytest_warning_recorded.call_historic(kwargs=told)
            case _:
                raise RuntimeError(f"a worker broke:\n{told}")

    def _ended(self, worker: _Worker) -> None:
        """Take down that a worker has ended; what it died of fails, and others run the rest."""
        del self._workers[worker.connection]
        worker.connection.close()
        worker.process.join()
        if worker.left:
            item = self._session.items[worker.left.popleft()]
            why = f"the worker ended with exit code {worker.process.exitcode} in this test"
            report = pytest.TestReport(
                item.nodeid, item.location, {}, outcome="failed", longrepr=why, when="call"
            )
            self._tell(item, [report])
        if worker.left:
            self._bunches.appendleft(worker.left)

    def _tell(self, item: pytest.Item, reports: list[pytest.TestReport]) -> None:
        """Tell what came of a test, as the loop of pytest does."""
        hook = self._config.hook
        hook.pytest_runtest_logstart(nodeid=item.nodeid, location=item.location)
        for report in reports:
            hook.pytest_runtest_logreport(report=report)
        hook.pytest_runtest_logfinish(nodeid=item.nodeid, location=item.location)


def _work(session: pytest.Session, connection: Connection) -> None:
    """Be a worker: run what is dealt out, until there is no more."""
    config = session.config
    try:
        _become_worker(config, connection)
        _run_all(session, connection)
        config.hook.pytest_sessionfinish(session=session, exitstatus=pytest.ExitCode.OK)
    except KeyboardInterrupt:
        config.hook.pytest_sessionfinish(session=session, exitstatus=pytest.ExitCode.INTERRUPTED)
    except Exception:
        connection.send(("broke", traceback.format_exc()))


def _become_worker(config: pytest.Config, connection: Connection) -> None:
    """Have this process tell its parent, and nobody else."""
    plugins = config.pluginmanager
    for plugin in plugins.get_plugins():
        if isinstance(plugin, (Workers, LogXML, pytest.TerminalReporter)):
            plugins.unregister(plugin)
    # Plugins know a worker, who must not write what is kept from one run to the next, by this.
    vars(config)["workerinput"] = {"workerid": str(os.getpid())}
    # What is captured goes to a file, and a fork shares its place in it.
    capture = plugins.get_plugin("capturemanager")
    assert isinstance(capture, CaptureManager)
    capture.stop_global_capturing()
    capture.start_global_capturing()
    capture.suspend_global_capture()
    teller = _Teller(connection)
    plugins.register(teller, "teller")
    teller.begin()


def _run_all(session: pytest.Session, connection: Connection) -> None:
    dealt = _dealt_out(session, connection)
    item = next(dealt, None)
    while item is not None:
        # Known beforehand, so that what both need outlives the first.
        following = next(dealt, None)
        session.config.hook.pytest_runtest_protocol(item=item, nextitem=following)
        item = following


def _dealt_out(session: pytest.Session, connection: Connection) -> Iterator[pytest.Item]:
    while True:
        connection.send(("asks", None))
        bunch: _Bunch | None = connection.recv()
        if bunch is None:
            return
        for place in bunch:
            yield session.items[place]


class _Teller:
    """Plugin of a worker's pytest: tells its parent what comes of each test."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection
        self._reports: list[pytest.TestReport] = []
        self._begun = False

    def begin(self) -> None:
        """Tell warnings from now on: at its registration it is given those that were before."""
        self._begun = True

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Keep it until the test has ended."""
        self._reports.append(report)

    def pytest_runtest_logfinish(self) -> None:
        """Tell all of a test at once."""
        self._connection.send(("ran", self._reports))
        self._reports = []

    def pytest_warning_recorded(
        self,
        warning_message: warnings.WarningMessage,
        when: str,
        nodeid: str,
        location: tuple[str, int, str] | None,
    ) -> None:
        """Tell it at once."""
        if not self._begun:
            return
        told: dict[str, Any] = {
            "warning_message": warning_message,
            "when": when,
            "nodeid": nodeid,
            "location": location,
        }
        self._connection.send(("warned", told))
