"""Arguments of the commands of `motion`: common options, JSON values, and which errors are whose.

Owns the side of a coupled joint that the numbers of a command line are on, the exit codes of
errors, and the bounds and wording of JSON arguments: every malformed text becomes a `BadArgument`
or `NotFinite` that names the option.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from enum import StrEnum
from typing import Annotated, Any

import typer

from openpendant.tools.console import ExitCode, Faults, complain, one_line

from .. import errors
from ..description.limits import JointLimits
from ..description.robot import ParallelRobot, SerialRobot


class Angles(StrEnum):
    """Side of a coupled joint that the numbers are on."""

    FILE = "file"
    CONTROLLER = "controller"


class Names(StrEnum):
    """Names of joints in tables."""

    DISPLAY = "display"
    FILE = "file"


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

InDegrees = Annotated[
    bool,
    typer.Option("--degrees", help="Given angles are degrees, also roll, pitch, yaw; else rad."),
]
NamedAs = Annotated[
    Names, typer.Option("--names", help="Joints as people call them, or as in the robot file.")
]


def names_of(robot: ParallelRobot | SerialRobot, names: Names) -> Mapping[str, str]:
    """Return what each driven joint is called in a table, by its name in the robot file."""
    if not isinstance(robot, SerialRobot):
        return {name: name for name in robot.joint_names}
    limits = robot.limits
    shown = limits.display_names if names is Names.DISPLAY else limits.names
    return dict(zip(limits.names, shown, strict=True))


def in_radians(limits: JointLimits, values: tuple[float, ...], degrees: bool) -> tuple[float, ...]:
    """Return joint values as they are computed with, where angles may be degrees [rad or m].

    Raises:
        WrongJointCount: there is not one value per joint.
    """
    if not degrees:
        return values
    limits.check_finite(values, "the joint values")
    pairs = zip(values, limits.prismatic, strict=True)
    return tuple(value if slides else math.radians(value) for value, slides in pairs)


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

_TOLD_BY_FK = frozenset(
    {"position", "orientation", "matrix", "rpy_unique", "axis_angle", "configuration", "limits"}
)
"""What `robots fk` prints beside; its answer is taken as a pose, as it is."""

_POSE_FIELDS = frozenset({"xyz", "quat", "rpy", "frame"}) | _TOLD_BY_FK


def parse_joints(text: str, option: str) -> tuple[float, ...]:
    """Return the numbers of a JSON list of finite numbers.

    Raises:
        BadArgument: the text is not a JSON list of numbers.
        NotFinite: a number is infinite or not a number.
    """
    return _numbers(_parse(text, option, "a JSON list of numbers"), option)


def parse_pose(
    text: str, option: str, *, degrees: bool = False
) -> tuple[tuple[float, ...], tuple[float, ...], str | None]:
    """Return position [m], quaternion and frame, if given, of a pose with `quat` or `rpy`.

    Args:
        degrees: whether roll, pitch and yaw are degrees.

    Raises:
        BadArgument: the text is not such an object, or the quaternion's norm is not 1.
        NotFinite: a number is infinite or not a number.
    """
    accepted = '{"xyz": [x, y, z], "quat": [x, y, z, w]} or {"xyz": ..., "rpy": [r, p, y]}'
    value = _parse(text, option, accepted)
    is_pose = isinstance(value, dict) and "xyz" in value and value.keys() <= _POSE_FIELDS
    given = {"quat", "rpy"} & value.keys() if is_pose else set()
    # An answer of `fk` has both, and its quaternion counts; who types a pose gives one of them.
    if not given or (len(given) > 1 and not _TOLD_BY_FK & value.keys()):
        raise errors.BadArgument(option, text, accepted)
    frame = value.get("frame")
    if frame is not None and not isinstance(frame, str):
        raise errors.BadArgument(f"frame of {option}", frame, "a frame's name")
    xyz = _numbers(value["xyz"], f"xyz of {option}", 3)
    if "quat" not in value:
        rpy = _numbers(value["rpy"], f"rpy of {option}", 3)
        return xyz, _quaternion(tuple(map(math.radians, rpy)) if degrees else rpy), frame
    quaternion = _numbers(value["quat"], f"quat of {option}", 4)
    norm = math.hypot(*quaternion)
    if not abs(norm - 1.0) <= NORM_TOLERANCE:
        unit = f"four numbers of norm 1 within {NORM_TOLERANCE:g}; this one is {norm:.6g}"
        raise errors.BadArgument(f"quat of {option}", list(quaternion), unit)
    return xyz, quaternion, frame


def _quaternion(rpy: tuple[float, ...]) -> tuple[float, ...]:
    from ..pose import Pose

    return tuple(Pose.from_rpy((0.0, 0.0, 0.0), rpy).quaternion.tolist())


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
