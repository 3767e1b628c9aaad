"""Faults of the commands of `motion`: which errors are the caller's mistake, and which refusals."""

from __future__ import annotations

from openpendant.tools.console import ExitCode, Faults, complain, one_line

from ..errors import (
    BadArgument,
    DuplicateObject,
    FrameUnknown,
    MeshFileError,
    MotionError,
    NotFinite,
    PlannerUnavailable,
    RobotFileError,
    SceneFileError,
    SceneTooLarge,
    UnknownObject,
    UnknownRobot,
    WrongJointCount,
)

_USAGE_ERRORS = (
    BadArgument,
    DuplicateObject,
    FrameUnknown,
    MeshFileError,
    NotFinite,
    PlannerUnavailable,
    RobotFileError,
    SceneFileError,
    SceneTooLarge,
    UnknownObject,
    UnknownRobot,
    WrongJointCount,
)
FAULTS: Faults = {
    **dict.fromkeys(_USAGE_ERRORS, ExitCode.USAGE),
    MotionError: ExitCode.REFUSED,
    OSError: ExitCode.OUTPUT_FAILED,
}


def tell(text: str) -> None:
    """Write what is wrong to standard error, with blanks for what cannot be printed."""
    complain(f"error: {one_line(text, ' ')}")
