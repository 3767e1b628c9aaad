"""Arguments that the commands of `motion` share, and how they read joint values.

Owns the side of a coupled joint that the numbers of a command line are on. Decides no exit code.
"""

from __future__ import annotations

from collections.abc import Sequence
from enum import StrEnum
from typing import Annotated

import typer

from openpendant.tools.console import complain, one_line

from ..description.limits import JointLimits
from ..description.robot import SerialRobot
from ..errors import OutOfRange


class Angles(StrEnum):
    """Side of a coupled joint that the numbers are on."""

    FILE = "file"
    CONTROLLER = "controller"


class PoseFrame(StrEnum):
    """Frame of a tool pose."""

    BASE = "base"
    ROOT = "root"


Robot = Annotated[
    str, typer.Argument(metavar="NAME|FILE", help="A robot's name, or any robot file.")
]
AsJson = Annotated[bool, typer.Option("--json", help="Print one JSON line.")]
InFrame = Annotated[
    PoseFrame,
    typer.Option(help="base: the controller's own; root: the root link, as the DH table."),
]
OnSide = Annotated[
    Angles,
    typer.Option(help="file: joint angles as in the robot file; controller: coupling applied."),
]


def to_controller(
    robot: SerialRobot, values: tuple[float, ...], angles: Angles
) -> tuple[float, ...]:
    """Return (n,) joint values on the controller's side [rad or m]."""
    return robot.to_controller(values) if angles is Angles.FILE else values


def note_out_of_range(limits: JointLimits, position: Sequence[float]) -> None:
    """Print on standard error where a (n,) position [rad or m] is outside a joint's range."""
    try:
        limits.check_position(position)
    except OutOfRange as error:
        complain(f"note: {one_line(str(error), ' ')}")
