"""`openpendant pendant`: a teach pendant in a terminal.

Owns arguments, messages to the user, exit codes, and the end of the process with its terminal. Exit
codes: 0 ended by the user, 1 no server to print about, one that does not want us, or a stop that
was not confirmed at the end, 2 wrong usage, no such cell or no terminal, 69 textual is not
installed, 130 interrupted.
"""

from __future__ import annotations

import asyncio
import importlib
import os
import select
import signal
import sys
import threading
from collections.abc import Callable, Sequence
from enum import StrEnum
from typing import Annotated

import typer

from ...console import ExitCode, command, complain, run
from ..attaching import attach_command
from ..client import (
    DEFAULT_PORT,
    PendantError,
    Refused,
    SecretUnprotected,
    WrongArgument,
)
from ..connection_errors import server_address
from ..credentials import told_of_unprotected_secrets
from ..panel.command_line import (
    ByPairing,
    CellName,
    Certificate,
    ConnectionFailed,
    Connector,
    PanelLogin,
    PendantName,
    Strict,
    Unusable,
    UserName,
    give_up,
)
from ..panel.connection import Connect, LogIn
from ..panel.stop_key import REMEDY
from .screen_text import status_once

_NAME = "terminal"

app = command()


class ShownNames(StrEnum):
    """Names of joints on the screen."""

    DISPLAY = "display"
    FILE = "file"


def main(argv: Sequence[str]) -> int:
    """Run `openpendant pendant` and return its exit code."""
    faults = {
        Unusable: ExitCode.USAGE,
        WrongArgument: ExitCode.USAGE,
        ConnectionFailed: ExitCode.FAILED,
    }
    return run(app, "pendant", argv, faults, _complain)


def _complain(text: str) -> None:
    complain(f"openpendant pendant: {text}")


@app.command()
def pendant(
    server: Annotated[
        str, typer.Argument(metavar="[HOST[:PORT]]", help="The pendant server.")
    ] = f"127.0.0.1:{DEFAULT_PORT}",
    cell: CellName = "",
    name: PendantName = _NAME,
    user: UserName = "",
    pairing: ByPairing = False,
    ca: Certificate = None,
    strict: Strict = False,
    plain: Annotated[
        bool, typer.Option(help="Print once how the robot stands, and end; needs no terminal.")
    ] = False,
    names: Annotated[
        ShownNames, typer.Option(help="Joints as people call them, or as in the robot file.")
    ] = ShownNames.DISPLAY,
) -> None:
    """A teach pendant in a terminal: jog, teach, run and stop.

    The space bar and F8 are always the software stop. It is no safety device: keep a wired
    emergency stop at hand.
    """
    address = server_address(server)
    if address is None:
        raise Unusable(f"{server!r} is no server; accepted: HOST or HOST:PORT, PORT 1 to 65535")
    # textual draws on standard error.
    if not (plain or all(each.isatty() for each in (sys.stdin, sys.stdout, sys.stderr))):
        raise Unusable("this is no terminal; --plain prints once how the robot stands")
    if not plain:
        # Before any question to the user; where it fails, the command says how to install it.
        importlib.import_module("textual")
    connector = Connector(address, name=name, cell=cell, ca=ca, strict=strict)
    login = PanelLogin.asked(user, by_pairing=pairing, name=name, usual_name=_NAME)
    if plain:
        with told_of_unprotected_secrets(lambda text: _complain(f"warning: {text}")):
            print(_status(connector.connect, login.enter, names))
    else:
        from .app import PendantApp

        end_with_terminal([sys.stdin.fileno(), sys.stderr.fileno()])
        screen = PendantApp(connector.connect, login.enter)
        chosen = ("--cell", cell) if cell else ()
        screen.panel.attach_command = attach_command(*address, *chosen)
        screen.panel.cell.names_as_in_file = names is ShownNames.FILE
        with told_of_unprotected_secrets(screen.panel.messages.add):
            gave_up = screen.run(mouse=False)
        if screen.panel.stop_key.is_owed:
            how, why = ("was left", "") if gave_up is None else ("ended", f" ({gave_up})")
            raise ConnectionFailed(f"it {how} before its stop was confirmed: {REMEDY}{why}")
        if gave_up is not None:
            give_up(gave_up)


def _status(connect: Connect, log_in: LogIn, names: ShownNames) -> str:
    """Return the state of the robot as text."""
    try:
        as_in_file = names is ShownNames.FILE
        return asyncio.run(status_once(connect, log_in, names_as_in_file=as_in_file))
    except (Refused, SecretUnprotected, WrongArgument) as error:
        give_up(error)
    except (OSError, PendantError, TimeoutError) as error:
        raise ConnectionFailed(str(error) or type(error).__name__) from None


def end_with_terminal(descriptors: Sequence[int]) -> None:
    """End this process by SIGHUP once one of its terminals has hung up.

    For a controlling terminal the kernel sends that signal. For any other terminal it sends
    nothing: reads return no data for ever, and the drawing thread has died and blocks the event
    loop; so a thread of its own polls the terminals. The end of the process closes the connection;
    the server then stops the robot and releases the motion authority.

    Call it in the main thread. On Windows it does nothing: closing a console ends its processes
    there.
    """
    if sys.platform == "win32":
        return
    # nohup starts a process with SIGHUP ignored; such a process would never end.
    signal.signal(signal.SIGHUP, signal.SIG_DFL)
    watch = threading.Thread(
        target=watch_terminals,
        args=(tuple(descriptors), lambda: os.kill(os.getpid(), signal.SIGHUP)),
        name="terminal-watch",
        daemon=True,
    )
    watch.start()


def watch_terminals(descriptors: Sequence[int], gone: Callable[[], None]) -> None:
    """Wait until a terminal has hung up, then call `gone` once; not on Windows.

    Returns without calling `gone` where the platform cannot watch a terminal.
    """
    poll = select.poll()
    for descriptor in descriptors:
        poll.register(descriptor, 0)  # poll reports hang-ups and errors without a mask
    events = [event for _, event in poll.poll()]
    if any(event & (select.POLLHUP | select.POLLERR) for event in events):
        gone()
