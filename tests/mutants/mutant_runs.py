"""Runs the tests of a row on the faulty code, in a process of its own, and judges how they ended.

Owns the verdicts. A row's tests run on the code as it is first, once for each set of tests: where
they fail, or are not there, a later failure tells nothing. Then they run with the fault planted;
tests on the real clock get no second try. The fault is found where a test fails, or where the tests
do not end in time although they end in a third of it on the code as it is. A row fails, and
counts neither as found nor as survived, where its text is not there exactly once, where no process
imported the fault, or where pytest ended otherwise than by tests that ran.
"""

import contextlib
import enum
import os
import re
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from mutants.mutant_table import FOLDER, ROOT, Mutant
from mutants.planting import planted_fault

ROW_SECONDS = 60.0
"""Longest run of a row's tests [s]."""

PYTEST = ("-x", "-q", "-p", "no:cacheprovider", "-p", "no:attempts")
"""How the tests of a row run: up to the first failure, without second tries on the real clock."""

PROJECT = ("--hypothesis-profile=mutants",)
"""What the tests of this project take on top: no time is spent on shrinking what was found."""

VARIABLE = "OPENPENDANT_MUTANT"
"""Names the folder of the fault to every process of a run; `planting/sitecustomize.py` reads it."""

_PASSED, _FAILED = 0, 1  # exit codes of pytest
_SAID = re.compile(r"^(?:FAILED|ERROR) (.*)$", re.MULTILINE)
_LOG_TAIL = 2_000
_POLL = 0.02  # [s]


class Verdict(enum.Enum):
    FOUND = "found"
    HUNG = "found by its hang"
    SURVIVED = "SURVIVED"
    EQUIVALENT = "equivalent"
    FAILED = "ROW FAILED"

    @property
    def found(self) -> bool:
        return self in (Verdict.FOUND, Verdict.HUNG)


@dataclass(frozen=True, slots=True)
class Outcome:
    """What became of a row.

    Attributes:
        row: the row.
        verdict: how it ended.
        seconds: how long its tests ran with the fault [s].
        said: the test that found it and why, or what was wrong with the row.
    """

    row: Mutant
    verdict: Verdict
    seconds: float = 0.0
    said: str = ""


@dataclass(frozen=True, slots=True)
class TestRun:
    """One run of pytest; `code` is None where it did not end in time."""

    __test__ = False

    code: int | None
    seconds: float
    log: str

    @property
    def said(self) -> str:
        if (line := _SAID.search(self.log)) is not None:
            return line[1]
        return self.log.strip()[-_LOG_TAIL:]


class MutantRuns:
    """Judges rows; may be asked by several threads."""

    def __init__(
        self, root: Path = ROOT, seconds: float = ROW_SECONDS, options: Sequence[str] = PROJECT
    ) -> None:
        """Run nothing yet.

        Args:
            root: of the project.
            seconds: longest run of a row's tests [s].
            options: for pytest, on top of `PYTEST`.
        """
        self._root = root.resolve()
        self._seconds = seconds
        self._options = (*PYTEST, *options)
        self._unchanged: dict[tuple[str, ...], TestRun] = {}
        self._running: set[subprocess.Popen[bytes]] = set()
        self._lock = threading.Lock()
        self._ended = False

    def run_unchanged(self, tests: tuple[str, ...]) -> TestRun:
        """Run a set of tests on the code as it is; its result stays known."""
        if tests not in self._unchanged:
            with tempfile.TemporaryDirectory(prefix="mutant") as folder:
                self._unchanged[tests] = self._run(tests, Path(folder), planted=False)
        return self._unchanged[tests]

    def judge(self, row: Mutant) -> Outcome:
        """Plant a row's fault and return what its tests said; an equivalent one is not planted."""
        if row.equivalent is not None:
            return Outcome(row, Verdict.EQUIVALENT, said=row.equivalent)
        try:
            file = (self._root / row.file).resolve(strict=True)
            changed = row.changed(file.read_text(encoding="utf-8"))
            compile(changed, row.file, "exec", dont_inherit=True)
        except (OSError, ValueError, SyntaxError) as error:
            return Outcome(row, Verdict.FAILED, said=str(error))
        unchanged = self.run_unchanged(row.tests)
        if unchanged.code != _PASSED:
            why = "do not end in time" if unchanged.code is None else "do not pass"
            said = f"its tests {why} on the code as it is: {unchanged.said}"
            return Outcome(row, Verdict.FAILED, unchanged.seconds, said)
        with tempfile.TemporaryDirectory(prefix="mutant") as name:
            folder = Path(name)
            (folder / planted_fault.FILE).write_text(str(file), encoding="utf-8")
            (folder / planted_fault.CHANGED).write_text(changed, encoding="utf-8", newline="")
            ran = self._run(row.tests, folder, planted=True)
            loaded = (folder / planted_fault.LOADED).exists()
        return judged(row, ran, loaded, unchanged.seconds < self._seconds / 3)

    def end(self) -> None:
        """End what runs, with everything that it started; nothing more is run."""
        with self._lock:
            self._ended = True
            for process in self._running:
                _kill(process)

    def _run(self, tests: Sequence[str], folder: Path, *, planted: bool) -> TestRun:
        environment = {name: value for name, value in os.environ.items() if "PYTEST" not in name}
        environment.pop(VARIABLE, None)
        environment["COLUMNS"] = "200"  # so that pytest's summary says what failed, and why
        if planted:
            path = (str(FOLDER / "planting"), environment.get("PYTHONPATH", ""))
            environment["PYTHONPATH"] = os.pathsep.join(path).rstrip(os.pathsep)
            environment[VARIABLE] = str(folder)
        command = [sys.executable, "-m", "pytest", *self._options, *tests]
        command.append(f"--basetemp={folder / 'tmp'}")
        log = folder / "log"
        began = time.monotonic()
        with log.open("wb") as output:
            with self._lock:
                if self._ended:
                    return TestRun(None, 0.0, "ended")
                process = subprocess.Popen(
                    command,
                    cwd=self._root,
                    env=environment,
                    stdin=subprocess.DEVNULL,
                    stdout=output,
                    stderr=subprocess.STDOUT,
                    start_new_session=True,
                )
                self._running.add(process)
            try:
                in_time = _ends_within(process, self._seconds)
            finally:
                with self._lock:
                    _kill(process)  # what a test started may have outlived it
                    self._running.discard(process)
                code = process.wait()
        text = log.read_text(encoding="utf-8", errors="replace")
        return TestRun(code if in_time else None, time.monotonic() - began, text)


def judged(row: Mutant, ran: TestRun, loaded: bool, quick: bool) -> Outcome:
    """Return the verdict on a run with the fault planted.

    Args:
        row: the row.
        ran: how its tests ended.
        loaded: whether a process imported the fault.
        quick: whether its tests end early enough on the code as it is to tell a hang.
    """
    if not loaded:
        said = f"no process of its tests imported {row.file}: the fault was not planted"
        return Outcome(row, Verdict.FAILED, ran.seconds, said)
    if ran.code == _PASSED:
        return Outcome(row, Verdict.SURVIVED, ran.seconds)
    if ran.code == _FAILED:
        return Outcome(row, Verdict.FOUND, ran.seconds, ran.said)
    if ran.code is None and quick:
        return Outcome(row, Verdict.HUNG, ran.seconds, "its tests do not end with the fault")
    how = "did not end in time" if ran.code is None else f"ended with exit code {ran.code}"
    said = f"pytest {how}, which tells nothing: {ran.said}"
    return Outcome(row, Verdict.FAILED, ran.seconds, said)


def _ends_within(process: subprocess.Popen[bytes], seconds: float) -> bool:
    """Wait for a process to end, but leave its number taken: its group is killed by it."""
    given_up = time.monotonic() + seconds
    while os.waitid(os.P_PID, process.pid, os.WEXITED | os.WNOWAIT | os.WNOHANG) is None:
        if time.monotonic() > given_up:
            return False
        time.sleep(_POLL)
    return True


def _kill(process: subprocess.Popen[bytes]) -> None:
    """Kill a run's whole group of processes; the first one must not have been waited for."""
    with contextlib.suppress(ProcessLookupError, PermissionError):
        os.killpg(process.pid, signal.SIGKILL)
