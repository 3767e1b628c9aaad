"""Arguments that the commands of `motion` share, and how they read joint values and print.

Owns which side of a coupled joint the numbers of a command line are on. Decides no exit code.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from enum import StrEnum
from typing import Annotated

import typer

from .errors import OutOfRange
from .limits import JointLimits
from .robot import SerialRobot


class Angles(StrEnum):
    """Which side of a coupled joint the numbers are on."""

    FILE = "file"
    CONTROLLER = "controller"


class Frame(StrEnum):
    """The frame a tool pose is expressed in."""

    BASE = "base"
    ROOT = "root"


Robot = Annotated[
    str, typer.Argument(metavar="NAME|FILE", help="A robot's name, or any robot file.")
]
AsJson = Annotated[bool, typer.Option("--json", help="Print one JSON line.")]
InFrame = Annotated[
    Frame, typer.Option(help="base: the controller's own; root: the root link, as the DH table.")
]
OnSide = Annotated[
    Angles,
    typer.Option(help="file: joint angles as in the robot file; controller: coupling applied."),
]


def to_controller(
    robot: SerialRobot, values: tuple[float, ...], angles: Angles
) -> tuple[float, ...]:
    """Return (n,) joint values as the controller counts them [rad or m]."""
    return robot.to_controller(values) if angles is Angles.FILE else values


def note_out_of_range(limits: JointLimits, position: Sequence[float]) -> None:
    """Tell on standard error where a (n,) position [rad or m] leaves a joint's range."""
    try:
        limits.check_position(position)
    except OutOfRange as error:
        sys.stderr.write(f"note: {one_line(str(error))}\n")


def print_json(value: object) -> None:
    """Print plain data as one line of JSON."""
    sys.stdout.write(json.dumps(value, separators=(",", ":"), allow_nan=False) + "\n")


def one_line(text: str) -> str:
    """Return a text for a terminal, with blanks for all that cannot be printed."""
    # Names come from files and arguments: no line break or terminal control may pass.
    return "".join(char if char.isprintable() else " " for char in text)
