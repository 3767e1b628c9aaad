"""Client role of the tester: judges a recording, or a client that connects to it.

Owns the arguments of the client role. The verdicts are `judge`'s.
"""

from __future__ import annotations

import argparse
import asyncio
import re
import shlex
from collections.abc import Mapping
from functools import partial
from pathlib import Path

from openpendant.motion.description.limits import JointLimits
from openpendant.simplemsg import MOTOMAN, ByteOrder

from ....console import complain
from ...console import ORDERS, PacketToolError, PeerError, add_wire_form, codec_of, seconds
from ...live.endpoints import is_loopback
from ...reading.trace_files import read_trace
from ...trace import Entry
from ..check import CheckFinding, Judgement
from .controller import ScriptedController
from .judge import judge_scenario, results_of, scenarios_of
from .live import LiveController, Trigger
from .setup import SCENARIOS, Purpose, Scenario, Setup

MAX_ENTRIES = 1_000_000
"""Most entries of a recording; each is held in memory."""

_PORTS = (Purpose.MOTION, Purpose.STATE, Purpose.IO)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add what the client role takes."""
    group = parser.add_argument_group("judging a client (--role client)")
    group.add_argument("--capture", type=Path, metavar="FILE", help="judge a recorded client")
    group.add_argument(
        "--ports",
        type=_ports,
        metavar="MOTION[:STATE[:IO]]",
        help="of a capture with unusual ports: what they are for",
    )
    group.add_argument(
        "--listen",
        type=_listen,
        metavar="[HOST:]MOTION[:STATE]",
        help="let the client connect here; 0 for any free port; STATE is MOTION + 2 unless given",
    )
    group.add_argument(
        "--trigger",
        metavar="COMMAND",
        help="run without a shell before each scenario, to make the client begin a trajectory;"
        " {scenario} is replaced by its name; without it a person is asked",
    )
    group.add_argument(
        "--wait",
        type=seconds,
        default=60.0,
        metavar="S",
        help="how long to wait for a trajectory in each scenario (default: 60)",
    )
    group.add_argument(
        "--scenario",
        action="append",
        choices=[scenario.name for scenario in SCENARIOS],
        metavar="NAME",
        help="play only this scenario; may be repeated; one of: "
        + ", ".join(scenario.name for scenario in SCENARIOS),
    )
    group.add_argument(
        "--at-point",
        type=int,
        default=1,
        metavar="N",
        help="make a scenario's change at the point with this index (default: 1)",
    )
    group.add_argument("--robot", metavar="NAME|FILE", help="robot whose limits hold")
    group.add_argument("--joints", type=int, metavar="N", help="number of joints, if no --robot")
    add_wire_form(parser, order=None)


async def judge_client(options: argparse.Namespace) -> Judgement:
    """Judge a client as the arguments say; see `add_arguments`.

    Raises:
        PacketToolError: the arguments make no sense, a file cannot be read, a port is taken.
        PeerError: no client connected.
    """
    if (options.capture is None) == (options.listen is None):
        raise PacketToolError("--role client needs either --capture or --listen")
    setup = _setup(options)
    if options.capture is not None:
        return judge_recording(options.capture, setup)
    return await _judge_listening(options, setup)


def judge_recording(file: Path, setup: Setup) -> Judgement:
    """Judge a recorded client, scenario by scenario; PacketToolError where it is unreadable."""
    entries: list[Entry] = []
    for entry in read_trace(file):
        entries.append(entry)
        if len(entries) > MAX_ENTRIES:
            raise PacketToolError(f"{file}: more than {MAX_ENTRIES} entries; judge a part of it")
    findings = {name: judge_scenario(part, setup) for name, part in scenarios_of(entries).items()}
    return Judgement(f"client in {file}", "client", results_of(findings))


async def _judge_listening(options: argparse.Namespace, setup: Setup) -> Judgement:
    host, motion, state = options.listen
    if state is None:
        state = motion and motion + (1 if setup.dialect is MOTOMAN else 2)
    robot = _robot(options)
    core = ScriptedController(
        setup, robot[1] if robot else (), at_point=options.at_point, now=LiveController.now()
    )
    live = LiveController(core, host, {Purpose.MOTION: motion, Purpose.STATE: state})
    chosen = [
        scenario
        for scenario in SCENARIOS
        if (options.scenario is None or scenario.name in options.scenario)
        and (setup.dialect is MOTOMAN or not scenario.is_motoman)
    ]
    trigger = _ask if options.trigger is None else partial(_run, _words(options.trigger))
    async with live.listening() as ports:
        told = ", ".join(f"{purpose.value} {port}" for purpose, port in ports.items())
        complain(f"listening on {host}: {told}")
        if not is_loopback(host):
            complain("warning: whoever reaches this address may connect")
        findings = await judge_live(live, setup, chosen, trigger, options.wait)
    return Judgement(f"client of {host}, {told}", "client", results_of(findings))


async def judge_live(
    live: LiveController, setup: Setup, scenarios: list[Scenario], trigger: Trigger, wait: float
) -> Mapping[str, Mapping[str, CheckFinding]]:
    """Return the findings by scenario and check; PeerError where no client ever connected."""
    ports = {port: purpose for purpose, port in live.ports.items()}
    known = Setup(setup.dialect, setup.order, setup.real_size, setup.dof, setup.limits, ports)
    findings: dict[str, Mapping[str, CheckFinding]] = {}
    for scenario in scenarios:
        trace = await live.play(scenario, trigger, wait)
        findings[scenario.name] = judge_scenario(trace, known)
    if not live.was_connected:
        raise PeerError(f"no client connected; {wait:g} s were waited in each scenario")
    return findings


async def _ask(scenario: Scenario) -> None:
    """Ask the person at the terminal to make the client move."""
    complain(f"{scenario.name} ({scenario.mutation.value}): make the client begin a trajectory now")


async def _run(command: list[str], scenario: Scenario) -> None:
    """Run the trigger; what it prints goes where ours goes."""
    words = [word.replace("{scenario}", scenario.name) for word in command]
    try:
        process = await asyncio.create_subprocess_exec(
            *words, stdin=asyncio.subprocess.DEVNULL, stdout=asyncio.subprocess.DEVNULL
        )
    except OSError as error:
        complain(f"--trigger {words[0]}: {error.strerror or error}")
        return
    try:
        code = await process.wait()
    except asyncio.CancelledError:
        process.kill()
        await process.wait()
        raise
    if code:
        complain(f"{scenario.name}: the trigger ended with exit code {code}")


def _words(command: str) -> list[str]:
    try:
        words = shlex.split(command)
    except ValueError as error:
        raise PacketToolError(f"--trigger {command!r}: {error}") from None
    if not words:
        raise PacketToolError("--trigger is empty")
    return words


def _setup(options: argparse.Namespace) -> Setup:
    codec = codec_of(options)
    robot = _robot(options)
    order: ByteOrder | None = ORDERS[options.order] if options.order else None
    return Setup(
        dialect=codec.dialect,
        order=order,
        real_size=codec.real_size,
        dof=options.joints,
        limits=robot[0] if robot else None,
        ports=options.ports or {},
    )


def _robot(options: argparse.Namespace) -> tuple[JointLimits, tuple[float, ...]] | None:
    """Return limits and home position of `--robot`."""
    if options.robot is None:
        return None
    # Robot files need pydantic and yaml, which take longer to import than most runs take.
    from openpendant.motion.description.robot import serial_robot
    from openpendant.motion.errors import MotionError

    try:
        robot = serial_robot(options.robot)
    except MotionError as error:
        raise PacketToolError(f"--robot {options.robot}: {error}") from None
    return robot.limits, robot.home_position


def _ports(text: str) -> dict[int, Purpose]:
    numbers = text.split(":")
    if len(numbers) > len(_PORTS) or not all(re.fullmatch(r"[0-9]{1,5}", n) for n in numbers):
        raise argparse.ArgumentTypeError(f"{text[:40]!r} is no MOTION[:STATE[:IO]]")
    return {int(number): purpose for number, purpose in zip(numbers, _PORTS, strict=False)}


def _listen(text: str) -> tuple[str, int, int | None]:
    found = re.fullmatch(r"(?:(.*?):)??([0-9]{1,5})(?::([0-9]{1,5}))?", text)
    if found is None:
        raise argparse.ArgumentTypeError(f"{text[:80]!r} is no [HOST:]MOTION[:STATE]")
    host, motion, state = found.groups()
    ports = [int(port) for port in (motion, state) if port is not None]
    if max(ports) > 65_535:
        raise argparse.ArgumentTypeError(f"{max(ports)} is no TCP port")
    return (host or "127.0.0.1").strip("[]"), ports[0], ports[1] if state is not None else None
