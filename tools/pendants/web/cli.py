"""`openpendant web`: serves the browser pendant and relays it to pendant servers.

Owns the arguments, the ready line and the exit codes: 0 ended by its user, 2 wrong usage or a file
that cannot be used, 3 the port is taken, or a server demands no logins where other machines could
come, 69 such a server did not answer, or aiohttp is not installed.
"""

from __future__ import annotations

import asyncio
import os
import signal
import socket
import ssl
from collections.abc import Awaitable, Sequence
from pathlib import Path
from typing import Annotated, Any, TypeVar

import typer
from aiohttp import web

from ...console import ExitCode, command, complain, emit_json, run
from ..connection_errors import DEFAULT_PORT as SERVER_PORT
from ..connection_errors import WrongArgument
from ..settings_file import SettingsRefused, read_file
from .admission import PageAdmission
from .keypad_relay import HOST as KEYPAD_HOST
from .keypad_relay import KeypadRelay
from .page_files import BUILT, PageFiles
from .relay import BrowserRelay
from .server_exposure import NotAsked, NotGuarded, check_logins_are_demanded
from .server_link import GatewayIdentity, Server
from .settings import (
    OwnCertificate,
    WebSettings,
    read_secret,
    settings_of,
)

_SHUTDOWN_WITHIN = 3.0
"""Time for what still runs when the gateway ends [s]."""

app = command()

_T = TypeVar("_T")


class PortUnusable(Exception):
    """The port cannot be listened at; the text is for the user."""


def main(argv: Sequence[str]) -> int:
    """Run `openpendant web` and return its exit code."""
    faults = {
        SettingsRefused: ExitCode.USAGE,
        WrongArgument: ExitCode.USAGE,
        NotGuarded: ExitCode.REFUSED,
        PortUnusable: ExitCode.REFUSED,
        NotAsked: ExitCode.UNAVAILABLE,
    }
    return run(app, "web", argv, faults, lambda text: complain(f"openpendant web: {text}"))


@app.command(
    epilog="Exit codes: 0 ended by you, 2 wrong usage or an unusable file, 3 the port is "
    "taken or a server demands no logins, 69 a server did not answer, or aiohttp is missing."
)
def web_(
    server: Annotated[
        list[str] | None,
        typer.Option(
            metavar="[NAME=]HOST[:PORT]",
            help=f"A pendant server; may be repeated (default: 127.0.0.1:{SERVER_PORT}).",
        ),
    ] = None,
    port: Annotated[int | None, typer.Option(help="Port of the page; 0: any free one.")] = None,
    host: Annotated[
        str | None, typer.Option(help="Address to listen at; loopback unless told otherwise.")
    ] = None,
    keypad: Annotated[
        int | None,
        typer.Option(
            metavar="PORT",
            help="The keypad in the page: `openpendant keypad --port socket://127.0.0.1:PORT`"
            " comes here; 0: any free port.",
        ),
    ] = None,
    config: Annotated[Path | None, typer.Option(help="TOML file; arguments go before it.")] = None,
    ca: Annotated[
        Path | None, typer.Option(help="Certificate of the servers; encrypts the connections.")
    ] = None,
    gateway: Annotated[
        str | None, typer.Option(help="Name of this gateway in the servers' files.")
    ] = None,
    secret_file: Annotated[
        Path | None, typer.Option(help="File with the gateway's secret.")
    ] = None,
    page: Annotated[
        Path | None, typer.Option(help="Folder of another page than the one built here.")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Ready line as a JSON object.")] = False,
) -> None:
    """Serve the pendant as a page for browsers until it is interrupted.

    Each page has a connection of its own to a server, where it is a pendant like any other.
    """
    data = read_file(config) if config else {}
    given = _given(server, ca, host=host, port=port, keypad=keypad)
    if gateway is not None or secret_file is not None:
        table = data.get("gateway")
        known = dict(table) if isinstance(table, dict) else {}
        words = {"name": gateway, "secret_file": secret_file and str(secret_file)}
        given["gateway"] = known | {key: value for key, value in words.items() if value is not None}
    if not data.get("servers") and "servers" not in given:
        given["servers"] = _servers([f"127.0.0.1:{SERVER_PORT}"], ca)
    settings = settings_of(data | given, str(config) if config else "arguments")
    named = settings.gateway
    identity = None if named is None else GatewayIdentity(named.name, read_secret(named))
    servers = [Server.of(each, named.address if named else "") for each in settings.servers]
    tls = _tls(settings.tls)
    asyncio.run(
        _serve(WebGateway(settings, servers, identity, tls, page or BUILT), as_json=as_json)
    )


def _given(servers: list[str] | None, ca: Path | None, **values: object) -> dict[str, Any]:
    """Return the keys that arguments name, as a file would say them."""
    given = {key: value for key, value in values.items() if value is not None}
    if servers:
        given["servers"] = _servers(servers, ca)
    return given


def _servers(texts: Sequence[str], ca: Path | None) -> list[dict[str, str]]:
    named = [text.rpartition("=") for text in texts]
    trusted = "" if ca is None else str(ca)
    return [
        {"name": name or address, "address": address, "ca": trusted} for name, _, address in named
    ]


def _tls(settings: OwnCertificate | None) -> ssl.SSLContext | None:
    """Return the context of the gateway's own certificate.

    Raises:
        SettingsRefused: certificate or key cannot be used.
    """
    if settings is None:
        return None
    context = ssl.create_default_context(ssl.Purpose.CLIENT_AUTH)
    try:
        context.load_cert_chain(settings.certificate, settings.key)
    except (OSError, ssl.SSLError) as error:
        problem = error.strerror or error
        raise SettingsRefused(f"tls: {settings.certificate}, {settings.key}: {problem}") from None
    return context


class WebGateway:
    """A gateway that is ready to listen.

    Attributes:
        keypad_port: what the bridge of a keypad in a page takes as `--port`; empty for none.
    """

    def __init__(
        self,
        settings: WebSettings,
        servers: Sequence[Server],
        identity: GatewayIdentity | None,
        tls: ssl.SSLContext | None,
        page: Path,
    ) -> None:
        """Know all that it needs."""
        self.keypad_port = ""
        self._settings = settings
        self._servers = servers
        self._identity = identity
        self._tls = tls
        admission = PageAdmission(settings, () if settings.is_local else _own_names())
        self._keypad = None if settings.keypad is None else KeypadRelay()
        application = BrowserRelay(servers, admission, identity, self._keypad).application()
        files = PageFiles(page)
        application.router.add_get("/", files.serve)
        application.router.add_get("/{file:.+}", files.serve)
        self._runner = web.AppRunner(
            application, access_log=None, shutdown_timeout=_SHUTDOWN_WITHIN, handle_signals=False
        )

    async def start(self) -> str:
        """Listen, and return the address of the page.

        Raises:
            NotGuarded: other machines could come, and a server demands no logins.
            NotAsked: they could, and a server did not answer.
            PortUnusable: the port cannot be listened at.
        """
        if not self._settings.is_local and self._identity is not None:
            await check_logins_are_demanded(self._servers, self._identity)
        await self._runner.setup()
        host, port = self._settings.host, self._settings.port
        site = web.TCPSite(self._runner, host, port, ssl_context=self._tls)
        await _listening(host, port, site.start())
        if self._keypad is not None and (at := self._settings.keypad) is not None:
            self.keypad_port = await _listening(KEYPAD_HOST, at, self._keypad.listen(at))
        shown = f"[{host}]" if ":" in host else host
        scheme = "http" if self._tls is None else "https"
        return f"{scheme}://{shown}:{self._runner.addresses[0][1]}/"

    async def close(self) -> None:
        """End all pages in order and listen no more."""
        await self._runner.cleanup()


async def _listening(host: str, port: int, begun: Awaitable[_T]) -> _T:
    """Begin to listen.

    Raises:
        PortUnusable: it cannot be listened at.
    """
    try:
        return await begun
    except OSError as error:
        why = os.strerror(error.errno) if error.errno else str(error)
        raise PortUnusable(f"{host}:{port}: {why}") from None


def _own_names() -> list[str]:
    name = socket.gethostname()
    return [name, f"{name}.local", socket.getfqdn()]


async def _serve(gateway: WebGateway, *, as_json: bool) -> None:
    loop = asyncio.get_running_loop()
    interrupted = asyncio.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        try:
            loop.add_signal_handler(number, interrupted.set)
        except NotImplementedError:  # Windows
            signal.signal(number, lambda *_: loop.call_soon_threadsafe(interrupted.set))
    try:
        address = await gateway.start()
        keypad = gateway.keypad_port
        if as_json:
            told = {"event": "ready", "page": address, "pid": os.getpid()}
            emit_json(told | ({"keypad": keypad} if keypad else {}), flush=True)
        else:
            print(f"web ready {address} pid={os.getpid()}", flush=True)
            if keypad:
                print(f"keypad in the page: openpendant keypad --port {keypad}", flush=True)
        await interrupted.wait()
    finally:
        await gateway.close()
