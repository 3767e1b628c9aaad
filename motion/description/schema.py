"""The parts of a robot file of schema `robot-facts/1`, as frozen pydantic models.

Owns the fields, their types and their units: SI, radians, metres for prismatic joints; `rpy` is
R = Rz(yaw) Ry(pitch) Rx(roll). Owns also what follows from the fields alone: the driven joints and
their limits, the named joint positions, and the display names of joints, the file's or else the
default ones. Rules that join
several fields are in `rules`; `robot` loads files and obeys them. No numpy here: the emulator
imports these models.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from enum import StrEnum
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any, Literal, TypeAlias

from pydantic import BaseModel, ConfigDict, Field, PrivateAttr, StringConstraints

from ..errors import WrongJointCount
from .limits import JointLimits

SCHEMA = "robot-facts/1"

MAX_MESHES = 128
"""Most meshes of a robot: an answer that lists them fits a frame."""

MESH_FOLDER = "openpendant-meshes"
"""Folder beside a robot file with the meshes and hulls that it names.

Not `meshes`: that is the name of most folders which a URDF takes its own from.
"""

# Strict, so that YAML's `yes` and `on` are not taken for the number 1.
Real: TypeAlias = Annotated[float, Field(strict=True, allow_inf_nan=False)]
Positive: TypeAlias = Annotated[float, Field(strict=True, allow_inf_nan=False, gt=0)]
NotNegative: TypeAlias = Annotated[float, Field(strict=True, allow_inf_nan=False, ge=0)]
# Not so small or large that a quotient of two of them could leave the range of a real.
Rate: TypeAlias = Annotated[float, Field(strict=True, allow_inf_nan=False, ge=1e-6, le=1e6)]
Count: TypeAlias = Annotated[int, Field(strict=True, ge=1)]
Vector: TypeAlias = tuple[Real, Real, Real]
Scalar: TypeAlias = str | bool | int | Real | None
Name: TypeAlias = Annotated[str, StringConstraints(min_length=1, max_length=64)]
Sha256: TypeAlias = Annotated[str, StringConstraints(pattern=r"^[0-9a-f]{64}$")]


class Kind(StrEnum):
    """The kind of a mechanism: how its links are joined."""

    SERIAL = "serial"
    PARALLEL = "parallel"


class JointType(StrEnum):
    """The motion of a joint; a fixed one only places a link."""

    REVOLUTE = "revolute"
    PRISMATIC = "prismatic"
    FIXED = "fixed"


class CouplingType(StrEnum):
    """Coupling of the controller's joint 3 to joint 2."""

    NONE = "none"
    J2_J3 = "j2_j3"


class Variable(StrEnum):
    """Which Denavit–Hartenberg parameter a joint moves."""

    THETA = "theta"
    D = "d"


class AllowedReason(StrEnum):
    """The reason why a pair of links is left out of collision checks."""

    ADJACENT = "adjacent"
    OVERLAP = "overlap"
    HOME = "home"
    STOPS = "stops"
    """The joints between the links keep them apart within their ranges; the shapes enclose more."""


class Facts(BaseModel):
    """Base of every part: read-only, no unknown fields."""

    model_config = ConfigDict(frozen=True, extra="forbid", defer_build=True)


class Placement(Facts):
    """A frame in its parent's: position [m] and roll, pitch, yaw [rad]."""

    xyz: Vector
    rpy: Vector


class BaseFrame(Placement):
    """The controller's own world frame, in the frame of the link `parent`."""

    parent: Name


class Specs(Facts):
    """Data-sheet figures; None is unknown."""

    payload_kg: NotNegative | None = None
    reach_m: NotNegative | None = None
    repeatability_m: NotNegative | None = None
    mass_kg: NotNegative | None = None


class Coupling(Facts):
    """Controller-side joint 3 is the chain's joint 3 less `state_factor` times joint 2."""

    type: Literal[CouplingType.NONE, CouplingType.J2_J3]
    state_factor: Literal[-1, 0, 1]


class Term(Facts):
    """One driven joint's share in a dependent joint's position."""

    joint: Name
    gain: Real


class Dependence(Facts):
    """Position of a joint that is not driven: `offset` plus the sum of gain times joint."""

    terms: Annotated[tuple[Term, ...], Field(min_length=1)]
    offset: Real


class FixedJoint(Facts):
    """A joint that only places its child link."""

    type: Literal[JointType.FIXED]
    name: Name
    parent: Name
    child: Name
    origin: Placement


class Joint(Facts):
    """A joint that moves, about (revolute) or along (prismatic) `axis` in its own frame.

    Bounds and rates are in rad or m and seconds; those of driven joints are controller-side.
    """

    type: Literal[JointType.REVOLUTE, JointType.PRISMATIC]
    name: Name
    parent: Name
    child: Name
    origin: Placement
    axis: Vector
    lower: Real
    upper: Real
    velocity: Rate
    acceleration: Rate | None = None
    effort: NotNegative | None = None
    dependent: Dependence | None = None
    display_name: Name | None = None

    @property
    def prismatic(self) -> bool:
        """True if the joint is measured in metres."""
        return self.type is JointType.PRISMATIC


AnyJoint: TypeAlias = Annotated[FixedJoint | Joint, Field(discriminator="type")]


class DhRow(Facts):
    """One standard Denavit–Hartenberg row: Rz(theta) Tz(d) Tx(a) Rx(alpha)."""

    joint: Name
    theta_offset: Real
    d: Real
    a: Real
    alpha: Real
    variable: Variable


class DhTable(Facts):
    """The chain once more, as a table over chain-side angles, for comparison."""

    convention: Literal["standard"]
    base: Placement
    rows: tuple[DhRow, ...]
    tool: Placement


class VrmRow(Facts):
    """One row of the RoboAnalyzer Virtual Robot Module, in its letters and its angles."""

    b: Real
    theta_home: Real
    a: Real
    alpha: Real
    lower: Real
    upper: Real


class VrmMap(Facts):
    """From our angles to those of the Virtual Robot Module: sign times ours plus offset."""

    sign: tuple[Literal[-1, 1], ...]
    offset: tuple[Real, ...]


class VrmDifference(Facts):
    """What remains between the two forward kinematics after the map."""

    position_m: NotNegative
    rotation_rad: NotNegative


class Vrm(Facts):
    """The robot as RoboAnalyzer's Virtual Robot Module describes it."""

    name: Name
    convention: str
    payload_kg: NotNegative | None = None
    weight_kg: NotNegative | None = None
    rows: tuple[VrmRow, ...]
    map: VrmMap
    tool: Placement
    home_joints: tuple[Real, ...]
    fk_difference: VrmDifference


class CapsuleFacts(Placement):
    """A cylinder along local z with round caps; `length` is the straight part."""

    type: Literal["capsule"]
    radius: Positive
    length: NotNegative


class BoxFacts(Placement):
    """A cuboid; `size` holds the full edge lengths."""

    type: Literal["box"]
    size: tuple[Positive, Positive, Positive]


class SphereFacts(Placement):
    """A ball."""

    type: Literal["sphere"]
    radius: Positive


class HullFacts(Placement):
    """Convex hull of a mesh, made when its robot was imported.

    Attributes:
        size: full edge lengths of the box around it, whose centre and axes are its frame [m].
        hull: SHA-256 of the OBJ file with its points and faces, in that frame [m].
    """

    type: Literal["hull"]
    size: tuple[Positive, Positive, Positive]
    hull: Sha256

    _folder: Path = PrivateAttr(Path())

    def model_post_init(self, context: Any, /) -> None:
        """Take note of the folder with the robot's meshes, which whoever reads the file tells."""
        self._folder = Path((context or {}).get("meshes", ""))

    @property
    def file(self) -> Path:
        """The file with its points and faces."""
        return self._folder / f"{self.hull}.obj"


Shape: TypeAlias = Annotated[
    CapsuleFacts | BoxFacts | SphereFacts | HullFacts, Field(discriminator="type")
]


class MeshForm(StrEnum):
    """The format of a mesh that is kept, and the ending of its file."""

    STL = "stl"
    OBJ = "obj"


class MeshFacts(Placement):
    """Mesh that shows a link, kept as it was imported; its placement is in the link's frame.

    Attributes:
        link: the link it moves with.
        hash: SHA-256 of the file's bytes, which is its name in the folder of meshes.
        bytes: how many the file has.
        scale: of the file's unit along each axis; negative mirrors.
        colour: as `#rrggbb`; None for that of the arm.
    """

    link: Name
    hash: Sha256
    form: MeshForm
    bytes: Count
    scale: Vector
    colour: Annotated[str, StringConstraints(pattern=r"^#[0-9a-f]{6}$")] | None = None

    @property
    def file_name(self) -> str:
        """Name of its file in the folder of meshes."""
        return f"{self.hash}.{self.form}"


class RobotFacts(Facts):
    """The content of every robot file, whatever its kind."""

    schema_: Literal["robot-facts/1"] = Field(alias="schema")
    name: Name
    manufacturer: str = ""
    model: str = ""
    named_in: tuple[str, ...] = ()
    dof: Count
    specs: Specs = Specs.model_construct()
    specs_source: str = ""
    root_link: Name
    tool_link: Name
    tool_convention: str = ""
    zero_pose: str = ""
    home: tuple[Real, ...]
    acceleration_ramp_s: Rate
    collision: Mapping[Name, tuple[Shape, ...]] = Field(default_factory=dict)
    collision_source: str = ""
    sources: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    validation: Mapping[str, Scalar | Mapping[str, Scalar]] = Field(default_factory=dict)


class Anchor(Facts):
    """The end of a leg of a parallel robot, in the base or platform frame [m]."""

    leg: Name
    angle: Real
    xyz: Vector


class LegLimits(Facts):
    """The stroke and rates all legs of a parallel robot share [m, s]."""

    min_length: Positive
    max_length: Positive
    home_length: Positive
    velocity: Rate
    acceleration: Rate | None = None
    anchor_cone_rad: Positive
    body_radius: Positive


class Workspace(Facts):
    """Bounds of each single platform coordinate about home [m, rad]."""

    x: Positive
    y: Positive
    z: Positive
    roll: Positive
    pitch: Positive
    yaw: Positive


SIX_AXIS_NAMES = ("Base", "Lower-Arm", "Upper-Arm", "Wrist-Roll", "Wrist-Pitch", "Wrist-Twist")
"""The buttons of the first paper's pendant, joint 1 to 6."""

_PARTS = re.compile(r"[_\-\s]+")
_FILLERS = frozenset({"joint", "axis"})


def display_names(driven: Sequence[Joint]) -> tuple[str, ...]:
    """Return one name per driven joint, base to tip: the file's own, else the default."""
    names = [joint.name for joint in driven]
    defaults = default_display_names(names, [joint.prismatic for joint in driven])
    return tuple(
        joint.display_name or default for joint, default in zip(driven, defaults, strict=True)
    )


def default_display_names(names: Sequence[str], prismatic: Sequence[bool]) -> tuple[str, ...]:
    """Return the names that joints get where nobody gave them any.

    Args:
        names: the joints' own names, base to tip.
        prismatic: True if each of them is measured in metres.
    """
    if len(names) == len(SIX_AXIS_NAMES) and not any(prismatic):
        return SIX_AXIS_NAMES
    return tuple(_in_words(name) for name in names)


def _in_words(name: str) -> str:
    parts = [part for part in _PARTS.split(name) if part]
    telling = [part for part in parts if part.lower() not in _FILLERS]
    if not any(any(letter.isalpha() for letter in part) for part in telling):
        telling = ["joint", *telling]
    words = " ".join(telling)
    return words[:1].upper() + words[1:]


HOME_NAME, ZERO_NAME, VRM_NAME = "home", "zero", "vrm"
OWN_NAMES = (HOME_NAME, ZERO_NAME, VRM_NAME)
"""Names of joint positions that only a robot's file gives a meaning."""


class SerialFacts(RobotFacts):
    """A chain of joints from `root_link` to `tool_link`."""

    kind: Literal[Kind.SERIAL]
    base_frame: BaseFrame
    flange_link: Name | None = None
    coupling: Coupling
    joints: tuple[AnyJoint, ...]
    positions: Mapping[Name, tuple[Real, ...]] = Field(default_factory=dict)
    link_mass_kg: Mapping[Name, NotNegative | None] = Field(default_factory=dict)
    dh: DhTable | None = None
    vrm: Vrm | None = None
    meshes: Annotated[tuple[MeshFacts, ...], Field(max_length=MAX_MESHES)] = ()
    allowed_collisions: tuple[tuple[Name, Name, AllowedReason], ...] = ()

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
            display_names=self.display_names,
        )

    @cached_property
    def home_position(self) -> tuple[float, ...]:
        """The home joint position, controller side [rad or m]."""
        return self.to_controller(self.home)

    @cached_property
    def named_positions(self) -> Mapping[str, tuple[float, ...]]:
        """The joint positions that the robot's file names, controller side [rad or m].

        `home`, and `zero`, all joints at zero; `vrm`, the home of RoboAnalyzer's Virtual Robot
        Module, where the file has one; then those of `positions`. The robot may be unable to stand
        at `zero` or `vrm`: limits exclude it, or links touch.
        """
        named = {HOME_NAME: self.home_position, ZERO_NAME: (0.0,) * len(self.driven)}
        if self.vrm is not None:
            stated = zip(self.moving, self.vrm.home_joints, strict=True)
            model = [value for joint, value in stated if joint.dependent is None]
            named[VRM_NAME] = self.to_controller(model)
        return named | {name: self.to_controller(at) for name, at in self.positions.items()}

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


class ParallelFacts(RobotFacts):
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
    leg: LegLimits
    workspace: Workspace
    workspace_rule: str = ""
    joint_names: tuple[Name, ...]
    inverse_kinematics: str = ""
