"""`openpendant gamepad`: a gamepad or a SpaceMouse as a pendant.

Owns arguments, messages to the user and exit codes: 0 ended by its user, 1 a server that does not
want us, or a stop that was not confirmed at the end, 2 wrong usage, a file that cannot be used or
no such cell, 69 no Linux.
"""

from __future__ import annotations

import asyncio
import contextlib
import signal
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from openpendant.simplemsg.verdicts import VerdictCode

from ...console import ExitCode, command, complain, run
from ..client import PendantClient, PendantError, Refused, SecretUnprotected, WrongArgument
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
from ..settings_file import SettingsRefused, read_file
from .bridge import GamepadBridge
from .settings import GamepadSettings, settings_of

_STATE_RATE = 25.0
_NAME = "gamepad"

app = command()


class _Failed(Exception):
    """The server did not want us, or a stop is in doubt; the text is for the user."""


class _Unusable(Exception):
    """Arguments that the gamepad cannot run with; the text is for the user."""


class _NotHere(Exception):
    """This machine has no such devices; the text is for the user."""


def main(argv: Sequence[str]) -> int:
    """Run `openpendant gamepad` and return its exit code."""
    faults = {
        _Unusable: ExitCode.USAGE,
        SettingsRefused: ExitCode.USAGE,
        WrongArgument: ExitCode.USAGE,
        _Failed: ExitCode.FAILED,
        _NotHere: ExitCode.UNAVAILABLE,
    }
    return run(app, "gamepad", argv, faults, lambda text: complain(f"openpendant gamepad: {text}"))


@app.command(
    epilog="Exit codes: 0 ended by you, 1 refused by the server or a stop not confirmed, 2 wrong "
    "usage, an unusable file or no such cell, 69 no Linux."
)
def gamepad(
    device: Annotated[
        str | None, typer.Option(metavar="PATH", help="The device (default: /dev/input/js0).")
    ] = None,
    server: Annotated[
        str | None,
        typer.Option(metavar="HOST[:PORT]", help="The pendant server (default: this machine's)."),
    ] = None,
    config: Annotated[
        Path | None, typer.Option(help="TOML file with a table [gamepad]; arguments go before it.")
    ] = None,
    cell: Annotated[str, typer.Option(help="Name of the cell; not needed for the only one.")] = "",
    name: Annotated[str, typer.Option(help="Name of this pendant, shown to others.")] = _NAME,
    user: Annotated[
        str,
        typer.Option(help=f"Account; its password is asked for, or in {PASSWORD_VARIABLE}."),
    ] = "",
    pairing: Annotated[
        bool, typer.Option("--pairing", help="Ask for the code of a class, and for your name.")
    ] = False,
    ca: Annotated[
        Path | None, typer.Option(help="Certificate of the server; encrypts the connection.")
    ] = None,
    strict: Annotated[
        bool, typer.Option("--strict", help=f"{STRICT[0].upper()}{STRICT[1:]}.")
    ] = False,
) -> None:
    """A gamepad or a SpaceMouse as a pendant: it jogs while its enabling button is held.

    The left shoulder button is enabling (training), B or Circle the software stop. Neither is a
    safety device: keep a wired emergency stop at hand. A device that is unplugged has let go.
    """
    given = {"device": device, "server": server}
    named = {key: value for key, value in given.items() if value is not None}
    settings = settings_of(
        read_file(config) if config else {}, named, str(config) if config else "arguments"
    )
    if sys.platform != "linux":
        raise _NotHere("the devices are those of Linux; elsewhere use the pendant in a browser")
    tls = tls_context(ca)
    secret = pairing_code() if pairing else password_of(user)
    if pairing and not user:
        user = guest_name(name) if name == _NAME else name
    host, port = server_address(settings.server) or ("", 0)

    async def connect() -> PendantClient:
        return await PendantClient.connect(
            *(host, port),
            client=name,
            cell=cell,
            state_rate=_STATE_RATE,
            tls=tls,
            strict=strict,
            enabling_deadline=settings.deadline,
        )

    async def log_in(client: PendantClient) -> None:
        if pairing:
            await client.login(user, pairing=secret)
        elif secret is not None:
            await client.login(user, password=secret)

    with told_of_unprotected_secrets(_say):
        asyncio.run(_serve(settings, connect, log_in))


async def _serve(settings: GamepadSettings, connect: Connect, log_in: LogIn) -> None:
    """Serve the gamepad until it is interrupted.

    Raises:
        _Unusable: an argument must change.
        _Failed: the server refuses the connection, or a stop was not confirmed at the end.
    """
    bridge = GamepadBridge(settings, connect, log_in)
    bridge.gamepad.messages.on_new = _say
    serving = asyncio.ensure_future(bridge.run())
    loop = asyncio.get_running_loop()
    for number in (signal.SIGINT, signal.SIGTERM):
        loop.add_signal_handler(number, serving.cancel)
    why = ""
    try:
        with contextlib.suppress(asyncio.CancelledError):
            await serving
    except PendantError as error:
        why = connection_refused(error) if isinstance(error, Refused) else str(error)
        if _is_wrong(error) and not bridge.gamepad.stop_key.is_owed:
            raise _Unusable(why) from None
    if bridge.gamepad.stop_key.is_owed:
        because = f" ({why})" if why else ""
        raise _Failed(f"it ended before its stop was confirmed: {REMEDY}{because}")
    if why:
        raise _Failed(why)


def _is_wrong(error: PendantError) -> bool:
    """Return True if an argument must change."""
    if isinstance(error, Refused):
        return error.code == VerdictCode.UNKNOWN_CELL
    return isinstance(error, SecretUnprotected | WrongArgument)


def _say(text: str) -> None:
    print(f"gamepad: {text}", flush=True)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
