"""`openpendant emulate`: the run, the operator's keys, messages to the user, exit codes.

Owns the choice of the event loop and, while keys are watched, the mode of the terminal. Exit codes:
0 for a run that ended on request; 1 for one with a file that cannot be written or, with `--strict`,
in which the referee saw a violation; 2 for wrong usage or configuration; 3 for a port that could
not be bound.
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
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from datetime import datetime
from pathlib import Path
from typing import Any

from openpendant.motion.errors import LibraryMissing, MotionError
from openpendant.simplemsg import __version__
from openpendant.simplemsg.journal import Journal
from openpendant.simplemsg.pendant import OperatorAction

from ..float32 import NANOSECONDS
from ..interpolation.segment import State
from .build import build_controller
from .recording import MotionLog, write_report
from .service import EmulatorListenFailed, EmulatorPorts, Service, loop_time
from .settings import (
    EmulatorSettings,
    EmulatorSettingsError,
    EventLoop,
    as_toml,
    parser,
    settings_of,
    settings_of_each,
)

OK, FAILED, USAGE, PORT_TAKEN = 0, 1, 2, 3

EMERGENCY_STOP, RESET, QUIT = "e", "r", "q"


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
    except (EmulatorSettingsError, MotionError) as error:
        return _fail(str(error), USAGE)
    except EmulatorListenFailed as error:
        return _fail(str(error), PORT_TAKEN)
    except OSError as error:
        return _fail(_reason(error))


async def _run(wanted: Sequence[EmulatorSettings], options: argparse.Namespace) -> int:
    loop = asyncio.get_running_loop()
    due = _operator(options.scenario, loop)
    journal, now = Journal(), loop_time(loop)
    with contextlib.ExitStack() as stack:
        if options.journal is not None:
            stack.enter_context(kept_journal(journal, options.journal, wanted[0], now))
        controllers = [build_controller(each, now) for each in wanted]
        log = MotionLog(options.record, controllers[0].joint_names) if options.record else None
        if log is not None:
            stack.callback(_close, log)
        # Log, scenario and journal belong to one controller, so several controllers have none.
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
        # Objects made at start-up stay: frozen, the collector does not scan them at each tick.
        gc.freeze()
        gc.enable()
        try:
            await stop.wait()
        finally:
            for service in services:
                await service.close()
    text = "\n".join(str(controller.referee) for controller in controllers)
    return _finish([controller.referee.as_dict() for controller in controllers], text, options)


async def _start(services: Sequence[Service]) -> list[EmulatorPorts]:
    """Start all controllers, or none.

    Raises:
        EmulatorListenFailed: a port cannot be used.
    """
    ports: list[EmulatorPorts] = []
    try:
        for service in services:
            ports.append(await service.start())
    except EmulatorListenFailed:
        for service in services:
            await service.close()
        raise
    return ports


def _operate(services: Sequence[Service], action: OperatorAction) -> None:
    """Carry out an operator's action at every controller."""
    for service in services:
        service.operate(action)


@contextlib.contextmanager
def kept_journal(
    journal: Journal, file: Path, settings: EmulatorSettings, now: int
) -> Iterator[None]:
    """Keep the journal in a file while the context lasts; a full disk ends it, not the run.

    Args:
        now: when the controller was built [ns].
    """

    def end(error: OSError) -> None:
        _fail(f"the journal ends here: {_reason(error)}")

    from openpendant.simplemsg.journal_writer import JournalWriter  # most runs keep no journal

    stream = JournalWriter(file)
    started = datetime.now().astimezone().isoformat()
    about = {"version": __version__, "settings": settings.model_dump(mode="json")}
    journal.keep(stream, end, now, kind="emulator", started=started, **about)
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
    """Return the player of the operator's scenario, None without one."""
    if file is None:
        return None
    from .scenario import ScenarioPlayer, load_scenario

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
    """Warn if other machines can connect: nobody has to log in."""
    if host in ("127.0.0.1", "localhost"):
        return
    import ipaddress  # imported here because most runs need none, and the emulator must start fast

    try:
        is_loopback = ipaddress.ip_address(host).is_loopback
    except ValueError:
        is_loopback = False
    if not is_loopback:
        _say(f"warning: whoever reaches {host or 'any address'} may move this robot")


def _say_ready(ports: Sequence[EmulatorPorts], began: float, *, as_json: bool) -> None:
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


@contextmanager
def watched_keys(actions: Mapping[str, Callable[[], None]]) -> Iterator[bool]:
    """Call an action for each key that is pressed, while the context lasts.

    Nothing is watched where standard input is no terminal, and False is yielded.
    """
    # A process that was started with its standard input closed has none at all.
    if sys.platform == "win32" or sys.stdin is None or not sys.stdin.isatty():
        yield False
        return
    import termios
    import tty

    terminal = sys.stdin.fileno()
    loop = asyncio.get_running_loop()

    def read() -> None:
        typed = os.read(terminal, 64).decode("ascii", "replace")
        if not typed:
            loop.remove_reader(terminal)
        for key in typed:
            if key in actions:
                actions[key]()

    before = termios.tcgetattr(terminal)
    tty.setcbreak(terminal)
    loop.add_reader(terminal, read)
    try:
        yield True
    finally:
        loop.remove_reader(terminal)
        termios.tcsetattr(terminal, termios.TCSADRAIN, before)


def loop_factory(wanted: EventLoop) -> Callable[[], asyncio.AbstractEventLoop] | None:
    """Return what makes the event loop, as `asyncio.Runner` takes it; None for Python's own.

    Raises:
        LibraryMissing: uvloop is not installed.
    """
    if wanted == "asyncio":
        return None
    try:
        import uvloop  # imported here because most runs need none, and the emulator must start fast
    except ImportError:
        raise LibraryMissing("uvloop", "fast") from None
    return uvloop.new_event_loop
