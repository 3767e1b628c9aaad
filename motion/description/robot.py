"""Robots as plain data, read from robot files of schema `robot-facts/1` and validated.

Owns finding and reading a robot file by name or by path, and the robot of each kind, which obeys
all of `rules`. The fields and the data derived from them are `schema`'s: the driven joints, their
limits with the default acceleration, the coupling between the controller's joint 3 and the chain's,
and the display names (those of the first paper's pendant for six revolute axes, else the joint's
own name in words).

A joint vector is always of driven joints in file order: *controller-side* on the wire, in limits
and plans, *chain-side* (`model`) in the file's `home` and `dh` table. No numpy and no kinematics
here: the emulator and screens read robots too.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from functools import cache
from importlib.resources import as_file, files
from pathlib import Path
from typing import Any, Self, TypeAlias, TypeVar

from pydantic import ValidationError, ValidationInfo, model_validator

from ..errors import RobotFileError, UnknownRobot, UnsupportedKind, shortened
from .field_problems import Problem, field_problems
from .rules import parallel_problems, serial_problems
from .schema import MESH_FOLDER, SCHEMA, Facts, Kind, ParallelFacts, SerialFacts
from .yaml_file import read_mapping

_Facts = TypeVar("_Facts", bound=Facts)

_SUFFIX = ".yaml"


class SerialRobot(SerialFacts):
    """Chain of joints from `root_link` to `tool_link`, all rules obeyed."""

    @model_validator(mode="after")
    def _obey_rules(self, info: ValidationInfo) -> Self:
        _raise_problems(serial_problems(self), info)
        return self


class ParallelRobot(ParallelFacts):
    """Platform on six legs, all rules obeyed."""

    @model_validator(mode="after")
    def _obey_rules(self, info: ValidationInfo) -> Self:
        _raise_problems(parallel_problems(self), info)
        return self


Robot: TypeAlias = SerialRobot | ParallelRobot


def robot_names() -> tuple[str, ...]:
    """Return the names of the robots that come with the project, sorted."""
    folder = files("openpendant.motion") / "robots"
    names = (entry.name for entry in folder.iterdir())
    return tuple(sorted(name.removesuffix(_SUFFIX) for name in names if name.endswith(_SUFFIX)))


def load_robot(name_or_path: str | Path) -> Robot:
    """Load a robot of the project by its name, or any robot file by its path.

    Args:
        name_or_path: a string without a path separator or `.yaml` ending that is no existing
            file is a name; all else is a path.

    Raises:
        UnknownRobot: the name is not one of `robot_names()`.
        RobotFileError: the file is missing, unreadable, or not a sound robot.
    """
    if isinstance(name_or_path, str) and not _is_path(name_or_path):
        return _robot_of_the_project(name_or_path)
    path = Path(name_or_path)
    return robot_from_content(read_mapping(path), str(path))


@cache
def _robot_of_the_project(name: str) -> Robot:
    """Return a robot that comes with the project; its file is read once in each process."""
    known = robot_names()
    if name not in known:
        raise UnknownRobot(name, known)
    with as_file(files("openpendant.motion") / "robots" / f"{name}{_SUFFIX}") as path:
        return robot_from_content(read_mapping(path), str(path))


def serial_robot(name_or_path: str | Path) -> SerialRobot:
    """Load a robot that must be a serial one.

    Raises:
        UnsupportedKind: the robot is parallel.
        MotionError: as of `load_robot`.
    """
    robot = load_robot(name_or_path)
    if not isinstance(robot, SerialRobot):
        missing = "emulated controller, pendant server or planner"
        raise UnsupportedKind(robot.name, robot.kind, missing)
    return robot


def _is_path(text: str) -> bool:
    if "/" in text or "\\" in text or text.endswith((_SUFFIX, ".yml")):
        return True
    try:
        return Path(text).is_file()
    except (OSError, ValueError):
        return False


def robot_from_content(content: Mapping[str, Any], file: str, meshes: Path | None = None) -> Robot:
    """Return a robot from the mapping that a robot file holds.

    Args:
        content: field names and values of schema `robot-facts/1`.
        meshes: the folder with its meshes and hulls; `mesh_folder(file)` where left out.

    Raises:
        RobotFileError: the content is not a sound robot.
    """
    if content.get("schema") != SCHEMA:
        raise RobotFileError(file, "schema", f"is not {SCHEMA!r}, the one schema accepted")
    kinds: dict[object, type[Robot]] = {
        Kind.SERIAL.value: SerialRobot,
        Kind.PARALLEL.value: ParallelRobot,
    }
    kind = content.get("kind")
    model = kinds.get(kind) if isinstance(kind, str) else None
    if model is None:
        found = f"is {shortened(kind)}" if "kind" in content else "is missing"
        raise RobotFileError(file, "kind", f"{found}; accepted: {' or '.join(map(str, kinds))}")
    return validated(model, content, file, mesh_folder(file) if meshes is None else meshes)


def mesh_folder(file: str | Path) -> Path:
    """Return the folder with the meshes and hulls of a robot file."""
    return Path(file).parent / MESH_FOLDER


def validated(
    model: type[_Facts], content: Mapping[str, Any], file: str, meshes: Path = Path()
) -> _Facts:
    """Return facts of any kind from a mapping, or raise `RobotFileError` with all that is wrong."""
    try:
        return model.model_validate(content, context={"file": file, "meshes": meshes})
    except ValidationError as error:
        raise _file_error(file, field_problems(error, model)) from None


def _raise_problems(problems: Iterator[Problem], info: ValidationInfo) -> None:
    found = tuple(problems)
    if found:
        # Not a ValueError, so pydantic lets it pass unchanged and the field keeps its name.
        raise _file_error(str((info.context or {}).get("file", "robot")), found)


def _file_error(file: str, problems: Iterable[Problem]) -> RobotFileError:
    (field, problem), *more = problems
    return RobotFileError(file, field, problem, tuple(more))
