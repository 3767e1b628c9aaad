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

from ...console import ExitCode, command, complain, run
from ..client import PendantError, WrongArgument
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
    must_change,
    words_of,
)
from ..panel.connection import Connect, LogIn
from ..panel.stop_key import REMEDY
from ..settings_file import SettingsRefused, read_file
from .bridge import GamepadBridge
from .settings import GamepadSettings, settings_of

_NAME = "gamepad"

app = command()


class _NotHere(Exception):
    """This machine has no such devices; the text is for the user."""


def main(argv: Sequence[str]) -> int:
    """Run `openpendant gamepad` and return its exit code."""
    faults = {
        Unusable: ExitCode.USAGE,
        SettingsRefused: ExitCode.USAGE,
        WrongArgument: ExitCode.USAGE,
        ConnectionFailed: ExitCode.FAILED,
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
    cell: CellName = "",
    name: PendantName = _NAME,
    user: UserName = "",
    pairing: ByPairing = False,
    ca: Certificate = None,
    strict: Strict = False,
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
    address = server_address(settings.server)
    assert address is not None
    connector = Connector(
        address, name=name, cell=cell, ca=ca, strict=strict, enabling_deadline=settings.deadline
    )
    login = PanelLogin.asked(user, by_pairing=pairing, name=name, usual_name=_NAME)
    with told_of_unprotected_secrets(_say):
        asyncio.run(_serve(settings, connector.connect, login.enter))


async def _serve(settings: GamepadSettings, connect: Connect, log_in: LogIn) -> None:
    """Serve the gamepad until it is interrupted.

    Raises:
        Unusable: an argument must change.
        ConnectionFailed: the server refuses us, or a stop was not confirmed at the end.
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
        why = words_of(error)
        if must_change(error) and not bridge.gamepad.stop_key.is_owed:
            raise Unusable(why) from None
    if bridge.gamepad.stop_key.is_owed:
        because = f" ({why})" if why else ""
        raise ConnectionFailed(f"it ended before its stop was confirmed: {REMEDY}{because}")
    if why:
        raise ConnectionFailed(why)


def _say(text: str) -> None:
    print(f"gamepad: {text}", flush=True)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
