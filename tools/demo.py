"""`openpendant demo`: an emulated controller, the server and a pendant, as three processes.

Starts them on free loopback ports, lets the pendant run its tour, stops them in order and reports:
what was planned against what the emulated robot did, as a plot and a table, and what the
emulator's referee found. Exit codes: 0 all went well, 1 something did not, 2 wrong usage,
128 + the signal that ended it.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

from .child_processes import (
    Interrupted,
    Interruptions,
    PartFailed,
    Streams,
    process,
    python_command,
    ready,
)
from .demo_report import DemoResult, summarise, write_csv, write_plot

TOUR_TIMEOUT = 120.0


@dataclass(frozen=True, slots=True)
class Journals:
    """Journal files of server and emulator, which hold every byte for a rerun."""

    server: Path
    emulator: Path


def run_demo(
    robot: str, work: Path, journals: Journals, interruptions: Interruptions
) -> DemoResult:
    """Run the three processes and the tour.

    Raises:
        PartFailed: a part did not start, ended early or refused a motion.
        Interrupted: a signal came; all processes are stopped.
    """
    referee, record = work / "referee.json", work / "executed.csv"
    plans, tour = work / "plans", work / "tour.json"
    with ExitStack() as stack:
        emulator = stack.enter_context(
            process(
                "the emulator",
                python_command(
                    "openpendant.controller_emulator",
                    *("--robot", robot, "--motion-port", "0", "--state-port", "0", "--json"),
                    *("--report", str(referee), "--record", str(record)),
                    *("--journal", str(journals.emulator)),
                ),
            )
        )
        controller = ready(emulator, interruptions)
        server = stack.enter_context(
            process(
                "the server",
                python_command(
                    "openpendant.server",
                    *("--robot", robot, "--pendant-port", "0", "--ros-motion-port", "0"),
                    *("--ros-state-port", "0", "--json", "--plans", str(plans)),
                    *("--journal", str(journals.server), "--store", "off"),
                    *("--controller", f"127.0.0.1:{controller['motion']}:{controller['state']}"),
                    *("--signals", "openpendant", "--emulated"),
                ),
            )
        )
        ports = ready(server, interruptions)
        _run_tour(ports["pendant"], tour, interruptions)
    with interruptions.welcome():
        return summarise(robot, tour, plans, record, referee, controller["origin_ns"] / 1e9)


def _run_tour(port: int, report: Path, interruptions: Interruptions) -> None:
    command = python_command(
        "openpendant.tools.pendants.demo_pendant", "--port", str(port), "--report", str(report)
    )
    # The pendant keeps the terminal: its table is what there is to see.
    with process("the pendant", command, streams=Streams.SHOWN) as pendant:
        try:
            with interruptions.welcome():
                code = pendant.process.wait(TOUR_TIMEOUT)
        except subprocess.TimeoutExpired:
            raise PartFailed(f"the pendant's tour took more than {TOUR_TIMEOUT:g} s") from None
    if code:
        raise PartFailed("the pendant's tour was not completed")


def _check_output(folder: Path) -> None:
    """Make the folder for plot and table; PartFailed where files cannot be written there."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        raise PartFailed(f"cannot write to the folder {folder}: {error.strerror}") from None


def _show(robot: str, output: Path, interruptions: Interruptions) -> int:
    """Run the demonstration, write plot and table, print the summary; return the exit code."""
    _check_output(output)
    stem = f"demo-{Path(robot).stem}"
    journals = Journals(output / f"{stem}-server.journal", output / f"{stem}-emulator.journal")
    for old in (journals.server, journals.emulator):
        old.unlink(missing_ok=True)
    with tempfile.TemporaryDirectory(prefix="openpendant-demo-") as work:
        result = run_demo(robot, Path(work), journals, interruptions)
    with interruptions.welcome():
        table = write_csv(result, output / f"{stem}.csv")
        plot = write_plot(result, output / f"{stem}.png")
        print(result.text())
        print(f"plot:  {plot}")
        print(f"table: {table}")
        print(f"again: openpendant packets rerun {journals.server} {journals.emulator}")
    return 0 if result.violations == 0 else 1


def main(argv: list[str]) -> int:
    """Run `openpendant demo` with arguments; return the exit code."""
    parser = argparse.ArgumentParser(
        prog="openpendant demo",
        description="An emulated robot controller, the pendant server and a small pendant move a"
        " robot on this machine; what was planned and what happened is plotted.",
    )
    parser.add_argument("--robot", default="ur5", help="robot name or file (default: %(default)s)")
    parser.add_argument(
        "--output", type=Path, default=Path("demo-output"), help="folder for plot and table"
    )
    arguments = parser.parse_args(argv)
    interruptions = Interruptions()
    with interruptions.installed():
        try:
            return _show(arguments.robot, arguments.output, interruptions)
        except BrokenPipeError:
            raise  # the command `openpendant` knows what to do when its reader went away
        except (PartFailed, OSError) as error:
            print(f"openpendant demo: {error}", file=sys.stderr)
            return 1
        except Interrupted as interruption:
            return 128 + interruption.number
