"""Robots as plain data: finding, reading and validating a robot file of schema `robot-facts/1`.

Owns the meaning of a robot's numbers: which joints are driven, their limits with the default
acceleration, and the coupling between the controller's joint 3 and the chain's. A joint vector is
always of driven joints in file order: *controller-side* on the wire, in limits and plans,
*chain-side* (`model`) in the file's `home` and `dh` table. No numpy and no kinematics here: the
emulator imports this module.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import cached_property
from importlib.resources import as_file, files
from pathlib import Path
from typing import Any, Literal, Self, TypeAlias, TypeVar

from pydantic import Field, ValidationError, ValidationInfo, model_validator

from .display_names import display_names
from .errors import RobotFileError, UnknownRobot, UnsupportedKind, WrongJointCount
from .errors.wording import shortened
from .field_problems import Problem, field_problems
from .limits import JointLimits
from .robot_file import read_mapping
from .robot_rules import parallel_problems, serial_problems
from .robot_schema import (
    SCHEMA,
    AllowedReason,
    Anchor,
    AnyJoint,
    BaseFrame,
    Coupling,
    DhTable,
    Facts,
    Joint,
    Kind,
    Leg,
    Name,
    NotNegative,
    Positive,
    RobotFacts,
    Vrm,
    Workspace,
)

_Facts = TypeVar("_Facts", bound=Facts)

_SUFFIX = ".yaml"


class SerialRobot(RobotFacts):
    """A chain of joints from `root_link` to `tool_link`."""

    kind: Literal[Kind.SERIAL]
    base_frame: BaseFrame
    flange_link: Name | None = None
    coupling: Coupling
    joints: tuple[AnyJoint, ...]
    link_mass_kg: Mapping[Name, NotNegative | None] = Field(default_factory=dict)
    dh: DhTable | None = None
    vrm: Vrm | None = None
    allowed_collisions: tuple[tuple[Name, Name, AllowedReason], ...] = ()

    @model_validator(mode="after")
    def _obey_rules(self, info: ValidationInfo) -> Self:
        _raise_problems(serial_problems(self), info)
        return self

    @cached_property
    def links(self) -> tuple[str, ...]:
        """Names of the links from the root to the tool."""
        return (self.root_link, *(joint.child for joint in self.joints))

    @cached_property
    def moving(self) -> tuple[Joint, ...]:
        """The joints that move, driven or dependent, base to tip."""
        return tuple(joint for joint in self.joints if isinstance(joint, Joint))

    @cached_property
    def driven(self) -> tuple[Joint, ...]:
        """The joints with a motor, base to tip: the order of every joint vector."""
        return tuple(joint for joint in self.moving if joint.dependent is None)

    @cached_property
    def display_names(self) -> tuple[str, ...]:
        """What people call the driven joints, for screens."""
        return display_names(self.driven)

    @cached_property
    def limits(self) -> JointLimits:
        """Limits of the driven joints, controller side.

        An unknown acceleration becomes velocity / `acceleration_ramp_s`.
        """
        return JointLimits(
            names=tuple(joint.name for joint in self.driven),
            lower=tuple(joint.lower for joint in self.driven),
            upper=tuple(joint.upper for joint in self.driven),
            velocity=tuple(joint.velocity for joint in self.driven),
            acceleration=tuple(
                joint.acceleration or joint.velocity / self.acceleration_ramp_s
                for joint in self.driven
            ),
            prismatic=tuple(joint.prismatic for joint in self.driven),
        )

    @cached_property
    def home_position(self) -> tuple[float, ...]:
        """The home joint position, controller side [rad or m]."""
        return self.to_controller(self.home)

    def to_controller(self, model: Sequence[float]) -> tuple[float, ...]:
        """Convert (n,) chain-side driven joint values to the controller's: c3 = j3 - f·j2.

        The rule is linear, so it holds for positions, rates and accelerations alike.

        Raises:
            WrongJointCount: not one value per driven joint.
        """
        return self._shear(model, -self.coupling.state_factor)

    def to_model(self, controller: Sequence[float]) -> tuple[float, ...]:
        """Convert (n,) controller-side driven joint values to the chain's: j3 = c3 + f·c2.

        Raises:
            WrongJointCount: not one value per driven joint.
        """
        return self._shear(controller, self.coupling.state_factor)

    def _shear(self, values: Sequence[float], factor: int) -> tuple[float, ...]:
        if len(values) != len(self.driven):
            raise WrongJointCount(len(values), len(self.driven))
        sheared = [float(value) for value in values]
        if factor:
            sheared[2] += factor * sheared[1]
        return tuple(sheared)


class ParallelRobot(RobotFacts):
    """A platform on six legs; `home` and `pose_variables` are the platform's, about home."""

    kind: Literal[Kind.PARALLEL]
    architecture: str = ""
    pose_variables: tuple[Literal["x", "y", "z", "roll", "pitch", "yaw"], ...]
    rpy_order: str = ""
    home_height: Positive
    base_radius: Positive
    platform_radius: Positive
    base_anchors: tuple[Anchor, ...]
    platform_anchors: tuple[Anchor, ...]
    leg: Leg
    workspace: Workspace
    workspace_rule: str = ""
    joint_names: tuple[Name, ...]
    inverse_kinematics: str = ""

    @model_validator(mode="after")
    def _obey_rules(self, info: ValidationInfo) -> Self:
        _raise_problems(parallel_problems(self), info)
        return self


Robot: TypeAlias = SerialRobot | ParallelRobot


def robot_names() -> tuple[str, ...]:
    """Return the names of the robots that come with the project, sorted."""
    folder = files(__package__) / "robots"
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
        known = robot_names()
        if name_or_path in known:
            with as_file(files(__package__) / "robots" / f"{name_or_path}{_SUFFIX}") as path:
                return robot_from_content(read_mapping(path), str(path))
        raise UnknownRobot(name_or_path, known)
    path = Path(name_or_path)
    return robot_from_content(read_mapping(path), str(path))


def serial_robot(name_or_path: str | Path) -> SerialRobot:
    """Load a robot that must be a serial one.

    Raises:
        UnsupportedKind: the robot is parallel.
        UnknownRobot: the name is not one of `robot_names()`.
        RobotFileError: the file is missing, unreadable, or not a sound robot.
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


def robot_from_content(content: Mapping[str, Any], file: str) -> Robot:
    """Build a robot from the mapping a robot file holds.

    Args:
        content: field names and values of schema `robot-facts/1`.
        file: the file's name, for messages.

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
    return validated(model, content, file)


def validated(model: type[_Facts], content: Mapping[str, Any], file: str) -> _Facts:
    """Build facts of any kind from a mapping somebody wrote.

    Raises:
        RobotFileError: a field is missing, unknown or wrong; all that are wrong are in it.
    """
    try:
        return model.model_validate(content, context={"file": file})
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
