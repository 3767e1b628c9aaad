"""Settings of the emulator: the table `[emulator]` of a cell file, overridden by arguments.

Owns names, bounds and defaults of the settings, and the sentence a user reads when one is wrong.
Other tables of a cell file belong to other programs and are not looked at.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from openpendant.motion.bounded_file import beginning_of

TABLE = "emulator"

MAX_FILE = 1_048_576
"""Largest file that is read, bytes."""

Port = Annotated[int, Field(ge=0, le=65535)]
EventLoop = Literal["asyncio", "uvloop"]


class EmulatorSettingsError(Exception):
    """A setting cannot be used.

    Attributes:
        file: where it stands, "arguments" for the command line.
        key: dotted name of the setting.
        value: what was given.
        expected: what would be accepted.
    """

    def __init__(self, file: str, key: str, value: object, expected: str) -> None:
        super().__init__(f"{file}: {key} = {value!r}: expected {expected}")
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
    max_connections: int = Field(16, ge=1, le=1024, description="most connections per port")
    violations_kept: int = Field(100, ge=1, le=10_000, description="violations stored in full")


def load_settings(
    file: Path | None = None, overrides: Mapping[str, Any] | None = None
) -> EmulatorSettings:
    """Return the settings of a cell file with arguments laid over them.

    Args:
        file: TOML file of a cell, with its `robot` and a table `[emulator]`; None for the defaults.
        overrides: settings given as arguments, by name.

    Raises:
        ConfigurationError: the file cannot be read, or a setting is unknown or out of bounds.
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
        ConfigurationError: it cannot be read, is too large or is no TOML.
    """
    import tomllib  # imported here because most runs read no file, and the emulator must start fast

    try:
        content = beginning_of(file, MAX_FILE + 1)
        if len(content) > MAX_FILE:
            size = f"more than {MAX_FILE} bytes"
            raise EmulatorSettingsError(str(file), "file", size, f"at most {MAX_FILE} bytes")
        return tomllib.loads(content.decode())
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
    """Return the first finding of pydantic as one sentence for the user.

    Args:
        error: what pydantic found.
        source: file or "arguments".
        table: dotted name of the table.
        known: names that the table accepts.
    """
    first = error.errors(include_url=False, include_context=False)[0]
    names = [str(part) for part in first["loc"]]
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
