"""Operations on kinematics: forward, Jacobian, inverse; nothing moves, and no authority is needed.

Joints are counted from 0, controller side: rad, or m on a linear axis. Lengths are m, quaternions
x, y, z, w. Questions are answered beside the event loop and count in a rate of each connection:
TOO_OFTEN says how many seconds to wait.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import field
from typing import Annotated, Literal, NotRequired, TypeAlias, TypedDict

from ..roles import Permission
from .declaration import Length, Number, Placed, ReadAs, Request, operation

MOST_JOINT = 1e3
"""Greatest joint value that is computed with [rad or m]."""

JointValue: TypeAlias = Annotated[float, Number(-MOST_JOINT, MOST_JOINT)]

Joints: TypeAlias = Annotated[
    Sequence[float] | None, ReadAs(Annotated[tuple[JointValue, ...], Length(1, 32)] | None)
]
"""A joint position; None for where the robot is reported now."""


class JointOutside(TypedDict):
    """A joint outside its limits.

    Attributes:
        joint: its number, from 0.
        value: what was given [rad, m for a linear axis].
        lower: lower limit [rad, m for a linear axis].
        upper: upper limit [rad, m for a linear axis].
    """

    joint: int
    value: float
    lower: float
    upper: float


class ArmPosture(TypedDict):
    """In which of the ways an arm stands.

    Attributes:
        shoulder: `front` or `back`.
        elbow: `up` or `down`.
        wrist: `no-flip` or `flip`.
        turns: revolutions of each joint, 0 from -π up to π.
    """

    shoulder: str
    elbow: str
    wrist: str
    turns: list[int]


class LinkPose(TypedDict):
    """Where a link is.

    Attributes:
        link: its name.
        position: x, y, z [m].
        orientation: quaternion x, y, z, w.
    """

    link: str
    position: list[float]
    orientation: list[float]


class ForwardAnswer(TypedDict):
    """Where the tool is, in several forms.

    Attributes:
        position: x, y, z [m].
        orientation: quaternion x, y, z, w; w is not negative.
        matrix: 4 × 4, row by row: [[R, p], [0, 1]] [m].
        rpy: roll, pitch, yaw [rad] with R = Rz(yaw) Ry(pitch) Rx(roll).
        rpy_unique: False at a pitch of ±π/2, where roll is 0 and yaw the sum or difference.
        axis_angle: rotation vector x, y, z [rad].
        configuration: how the arm stands; None where it has no flags.
        limits: joints outside their limits; the pose is told all the same.
        links: all links, where asked for.
    """

    position: list[float]
    orientation: list[float]
    matrix: list[list[float]]
    rpy: list[float]
    rpy_unique: bool
    axis_angle: list[float]
    configuration: ArmPosture | None
    limits: list[JointOutside]
    links: NotRequired[list[LinkPose]]


class NearestSingularity(TypedDict):
    """The singularity that the arm is nearest to.

    Attributes:
        kind: `wrist`, `elbow`, `shoulder` or `unnamed`.
        distance: from it, in `unit`.
        unit: `rad` or `m`; empty for an unnamed one, whose distance is the least singular value.
        joints: numbers of the joints that, moved together there, leave the tool still.
    """

    kind: str
    distance: float
    unit: str
    joints: list[int]


class JacobianAnswer(TypedDict):
    """The Jacobian of the tool centre point, and how near it is to losing rank.

    Attributes:
        jacobian: 6 × n, rows vx, vy, vz, ωx, ωy, ωz, per unit of controller-side joint speed
            [m/rad and rad/rad; m/m and rad/m on a linear axis].
        order: `linear-first`; the RoboAnalyzer's paper stacks [ω; v], so swap the halves for it.
        condition: greatest over least singular value, 1 at best; None for infinite.
        manipulability: square root of the determinant of J Jᵀ, of Jᵀ J with fewer than six joints.
        nearest_singularity: which, and how far.
        size: length by which those of the Jacobian are divided for these three [m].
    """

    jacobian: list[list[float]]
    order: str
    condition: float | None
    manipulability: float
    nearest_singularity: NearestSingularity
    size: float


class NearestLimit(TypedDict):
    """The joint that is nearest to an end of its range.

    Attributes:
        joint: its number, from 0.
        margin: how far it may go there [rad, m for a linear axis].
    """

    joint: int
    margin: float


class InverseSolution(TypedDict):
    """One joint position that reaches the pose.

    Attributes:
        branch: number of its configuration, from 1, which a motion takes by itself: the nearest,
            where a slow joint weighs more. Turns of one share it. It names the same one while
            joints, tool and frame stay.
        joints: inside the limits [rad, m for a linear axis].
        configuration: how the arm stands; None where it has no flags.
        distance: greatest change of a joint from the seed [rad, m for a linear axis].
        position_error: distance from the pose, by forward kinematics [m].
        rotation_error: angle from it [rad].
        nearest_limit: the joint that is nearest to an end of its range.
        touches: names of two bodies that touch; None for none, and where it was not asked for.
    """

    branch: int
    joints: list[float]
    configuration: ArmPosture | None
    distance: float
    position_error: float
    rotation_error: float
    nearest_limit: NearestLimit
    touches: list[str] | None


class InverseAnswer(TypedDict):
    """Joint positions that reach the pose, that of the smallest `distance` first.

    Attributes:
        solutions: at most 64.
        total: how many there are of the kind that was asked for.
        complete: whether nothing is missing in `total`; false for `nearest`, for an arm with a
            self-motion or without a closed form, and at a singularity: those are samples.
    """

    solutions: list[InverseSolution]
    total: int
    complete: bool


@operation("kinematics.fk", needs=Permission.OBSERVE, since=3)
class ForwardKinematics(Request[ForwardAnswer]):
    """Return where the tool is at a joint position: matrix, angles, quaternion, configuration.

    Raises:
        Refused: TOO_OFTEN, WRONG_JOINT_COUNT, FEEDBACK_STALE, UNKNOWN_FRAME, PLANNER_FAILED.
    """

    joints: Joints = field(default=None, kw_only=True)
    """the joint position [rad, m for a linear axis]; None for where the robot is reported now."""
    frame: str = field(default="base", kw_only=True)
    """base, root or a user frame that stands still."""
    tool: str | None = field(default=None, kw_only=True)
    """a tool, or flange; None for the selected tool."""
    link: str | None = field(default=None, kw_only=True)
    """a link whose place is wanted; None for the tool."""
    all_links: bool = field(default=False, kw_only=True)
    """whether all links are told as well."""


@operation("kinematics.jacobian", needs=Permission.OBSERVE, since=3)
class ToolJacobian(Request[JacobianAnswer]):
    """Return the Jacobian of the tool centre point, its condition and the nearest singularity.

    Raises:
        Refused: TOO_OFTEN, WRONG_JOINT_COUNT, FEEDBACK_STALE, UNKNOWN_FRAME, PLANNER_FAILED.
    """

    joints: Joints = field(default=None, kw_only=True)
    """the joint position [rad, m for a linear axis]; None for where the robot is reported now."""
    frame: Literal["base", "root"] = field(default="base", kw_only=True)
    """whose axes."""
    tool: str | None = field(default=None, kw_only=True)
    """a tool, or flange; None for the selected tool."""


@operation("kinematics.ik", needs=Permission.OBSERVE, since=3)
class InverseKinematics(Request[InverseAnswer]):
    """Return joint positions that put the tool at a pose; of a connection's only the newest waits.

    Raises:
        Refused: TOO_OFTEN, SUPERSEDED, UNREACHABLE, OUT_OF_RANGE, UNKNOWN_FRAME,
            WRONG_JOINT_COUNT, FEEDBACK_STALE, PLANNER_FAILED.
    """

    pose: Placed
    """the wanted pose of the tool."""
    frame: str = field(default="base", kw_only=True)
    """base, root or a user frame that stands still."""
    tool: str | None = field(default=None, kw_only=True)
    """a tool, or flange; None for the selected tool."""
    seed: Joints = field(default=None, kw_only=True)
    """the joint position to be near to; None for where the robot is reported now."""
    branches: Literal["nearest", "all", "turns"] = field(default="nearest", kw_only=True)
    """the nearest answer, each configuration at its nearest turn, or all turns in the limits."""
    scene: bool = field(default=False, kw_only=True)
    """whether each answer also tells what touches in the cell's scene."""


Question: TypeAlias = ForwardKinematics | ToolJacobian | InverseKinematics
"""Any of these."""
