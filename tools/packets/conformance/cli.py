"""`openpendant packets conformance`: arguments, the question before anything moves, the report.

Owns the command line and its exit codes. What is judged, and how, is the runner's business for
servers and `client.role`'s for clients.
"""

from __future__ import annotations

import argparse
import asyncio
import re
import signal
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

from openpendant.motion.description.limits import JointLimits
from openpendant.motion.errors import MotionError
from openpendant.simplemsg import JOINT_SLOTS

from ...console import ExitCode, complain
from ..console import ORDERS, PacketToolError, PeerError, add_wire_form, parser
from ..console import run as run_command
from .check import Check, CheckVerdict, Judgement, Profile, Result, Section
from .report import as_json, as_junit, as_text
from .server.checks import server_checks
from .server.runner import applicable, judge
from .server.target import Options
from .server.wire import TargetUnreachable

_ABOUT = """Judge a simple-message server (a robot controller) or a client, check by check.

--role server connects to HOST:MOTION[:STATE] and judges what it finds there.
--role client listens and judges whatever client connects."""

_EPILOG = (
    "exit codes: 0 nothing failed; 1 something failed; 2 wrong usage; 3 target not reachable;\n"
    "130 interrupted (Ctrl-C, SIGTERM): the robot was sent STOP, and the report is partial"
)

_MARKS = {
    CheckVerdict.PASSED: ".",
    CheckVerdict.FAILED: "FAILED",
    CheckVerdict.DEVIATES: "deviates",
    CheckVerdict.NOT_APPLICABLE: "n.a.",
}
_LARGEST_AMPLITUDE = 0.2
_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
_ADDRESS = re.compile(r"(?P<host>\[[^\]]+\]|[^:]+):(?P<motion>[^:]*)(:(?P<state>[^:]*))?")


def main(argv: list[str] | None = None) -> int:
    """Run the command; return its exit code."""
    arguments = sys.argv[1:] if argv is None else argv
    role = argparse.ArgumentParser(add_help=False, allow_abbrev=False, exit_on_error=False)
    role.add_argument("--role", default="server")
    try:
        chosen = role.parse_known_args(arguments)[0].role
    except argparse.ArgumentError:
        chosen = "server"  # the full parser will complain
    command = parser("conformance", _ABOUT, _EPILOG)
    command.add_argument(
        "--role", choices=("server", "client"), default="server", help="which end is judged"
    )
    command.add_argument(
        "--list", action="store_true", help="list the checks of both roles, and end"
    )
    command.add_argument("--json", action="store_true", help="print the report as JSON")
    command.add_argument("--junit", metavar="FILE", type=Path, help="write the report as JUnit XML")
    if chosen == "client":
        from .client import (
            role as client_role,  # its own arguments; nothing of it is needed to judge a server
        )

        client_role.add_arguments(command)
    else:
        _add_server_arguments(command)
    return run_command(command, _run, arguments)


def _add_server_arguments(command: argparse.ArgumentParser) -> None:
    command.add_argument(
        "target", nargs="?", metavar="HOST:MOTION[:STATE]", help="address and ports"
    )
    command.add_argument("--pendant-port", type=_port, metavar="PORT", help="our pendant protocol")
    command.add_argument(
        "--profile",
        choices=[profile.value for profile in Profile],
        help="what it is judged as (default: generic, motoman with --dialect motoman)",
    )
    command.add_argument(
        "--only", default="", metavar="FS03,stop,…", help="numbers of checks or names of sections"
    )
    command.add_argument(
        "--yes-it-may-move",
        action="store_true",
        help="the robot may be moved, slowly and by little",
    )
    command.add_argument("--robot", metavar="NAME|FILE", help="robot whose limits hold")
    command.add_argument("--joint", type=int, metavar="N", help="joint to move, from 1")
    command.add_argument(
        "--amplitude", type=float, default=0.05, metavar="RAD", help="how far (default: 0.05)"
    )
    add_wire_form(command, order=None)


def _port(text: str) -> int:
    if not text.isdigit() or not 1 <= int(text) <= 65_535:
        raise argparse.ArgumentTypeError(f"{text!r} is no TCP port")
    return int(text)


def _run(arguments: argparse.Namespace) -> int:
    if arguments.list:
        _list()
        return ExitCode.OK
    if arguments.junit is not None:
        _check_writable(arguments.junit)
    interruption = _Interruption()
    if arguments.role == "client":
        from .client import role as client_role

        judgement = asyncio.run(client_role.judge_client(arguments))
    else:
        judgement = _judge_server(arguments, interruption)
    if arguments.junit is not None:
        arguments.junit.write_text(as_junit(judgement), encoding="utf-8")
    print(as_json(judgement) if arguments.json else as_text(judgement, sys.stdout.isatty()))
    if interruption.has_happened:
        return ExitCode.INTERRUPTED
    return ExitCode.FAILED if judgement.count(CheckVerdict.FAILED) else ExitCode.OK


def _check_writable(file: Path) -> None:
    """Raise PacketToolError before the run if its report could not be written after it."""
    is_new = not file.exists()
    try:
        file.open("a").close()
        if is_new:
            file.unlink()
    except OSError as error:
        raise PacketToolError(f"--junit {file}: {error.strerror or error}") from None


class _Interruption:
    """Signals that end a run early, after the robot was sent STOP."""

    def __init__(self) -> None:
        self.has_happened = False

    def listen(self, interrupt: Callable[[], None]) -> None:
        """Take the signals from now on, on the running loop."""

        def take() -> None:
            if not self.has_happened:
                complain("interrupted: STOP is sent")
            self.has_happened = True
            interrupt()

        loop = asyncio.get_running_loop()
        for number in _SIGNALS:
            # One that is ignored stays so: under nohup a run outlives its terminal.
            if signal.getsignal(number) is not signal.SIG_IGN:
                loop.add_signal_handler(number, take)


def _list() -> None:
    from .client.judge import CHECKS

    checks: list[Check[Any]] = [*server_checks(), *CHECKS]
    for check in checks:
        print(f"{check.number}  {check.title}{' (moves)' if check.moves else ''}")
        print(f"      {check.clause}")
    print(f"{len(checks)} checks")


def _judge_server(arguments: argparse.Namespace, interruption: _Interruption) -> Judgement:
    options = _options(arguments)
    only = [word.strip() for word in arguments.only.split(",") if word.strip()]
    _check_only(only)
    chosen = applicable(options, only)
    if not chosen:
        raise PacketToolError("no check of this profile is asked for")
    if any(entry.moves for entry in chosen) and not options.may_move:
        options = _ask_first(options)
    progress = _Progress(len(chosen)) if sys.stderr.isatty() else None
    try:
        return asyncio.run(
            judge(options, only=only, progress=progress, on_start=interruption.listen)
        )
    except TargetUnreachable as error:
        raise PeerError(str(error)) from None


def _check_only(only: list[str]) -> None:
    numbers = {entry.number for entry in server_checks()}
    sections = {section.name for section in Section}
    for word in only:
        if word.upper() not in numbers | sections:
            known = ", ".join(section.name.lower() for section in Section)
            raise PacketToolError(
                f"--only: {word!r} is no check on servers and no section: {known}"
            )


def _ask_first(options: Options) -> Options:
    """Ask once whether the robot may move; nobody to ask means no."""
    if not (sys.stdin.isatty() and sys.stderr.isatty()):
        return options
    complain(
        f"Some checks move one joint by {options.amplitude:g} rad (m) and back, slowly; LS09 asks"
        " for it too fast, so that it may move as fast as the joint can."
        " Is the robot's space free, and somebody at its emergency stop?"
    )
    print("It may move [y/N]: ", end="", file=sys.stderr, flush=True)
    may_move = sys.stdin.readline().strip().lower() in ("y", "yes")
    return replace(options, may_move=may_move)


def _options(arguments: argparse.Namespace) -> Options:
    if arguments.target is None:
        raise PacketToolError("--role server needs HOST:MOTION[:STATE]")
    host, motion, state = _address(arguments.target)
    if arguments.dialect == "pendant":
        raise PacketToolError(
            "--dialect pendant: a pendant port is judged by --pendant-port, no controller speaks it"
        )
    limits = _limits(arguments.robot)
    dialect = "motoman" if arguments.profile == Profile.MOTOMAN.value else arguments.dialect
    profile = Profile.MOTOMAN if dialect == "motoman" else Profile.GENERIC
    if not 0.005 <= arguments.amplitude <= _LARGEST_AMPLITUDE:
        raise PacketToolError(
            f"--amplitude {arguments.amplitude:g}: accepted are 0.005 to {_LARGEST_AMPLITUDE:g}"
        )
    joints = limits.dof if limits is not None else JOINT_SLOTS
    if arguments.joint is not None and not 1 <= arguments.joint <= joints:
        raise PacketToolError(f"--joint {arguments.joint}: accepted are 1 to {joints}")
    return Options(
        host=host,
        motion_port=motion,
        state_port=state,
        pendant_port=arguments.pendant_port,
        profile=Profile(arguments.profile) if arguments.profile else profile,
        dialect=dialect,
        order=ORDERS[arguments.order] if arguments.order else None,
        real_size=arguments.real,
        may_move=arguments.yes_it_may_move,
        joint=None if arguments.joint is None else arguments.joint - 1,
        amplitude=arguments.amplitude,
        limits=limits,
    )


def _address(text: str) -> tuple[str, int, int | None]:
    found = _ADDRESS.fullmatch(text)
    if found is None:
        raise PacketToolError(f"{text!r} is not HOST:MOTION[:STATE]")
    try:
        ports = [_port(port) for port in found.group("motion", "state") if port is not None]
    except argparse.ArgumentTypeError as error:
        raise PacketToolError(f"{text}: {error}") from None
    return found["host"].strip("[]"), ports[0], ports[1] if len(ports) == 2 else None


def _limits(robot: str | None) -> JointLimits | None:
    if robot is None:
        return None
    from openpendant.motion.description.robot import (
        serial_robot,
    )  # reading robot files costs a tenth of a second

    try:
        return serial_robot(robot).limits
    except MotionError as error:
        raise PacketToolError(str(error)) from None


class _Progress:
    """One line a check on a terminal, while the report is not there yet."""

    def __init__(self, total: int) -> None:
        self._total = total
        self._done = 0

    def __call__(self, result: Result) -> None:
        self._done += 1
        mark = _MARKS[result.finding.verdict]
        complain(f"{self._done:3d}/{self._total} {result.check.number} {result.check.title} {mark}")
