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
from pathlib import Path
from typing import Annotated, NoReturn

import typer

from openpendant.simplemsg.verdicts import VerdictCode

from ...console import ExitCode, command, complain, run
from ..attaching import attach_command
from ..client import (
    DEFAULT_PORT,
    PendantClient,
    PendantError,
    Refused,
    SecretUnprotected,
    WrongArgument,
)
from ..connection_errors import server_address
from ..credentials import (
    PASSWORD_VARIABLE,
    STRICT,
    guest_name,
    pairing_code,
    password_of,
    tls_context,
    told_of_unprotected_secrets,
)
from ..panel.connection import Connect, LogIn
from ..panel.stop_key import REMEDY
from ..panel.wording import connection_refused
from .screen_text import status_once

_STATE_RATE = 25.0
_NAME = "terminal"

app = command()


class ShownNames(StrEnum):
    """Names of joints on the screen."""

    DISPLAY = "display"
    FILE = "file"


class _Failed(Exception):
    """No answer of the server; the text is for the user."""


class _Unusable(Exception):
    """Arguments or a place that the pendant cannot run with; the text is for the user."""


def main(argv: Sequence[str]) -> int:
    """Run `openpendant pendant` and return its exit code."""
    faults = {_Unusable: ExitCode.USAGE, _Failed: ExitCode.FAILED}
    return run(app, "pendant", argv, faults, _complain)


def _complain(text: str) -> None:
    complain(f"openpendant pendant: {text}")


@app.command()
def pendant(
    server: Annotated[
        str, typer.Argument(metavar="[HOST[:PORT]]", help="The pendant server.")
    ] = f"127.0.0.1:{DEFAULT_PORT}",
    cell: Annotated[str, typer.Option(help="Name of the cell; not needed for the only one.")] = "",
    name: Annotated[str, typer.Option(help="Name of this pendant, shown to others.")] = _NAME,
    user: Annotated[
        str,
        typer.Option(
            help=f"Account; its password is asked for, or in {PASSWORD_VARIABLE}."
            " With --pairing: your name in the class."
        ),
    ] = "",
    pairing: Annotated[
        bool,
        typer.Option(
            "--pairing",
            help="Ask for the code of a class, and for your name unless --user or --name says it.",
        ),
    ] = False,
    ca: Annotated[
        Path | None, typer.Option(help="Certificate of the server; encrypts the connection.")
    ] = None,
    strict: Annotated[
        bool, typer.Option("--strict", help=f"{STRICT[0].upper()}{STRICT[1:]}.")
    ] = False,
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
        raise _Unusable(f"{server!r} is no server; accepted: HOST or HOST:PORT, PORT 1 to 65535")
    host, port = address
    # textual draws on standard error.
    if not (plain or all(each.isatty() for each in (sys.stdin, sys.stdout, sys.stderr))):
        raise _Unusable("this is no terminal; --plain prints once how the robot stands")
    if not plain:
        # Before any question to the user; where it fails, the command says how to install it.
        importlib.import_module("textual")
    try:
        tls = tls_context(ca)
        secret = pairing_code() if pairing else password_of(user)
        if pairing and not user:
            user = guest_name(name) if name == _NAME else name
    except WrongArgument as error:
        raise _Unusable(str(error)) from None

    async def connect() -> PendantClient:
        return await PendantClient.connect(
            host,
            port,
            client=name,
            cell=cell,
            state_rate=_STATE_RATE,
            tls=tls,
            strict=strict,
        )

    async def log_in(client: PendantClient) -> None:
        if pairing:
            await client.login(user, pairing=secret)
        elif secret is not None:
            await client.login(user, password=secret)

    if plain:
        with told_of_unprotected_secrets(lambda text: _complain(f"warning: {text}")):
            print(_status(connect, log_in, names))
    else:
        from .app import PendantApp

        end_with_terminal([sys.stdin.fileno(), sys.stderr.fileno()])
        screen = PendantApp(connect, log_in)
        screen.panel.attach_command = attach_command(
            host, port, *(("--cell", cell) if cell else ())
        )
        screen.panel.cell.names_as_in_file = names is ShownNames.FILE
        with told_of_unprotected_secrets(screen.panel.messages.add):
            gave_up = screen.run(mouse=False)
        if screen.panel.stop_key.is_owed:
            how, why = ("was left", "") if gave_up is None else ("ended", f" ({gave_up})")
            raise _Failed(f"it {how} before its stop was confirmed: {REMEDY}{why}")
        if gave_up is not None:
            _give_up(gave_up)


def _status(connect: Connect, log_in: LogIn, names: ShownNames) -> str:
    """Return the state of the robot as text."""
    try:
        as_in_file = names is ShownNames.FILE
        return asyncio.run(status_once(connect, log_in, names_as_in_file=as_in_file))
    except (Refused, SecretUnprotected, WrongArgument) as error:
        _give_up(error)
    except (OSError, PendantError, TimeoutError) as error:
        raise _Failed(str(error) or type(error).__name__) from None


def _give_up(error: PendantError) -> NoReturn:
    """Raise `_Unusable` where an argument must change, else `_Failed`."""
    if isinstance(error, Refused):
        wrong = error.code == VerdictCode.UNKNOWN_CELL
        raise (_Unusable if wrong else _Failed)(connection_refused(error))
    wrong = isinstance(error, SecretUnprotected | WrongArgument)
    raise (_Unusable if wrong else _Failed)(str(error))


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
