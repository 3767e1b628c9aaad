"""`openpendant serve`: arguments to settings, messages to the user, exit codes.

Exit codes: 0 stopped as asked, 1 something failed in the run, such as writing the ready line, 2
wrong usage or configuration, 3 a port could not be bound.
"""

from __future__ import annotations

import asyncio
import contextlib
import ipaddress
import json
import logging
import os
import signal
import sys
from collections.abc import Iterator
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from openpendant.motion.errors import MotionError
from openpendant.motion.robot import SerialRobot, serial_robot
from openpendant.simplemsg import __version__
from openpendant.simplemsg.journal import Journal

from .settings import (
    CellSettings,
    ConfigurationError,
    load_settings,
    make_settings,
    settings_as_toml,
)

if TYPE_CHECKING:
    from .app import Ports

OK, FAILED, USAGE, PORT_TAKEN = 0, 1, 2, 3

app = typer.Typer(add_completion=False, pretty_exceptions_enable=False, rich_markup_mode=None)


@app.command()
def serve(
    config: Annotated[
        Path | None, typer.Option(help="Cell file (TOML); arguments go before it.")
    ] = None,
    robot: Annotated[str | None, typer.Option(help="Robot name or file.")] = None,
    controller: Annotated[
        str | None, typer.Option(help="Robot controller, HOST:MOTION_PORT:STATE_PORT.")
    ] = None,
    host: Annotated[str | None, typer.Option(help="Address to listen on.")] = None,
    pendant_port: Annotated[int | None, typer.Option(help="Pendant protocol.")] = None,
    ros_motion_port: Annotated[int | None, typer.Option(help="ROS-I motion.")] = None,
    ros_state_port: Annotated[int | None, typer.Option(help="ROS-I state.")] = None,
    points: Annotated[
        str | None, typer.Option(help="Send points as type 14 (full) or type 11 (simple).")
    ] = None,
    stop_connection: Annotated[
        bool | None, typer.Option(help="Keep a second motion connection for nothing but STOP.")
    ] = None,
    print_config: Annotated[
        bool, typer.Option(help="Print the settings that would be used, and end.")
    ] = False,
    json_output: Annotated[
        bool, typer.Option("--json", help="Say that it is ready as one JSON line.")
    ] = False,
    plans: Annotated[
        Path | None, typer.Option(help="Keep every motion and its certificate in this folder.")
    ] = None,
    journal: Annotated[
        Path | None, typer.Option(help="Write every byte to this file, to run it again exactly.")
    ] = None,
    verbose: Annotated[bool, typer.Option(help="Log every connection.")] = False,
) -> None:
    """Run the pendant server of one cell until it is interrupted."""
    try:
        data = load_settings(config) if config else {}
        _override(data, None, robot=robot)
        _override(
            data,
            "listen",
            host=host,
            pendant_port=pendant_port,
            ros_motion_port=ros_motion_port,
            ros_state_port=ros_state_port,
        )
        _override(data, "controller", points=points, stop_connection=stop_connection)
        if controller is not None:
            _override(data, "controller", **_controller_address(controller))
        settings = make_settings(data, str(config) if config else "arguments")
        if print_config:
            print(settings_as_toml(settings), end="")
            return
        _check_loopback(settings.listen.host)
        model = serial_robot(settings.robot)
    except (ConfigurationError, MotionError) as error:
        raise _failure(str(error), USAGE) from None
    logging.basicConfig(
        level=logging.INFO if verbose else logging.WARNING,
        format="%(asctime)s %(levelname)s %(name)s: %(message)s",
        stream=sys.stderr,
    )
    # Imported here so that --help and a wrong configuration answer without loading pinocchio.
    from .app import ListenFailed

    try:
        asyncio.run(_run(settings, model, json_output, plans, journal))
    except ListenFailed as error:
        raise _failure(str(error), PORT_TAKEN) from None
    except OSError as error:
        raise _failure(" ".join(str(error).split()), FAILED) from None


def _check_loopback(host: str) -> None:
    """Refuse an address that others can reach: there are no credentials to ask them for.

    Raises:
        ConfigurationError: the address is no loopback address.
    """
    try:
        loopback = host == "localhost" or ipaddress.ip_address(host).is_loopback
    except ValueError:
        loopback = False
    if not loopback:
        problem = "this version has no credentials, so it listens on loopback addresses only"
        raise ConfigurationError("listen", "host", f"{host}: {problem}")


def _override(data: dict[str, Any], table: str | None, **values: object) -> None:
    """Put arguments over what the file says; a file's wrong table is left for the check."""
    given = {key: value for key, value in values.items() if value is not None}
    target = data if table is None else data.setdefault(table, {}) if given else {}
    if isinstance(target, dict):
        target.update(given)


def _controller_address(text: str) -> dict[str, Any]:
    host, _, ports = text.partition(":")
    motion, _, state = ports.partition(":")
    if not (host and motion.isdigit() and state.isdigit()):
        raise ConfigurationError(
            "arguments", "--controller", f"{text!r}; expected HOST:MOTION_PORT:STATE_PORT"
        )
    return {"host": host, "motion_port": int(motion), "state_port": int(state)}


def _failure(text: str, code: int) -> typer.Exit:
    print(f"openpendant serve: {text}", file=sys.stderr)
    return typer.Exit(code)


@contextlib.contextmanager
def kept_journal(journal: Journal, file: Path | None, settings: CellSettings) -> Iterator[None]:
    """Keep the journal in a file while the context lasts; a full disk ends it, not the run."""
    if file is None:
        yield
        return
    from openpendant.simplemsg.journal_writer import JournalWriter  # most runs keep no journal

    stream = JournalWriter(file)
    started = datetime.now().astimezone().isoformat()
    about = settings.model_dump(mode="json")
    journal.keep(
        stream, _journal_failed, kind="server", started=started, version=__version__, settings=about
    )
    try:
        yield
    finally:
        journal.end()
        try:
            stream.close()
        except OSError as error:
            _journal_failed(error)


def _journal_failed(error: OSError) -> None:
    logging.getLogger("openpendant.server").error("the journal is incomplete: %s", error)


async def _run(
    settings: CellSettings,
    robot: SerialRobot,
    json_output: bool,
    plans: Path | None,
    journal_file: Path | None,
) -> None:
    from .app import App, loop_time  # here for the same reason as in `serve`
    from .plan_store import PlanStore

    loop = asyncio.get_running_loop()
    interrupted = asyncio.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        loop.add_signal_handler(number, interrupted.set)
    store = None if plans is None else PlanStore(plans)
    journal = Journal(loop_time)
    server = App(settings, robot, plans=store, journal=journal)
    with kept_journal(journal, journal_file, settings):
        async with server.running() as ports:
            _say_ready(ports, json_output)
            await interrupted.wait()
    if store is not None:
        await asyncio.to_thread(store.close)


def _say_ready(ports: Ports, json_output: bool) -> None:
    ready = {
        "pendant": ports.pendant,
        "ros_motion": ports.ros_motion,
        "ros_state": ports.ros_state,
        "pid": os.getpid(),
    }
    if json_output:
        line = json.dumps({"event": "ready", **ready})
    else:
        line = "server ready " + " ".join(f"{key}={value}" for key, value in ready.items())
    print(line, flush=True)


def main(argv: list[str]) -> int:
    """Run `openpendant serve` with arguments; return the exit code."""
    try:
        app(argv, prog_name="openpendant serve")
    except SystemExit as ended:
        return ended.code if isinstance(ended.code, int) else USAGE
    return OK
