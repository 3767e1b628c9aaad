"""`openpendant start`: an emulated controller, the server and a terminal pendant, in T1.

Owns the cell file of such a cell, which is always an emulated one, its ports, the folder of its
logs, and that the three end together: whichever ends, the others end too. Exit codes: 0 ended by
its user, 1 a part failed, 2 wrong usage, no such robot or no terminal, 69 a library is not
installed, 128 + the signal that ended it.
"""

from __future__ import annotations

import argparse
import contextlib
import importlib
import json
import socket
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from openpendant.motion.description.robot import serial_robot
from openpendant.motion.errors import MotionError

from .child_processes import (
    Interrupted,
    Interruptions,
    Part,
    PartFailed,
    Streams,
    process,
    python_command,
    ready,
)
from .console import ExitCode, complain
from .pendants.attaching import attach_command
from .pendants.connection_errors import DEFAULT_PORT

_HOST = "127.0.0.1"
_LOOK = 0.1
"""Time between two looks at whether all parts still run [s]."""

ARGUMENTS_OF_AN_EMULATED_CELL = ("--signals", "openpendant", "--emulated")
"""Of `openpendant serve`: what is true of our emulator and of no real controller."""

_RESET_SCREEN = "\x1b[?1049l\x1b[?25h\x1b[?2004l\x1b[?1004l\x1b[<u\x1b[0m"
"""Back to the first screen, with a cursor; no reports of pasting, focus and key codes."""


@dataclass(frozen=True, slots=True)
class EmulatedCell:
    """What is started.

    Attributes:
        pendant_port: of the server; 0 for a free one.
        motion_port: of the emulator, as `state_port`; 0 for a free one.
        store: file of programs and other documents, or `off`.
        logs: folder of the cell file and of the logs.
    """

    robot: str
    pendant_port: int
    motion_port: int
    state_port: int
    store: str
    logs: Path

    @property
    def cell_file(self) -> Path:
        """The cell file, which `openpendant serve --config` takes."""
        return self.logs / "cell.toml"

    def robot_line(self) -> str:
        """Return the line of the cell file that names the robot."""
        return f"robot = {json.dumps(self.robot, ensure_ascii=False)}\n"

    def written(self) -> str:
        """Return the text of the cell file."""
        return f'{self.robot_line()}\n[modes]\ninitial = "manual_reduced"\n'

    def emulator_command(self) -> list[str]:
        """Return the command of the emulated controller."""
        ports = ("--motion-port", str(self.motion_port), "--state-port", str(self.state_port))
        return our_command("emulate", "--robot", self.robot, *ports, "--json")

    def server_command(self, motion: int, state: int) -> list[str]:
        """Return the command of the server.

        Args:
            motion: port of the controller, as `state`.
        """
        return our_command(
            "serve",
            *("--config", str(self.cell_file), "--controller", f"{_HOST}:{motion}:{state}"),
            *("--pendant-port", str(self.pendant_port), "--store", self.store),
            *("--ros-motion-port", "0", "--ros-state-port", "0", "--json"),
            *ARGUMENTS_OF_AN_EMULATED_CELL,
        )

    def pendant_command(self, port: int) -> list[str]:
        """Return the command of the pendant at this terminal; `port` is the server's."""
        return our_command("pendant", f"{_HOST}:{port}")


def our_command(*arguments: str) -> list[str]:
    """Return the command of `openpendant` with arguments, run by this interpreter."""
    return python_command("openpendant.tools", *arguments)


def run(cell: EmulatedCell, interruptions: Interruptions) -> None:
    """Run the cell and a pendant at this terminal until one of the three ends.

    Raises:
        PartFailed: a part did not start, or ended before the pendant.
        Interrupted: a signal came; all processes are stopped.
        OSError: the folder of the logs cannot be written.
    """
    cell.cell_file.write_text(cell.written(), encoding="utf-8")
    with ExitStack() as stack:

        def start(name: str, command: list[str]) -> Part:
            log = cell.logs / f"{name.rpartition(' ')[2]}.log"
            return stack.enter_context(process(name, command, log=log))

        emulator = start("the emulator", cell.emulator_command())
        controller = ready(emulator, interruptions)
        server = start("the server", cell.server_command(controller["motion"], controller["state"]))
        port = ready(server, interruptions)["pendant"]
        print(f"{cell.robot} in T1; another pendant: {attach_command(_HOST, port)}", flush=True)
        stack.enter_context(kept_terminal())
        pendant = stack.enter_context(
            process("the pendant", cell.pendant_command(port), streams=Streams.TERMINAL)
        )
        wait_for_an_end(pendant, (emulator, server), interruptions)


def wait_for_an_end(pendant: Part, others: tuple[Part, ...], interruptions: Interruptions) -> None:
    """Return when the user has ended the pendant; raise PartFailed where any part failed."""
    while True:
        with interruptions.welcome(), contextlib.suppress(subprocess.TimeoutExpired):
            if pendant.process.wait(_LOOK):
                raise pendant.ended()
            return
        for part in others:
            if part.process.poll() is not None:
                raise part.ended()


@contextmanager
def kept_terminal() -> Iterator[None]:
    """Leave the terminal as it was, even where the pendant was killed and could not."""
    import termios  # not on Windows, where no server runs

    terminal = sys.stdin.fileno()
    before = termios.tcgetattr(terminal)
    try:
        yield
    finally:
        if termios.tcgetattr(terminal) != before:
            termios.tcsetattr(terminal, termios.TCSADRAIN, before)
            print(_RESET_SCREEN, end="", flush=True)


def main(argv: list[str]) -> int:
    """Run `openpendant start` with arguments; return the exit code."""
    arguments = parser().parse_args(argv)
    try:
        robot = serial_robot(arguments.robot)
    except MotionError as error:
        return _complain(str(error), ExitCode.USAGE)
    if not all(each.isatty() for each in (sys.stdin, sys.stdout, sys.stderr)):
        return _complain("this is no terminal for a pendant to be shown at", ExitCode.USAGE)
    # Before anything starts; where it fails, the command says how to install it.
    importlib.import_module("textual")
    try:
        cell = _cell(arguments, robot.name)
    except OSError as error:
        return _complain(f"{arguments.logs}: {error.strerror}", ExitCode.USAGE)
    return run_to_its_end(cell, partial(run, cell), "all three")


def run_to_its_end(
    cell: EmulatedCell, run_parts: Callable[[Interruptions], None], all_parts: str
) -> int:
    """Run a cell; say in a line each why it ended and where its logs are; return the exit code.

    Args:
        run_parts: runs the parts until one of them ends.
        all_parts: what they are called together, such as "all three".
    """
    code: int = ExitCode.OK
    why = ""
    interruptions = Interruptions()
    with interruptions.installed():
        try:
            run_parts(interruptions)
        except (PartFailed, OSError) as error:
            code, why = ExitCode.FAILED, str(error)
        except Interrupted as interruption:
            code = 128 + interruption.number
        with contextlib.suppress(OSError):  # of a terminal that is gone
            if why:
                _complain(why, code)
            print(f"{all_parts} have ended; cell file and logs: {cell.logs}", flush=True)
    return code


def parser() -> argparse.ArgumentParser:
    """Return the parser of the arguments."""
    reader = argparse.ArgumentParser(
        prog="openpendant start",
        description="An emulated robot controller, the pendant server and a pendant at this"
        " terminal, in manual mode T1. The three end together: ctrl+q in the pendant ends all.",
        epilog="Exit codes: 0 ended by you, 1 a part failed, 2 wrong usage, no such robot or no"
        " terminal, 69 a library is not installed.",
    )
    reader.add_argument("--robot", default="ur5", help="robot name or file (default: %(default)s)")
    reader.add_argument(
        "--pendant-port",
        type=_port,
        metavar="PORT",
        help=f"of the server, 0: any free one (default: {DEFAULT_PORT}, or a free one)",
    )
    for name in ("motion", "state"):
        reader.add_argument(
            f"--{name}-port",
            type=_port,
            default=0,
            metavar="PORT",
            help="of the emulated controller (default: a free one)",
        )
    reader.add_argument(
        "--store",
        metavar="FILE",
        help='file of programs and other documents, "off" for none (default: one for each robot)',
    )
    reader.add_argument(
        "--logs", type=Path, metavar="FOLDER", help="for cell file and logs (default: a new one)"
    )
    return reader


def _port(text: str) -> int:
    if not (text.isascii() and text.isdigit() and int(text) <= 65535):
        raise argparse.ArgumentTypeError(f"{text!r} is no port; accepted: 0 to 65535")
    return int(text)


def _cell(arguments: argparse.Namespace, robot: str) -> EmulatedCell:
    # Imported here so that --help and wrong arguments answer without loading half a server.
    from openpendant.server.store.store_client import default_path

    logs = arguments.logs or Path(tempfile.mkdtemp(prefix="openpendant-start-"))
    logs.mkdir(parents=True, exist_ok=True)
    pendant_port = (
        port_or_free(DEFAULT_PORT) if arguments.pendant_port is None else arguments.pendant_port
    )
    return EmulatedCell(
        robot=arguments.robot,
        pendant_port=pendant_port,
        motion_port=arguments.motion_port,
        state_port=arguments.state_port,
        store=arguments.store or str(default_path().with_name(f"start-{robot}.db")),
        logs=logs,
    )


def port_or_free(port: int) -> int:
    """Return a port that commands use unless told otherwise; 0 where somebody has it."""
    with socket.socket() as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind((_HOST, port))
        except OSError:
            return 0
    return port


def _complain(text: str, code: int) -> int:
    complain(f"openpendant start: {text}")
    return code
