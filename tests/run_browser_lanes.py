"""The command behind `make browser`: what the page shows, then how soon it lets go.

The tests of what a page shows run in two workers, each with a browser of its own: they wait for
what they are to see. Those whose times are bounded come after them in two that take turns: one
jogs and lets go, the other only sees to it that nothing moves again. Standard library only.
"""

import signal
import sys
import tempfile
from collections.abc import Sequence
from glob import glob
from pathlib import Path
from xml.etree import ElementTree

from run_lanes import CAME_TO_ITS_END, Run, exit_code, outcomes, tell_figures

ALL = "tests/browser/test_*.py"
TIMED = "tests/browser/test_holding*.py"
SHOWING_WORKERS = TIMED_WORKERS = 2
"""Of the two lanes. A browser that jogs beside the one that is timed made ramps begin up to 100 ms
later, so those of the second lane have a lock, see `hold_trials`."""


def lane_commands(arguments: Sequence[str]) -> list[tuple[str, list[str]]]:
    """Return each lane's name and what the interpreter is to be asked."""
    timed = sorted(glob(TIMED))
    showing = sorted(set(glob(ALL)) - set(timed))
    lanes = (("what it shows", showing, SHOWING_WORKERS), ("letting go", timed, TIMED_WORKERS))
    return [
        (name, ["-m", "pytest", *chosen, f"--workers={workers}", *arguments])
        for name, chosen, workers in lanes
    ]


def run_lanes(run: Run, arguments: Sequence[str]) -> None:
    """Run the lanes, until one of them does not come to its end."""
    with tempfile.TemporaryDirectory() as folder:
        for number, (name, command) in enumerate(lane_commands(arguments)):
            file = Path(folder, f"{number}.xml")
            lane = run.start(name, [sys.executable, *command, f"--junitxml={file}"])
            if not run.wait() or lane.exit_code not in CAME_TO_ITS_END or not file.exists():
                break
            lane.outcomes = outcomes(ElementTree.parse(file).getroot()[0])


def main(arguments: Sequence[str]) -> int:
    """Run the lanes, tell what came of them and return the exit code."""
    run = Run()
    run.obey(signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
    run_lanes(run, arguments)
    if run.ended_by is not None:
        sys.stderr.write("run_browser_lanes: ended before its time\n")
        return 128 + run.ended_by
    tell_figures(run.parts)
    return exit_code(run.parts)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
