"""`make pendant`: an emulated controller, its server, and the pendant as a page for browsers.

Owns that the gateway's secret is made anew for each run, for nobody else's eyes, and that the page
is opened where there is a desktop. Everything else is as `openpendant start` does it: the three
end together. Exit codes: 0 ended by its user, 1 a part failed, 2 wrong usage or no such robot, 69 a
library is not installed, 128 + the signal that ended it.
"""

from __future__ import annotations

import argparse
import contextlib
import importlib
import os
import secrets
import sys
import tempfile
import webbrowser
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

from openpendant.motion.description.robot import serial_robot
from openpendant.motion.errors import MotionError

from .child_processes import Interrupted, Interruptions, Part, PartFailed, process, ready
from .console import ExitCode, complain
from .pendants.connection_errors import DEFAULT_PORT
from .start import EmulatedCell, our_command, port_or_free, wait_for_an_end

_HOST = "127.0.0.1"
_PAGE_PORT = 8080
_GATEWAY = "web"


@dataclass(frozen=True, slots=True)
class PageCell(EmulatedCell):
    """What is started.

    Attributes:
        page_port: of the gateway; 0 for a free one.
        has_keypad: the page has a keypad, and a bridge serves it.
    """

    page_port: int = _PAGE_PORT
    has_keypad: bool = False

    @property
    def secret_file(self) -> Path:
        """What the server believes the gateway by."""
        return self.logs / "gateway.secret"

    def written(self) -> str:
        """Return the text of the cell file: in automatic mode, as a server starts."""
        table = f'[[gateways]]\nname = "{_GATEWAY}"\naddress = "{_HOST}"\n'
        return f"{self.robot_line()}\n{table}secret_file = {str(self.secret_file)!r}\n"

    def gateway_command(self, port: int) -> list[str]:
        """Return the command of the gateway; `port` is the server's."""
        return our_command(
            *("web", "--server", f"emulated={_HOST}:{port}", "--port", str(self.page_port)),
            *("--gateway", _GATEWAY, "--secret-file", str(self.secret_file), "--json"),
            *(("--keypad", "0") if self.has_keypad else ()),
        )

    def bridge_command(self, line: str, port: int) -> list[str]:
        """Return the command of the keypad's bridge.

        Args:
            line: where the gateway says that it comes.
            port: the server's.
        """
        return our_command("keypad", "--port", line, "--server", f"{_HOST}:{port}")


def run(cell: PageCell, interruptions: Interruptions, *, opens: bool) -> None:
    """Run the cell and its page until one of their parts ends.

    Raises:
        PartFailed: a part did not start, or ended.
        Interrupted: a signal came; all processes are stopped.
        OSError: the folder of the logs cannot be written.
    """
    descriptor = os.open(cell.secret_file, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
    with os.fdopen(descriptor, "w") as file:
        file.write(f"{secrets.token_hex(32)}\n")
    cell.cell_file.write_text(cell.written(), encoding="utf-8")
    with ExitStack() as stack:

        def start(name: str, command: list[str]) -> Part:
            log = cell.logs / f"{name.rpartition(' ')[2]}.log"
            return stack.enter_context(process(name, command, log=log))

        emulator = start("the emulator", cell.emulator_command())
        controller = ready(emulator, interruptions)
        server = start("the server", cell.server_command(controller["motion"], controller["state"]))
        port = ready(server, interruptions)["pendant"]
        gateway = start("the gateway", cell.gateway_command(port))
        served = ready(gateway, interruptions)
        page = served["page"]
        others: tuple[Part, ...] = (emulator, server)
        if cell.has_keypad:
            bridge = start("the bridge", cell.bridge_command(served["keypad"], port))
            others = (*others, bridge)
        print(f"{cell.robot}, emulated. The pendant is at {page} (Ctrl-C ends all)", flush=True)
        if opens:
            webbrowser.open(page)
        wait_for_an_end(gateway, others, interruptions)


def has_desktop() -> bool:
    """Return True if a page would be opened in a window of this user."""
    if os.environ.get("CI") or os.environ.get("SSH_CONNECTION"):
        return False
    shown = os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
    return sys.platform in ("darwin", "win32") or bool(shown)


def main(argv: list[str]) -> int:
    """Run it with arguments; return the exit code."""
    arguments = parser().parse_args(argv)
    try:
        robot = serial_robot(arguments.robot)
    except MotionError as error:
        return _complain(str(error), ExitCode.USAGE)
    try:
        importlib.import_module("aiohttp")
    except ModuleNotFoundError:
        text = "this needs aiohttp, which is not installed: make pendant installs it"
        return _complain(text, ExitCode.UNAVAILABLE)
    from openpendant.server.store.store_client import default_path

    logs = Path(tempfile.mkdtemp(prefix="openpendant-page-"))
    cell = PageCell(
        robot=arguments.robot,
        pendant_port=port_or_free(DEFAULT_PORT),
        motion_port=0,
        state_port=0,
        store=arguments.store or str(default_path().with_name(f"start-{robot.name}.db")),
        logs=logs,
        page_port=port_or_free(_PAGE_PORT) if arguments.port is None else arguments.port,
        has_keypad=arguments.keypad,
    )
    code: int = ExitCode.OK
    interruptions = Interruptions()
    with interruptions.installed():
        try:
            run(cell, interruptions, opens=has_desktop() and not arguments.no_open)
        except (PartFailed, OSError) as error:
            code = _complain(f"{error}; logs: {logs}", ExitCode.FAILED)
        except Interrupted as interruption:
            code = 128 + interruption.number
    with contextlib.suppress(OSError):  # of a terminal that is gone
        count = "four" if cell.has_keypad else "three"
        print(f"all {count} have ended; cell file and logs: {logs}", flush=True)
    return code


def parser() -> argparse.ArgumentParser:
    """Return the parser of the arguments."""
    reader = argparse.ArgumentParser(
        prog="make pendant", description="An emulated robot and its pendant as a page for browsers."
    )
    reader.add_argument("--robot", default="ur5", help="robot name or file (default: %(default)s)")
    reader.add_argument("--port", type=int, help=f"of the page (default: {_PAGE_PORT}, or free)")
    reader.add_argument("--store", metavar="FILE", help="file of programs (default: one a robot)")
    reader.add_argument("--keypad", action="store_true", help="with a keypad and its bridge")
    reader.add_argument("--no-open", action="store_true", help="open no browser")
    return reader


def _complain(text: str, code: int) -> int:
    complain(f"openpendant: {text}")
    return code


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
