"""Settings of the emulator: the table `[emulator]` of a cell file, overridden by arguments.

Owns names, bounds and defaults of the settings, the options of `openpendant emulate` with how many
controllers they ask for, and the sentence a user reads when a setting is wrong. Other tables of a
cell file belong to other programs and are not looked at.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from openpendant.motion.bounded_file import beginning_of, toml_of
from openpendant.motion.errors import shortened

TABLE = "emulator"

MAX_FILE = 1_048_576
"""Largest file that is read, bytes."""

Port = Annotated[int, Field(ge=0, le=65535)]
EventLoop = Literal["asyncio", "uvloop"]


_SHOWN = 200
"""Characters of a key or value that are shown."""


class EmulatorSettingsError(Exception):
    """A setting cannot be used.

    Attributes:
        file: where it stands, "arguments" for the command line.
    """

    def __init__(self, file: str, key: str, value: object, expected: str) -> None:
        super().__init__(f"{file}: {key} = {shortened(value, _SHOWN)}: expected {expected}")
        self.file = file
        self.key = key
        self.value = value
        self.expected = expected


class EmulatorSettings(BaseModel):
    """Settings of the emulator; durations in seconds, joint positions controller-side."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    robot: str = Field("ur5", description="name of a robot, or path of a robot file")
    profile: Literal["generic"] = Field("generic", description="vendor behaviour")
    host: str = Field("127.0.0.1", description="address to listen on")
    motion_port: Port = Field(12000, description="TCP port of the motion link, 0 for a free one")
    state_port: Port = Field(12002, description="TCP port of the state link, 0 for a free one")
    start: Literal["home", "zero"] | tuple[float, ...] = Field(
        "home", description="joint position at the start: home, zero, or values [rad or m]"
    )
    event_loop: EventLoop = Field(
        "asyncio", description="asyncio, or uvloop, which the extra `fast` installs"
    )
    rate: int = Field(100, ge=1, le=250, description="joint reports per second")
    buffer: int = Field(200, ge=2, le=10_000, description="most buffered points")
    byte_order: Literal["little", "big"] = Field(
        "little",
        description="order on the state link until its client's first request, on either link,"
        " tells; the motion link follows its client",
    )
    joint_feedback: bool = Field(
        True, description="report type 15 too, which the stock ROS-I client does not know"
    )
    real_size: Literal[4, 8] = Field(4, description="bytes of a real on the wire")
    strict_sequence: bool = Field(True, description="a gap in the sequence breaks the motion off")
    start_tolerance: float = Field(
        0.01, gt=0, le=0.1, description="how far a first point may be from the robot [rad or m]"
    )
    start_points: int = Field(2, ge=1, le=100, description="points needed before a motion starts")
    start_lead: float = Field(
        0.05, ge=0, le=1, description="buffered motion needed before a motion starts [s]"
    )
    start_wait: float = Field(
        0.02, ge=0, le=1, description="start anyway this long after the last point [s] …"
    )
    start_patience: float = Field(
        0.2, ge=0, le=1, description="… or this long if that point is passed at speed [s]"
    )
    interpolation_margin: float = Field(
        0.05, ge=0, le=0.5, description="acceleration allowed on top between two legal points"
    )
    inputs: int = Field(16, ge=0, le=512, description="digital inputs")
    outputs: int = Field(16, ge=0, le=512, description="digital outputs")
    operator_events: bool = Field(True, description="obey the message OPERATOR_EVENT (training)")
    max_connections: int = Field(96, ge=1, le=1024, description="most connections per port")
    violations_kept: int = Field(100, ge=1, le=10_000, description="violations stored in full")


def load_settings(
    file: Path | None = None, overrides: Mapping[str, Any] | None = None
) -> EmulatorSettings:
    """Return the settings of a cell file with arguments laid over them.

    Args:
        file: TOML file of a cell, with its `robot` and a table `[emulator]`; None for the defaults.
        overrides: settings given as arguments, by name.

    Raises:
        EmulatorSettingsError: the file cannot be read, or a setting is unknown or out of bounds.
    """
    table: dict[str, Any] = {} if file is None else _read_table(file)
    if file is not None:
        _validate(table, str(file))
    return _validate({**table, **(overrides or {})}, "arguments")


def _read_table(file: Path) -> dict[str, Any]:
    content = read_toml(file)
    table = content.get(TABLE, {})
    if not isinstance(table, dict):
        raise EmulatorSettingsError(str(file), TABLE, table, "a table")
    # The cell's robot is the emulator's too, unless its own table names another.
    shared = {"robot": content["robot"]} if "robot" in content else {}
    return {**shared, **table}


def read_toml(file: Path) -> dict[str, Any]:
    """Return the content of a TOML file.

    Raises:
        EmulatorSettingsError: it cannot be read, is too large or is no TOML.
    """
    try:
        content = beginning_of(file, MAX_FILE + 1)
        if len(content) > MAX_FILE:
            size = f"more than {MAX_FILE} bytes"
            raise EmulatorSettingsError(str(file), "file", size, f"at most {MAX_FILE} bytes")
        return toml_of(content)
    except OSError as error:
        reason = error.strerror or str(error)
        raise EmulatorSettingsError(str(file), "file", reason, "a readable file") from None
    except (ValueError, RecursionError) as error:  # no TOML, no UTF-8, or nested without end
        raise EmulatorSettingsError(str(file), "file", str(error), "TOML") from None


def _validate(values: Mapping[str, Any], source: str) -> EmulatorSettings:
    try:
        return EmulatorSettings.model_validate(values)
    except ValidationError as error:
        raise from_validation(error, source, TABLE, tuple(EmulatorSettings.model_fields)) from None


def from_validation(
    error: ValidationError, source: str, table: str, known: tuple[str, ...]
) -> EmulatorSettingsError:
    """Return the first finding of pydantic as one sentence for the user."""
    first = error.errors(include_url=False, include_context=False)[0]
    names = [str(part)[:_SHOWN] for part in first["loc"]]
    if first["type"] == "extra_forbidden":
        expected = f"one of {', '.join(known)}"
    else:
        expected = first["msg"].removeprefix("Input should be ")
    return EmulatorSettingsError(source, ".".join([table, *names]), first["input"], expected)


def as_toml(settings: EmulatorSettings) -> str:
    """Return the settings as the TOML table they could have come from."""
    lines = [f"[{TABLE}]"]
    for name, field in EmulatorSettings.model_fields.items():
        value = getattr(settings, name)
        plain = list(value) if isinstance(value, tuple) else value
        # JSON's strings, numbers, booleans and arrays of numbers are TOML's too.
        lines.append(f"{name} = {json.dumps(plain)}  # {field.description}")
    return "\n".join(lines) + "\n"


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
        EmulatorSettingsError: one of them cannot be.
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
        EmulatorSettingsError: there are too many, or a file is asked for that is one controller's.
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
