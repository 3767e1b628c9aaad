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
from typing import Annotated

import typer

from ...console import ExitCode, command, complain, run
from ..client import PendantClient, Refused, SecretUnprotected, WrongArgument
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
from ..panel.connection import PanelConnection
from ..panel.panel import Panel
from ..panel.stop_key import REMEDY
from ..session import LONGEST_SILENCE
from ..settings_file import SettingsRefused
from .bridge import KeypadBridge, LineWords
from .keypad import Keypad
from .line import HOLDING_BAUD, KeypadLine
from .performer import KeypadPerformer
from .serial_port import KeypadPortMisnamed, check_port, open_port, seen_ports
from .settings import KeypadSettings, settings_of

_NAME = "keypad"
_LOOK = 0.1
"""Time between two looks at whether anything is to be said, or the end was asked for [s]."""

app = command()


def main(argv: Sequence[str]) -> int:
    """Run `openpendant keypad` and return its exit code."""
    faults = {
        Unusable: ExitCode.USAGE,
        SettingsRefused: ExitCode.USAGE,
        KeypadPortMisnamed: ExitCode.USAGE,
        WrongArgument: ExitCode.USAGE,
        ConnectionFailed: ExitCode.FAILED,
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
    cell: CellName = "",
    name: PendantName = _NAME,
    user: UserName = "",
    pairing: ByPairing = False,
    ca: Certificate = None,
    strict: Strict = False,
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
        raise Unusable(f"which port? Name it with --port (seen: {_seen()})")
    if take_control and not settings.characters:
        raise Unusable(
            "--take-control goes with --characters; the keys ask for control by themselves"
        )
    check_port(settings.port)
    address = server_address(settings.server)
    assert address is not None
    silence = LONGEST_SILENCE if _is_slow(settings) else settings.deadline
    connector = Connector(
        address, name=name, cell=cell, ca=ca, strict=strict, enabling_deadline=silence
    )
    login = PanelLogin.asked(user, by_pairing=pairing, name=name, usual_name=_NAME)

    async def log_in(client: PendantClient) -> None:
        await login.enter(client)
        if take_control:
            await client.take_control()

    core = Keypad(
        KeypadLine(settings.baud, settings.debounce_ms),
        settings.enabling,
        characters=settings.characters,
    )

    def performer(client: PendantClient, panel: Panel) -> KeypadPerformer:
        return KeypadPerformer(client, core, settings.deadline)

    connection = PanelConnection(core, connector.connect, log_in, performer=performer)
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
        raise ConnectionFailed(f"it ended before its stop was confirmed: {REMEDY}")


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
        give_up(error)
    finally:
        for side in sides:
            side.cancel()
        await asyncio.gather(*sides, return_exceptions=True)
