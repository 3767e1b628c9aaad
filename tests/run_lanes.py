"""The command behind `make test` and `make soak`: lanes of tests, one after the other.

Owns what runs beside what, how a run is ended before its time, and what is printed at its end.
Which test belongs to which lane, `lanes.py` knows. Standard library only.
"""

import argparse
import ctypes
import os
import resource
import shlex
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO
from xml.etree import ElementTree

from coverage_counts import counts, least, lost

PROCESS_WORKERS = 3
"""On two cores: they wait for robots half of the time. With four, single tests took over 3 s."""

REAL_TIME_WORKERS = 2
"""Three took a quarter less time, but storms of one were late for another, and tests failed."""

COMPUTING = "computing"

LANES = (COMPUTING, "processes", "real-time")
"""As `pytest --lane` calls them, in the order in which they run."""

SOAK = (
    "-m",
    "soak or conformance or hypothesis or promise",
    "--hypothesis-profile=soak",
    "--timeout=3600",
)

PASSED, FAILED, EMPTY = 0, 1, 5
CAME_TO_ITS_END = (PASSED, FAILED, EMPTY)
"""Exit codes of pytest."""

GRACE = 20.0
"""So long may what is interrupted take down what it began [s]; then it is killed."""

_TURN = 0.1
"""Between two looks at what has ended [s]."""

_PR_SET_CHILD_SUBREAPER = 36

_EXPLAINED = """\
First the tests that compute, in so many workers, and beside them the commands of --beside. When all
of these have ended, the tests of whole processes, in four workers, then the others on the real
clock, in two with nothing beside them; with --soak one after the other in one process. What stands
after -- reaches pytest in each lane; a file of --junitxml gets the results of all. For --pdb call
pytest itself.

Exit codes: 0 all passed; 1 a test or a command failed, or less is covered than
tests/coverage_counts.toml demands; 5 there was no test in any lane; 128 + n ended by signal n.
"""


@dataclass(eq=False, slots=True)
class Part:
    """A process of the run, and all that it starts.

    Attributes:
        process: leads a process group of its own.
        output: what it said, where that is kept.
        began: when, by the monotonic clock [s].
        exit_code: None while it runs.
        wall: how long it ran [s].
        processor: time that it took, and all that it waited for [s].
        outcomes: how many tests passed, failed and were skipped; empty where it ran none.
    """

    name: str
    process: subprocess.Popen[bytes]
    output: IO[bytes] | None = None
    began: float = field(default_factory=time.monotonic)
    exit_code: int | None = None
    wall: float = 0.0
    processor: float = 0.0
    outcomes: dict[str, int] = field(default_factory=dict)


class Run:
    """Processes that run beside each other, and how they end.

    Attributes:
        ended_by: the signal that ended the run before its time; None for none.
    """

    def __init__(self, grace: float = GRACE) -> None:
        """Begin with none.

        Args:
            grace: from the interruption to the kill [s].
        """
        self.parts: list[Part] = []
        self.ended_by: int | None = None
        self._grace = grace

    def obey(self, *numbers: signal.Signals) -> None:
        """End by signals, but those that whoever started this has ignored."""
        for number in numbers:
            if signal.getsignal(number) is not signal.SIG_IGN:
                signal.signal(number, self._end_by)

    def start(self, name: str, command: Sequence[str], *, keep: bool = False) -> Part:
        """Start a process; what it says is shown at once, or kept."""
        output = tempfile.TemporaryFile() if keep else None
        process = subprocess.Popen(
            command,
            stdin=subprocess.DEVNULL,
            stdout=output,
            stderr=None if output is None else subprocess.STDOUT,
            process_group=0,
        )
        part = Part(name, process, output)
        self.parts.append(part)
        return part

    def wait(self) -> bool:
        """Wait until all have ended and leave nothing of theirs; return whether they were let."""
        while self._running() and self.ended_by is None:
            self._look()
        if self.ended_by is not None:
            self._signal(signal.SIGINT)
            until = time.monotonic() + self._grace
            while self._running() and time.monotonic() < until and self._grace:
                self._look()
            self._signal(signal.SIGKILL)
        self._kill_what_is_left()
        return self.ended_by is None

    def _end_by(self, number: int, _frame: object) -> None:
        """Take down a signal; whoever sends a second one does not want to wait."""
        if self.ended_by is not None:
            self._grace = 0.0
        self.ended_by = number

    def _running(self) -> list[Part]:
        return [part for part in self.parts if part.exit_code is None]

    def _signal(self, number: signal.Signals) -> None:
        """Send a signal to the groups of those that run, as a terminal does."""
        for part in self._running():
            os.killpg(part.process.pid, number)

    def _look(self) -> None:
        """Take down what has ended, or wait a little."""
        pid, status, usage = os.wait3(os.WNOHANG)
        if pid:
            self._reap(pid, status, usage)
        else:
            time.sleep(_TURN)

    def _reap(self, pid: int, status: int, usage: resource.struct_rusage) -> None:
        """Take down that a child has ended; an orphan's time counts for what was started last."""
        part = next((part for part in self._running() if part.process.pid == pid), self.parts[-1])
        part.processor += usage.ru_utime + usage.ru_stime
        if part.process.pid == pid:
            part.exit_code = part.process.returncode = os.waitstatus_to_exitcode(status)
            part.wall = time.monotonic() - part.began

    def _kill_what_is_left(self) -> None:
        """Kill children until there are none: orphans of those that are killed come here, too."""
        while pids := _children():
            for pid in pids:
                os.kill(pid, signal.SIGKILL)
                self._reap(*os.wait4(pid, 0))


def run_lanes(run: Run, workers: int, pytest_arguments: Sequence[str], *, soak: bool) -> None:
    """Run the lanes, until one of them does not come to its end."""
    arguments, wanted = junit_taken_out(pytest_arguments)
    suites: list[ElementTree.Element] = []
    with tempfile.TemporaryDirectory() as folder:
        for name, command in lane_commands(workers, arguments, soak=soak):
            file = Path(folder, f"{name}.xml")
            lane = run.start(name, [sys.executable, *command, f"--junitxml={file}"])
            if not run.wait() or lane.exit_code not in CAME_TO_ITS_END or not file.exists():
                break
            suites += ElementTree.parse(file).getroot()
            lane.outcomes = outcomes(suites[-1])
    if wanted is not None:
        all_lanes = ElementTree.Element("testsuites")
        all_lanes.extend(suites)
        ElementTree.ElementTree(all_lanes).write(wanted, encoding="utf-8", xml_declaration=True)


def lane_commands(
    workers: int, arguments: Sequence[str], *, soak: bool
) -> list[tuple[str, list[str]]]:
    """Return each lane's name and what the interpreter is to be asked."""
    crowds = (workers, PROCESS_WORKERS, REAL_TIME_WORKERS)
    # What is measured is measured by itself; a soak's longest tests keep nobody waiting.
    asked = ["--deal-tests", *SOAK] if soak else []
    return [
        (
            lane,
            [
                *("-m", "pytest", f"--lane={lane}"),
                f"--workers={crowd if lane == COMPUTING or not soak else 0}",
                *asked,
                *arguments,
            ],
        )
        for lane, crowd in zip(LANES, crowds, strict=True)
    ]


def junit_taken_out(arguments: Sequence[str]) -> tuple[list[str], Path | None]:
    """Return arguments of pytest without the file that takes the results, and that file."""
    parser = argparse.ArgumentParser(add_help=False, allow_abbrev=False)
    parser.add_argument("--junitxml", "--junit-xml", type=Path)
    found, rest = parser.parse_known_args(arguments)
    return rest, found.junitxml


def outcomes(suite: ElementTree.Element) -> dict[str, int]:
    """Return how many tests of a lane passed, failed and were skipped."""
    counted = {"passed": 0, "failed": 0, "skipped": 0}
    for case in suite.iter("testcase"):
        told = {child.tag for child in case}
        failed = bool(told & {"failure", "error"})
        counted["failed" if failed else "skipped" if "skipped" in told else "passed"] += 1
    return counted


def exit_code(parts: Sequence[Part]) -> int:
    """Return that of the run: a lane may be empty, not all."""
    kept = {part.exit_code for part in parts if part.output is not None}
    lanes = {part.exit_code for part in parts if part.output is None}
    if kept - {PASSED} or lanes - {PASSED, EMPTY}:
        return FAILED
    return PASSED if PASSED in lanes else EMPTY


def tell_kept_output(parts: Sequence[Part]) -> None:
    """Print the whole of what was kept."""
    for part in parts:
        if part.output is not None:
            part.output.seek(0)
            _tell(f"\n{part.name}:\n{part.output.read().decode(errors='replace')}")


def tell_figures(parts: Sequence[Part]) -> None:
    """Print a line for each part: outcomes, wall time and processor time."""
    width = max(len(part.name) for part in parts)
    _tell(f"\n{'':{width}}   passed   failed  skipped     wall  processor\n")
    for part in parts:
        said = "passed" if part.exit_code == PASSED else "failed"
        shown = [f"{count:,}" for count in part.outcomes.values()] or [said, "", ""]
        columns = " ".join(f"{each:>8}" for each in shown)
        _tell(f"{part.name:{width}} {columns} {part.wall:6.1f} s {part.processor:8.1f} s\n")
    wall = max(part.began + part.wall for part in parts) - parts[0].began
    processor = sum(part.processor for part in parts)
    _tell(f"{'all':{width}} {'':26} {wall:6.1f} s {processor:8.1f} s\n")
    for part in parts:
        if part.exit_code not in (PASSED, EMPTY):
            _tell(f"ERROR: {part.name} ended with exit code {part.exit_code}\n")


def tell_coverage() -> bool:
    """Print how much is covered; return whether that is enough."""
    counted = counts()
    _tell(f"covered: {', '.join(f'{number:,} {name}' for name, number in counted.items())}\n")
    losses = lost(counted, least())
    for loss in losses:
        _tell(f"ERROR: {loss}\n")
    return not losses


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the lanes, tell what came of them and return the exit code."""
    asked = _parser().parse_args(arguments)
    _adopt_orphans()
    # Workers fill the processors already; threads of small products of matrices only wait in them.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    run = Run()
    run.obey(signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
    for command in asked.beside:
        run.start(command, shlex.split(command), keep=True)
    run_lanes(run, asked.workers, asked.pytest_arguments, soak=asked.soak)
    if run.ended_by is not None:
        sys.stderr.write("run_lanes: ended before its time\n")
        return 128 + run.ended_by
    tell_kept_output(run.parts)
    tell_figures(run.parts)
    return exit_code(run.parts) if tell_coverage() else FAILED


def _adopt_orphans() -> None:
    """Have what loses its parent become a child of this process, so that none is left (Linux)."""
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_PR_SET_CHILD_SUBREAPER, 1, 0, 0, 0)


def _children() -> list[int]:
    """Return the children of this process, as far as the system tells."""
    own = str(os.getpid())
    found = []
    for file in Path("/proc").glob("[0-9]*/stat"):
        try:
            parent = file.read_text(errors="replace").rpartition(")")[2].split()[1]
        except (FileNotFoundError, ProcessLookupError):
            continue
        if parent == own:
            found.append(int(file.parent.name))
    return found


def _tell(text: str) -> None:
    sys.stdout.write(text)
    sys.stdout.flush()


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="run_lanes.py",
        description=_EXPLAINED,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument(
        "--soak", action="store_true", help="the long tests, and all examples at length"
    )
    parser.add_argument(
        "--workers", type=int, default=2, metavar="N", help="those of the first lane (WORKERS=)"
    )
    parser.add_argument(
        "--beside",
        action="append",
        default=[],
        metavar="COMMAND",
        help="runs beside the first lane; its output is shown at the end; again for more",
    )
    parser.add_argument("pytest_arguments", nargs="*", metavar="ARGUMENT", help="(PYTEST_ARGS=)")
    return parser


if __name__ == "__main__":
    sys.exit(main())
