"""The arguments of `openpendant emulate`, and the settings that they come to.

Owns the options and how many controllers they ask for; what a setting may be is `settings`' rule.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

from .settings import EmulatorSettings, EmulatorSettingsError, load_settings

MOST_CONTROLLERS = 64
"""More would not keep their rate in one process."""

PORT_STEP = 4
"""From the ports of one controller to those of the next."""


def parser() -> argparse.ArgumentParser:
    """Return what reads the arguments."""
    reader = argparse.ArgumentParser(
        prog="openpendant emulate",
        description="Run an emulated multi-axis controller. Keys at a terminal: e emergency stop"
        " (TRAINING), r reset, q quit.",
        epilog="Exit codes: 0 ended on request, 1 a file could not be written or, with --strict,"
        " the referee saw a violation, 2 wrong usage or configuration, 3 a port could not be"
        " bound.",
    )
    add = reader.add_argument
    add("--config", type=Path, metavar="FILE", help="cell file; its table [emulator] is read")
    add("--print-config", action="store_true", help="print the settings in effect and leave")
    add("--robot", metavar="NAME|FILE", help="robot of the project, or a robot file")
    add("--host", help="address to listen on (default 127.0.0.1); others warn")
    add("--motion-port", type=int, metavar="PORT", help="0 for a free one (default 12000)")
    add("--state-port", type=int, metavar="PORT", help="0 for a free one (default 12002)")
    add("--count", type=int, metavar="N", help="so many controllers, their ports 4 apart")
    add("--start", metavar="home|zero|'[…]'", help="joint position at the start, rad or m")
    add("--event-loop", metavar="NAME", help="asyncio (default) or uvloop, of the extra `fast`")
    add("--rate", type=int, metavar="HZ", help="joint reports per second (default 100)")
    add(
        "--byte-order", metavar="ORDER", help="of the state link until a request tells: little, big"
    )
    add(
        "--joint-feedback",
        action=argparse.BooleanOptionalAction,
        default=None,
        help="report type 15 too (default), which the stock ROS-I client logs as unknown",
    )
    add("--buffer", type=int, metavar="POINTS", help="most buffered points (default 200)")
    add("--scenario", type=Path, metavar="FILE", help="timed operator events")
    add("--report", type=Path, metavar="FILE", help="write the referee's record as JSON")
    add("--record", type=Path, metavar="FILE", help="write the executed motion as CSV")
    add("--journal", type=Path, metavar="FILE", help="write every byte, to run it again exactly")
    add("--strict", action="store_true", help="exit code 1 if the referee saw a violation")
    add("--json", action="store_true", help="one JSON object a line on standard output")
    return reader


def settings_of(arguments: argparse.Namespace) -> EmulatorSettings:
    """Return the cell file's settings with what the arguments say instead.

    Raises:
        ConfigurationError: one of them cannot be.
    """
    return load_settings(arguments.config, _overrides(arguments))


def _overrides(arguments: argparse.Namespace) -> dict[str, Any]:
    names = set(vars(arguments)) & set(EmulatorSettings.model_fields)
    given = {name: value for name in names if (value := getattr(arguments, name)) is not None}
    start = given.get("start")
    if start is not None and start not in ("home", "zero"):
        try:
            given["start"] = json.loads(start)
        except json.JSONDecodeError:
            expected = "home, zero, or joint values such as '[0, -1.57, 1.57, 0, 0, 0]'"
            raise EmulatorSettingsError("arguments", "--start", start, expected) from None
    return given


def settings_of_each(
    settings: EmulatorSettings, options: argparse.Namespace
) -> list[EmulatorSettings]:
    """Return the settings of each controller.

    Raises:
        ConfigurationError: there are too many, or a file is asked for that is one controller's.
    """
    count = options.count
    if count is None:
        return [settings]
    ports = max(settings.motion_port, settings.state_port)
    most = min(MOST_CONTROLLERS, (65_535 - ports) // PORT_STEP + 1)
    if not 1 <= count <= most:
        raise EmulatorSettingsError("arguments", "--count", str(count), f"1 to {most}")
    for option in ("scenario", "record", "journal"):
        if count > 1 and getattr(options, option) is not None:
            raise EmulatorSettingsError("arguments", "--count", str(count), f"1 with --{option}")
    return [_shifted(settings, PORT_STEP * number) for number in range(count)]


def _shifted(settings: EmulatorSettings, by: int) -> EmulatorSettings:
    """Return settings with other ports; 0 stays any free one."""
    ports = {"motion_port": settings.motion_port, "state_port": settings.state_port}
    return settings.model_copy(
        update={key: port + by if port else 0 for key, port in ports.items()}
    )
