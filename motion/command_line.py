"""What the commands of `motion` share: how one is run, its exit codes, and how a fault is told.

Owns which errors are the caller's mistake and which are refusals. An error is one line on standard
error. Knows none of the commands.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence

import typer

from .errors import (
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
from .robot_arguments import one_line

EXIT_USAGE = 2
EXIT_REFUSED = 3
EXIT_OUTPUT = 74
EXIT_INTERRUPTED = 130

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
# Newer typers carry their own click, older ones import it; this names its error in both.
_TyperUsageError: type[Exception] = typer.BadParameter.mro()[2]


def run(app: typer.Typer, name: str, argv: Sequence[str]) -> int:
    """Run a command and return its exit code.

    Args:
        app: the command.
        name: how the user calls it, after `openpendant`.
        argv: the arguments after its name.
    """
    try:
        result = app(args=list(argv), prog_name=f"openpendant {name}", standalone_mode=False)
    except _TyperUsageError as error:
        describe = getattr(error, "format_message", error.__str__)
        return _fail(describe(), EXIT_USAGE)
    except (typer.Abort, KeyboardInterrupt):
        return _fail("interrupted", EXIT_INTERRUPTED)
    except MotionError as error:
        usage = isinstance(error, _USAGE_ERRORS)
        return _fail(str(error), EXIT_USAGE if usage else EXIT_REFUSED)
    except BrokenPipeError:
        # Whoever read the output has gone: nothing is left to be told.
        raise
    except OSError as error:
        return _fail(f"{error.filename or 'output'}: {error.strerror or error}", EXIT_OUTPUT)
    return result if isinstance(result, int) else 0


def _fail(message: str, code: int) -> int:
    sys.stderr.write(f"error: {one_line(message)}\n")
    return code
