"""Imported chain: the content of a robot's description before any assumption, with None for gaps.

Owns the common form that every importer returns. SI units, radians; `rpy` as in the robot schema.

Owns also placements of that schema as matrices and back, the one module that computes roll, pitch
and yaw of a rotation: R = Rz(yaw) Ry(pitch) Rx(roll), with yaw 0 where the pitch is ±π/2 and roll
and yaw cannot be separated.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from ..description.schema import (
    Dependence,
    DhTable,
    JointType,
    MeshFacts,
    Placement,
    Shape,
)
from ..pose import Array, Pose

UNTURNED = Placement(xyz=(0.0, 0.0, 0.0), rpy=(0.0, 0.0, 0.0))


@dataclass(frozen=True, slots=True)
class ImportedJoint:
    """Joint of the chain, limits in [rad or m, s]; None where the description says nothing.

    Attributes:
        origin: the joint's frame in that of the parent link.
        axis: unit vector in the joint's own frame; None for a fixed joint.
        effort: greatest torque or force [N·m or N].
        dependent: its dependence on driven joints, if it has no motor.
        continuous: True if it may rotate without end, by the description.
    """

    name: str
    type: JointType
    parent: str
    child: str
    origin: Placement
    axis: tuple[float, float, float] | None = None
    lower: float | None = None
    upper: float | None = None
    velocity: float | None = None
    acceleration: float | None = None
    effort: float | None = None
    dependent: Dependence | None = None
    continuous: bool = False

    @property
    def driven(self) -> bool:
        """True if the joint has a motor."""
        return self.type is not JointType.FIXED and self.dependent is None

    @property
    def unit(self) -> str:
        """Unit of the joint's position."""
        return "m" if self.type is JointType.PRISMATIC else "rad"


@dataclass(frozen=True, slots=True)
class ImportedChain:
    """Chain of joints from a root link to a tool link, as described.

    Attributes:
        source: kind of the description, in words.
        joints: root to tip, fixed joints included.
        collision: shapes of each link that has some, in the link's frame.
        masses: mass of each link that states one [kg].
        base_frame: the controller's base frame in the root link's, if the description has one.
        home: chain-side position of the driven joints, if the description has one.
        dh: a standard table, if the description is one.
        display_names: names of the driven joints on screens, if the description has them.
        remarks: decisions of the reader, in words.
        meshes: those that show its links.
        refused_meshes: those that are no use, each once with the reason, in words.
    """

    file: str
    source: str
    name: str
    joints: tuple[ImportedJoint, ...]
    collision: Mapping[str, tuple[Shape, ...]] = field(default_factory=dict)
    masses: Mapping[str, float] = field(default_factory=dict)
    base_frame: Placement | None = None
    home: tuple[float, ...] | None = None
    dh: DhTable | None = None
    display_names: tuple[str, ...] | None = None
    remarks: tuple[str, ...] = ()
    meshes: tuple[MeshFacts, ...] = ()
    refused_meshes: tuple[str, ...] = ()

    @property
    def root(self) -> str:
        """Link where the chain begins."""
        return self.joints[0].parent

    @property
    def tip(self) -> str:
        """Link where the chain ends."""
        return self.joints[-1].child

    @property
    def links(self) -> tuple[str, ...]:
        """The links, root to tip."""
        return (self.root, *(joint.child for joint in self.joints))

    @property
    def unchecked(self) -> tuple[str, ...]:
        """The links without a shape, root to tip: no collision of theirs is found."""
        return tuple(link for link in self.links if link not in self.collision)

    @property
    def driven(self) -> tuple[ImportedJoint, ...]:
        """The joints with a motor, root to tip."""
        return tuple(joint for joint in self.joints if joint.driven)

    def with_remarks(self, *remarks: str) -> ImportedChain:
        """Return the chain with further remarks."""
        return replace(self, remarks=(*self.remarks, *remarks))


_ROUNDING = 1e-15  # m or rad: what remains of a zero after a few products


def to_matrix(placement: Placement) -> Array:
    """Return a placement's (4, 4) homogeneous matrix."""
    return Pose.from_rpy(placement.xyz, placement.rpy).to_matrix()


def to_placement(matrix: Array) -> Placement:
    """Return the placement of a (4, 4) homogeneous matrix."""
    x, y, z = (_without_noise(float(value)) for value in matrix[:3, 3])
    roll, pitch, yaw = (_without_noise(value) for value in _roll_pitch_yaw(matrix[:3, :3]))
    return Placement(xyz=(x, y, z), rpy=(roll, pitch, yaw))


def compose(outer: Placement, inner: Placement) -> Placement:
    """Return the pose of `inner`, given in the frame `outer`, in the frame of `outer`'s parent."""
    return to_placement(to_matrix(outer) @ to_matrix(inner))


def _roll_pitch_yaw(rotation: Array) -> tuple[float, float, float]:
    # Roll is computed after the yaw found is undone, so that near a pitch of π/2 each corrects the
    # rounding of the other.
    (a, b, c), (d, e, f), (g, _, _) = rotation.tolist()
    yaw = math.atan2(d, a) if math.hypot(a, d) > _ROUNDING else 0.0
    sine, cosine = math.sin(yaw), math.cos(yaw)
    roll = math.atan2(sine * c - cosine * f, cosine * e - sine * b)
    return roll, math.atan2(-g, math.hypot(a, d)), yaw


def _without_noise(value: float) -> float:
    return 0.0 if abs(value) < _ROUNDING else value
