"""Arguments of the commands of `motion`: common options, JSON values, and which errors are whose.

Owns the side of a coupled joint that the numbers of a command line are on, the exit codes of
errors, and the bounds and wording of JSON arguments: every malformed text becomes a `BadArgument`
or `NotFinite` that names the option.
"""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from enum import StrEnum
from typing import Annotated, Any

import typer

from openpendant.tools.console import ExitCode, Faults, complain, one_line

from .. import errors
from ..description.limits import JointLimits
from ..description.robot import SerialRobot


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
    except errors.OutOfRange as error:
        complain(f"note: {one_line(str(error), ' ')}")


_USAGE_ERRORS = (
    errors.BadArgument,
    errors.DuplicateObject,
    errors.FrameUnknown,
    errors.MeshFileError,
    errors.NotFinite,
    errors.PlannerUnavailable,
    errors.RobotFileError,
    errors.SceneFileError,
    errors.SceneTooLarge,
    errors.UnknownObject,
    errors.UnknownRobot,
    errors.WrongJointCount,
)
FAULTS: Faults = {
    **dict.fromkeys(_USAGE_ERRORS, ExitCode.USAGE),
    errors.MotionError: ExitCode.REFUSED,
    OSError: ExitCode.OUTPUT_FAILED,
}


def tell(text: str) -> None:
    """Write what is wrong to standard error, with blanks for what cannot be printed."""
    complain(f"error: {one_line(text, ' ')}")


MAX_CHARACTERS = 4096

NORM_TOLERANCE = 1e-3
"""Greatest deviation of the norm of a quaternion from 1, if typed with three decimals or more."""

_POSE_FIELDS = frozenset({"xyz", "quat", "frame"})


def parse_joints(text: str, option: str) -> tuple[float, ...]:
    """Return the numbers of a JSON list of finite numbers.

    Raises:
        BadArgument: the text is not a JSON list of numbers.
        NotFinite: a number is infinite or not a number.
    """
    return _numbers(_parse(text, option, "a JSON list of numbers"), option)


def parse_pose(text: str, option: str) -> tuple[tuple[float, ...], tuple[float, ...], str | None]:
    """Return position [m], quaternion and frame, if given, of `{"xyz": […], "quat": […]}`.

    Raises:
        BadArgument: the text is not such an object, or the quaternion's norm is not 1.
        NotFinite: a number is infinite or not a number.
    """
    accepted = '{"xyz": [x, y, z], "quat": [x, y, z, w]}'
    value = _parse(text, option, accepted)
    if not isinstance(value, dict) or not {"xyz", "quat"} <= value.keys() <= _POSE_FIELDS:
        raise errors.BadArgument(option, text, accepted)
    frame = value.get("frame")
    if frame is not None and not isinstance(frame, str):
        raise errors.BadArgument(f"frame of {option}", frame, "a frame's name")
    xyz = _numbers(value["xyz"], f"xyz of {option}", 3)
    quaternion = _numbers(value["quat"], f"quat of {option}", 4)
    norm = math.hypot(*quaternion)
    if not abs(norm - 1.0) <= NORM_TOLERANCE:
        unit = f"four numbers of norm 1 within {NORM_TOLERANCE:g}; this one is {norm:.6g}"
        raise errors.BadArgument(f"quat of {option}", list(quaternion), unit)
    return xyz, quaternion, frame


def _parse(text: str, option: str, accepted: str) -> Any:
    if len(text) > MAX_CHARACTERS:
        raise errors.BadArgument(option, text, f"at most {MAX_CHARACTERS} characters")
    try:
        # Integers are read as reals: one of thousands of digits is then infinite, not an error.
        return json.loads(text, parse_int=float)
    except (ValueError, RecursionError):
        raise errors.BadArgument(option, text, accepted) from None


def _numbers(value: object, what: str, count: int | None = None) -> tuple[float, ...]:
    accepted = "a list of numbers" if count is None else f"a list of {count} numbers"
    if not isinstance(value, list) or not all(isinstance(number, float) for number in value):
        raise errors.BadArgument(what, value, accepted)
    if count is not None and len(value) != count:
        raise errors.BadArgument(what, value, accepted)
    for index, number in enumerate(value):
        if not math.isfinite(number):
            raise errors.NotFinite(what, index)
    return tuple(value)
