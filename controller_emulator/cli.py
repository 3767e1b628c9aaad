"""`openpendant emulate`: the run, messages to the user, exit codes.

Exit codes: 0 for a run that ended on request; 1 for one with a file that cannot be written or, with
`--strict`, in which the referee saw a violation; 2 for wrong usage or configuration; 3 for a port
that could not be bound.
"""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import gc
import json
import os
import signal
import sys
from collections.abc import Callable, Iterator, Sequence
from datetime import datetime
from pathlib import Path
from typing import Any

from openpendant.motion.errors import MotionError
from openpendant.simplemsg import __version__
from openpendant.simplemsg.journal import Journal
from openpendant.simplemsg.pendant import OperatorAction

from .arguments import parser, settings_of, settings_of_each
from .assembly import build_controller
from .console import EMERGENCY_STOP, QUIT, RESET, watched_keys
from .event_loop import loop_factory
from .float32 import NANOSECONDS
from .recording import MotionLog, write_report
from .segment import State
from .service import ListenFailed, Ports, Service, loop_time
from .settings import ConfigurationError, EmulatorSettings, as_toml

OK, FAILED, USAGE, PORT_TAKEN = 0, 1, 2, 3


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command and return its exit code; no error leaves as a traceback."""
    arguments = parser().parse_args(argv)
    try:
        settings = settings_of(arguments)
        if arguments.print_config:
            print(as_toml(settings), end="")
            return OK
        wanted = settings_of_each(settings, arguments)
        with asyncio.Runner(loop_factory=loop_factory(settings.event_loop)) as runner:
            return runner.run(_run(wanted, arguments))
    except (ConfigurationError, MotionError) as error:
        return _fail(str(error), USAGE)
    except ListenFailed as error:
        return _fail(str(error), PORT_TAKEN)
    except OSError as error:
        return _fail(_reason(error))


async def _run(wanted: Sequence[EmulatorSettings], options: argparse.Namespace) -> int:
    loop = asyncio.get_running_loop()
    due = _operator(options.scenario, loop)
    journal = Journal(lambda: loop_time(loop))
    journal.begin("start")
    with contextlib.ExitStack() as stack:
        if options.journal is not None:
            stack.enter_context(kept_journal(journal, options.journal, wanted[0]))
        controllers = [build_controller(each, journal.now) for each in wanted]
        log = MotionLog(options.record, controllers[0].joint_names) if options.record else None
        if log is not None:
            stack.callback(_close, log)
        # What belongs to one controller, log, scenario and journal, is there for the only one.
        services = [
            Service(controller, each, on_report=_recorder(log), due=due, journal=journal)
            for controller, each in zip(controllers, wanted, strict=True)
        ]
        ports = await _start(services)
        _warn_of_strangers(wanted[0].host)
        stop = asyncio.Event()
        stack.enter_context(_stopped_by_signals(loop, stop))
        stack.enter_context(
            watched_keys(
                {
                    EMERGENCY_STOP: lambda: _operate(services, OperatorAction.EMERGENCY_STOP),
                    RESET: lambda: _operate(services, OperatorAction.RESET),
                    QUIT: stop.set,
                }
            )
        )
        _say_ready(ports, services[0].began, as_json=options.json)
        # What start-up made stays: the collector need not look at it again, tick after tick.
        gc.freeze()
        gc.enable()
        try:
            await stop.wait()
        finally:
            for service in services:
                await service.close()
    text = "\n".join(str(controller.referee) for controller in controllers)
    return _finish([controller.referee.as_dict() for controller in controllers], text, options)


async def _start(services: Sequence[Service]) -> list[Ports]:
    """Start all controllers, or none.

    Raises:
        ListenFailed: a port cannot be used.
    """
    ports: list[Ports] = []
    try:
        for service in services:
            ports.append(await service.start())
    except ListenFailed:
        for service in services:
            await service.close()
        raise
    return ports


def _operate(services: Sequence[Service], action: OperatorAction) -> None:
    """Have every controller's operator do something."""
    for service in services:
        service.operate(action)


@contextlib.contextmanager
def kept_journal(journal: Journal, file: Path, settings: EmulatorSettings) -> Iterator[None]:
    """Keep the journal in a file while the context lasts; a full disk ends it, not the run."""

    def end(error: OSError) -> None:
        _fail(f"the journal ends here: {_reason(error)}")

    from openpendant.simplemsg.journal_writer import JournalWriter  # most runs keep no journal

    stream = JournalWriter(file)
    started = datetime.now().astimezone().isoformat()
    about = settings.model_dump(mode="json")
    journal.keep(stream, end, kind="emulator", started=started, version=__version__, settings=about)
    try:
        yield
    finally:
        journal.end()
        try:
            stream.close()
        except OSError as error:
            _fail(f"the journal is incomplete: {_reason(error)}")


def _operator(
    file: Path | None, loop: asyncio.AbstractEventLoop
) -> Callable[[int], list[OperatorAction]] | None:
    """Return what tells which operator events are due, if there is a scenario."""
    if file is None:
        return None
    from .scenario import ScenarioPlayer, load_scenario  # a start without one is faster

    return ScenarioPlayer(load_scenario(file), round(loop.time() * NANOSECONDS)).due


@contextlib.contextmanager
def _stopped_by_signals(loop: asyncio.AbstractEventLoop, stop: asyncio.Event) -> Iterator[None]:
    """Have signals set an event while the context lasts; more of them are ignored to the end."""
    signals = (signal.SIGINT, signal.SIGTERM)
    for number in signals:
        try:
            loop.add_signal_handler(number, stop.set)
        except NotImplementedError:  # Windows
            signal.signal(number, lambda *_: loop.call_soon_threadsafe(stop.set))
    try:
        yield
    finally:
        # A loop that closes takes its handlers back only after it closed what they write to.
        for number in signals:
            signal.signal(number, signal.SIG_IGN)


def _recorder(log: MotionLog | None) -> Callable[[float, State], None] | None:
    """Return what writes the log; a full disk ends the log, not the run."""
    if log is None:
        return None
    is_broken = False

    def write(time: float, state: State) -> None:
        nonlocal is_broken
        if is_broken:
            return
        try:
            log.write(time, state)
        except OSError as error:
            is_broken = True
            _fail(f"the motion log ends here: {_reason(error)}")

    return write


def _close(log: MotionLog) -> None:
    try:
        log.close()
    except OSError as error:
        _fail(f"the motion log is incomplete: {_reason(error)}")


def _warn_of_strangers(host: str) -> None:
    """Say that others can connect, where they can: nobody is asked who they are."""
    if host in ("127.0.0.1", "localhost"):
        return
    import ipaddress  # most runs need none, and the emulator is to start fast

    try:
        is_loopback = ipaddress.ip_address(host).is_loopback
    except ValueError:
        is_loopback = False
    if not is_loopback:
        _say(f"warning: whoever reaches {host or 'any address'} may move this robot")


def _say_ready(ports: Sequence[Ports], began: float, *, as_json: bool) -> None:
    pid = os.getpid()
    if as_json:
        # The motion log counts from `origin_ns`, on the clock that all processes here share.
        origin = round(began * NANOSECONDS)
        all_of_them = [each._asdict() for each in ports]
        about = all_of_them[0] if len(ports) == 1 else {"controllers": all_of_them}
        line = json.dumps({"event": "ready", **about, "pid": pid, "origin_ns": origin})
    else:
        where = " ".join(f"motion={motion} state={state}" for motion, state in ports)
        line = f"emulator ready {where} pid={pid}"
    print(line, flush=True)


def _finish(records: Sequence[dict[str, Any]], text: str, options: argparse.Namespace) -> int:
    violations = sum(record["violations"] for record in records)
    record = {"violations": violations, "controllers": list(records)}
    if len(records) == 1:
        record = records[0]
    print(text, file=sys.stderr)
    if options.json:
        print(json.dumps({"event": "summary", **record}), flush=True)
    if options.report:
        write_report(options.report, record)
    return FAILED if options.strict and violations else OK


def _reason(error: OSError) -> str:
    return " ".join(str(error).split())


def _say(text: str) -> None:
    print(f"openpendant emulate: {text}", file=sys.stderr)


def _fail(reason: str, code: int = FAILED) -> int:
    _say(reason)
    return code
