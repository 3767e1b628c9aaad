"""`make keypad`: an emulated controller, its server, the bridge, and the keypad at this terminal.

Owns the port between the bridge and the keypad on screen. Everything else is as `openpendant start`
does it: they end together. Exit codes: 0 ended by its user, 1 a part failed, 2 wrong usage, no such
robot or no terminal, 69 a library is not installed, 128 + the signal that ended it.
"""

from __future__ import annotations

import argparse
import importlib
import sys
import tempfile
from contextlib import ExitStack
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from openpendant.motion.description.robot import serial_robot
from openpendant.motion.errors import MotionError

from .child_processes import (
    Interruptions,
    Part,
    Streams,
    process,
    ready,
)
from .console import ExitCode, complain
from .pendants.attaching import attach_command
from .pendants.connection_errors import DEFAULT_PORT
from .start import (
    EmulatedCell,
    kept_terminal,
    our_command,
    port_or_free,
    run_to_its_end,
    wait_for_an_end,
)

_HOST = "127.0.0.1"

_LIBRARIES = {"serial_asyncio": "pyserial-asyncio", "textual": "textual"}


@dataclass(frozen=True, slots=True)
class KeypadCell(EmulatedCell):
    """What is started."""

    @property
    def line(self) -> Path:
        """The port between the bridge and the keypad on screen."""
        return self.logs / "keypad"

    def bridge_command(self, port: int) -> list[str]:
        """Return the command of the bridge; `port` is the server's."""
        return our_command("keypad", "--port", str(self.line), "--server", f"{_HOST}:{port}")

    def keypad_command(self) -> list[str]:
        """Return the command of the keypad at this terminal."""
        return our_command("emulate-keypad", "--link", str(self.line))


def run(cell: KeypadCell, interruptions: Interruptions) -> None:
    """Run the cell, the bridge and the keypad until one of them ends.

    Raises:
        PartFailed: a part did not start, or ended before the keypad.
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
        bridge = start("the bridge", cell.bridge_command(port))
        print(f"{cell.robot} in T1; another pendant: {attach_command(_HOST, port)}", flush=True)
        stack.enter_context(kept_terminal())
        keypad = stack.enter_context(
            process("the keypad", cell.keypad_command(), streams=Streams.TERMINAL)
        )
        wait_for_an_end(keypad, (emulator, server, bridge), interruptions)


def main(argv: list[str]) -> int:
    """Run it with arguments; return the exit code."""
    arguments = parser().parse_args(argv)
    try:
        robot = serial_robot(arguments.robot)
    except MotionError as error:
        return _complain(str(error), ExitCode.USAGE)
    if not all(each.isatty() for each in (sys.stdin, sys.stdout, sys.stderr)):
        return _complain("this is no terminal for a keypad to be shown at", ExitCode.USAGE)
    for library, name in _LIBRARIES.items():
        try:
            importlib.import_module(library)
        except ModuleNotFoundError:
            text = f"this needs {name}, which is not installed: make keypad installs it"
            return _complain(text, ExitCode.UNAVAILABLE)
    cell = _cell(arguments, robot.name)
    return run_to_its_end(cell, partial(run, cell), "all four")


def _cell(arguments: argparse.Namespace, robot: str) -> KeypadCell:
    from openpendant.server.store.store_client import default_path

    return KeypadCell(
        robot=arguments.robot,
        pendant_port=port_or_free(DEFAULT_PORT),
        motion_port=0,
        state_port=0,
        store=arguments.store or str(default_path().with_name(f"start-{robot}.db")),
        logs=Path(tempfile.mkdtemp(prefix="openpendant-keypad-")),
    )


def parser() -> argparse.ArgumentParser:
    """Return the parser of the arguments."""
    reader = argparse.ArgumentParser(
        prog="make keypad",
        description="An emulated robot, its server, and the keypad pendant at this terminal, in T1."
        " ctrl+q ends all.",
    )
    reader.add_argument("--robot", default="ur5", help="robot name or file (default: %(default)s)")
    reader.add_argument("--store", metavar="FILE", help="file of programs (default: one a robot)")
    return reader


def _complain(text: str, code: int) -> int:
    complain(f"openpendant: {text}")
    return code


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
