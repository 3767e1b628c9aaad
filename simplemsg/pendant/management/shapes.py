"""Operations on what robots look like: solids, joints and meshes for a page that draws them.

Nothing moves, no cell changes, and no authority is needed. Lengths are m, angles rad, quaternions
x, y, z, w. Answers are made beside the event loop and count in a rate of each connection: TOO_OFTEN
says how many seconds to wait.
"""

from __future__ import annotations

from typing import Annotated, Literal, TypeAlias, TypedDict

from ..roles import Permission
from .declaration import Count, Request, operation

MOST_OF_CHUNK = 32_768
"""Most bytes of a mesh in one answer."""


class DrawnShape(TypedDict):
    """A coloured solid fixed to a link.

    Attributes:
        link: the link that it moves with.
        form: `box`, `cylinder`, `capsule` or `sphere`; round ones have their axis along z.
        part: `body`, `joint`, `foot` or `flange`.
        size: extents along its own x, y, z [m]; a capsule's length includes its caps.
        xyz: its centre in the link's frame [m].
        quat: its orientation in the link's frame.
        colour: `#rrggbb`.
    """

    link: str
    form: str
    part: str
    size: list[float]
    xyz: list[float]
    quat: list[float]
    colour: str


class DrawnStrut(TypedDict):
    """A round rod between points of two links, such as the leg of a platform.

    Attributes:
        name: of the leg.
        first_link: the link at its one end.
        first: that end in the link's frame [m].
        second_link: the link at its other end.
        second: that end in that link's frame [m].
        diameter: its diameter [m].
        colour: `#rrggbb`.
    """

    name: str
    first_link: str
    first: list[float]
    second_link: str
    second: list[float]
    diameter: float
    colour: str


class DrawnLink(TypedDict):
    """A link of the robot.

    Attributes:
        link: its name.
        joint: the joint above it; None for the root.
        mesh: hash of a mesh that shows it, see shapes.meshes; None where it has none.
    """

    link: str
    joint: str | None
    mesh: str | None


class JointCoupling(TypedDict):
    """A joint whose value moves another one as well.

    Attributes:
        joint: its name.
        gain: movement of the other joint per movement of this one.
    """

    joint: str
    gain: float


class DrawnJoint(TypedDict):
    """A joint of the chain. Its value is its own, where driven, plus the couplings, plus `offset`.

    Attributes:
        name: as in the robot file.
        display_name: what people call it.
        type: `revolute`, `prismatic` or `fixed`; of a platform `floating`, which is at home where
            its place says, and `leg`.
        parent: the link that carries it.
        child: the link that it carries.
        xyz: its place in the parent's frame [m].
        quat: its orientation in the parent's frame.
        axis: unit vector in its own frame; None where it has none.
        lower: lower limit [rad, m for a linear axis]; None where it has none.
        upper: upper limit [rad, m for a linear axis]; None where it has none.
        driven: whether it has a motor, and so a place in every joint position.
        coupled_to: the joints whose controller-side values move it, too.
        offset: what is added [rad, m for a linear axis].
    """

    name: str
    display_name: str
    type: str
    parent: str
    child: str
    xyz: list[float]
    quat: list[float]
    axis: list[float] | None
    lower: float | None
    upper: float | None
    driven: bool
    coupled_to: list[JointCoupling]
    offset: float


class RobotShapes(TypedDict):
    """What a robot looks like.

    Attributes:
        robot: its name.
        shapes: its solids.
        struts: its rods.
        links: its links, root to tool.
        joints: its joints, root to tool.
        home: joint position of home, controller side [rad, m for a linear axis].
        hash: SHA-256 of all this: a page need not draw the same anew.
    """

    robot: str
    shapes: list[DrawnShape]
    struts: list[DrawnStrut]
    links: list[DrawnLink]
    joints: list[DrawnJoint]
    home: list[float]
    hash: str


class MeshOnLink(TypedDict):
    """Where a mesh is.

    Attributes:
        link: the link that it moves with.
        xyz: its origin in the link's frame [m].
        quat: its orientation in the link's frame.
    """

    link: str
    xyz: list[float]
    quat: list[float]


class RobotMesh(TypedDict):
    """A mesh of the robot, at one scale.

    Attributes:
        hash: SHA-256 of its bytes.
        bytes: how many it has.
        form: how to read it.
        unit_scale: m per unit of the file along x, y, z; negative mirrors.
        links: where it is.
        colour: `#rrggbb`.
    """

    hash: str
    bytes: int
    form: Literal["stl", "obj"]
    unit_scale: list[float]
    links: list[MeshOnLink]
    colour: str


class RobotMeshes(TypedDict):
    """The meshes of this cell's robot.

    Attributes:
        meshes: none for a robot of the catalogue.
    """

    meshes: list[RobotMesh]


class MeshChunk(TypedDict):
    """Some bytes of a mesh.

    Attributes:
        bytes_total: how many the whole mesh has.
        offset: number of the first byte here.
        data: the bytes in base64, at most 32,768 of them.
        more: whether more follow.
    """

    bytes_total: int
    offset: int
    data: str
    more: bool


@operation("shapes.show", needs=Permission.OBSERVE, since=3)
class ShowShapes(Request[RobotShapes]):
    """Return what a robot looks like, and how its joints move it.

    Raises:
        Refused: TOO_OFTEN, BAD_ARGUMENT, PLANNER_FAILED.
    """

    robot: str | None = None
    """a robot of the catalogue; None for that of this cell."""


@operation("shapes.meshes", needs=Permission.OBSERVE, since=3)
class ListMeshes(Request[RobotMeshes]):
    """Return the meshes of this cell's robot.

    Raises:
        Refused: TOO_OFTEN, PLANNER_FAILED.
    """


@operation("shapes.mesh", needs=Permission.OBSERVE, since=3)
class ReadMesh(Request[MeshChunk]):
    """Return some bytes of a mesh; ask for the next once these came.

    The server gives them as they were imported: compare the hash of all with the one asked for.

    Raises:
        Refused: TOO_OFTEN, UNKNOWN_MESH, BAD_ARGUMENT, PLANNER_FAILED.
    """

    hash: str
    """its SHA-256, as shapes.meshes tells it."""
    offset: Annotated[int, Count(0)] = 0
    """number of the first byte that is wanted."""


ShapeQuestion: TypeAlias = ShowShapes | ListMeshes | ReadMesh
"""Any of these."""
