"""The parts of a robot file of schema `robot-facts/1`, as frozen pydantic models.

Owns the fields, their types and their units: SI, radians, metres for prismatic joints; `rpy` is
R = Rz(yaw) Ry(pitch) Rx(roll). Rules that join several fields are in `robot_rules`, the whole
robots in `robot`. No numpy here: the emulator imports these models.
"""

from __future__ import annotations

from collections.abc import Mapping
from enum import StrEnum
from typing import Annotated, Literal, TypeAlias

from pydantic import BaseModel, ConfigDict, Field, StringConstraints

SCHEMA = "robot-facts/1"

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


class Kind(StrEnum):
    """How the links are joined."""

    SERIAL = "serial"
    PARALLEL = "parallel"


class JointType(StrEnum):
    """What a joint does; a fixed joint only places a link."""

    REVOLUTE = "revolute"
    PRISMATIC = "prismatic"
    FIXED = "fixed"


class CouplingType(StrEnum):
    """Whether the controller's joint 3 is tied to joint 2."""

    NONE = "none"
    J2_J3 = "j2_j3"


class Variable(StrEnum):
    """Which Denavit–Hartenberg parameter a joint moves."""

    THETA = "theta"
    D = "d"


class AllowedReason(StrEnum):
    """Why a pair of links is left out of collision checks."""

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
        """Whether the joint is measured in metres."""
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


class Capsule(Placement):
    """A cylinder along local z with round caps; `length` is the straight part."""

    type: Literal["capsule"]
    radius: Positive
    length: NotNegative


class Box(Placement):
    """A cuboid; `size` holds the full edge lengths."""

    type: Literal["box"]
    size: tuple[Positive, Positive, Positive]


class Sphere(Placement):
    """A ball."""

    type: Literal["sphere"]
    radius: Positive


Shape: TypeAlias = Annotated[Capsule | Box | Sphere, Field(discriminator="type")]


class RobotFacts(Facts):
    """What every robot file holds, whatever its kind."""

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
    """Where a leg of a parallel robot is fastened, in the base or platform frame [m]."""

    leg: Name
    angle: Real
    xyz: Vector


class Leg(Facts):
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
