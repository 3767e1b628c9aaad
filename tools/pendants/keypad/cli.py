"""`openpendant keypad`: the keypad pendant on a serial line.

Owns arguments, messages to the user and exit codes: 0 ended by its user, 1 no server that wants us,
or a stop that was not confirmed at the end, 2 wrong usage, no such cell or no such port, 69
pyserial-asyncio is not installed, 130 interrupted.
"""

from __future__ import annotations

import asyncio
import signal
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, NoReturn

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
from ..panel.connection import PanelConnection
from ..panel.panel import Panel
from ..panel.stop_key import REMEDY
from ..panel.wording import connection_refused
from ..session import LONGEST_SILENCE
from ..settings_file import SettingsRefused
from .bridge import KeypadBridge, LineWords
from .keypad import Keypad
from .line import HOLDING_BAUD, KeypadLine
from .performer import KeypadPerformer
from .serial_port import KeypadPortMisnamed, check_port, open_port, seen_ports
from .settings import KeypadSettings, settings_of

_STATE_RATE = 25.0
_NAME = "keypad"
_LOOK = 0.1
"""Time between two looks at whether anything is to be said, or the end was asked for [s]."""

app = command()


class _Failed(Exception):
    """No server that takes us; the text is for the user."""


class _Unusable(Exception):
    """Arguments that the bridge cannot run with; the text is for the user."""


def main(argv: Sequence[str]) -> int:
    """Run `openpendant keypad` and return its exit code."""
    faults = {
        _Unusable: ExitCode.USAGE,
        SettingsRefused: ExitCode.USAGE,
        KeypadPortMisnamed: ExitCode.USAGE,
        WrongArgument: ExitCode.USAGE,
        _Failed: ExitCode.FAILED,
    }
    return run(app, "keypad", argv, faults, lambda text: complain(f"openpendant keypad: {text}"))


def _tell(text: str) -> None:
    complain(f"keypad: {text}")


@app.command()
def keypad(
    port: Annotated[
        str | None, typer.Option(help="Port of the keypad: a device, a pty, socket://HOST:PORT.")
    ] = None,
    baud: Annotated[
        int | None, typer.Option(help="Speed; 9600, 19200, 38400: increments only. [115200]")
    ] = None,
    server: Annotated[
        str | None, typer.Option(metavar="HOST[:PORT]", help="The pendant server.")
    ] = None,
    config: Annotated[Path | None, typer.Option(help="TOML file with a table [keypad].")] = None,
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
        bool, typer.Option("--pairing", help="Ask for the code of a class, and for your name.")
    ] = False,
    ca: Annotated[
        Path | None, typer.Option(help="Certificate of the server; encrypts the connection.")
    ] = None,
    strict: Annotated[
        bool, typer.Option("--strict", help=f"{STRICT[0].upper()}{STRICT[1:]}.")
    ] = False,
    characters: Annotated[
        bool | None,
        typer.Option("--characters", help="The keypad sends plain characters: increments only."),
    ] = None,
    take_control: Annotated[
        bool, typer.Option("--take-control", help="With --characters: ask for control once.")
    ] = False,
    show: Annotated[
        bool, typer.Option("--show", help="Print what the display shows, as it changes.")
    ] = False,
    verbose: Annotated[
        bool, typer.Option("--verbose", help="Tell of frames that never came, too.")
    ] = False,
) -> None:
    """The keypad pendant: 16 keys and a display on a serial line, as a pendant of a server.

    Its STOP is a software stop and no safety device: keep a wired emergency stop at hand.
    """
    given = {"port": port, "baud": baud, "server": server, "characters": characters}
    settings = settings_of(config, given)
    if not settings.port:
        raise _Unusable(f"which port? Name it with --port (seen: {_seen()})")
    if take_control and not settings.characters:
        raise _Unusable(
            "--take-control goes with --characters; the keys ask for control by themselves"
        )
    check_port(settings.port)
    tls = tls_context(ca)
    secret = pairing_code() if pairing else password_of(user)
    if pairing and not user:
        user = guest_name(name) if name == _NAME else name
    address = server_address(settings.server)
    assert address is not None
    host, number = address
    silence = LONGEST_SILENCE if _is_slow(settings) else settings.deadline

    async def connect() -> PendantClient:
        return await PendantClient.connect(
            host,
            number,
            client=name,
            cell=cell,
            state_rate=_STATE_RATE,
            tls=tls,
            strict=strict,
            enabling_deadline=silence,
        )

    async def log_in(client: PendantClient) -> None:
        if pairing:
            await client.login(user, pairing=secret)
        elif secret is not None:
            await client.login(user, password=secret)
        if take_control:
            await client.take_control()

    core = Keypad(
        KeypadLine(settings.baud, settings.debounce_ms),
        settings.enabling,
        characters=settings.characters,
    )

    def performer(client: PendantClient, panel: Panel) -> KeypadPerformer:
        return KeypadPerformer(client, core, settings.deadline)

    connection = PanelConnection(core, connect, log_in, performer=performer)
    bridge = KeypadBridge(
        core,
        connection.perform,
        lambda protocol: open_port(settings.port, settings.baud, protocol),
        LineWords(settings.port, settings.baud, _tell),
        verbose=verbose,
    )
    if show:
        bridge.on_page = _print_page
    with told_of_unprotected_secrets(_tell):
        asyncio.run(_serve(bridge, connection, Messenger(core)))
    if core.stop_key.is_owed:
        raise _Failed(f"it ended before its stop was confirmed: {REMEDY}")


def _is_slow(settings: KeypadSettings) -> bool:
    return settings.characters or settings.baud < HOLDING_BAUD


def _seen() -> str:
    return ", ".join(seen_ports()) or "none"


def _print_page(rows: Sequence[str]) -> None:
    print("\n".join(["+" + "-" * 20 + "+", *(f"|{row}|" for row in rows)]), flush=True)


@dataclass(slots=True)
class Messenger:
    """Prints what the core has to say, once each."""

    keypad: Keypad
    _count: int = 0
    _last: str = ""

    def look(self) -> None:
        """Print the newest message where it is new."""
        newest = self.keypad.messages.newest
        if newest and newest != self._last:
            _tell(newest)
        self._last = newest


async def _serve(bridge: KeypadBridge, connection: PanelConnection, messenger: Messenger) -> None:
    """Run both sides until one ends, or somebody ends us."""
    loop = asyncio.get_running_loop()
    ended = asyncio.Event()
    if sys.platform != "win32":
        for number in (signal.SIGTERM, signal.SIGHUP):
            loop.add_signal_handler(number, ended.set)
    sides = [asyncio.ensure_future(bridge.run()), asyncio.ensure_future(connection.run())]
    try:
        while not ended.is_set():
            await asyncio.wait(sides, timeout=_LOOK, return_when=asyncio.FIRST_COMPLETED)
            messenger.look()
            for side in sides:
                if side.done():
                    side.result()
    except (SecretUnprotected, WrongArgument, Refused) as error:
        _give_up(error)
    finally:
        for side in sides:
            side.cancel()
        await asyncio.gather(*sides, return_exceptions=True)


def _give_up(error: PendantError) -> NoReturn:
    """Raise `_Unusable` where an argument must change, else `_Failed`."""
    if isinstance(error, Refused):
        wrong = error.code == VerdictCode.UNKNOWN_CELL
        raise (_Unusable if wrong else _Failed)(connection_refused(error))
    raise _Unusable(str(error))
