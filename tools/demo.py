"""`openpendant demo`: an emulated controller, the server and a pendant, as three processes.

Starts them on free loopback ports, lets the pendant run its tour, stops them in order and reports:
what was planned against what the emulated robot did, as a plot and a table, and what the
emulator's referee found. Exit codes: 0 all went well, 1 something did not, 2 wrong usage.
"""

from __future__ import annotations

import argparse
import json
import os
import queue
import signal
import subprocess
import sys
import tempfile
import threading
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import IO, Any

from .demo_report import DemoResult, summarise, write_csv, write_plot

READY_TIMEOUT = 30.0
TOUR_TIMEOUT = 120.0
STOP_TIMEOUT = 10.0


class DemoFailed(Exception):
    """A part of the demonstration did not do its work; the text says which and how."""


def _command(module: str, *arguments: str) -> list[str]:
    return [sys.executable, "-m", module, *arguments]


@contextmanager
def _process(name: str, command: list[str]) -> Iterator[subprocess.Popen[str]]:
    """Run a process for the length of the context; it is interrupted, then killed."""
    process = subprocess.Popen(
        command,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        text=True,
        # Ctrl-C is ours to handle: the parts are stopped in order, by process id.
        start_new_session=True,
        env={**os.environ, "MPLBACKEND": "Agg"},
    )
    try:
        yield process
    finally:
        if process.poll() is None:
            process.send_signal(signal.SIGTERM)
        try:
            process.wait(STOP_TIMEOUT)
        except subprocess.TimeoutExpired:
            print(f"demo: {name} does not end; killing it", file=sys.stderr)
            process.kill()
            process.wait()
        if process.stdout is not None:
            process.stdout.close()


def _ready(name: str, process: subprocess.Popen[str]) -> dict[str, Any]:
    """Return the ready line that a part prints as JSON.

    Raises:
        DemoFailed: it ended, or said nothing in time.
    """
    assert process.stdout is not None
    lines: queue.Queue[str] = queue.Queue()
    reader = threading.Thread(target=_forward, args=(process.stdout, lines), daemon=True)
    reader.start()
    try:
        line = lines.get(timeout=READY_TIMEOUT)
    except queue.Empty:
        raise DemoFailed(f"{name} was not ready within {READY_TIMEOUT:g} s") from None
    if not line:
        raise DemoFailed(f"{name} ended with exit code {process.wait(STOP_TIMEOUT)}")
    ready: dict[str, Any] = json.loads(line)
    return ready


def _forward(stream: IO[str], lines: queue.Queue[str]) -> None:
    """Pass the first line on and drain the rest, so that the process never blocks on a pipe."""
    lines.put(stream.readline())
    for _ in stream:
        continue


def run_demo(robot: str, output: Path, work: Path) -> DemoResult:
    """Run the three processes and the tour.

    Args:
        robot: name or file of the robot.
        output: folder for the plot and the table.
        work: folder for what the processes leave behind.

    Raises:
        DemoFailed: a part did not start, ended early or refused a motion.
    """
    referee, record = work / "referee.json", work / "executed.csv"
    plans, tour = work / "plans", work / "tour.json"
    with ExitStack() as stack:
        emulator = stack.enter_context(
            _process(
                "the emulator",
                _command(
                    "openpendant.controller_emulator",
                    *("--robot", robot, "--motion-port", "0", "--state-port", "0", "--json"),
                    *("--report", str(referee), "--record", str(record)),
                ),
            )
        )
        controller = _ready("the emulator", emulator)
        server = stack.enter_context(
            _process(
                "the server",
                _command(
                    "openpendant.server",
                    *("--robot", robot, "--pendant-port", "0", "--ros-motion-port", "0"),
                    *("--ros-state-port", "0", "--json", "--plans", str(plans)),
                    *("--controller", f"127.0.0.1:{controller['motion']}:{controller['state']}"),
                ),
            )
        )
        ports = _ready("the server", server)
        _run_tour(ports["pendant"], tour)
    return summarise(robot, tour, plans, record, referee, controller["origin_ns"] / 1e9)


def _run_tour(port: int, report: Path) -> None:
    command = _command(
        "openpendant.tools.pendants.demo_pendant", "--port", str(port), "--report", str(report)
    )
    # The pendant keeps the terminal: its table is what there is to see.
    pendant = subprocess.Popen(command, stdin=subprocess.DEVNULL)
    try:
        code = pendant.wait(TOUR_TIMEOUT)
    except subprocess.TimeoutExpired:
        raise DemoFailed(f"the pendant's tour took more than {TOUR_TIMEOUT:g} s") from None
    finally:
        if pendant.poll() is None:
            pendant.kill()
            pendant.wait()
    if code:
        raise DemoFailed("the pendant's tour was not completed")


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
    try:
        with tempfile.TemporaryDirectory(prefix="openpendant-demo-") as work:
            result = run_demo(arguments.robot, arguments.output, Path(work))
            arguments.output.mkdir(parents=True, exist_ok=True)
            stem = f"demo-{result.robot}"
            table = write_csv(result, arguments.output / f"{stem}.csv")
            plot = write_plot(result, arguments.output / f"{stem}.png")
    except (DemoFailed, OSError) as error:
        print(f"openpendant demo: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        return 130
    print(result.text())
    print(f"plot:  {plot}")
    print(f"table: {table}")
    return 0 if result.violations == 0 else 1
