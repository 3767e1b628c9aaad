"""`openpendant serve`: arguments to settings, messages to the user, exit codes.

Exit codes: 0 stopped as asked, 1 something failed in the run, such as writing the ready line, 2
wrong usage or configuration, 3 a port could not be bound.
"""

from __future__ import annotations

import asyncio
import contextlib
import gc
import logging
import os
import signal
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from openpendant.motion.description.robot import SerialRobot, serial_robot
from openpendant.motion.errors import MotionError
from openpendant.simplemsg import __version__
from openpendant.simplemsg.journal import Journal
from openpendant.tools.console import ExitCode, command, complain, emit_json, run_alone

from ..access.process_log import LimitedHandler
from ..background_writer import LogStream, standard_error
from ..settings.cell_settings import settings_as_data
from ..settings.config_file import OFF, ConfigurationError, load_settings
from ..settings.server_settings import ServerSettings, make_server_settings, server_settings_as_toml

if TYPE_CHECKING:
    from ..access.open_access import OpenedAccess
    from ..planning.plan_store import PlanStore
    from ..planning.pool.forked_child import ForkedChild
    from ..shell.cell_shell import CellParts
    from ..shell.listening import Ports

_UNCOLLECTED = 50_000
"""Objects that may come to be before the collector looks for cycles among all that are young.

Those of 30 robots that jog, reports and points of the last seconds above all, come and go without
it; at Python's 700 it looked at them every second, and held the tick up for 17 to 33 ms.
"""

app = command()


@app.command()
def serve(
    config: Annotated[
        Path | None, typer.Option(help="File of one cell or several; arguments go before it.")
    ] = None,
    robot: Annotated[str | None, typer.Option(help="Robot name or file.")] = None,
    controller: Annotated[
        str | None, typer.Option(help="Robot controller, HOST:MOTION_PORT:STATE_PORT.")
    ] = None,
    host: Annotated[str | None, typer.Option(help="Address to listen on.")] = None,
    pendant_port: Annotated[int | None, typer.Option(help="Pendant protocol.")] = None,
    ros_motion_port: Annotated[
        str | None, typer.Option(metavar="PORT", help='ROS-I motion, "off" for none.')
    ] = None,
    ros_state_port: Annotated[
        str | None, typer.Option(metavar="PORT", help='ROS-I state, "off" for none.')
    ] = None,
    points: Annotated[
        str | None, typer.Option(help="Send points as type 14 (full) or type 11 (simple).")
    ] = None,
    signals: Annotated[
        str | None,
        typer.Option(help="Its inputs and outputs: none, or openpendant, as our emulator's."),
    ] = None,
    emulated: Annotated[
        bool | None,
        typer.Option(help="It is an emulated controller, never a real one: training may do more."),
    ] = None,
    stop_connection: Annotated[
        bool | None, typer.Option(help="Keep a second motion connection for nothing but STOP.")
    ] = None,
    event_loop: Annotated[
        str | None, typer.Option(help="Run on asyncio or on uvloop, of the extra `fast`.")
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
    store: Annotated[
        str | None, typer.Option(help='File of programs and other documents, "off" for none.')
    ] = None,
    journal: Annotated[
        Path | None, typer.Option(help="Write every byte to this file, to run it again exactly.")
    ] = None,
    verbose: Annotated[bool, typer.Option(help="Log every connection.")] = False,
) -> None:
    """Run the pendant server of one cell or several until it is interrupted."""
    try:
        data = load_settings(config) if config else {}
        _override(data, "listen", host=host, pendant_port=pendant_port)
        _override(data, "store", path=store)
        _override(data, None, event_loop=event_loop)
        of_one_cell: dict[str | None, dict[str, Any]] = {
            None: {"robot": robot},
            "listen": {"ros_motion_port": ros_motion_port, "ros_state_port": ros_state_port},
            "controller": {
                "points": points,
                "signals": signals,
                "emulated": emulated,
                "stop_connection": stop_connection,
            },
        }
        if controller is not None:
            of_one_cell["controller"] |= _controller_address(controller)
        if "cells" in data:
            _check_unused(of_one_cell, controller)
        for table, values in of_one_cell.items():
            _override(data, table, **values)
        source = str(config) if config else "arguments"
        settings = make_server_settings(data, source)
        # Its matrices are of six rows, and a process with threads cannot fork.
        os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
        # Imported here so that --help and wrong arguments answer without loading numpy.
        from ..shell.controller_connection import check_controllers_apart
        from ..shell.server_process import loop_factory, provide_files

        check_controllers_apart(settings, source)
        if print_config:
            print(server_settings_as_toml(settings), end="")
            return
        robots = [serial_robot(cell.robot) for cell in settings.cells]
        make_loop = loop_factory(settings.cells[0].event_loop)
        provide_files(settings, source)
    except (ConfigurationError, MotionError) as error:
        raise _failure(str(error), ExitCode.USAGE) from None
    # Imported here so that a wrong configuration answers without loading pinocchio.
    from ..access.open_access import opened_access
    from ..planning.pool.forked_child import forked_children
    from ..planning.pool.planning_pool import processes_for
    from ..shell.app import App  # noqa: F401 - so that planning processes need not import it
    from ..shell.listening import ListenFailed

    try:
        # Before anything that starts a thread: the log, the accounts, the store, the loop.
        with forked_children(*processes_for([cell.robot for cell in settings.cells])) as planners:
            _log_to_standard_error(logging.INFO if verbose else logging.WARNING)
            with opened_access(settings, source) as access:
                for warning in access.warnings:
                    print(f"openpendant serve: {warning}", file=sys.stderr)
                made = ServerParts(settings, robots, access, planners)
                with asyncio.Runner(loop_factory=make_loop) as runner:
                    runner.run(_run(made, json_output, plans, journal))
    except ConfigurationError as error:
        raise _failure(str(error), ExitCode.USAGE) from None
    except ListenFailed as error:
        raise _failure(str(error), ExitCode.REFUSED) from None
    except OSError as error:
        raise _failure(" ".join(str(error).split()), ExitCode.FAILED) from None


def _log_to_standard_error(level: int) -> None:
    # Through a background thread: a terminal that is held must hold up no robot's server.
    handler = LimitedHandler(LogStream(standard_error()))
    logging.basicConfig(level=level, handlers=[handler])


def _override(data: dict[str, Any], table: str | None, **values: object) -> None:
    """Put arguments over what the file says; a file's wrong table is left for the check."""
    given = {key: value for key, value in values.items() if value is not None}
    target = data if table is None else data.setdefault(table, {}) if given else {}
    if isinstance(target, dict):
        target.update(given)


def _check_unused(values: dict[str | None, dict[str, Any]], controller: str | None) -> None:
    """Refuse arguments that speak of one cell, where a file has several.

    Raises:
        ConfigurationError: such an argument was given.
    """
    given = [key for table in values.values() for key, value in table.items() if value is not None]
    if not given:
        return
    argument = "controller" if controller is not None else given[0].replace("_", "-")
    problem = "speaks of one cell, and the file has [[cells]]; write it there"
    raise ConfigurationError("arguments", f"--{argument}", problem)


def _controller_address(text: str) -> dict[str, Any]:
    host, _, ports = text.partition(":")
    motion, _, state = ports.partition(":")
    if not (host and motion.isdigit() and state.isdigit()):
        raise ConfigurationError(
            "arguments", "--controller", f"{text!r}; expected HOST:MOTION_PORT:STATE_PORT"
        )
    return {"host": host, "motion_port": int(motion), "state_port": int(state)}


def _failure(text: str, code: int) -> typer.Exit:
    complain(f"openpendant serve: {text}")
    return typer.Exit(code)


@contextlib.contextmanager
def kept_journal(journal: Journal, file: Path | None, settings: ServerSettings) -> Iterator[None]:
    """Keep the journal in a file while the context lasts; a full disk ends it, not the run."""
    if file is None:
        yield
        return
    from openpendant.simplemsg.journal_writer import JournalWriter  # most runs keep no journal

    from ..shell.inbox import loop_time  # here for the same reason as in `serve`

    stream = JournalWriter(file)
    started = datetime.now().astimezone().isoformat()
    cells = [settings_as_data(cell) for cell in settings.cells]
    about = {"version": __version__, "settings": cells[0] if len(cells) == 1 else {"cells": cells}}
    journal.keep(stream, _journal_failed, loop_time(), kind="server", started=started, **about)
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


@dataclass(frozen=True, slots=True)
class ServerParts:
    """The parts of a server that exist before its loop runs.

    Attributes:
        robots: one for each cell.
        planners: planning processes that run already.
    """

    settings: ServerSettings
    robots: Sequence[SerialRobot]
    access: OpenedAccess
    planners: Sequence[ForkedChild]


async def _run(
    made: ServerParts, json_output: bool, plans: Path | None, journal_file: Path | None
) -> None:
    from ..shell.app import App  # here for the same reason as in `serve`
    from ..shell.server_process import asked_niceness
    from ..store.store_client import opened_store
    from ..watchdog.watchdog_process import watchdog_of

    loop = asyncio.get_running_loop()
    interrupted = asyncio.Event()
    signals = (signal.SIGINT, signal.SIGTERM)
    for number in signals:
        loop.add_signal_handler(number, interrupted.set)
    settings, access = made.settings, made.access
    served = _served(settings, made.robots, plans)
    journal = Journal()
    async with opened_store(settings.cells[0].store) as store:
        watchdog = watchdog_of([each.settings for each in served])
        parts = (served, journal, store, access.backend, watchdog, access.tls, made.planners)
        server = App(*parts, gateway_secrets=access.gateway_secrets)
        # The priority first, so that the watchdog's process has it as well.
        priority = asked_niceness(settings.cells[0].niceness)
        with priority, kept_journal(journal, journal_file, settings), watchdog:
            async with server.running() as ports:
                # What start-up made stays: the collector need not look at it, tick after tick.
                gc.freeze()
                gc.set_threshold(_UNCOLLECTED)
                gc.enable()
                say_ready(ports, json_output)
                await interrupted.wait()
    for cell in served:
        if cell.plans is not None:
            await asyncio.to_thread(cell.plans.close)
    # A loop that closes takes its handlers back only after it closed what they write to.
    for number in signals:
        signal.signal(number, signal.SIG_IGN)


def _served(
    settings: ServerSettings, robots: Sequence[SerialRobot], plans: Path | None
) -> list[CellParts]:
    from ..planning.plan_store import PlanStore
    from ..shell.cell_shell import CellParts  # here for the same reason as in `serve`

    def store(number: int) -> PlanStore | None:
        if plans is None:
            return None
        # The name of a cell may hold what the name of a folder may not.
        return PlanStore(plans if len(robots) == 1 else plans / f"cell{number}")

    return [
        CellParts(cell, robot, plans=store(number))
        for number, (cell, robot) in enumerate(zip(settings.cells, robots, strict=True), 1)
    ]


def say_ready(ports: Ports, json_output: bool) -> None:
    """Print where the server listens, in one line."""
    if json_output:
        emit_json({"event": "ready", **_ready(ports)}, flush=True)
        return
    cells = [
        f"cell={name!r} ros_motion={ros.motion or OFF} ros_state={ros.state or OFF}"
        for name, ros in ports.ros.items()
    ]
    if len(cells) == 1:
        cells = [cells[0].partition(" ")[2]]
    print(f"server ready pendant={ports.pendant}", *cells, f"pid={os.getpid()}", flush=True)


def _ready(ports: Ports) -> dict[str, Any]:
    """Return what the ready line says: of one cell its own ports, of several a table of them."""
    cells = {
        name: {"ros_motion": ros.motion, "ros_state": ros.state} for name, ros in ports.ros.items()
    }
    about = {"cells": cells} if len(cells) > 1 else next(iter(cells.values()))
    return {"pendant": ports.pendant, **about, "pid": os.getpid()}


def main(argv: list[str]) -> int:
    """Run `openpendant serve` with arguments; return the exit code."""
    # Start-up makes objects that stay; looking for garbage among them takes a tenth of its time.
    gc.disable()
    try:
        return run_alone(app, "serve", argv)
    finally:
        gc.enable()
