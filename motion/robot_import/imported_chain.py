"""What a description of a robot says, before anything is assumed: one chain, gaps left as None.

Owns the common form that every importer ends in. SI units, radians; `rpy` as in the robot schema.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from ..robot_schema import Dependence, DhTable, JointType, Placement, Shape

UNTURNED = Placement(xyz=(0.0, 0.0, 0.0), rpy=(0.0, 0.0, 0.0))


@dataclass(frozen=True, slots=True)
class ImportedJoint:
    """One joint of the chain; None is what the description does not say.

    Attributes:
        name: the joint's name.
        type: what it does.
        parent: link it is fastened to.
        child: link it carries.
        origin: the joint's frame in that of the parent link.
        axis: unit vector in the joint's own frame; None for a fixed joint.
        lower: least position [rad or m].
        upper: greatest position [rad or m].
        velocity: greatest speed [rad/s or m/s].
        acceleration: greatest acceleration [rad/s² or m/s²].
        effort: greatest torque or force [N·m or N].
        dependent: how it follows driven joints, if it has no motor.
        continuous: it may turn without end, as far as the description goes.
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
        """Whether the joint has a motor."""
        return self.type is not JointType.FIXED and self.dependent is None

    @property
    def unit(self) -> str:
        """Unit of the joint's position."""
        return "m" if self.type is JointType.PRISMATIC else "rad"


@dataclass(frozen=True, slots=True)
class ImportedChain:
    """A chain of joints from a root link to a tool link, as described.

    Attributes:
        file: where it was read.
        source: what kind of description that is, in words.
        name: the robot's own name there.
        joints: root to tip, fixed joints included.
        collision: shapes of each link that has some, in the link's frame.
        masses: mass of each link that states one [kg].
        base_frame: the controller's base frame in the root link's, if the description has one.
        home: chain-side position of the driven joints, if the description has one.
        dh: a standard table, if the description is one.
        display_names: what people call the driven joints, if the description says.
        remarks: what the reader did on its own, in words.
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

    @property
    def root(self) -> str:
        """The link the chain begins at."""
        return self.joints[0].parent

    @property
    def tip(self) -> str:
        """The link the chain ends at."""
        return self.joints[-1].child

    @property
    def links(self) -> tuple[str, ...]:
        """The links, root to tip."""
        return (self.root, *(joint.child for joint in self.joints))

    @property
    def driven(self) -> tuple[ImportedJoint, ...]:
        """The joints with a motor, root to tip."""
        return tuple(joint for joint in self.joints if joint.driven)

    def with_remarks(self, *remarks: str) -> ImportedChain:
        """Return the chain with further remarks."""
        return replace(self, remarks=(*self.remarks, *remarks))
