"""Geometry of a serial arm for closed forms, and what all closed forms share.

Owns the reading of axes, points and tool placement from a robot file, with every joint at zero, in
the robot's base frame: the screws of a product of exponentials. This reading knows no joint values,
no limits and no pinocchio, so it is also a check of the forward kinematics.

Owns also the types shared by the families: the branches that a closed form returns, and the three
measures whose signs are an arm's configuration and whose zeros are its singularities.

Owns three subproblems: rotating a point about an axis until it lies in a plane beside that axis,
placing the end of two links in a plane, and splitting a rotation into three angles. They are the
subproblems of Paden and Kahan (see Murray, Li, Sastry: A Mathematical Introduction to Robotic
Manipulation, 1994, section 3.3) in the coordinates of Brandstötter, Angerer and Hofbaur (An
Analytical Solution of the Inverse Kinematics Problem of Industrial Serial Manipulators with an
Ortho-parallel Basis and a Spherical Wrist, 2014). A problem without a solution returns the nearest
miss and its distance, the gap. Scalars, since numpy's fixed cost per call would be most of a
solution's time.

Owns the ortho-parallel base of these authors, in whose frame most industrial arms are solved. Its
origin lies on axis 1 at the height of axis 2; z is axis 1, y is along axis 2, and x points to the
side on which the arm's end stands at zero. Joint angles here are positive about z and y; `sign2`
and `sign3` give the joints' own directions.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple, Protocol, TypeAlias

import numpy as np

from ...description.robot import SerialRobot
from ...description.schema import Joint, Placement
from ...pose import Array, Pose

FULL_TURN = 2.0 * math.pi

Position: TypeAlias = tuple[float, ...]
"""Chain-side joint position [rad or m], each angle in any revolution."""


class Branches(NamedTuple):
    """Joint positions that reach a pose, or come nearest to it; two lists of the same length.

    Attributes:
        gaps: distance of the wrist from where the pose needs it [m]; 0 if it gets there.
    """

    positions: list[Position]
    gaps: list[float]

    def within(self, gap: float) -> list[Position]:
        """Return the positions of the branches that miss the pose by a gap [m] at most."""
        if max(self.gaps, default=0.0) <= gap:
            return self.positions
        return [self.positions[index] for index, miss in enumerate(self.gaps) if miss <= gap]


class Measures(NamedTuple):
    """Three lengths and angles whose product is the Jacobian's determinant, up to a factor.

    Attributes:
        shoulder: distance of the wrist in front of axis 1 [m]; behind it, negative.
        elbow: the bend from upper arm to forearm [rad], 0 if straight, ±π if folded; positive
            where the elbow is above the line from shoulder to wrist in the frame of axis 1.
        wrist: angle of the wrist's middle joint from where its outer axes are parallel [rad].
    """

    shoulder: float
    elbow: float
    wrist: float


class ClosedForm(Protocol):
    """Inverse kinematics by formulas, without limits; all values chain-side.

    Attributes:
        free_joint: index of the joint whose position is a free choice in any pose; None without
            a spare joint.
    """

    @property
    def free_joint(self) -> int | None:
        """Index of the joint whose position is a free choice; None without a spare joint."""
        ...

    def branches(self, target: Array, preferred: Sequence[float]) -> Branches:
        """Return all joint positions that reach a pose, at most eight, or nearest misses with gaps.

        Args:
            target: (4, 4) wanted tool placement in the base frame.
            preferred: values that the free joint, and undetermined joints, keep [rad or m].
        """
        ...

    def measures(self, position: Sequence[float]) -> Measures:
        """Return the signed distances of a joint position from the singularities."""
        ...


def wrapped(angle: float) -> float:
    """Return the same direction as an angle from -π to π [rad]."""
    return math.remainder(angle, FULL_TURN)


@dataclass(frozen=True, slots=True, eq=False)
class ArmGeometry:
    """Arm at its chain-side zero position, in the base frame; one row per moving joint.

    Attributes:
        axes: (m, 3) unit directions of the joint axes.
        points: (m, 3) a point on each axis [m].
        prismatic: (m,) True if the joint slides along its axis instead of rotating about it.
        tool: (4, 4) placement of the tool link.
    """

    axes: Array
    points: Array
    prismatic: tuple[bool, ...]
    tool: Array

    def without_first(self) -> ArmGeometry:
        """Return the rest of the arm, the first joint held at zero."""
        return ArmGeometry(self.axes[1:], self.points[1:], self.prismatic[1:], self.tool)


def arm_geometry(robot: SerialRobot) -> ArmGeometry:
    """Return the geometry of a robot, dependent joints included."""
    placement = inverse(_base_in_root(robot))
    axes, points = [], []
    for joint in robot.joints:
        placement = placement @ _matrix(joint.origin)
        if isinstance(joint, Joint):
            axis = placement[:3, :3] @ np.array(joint.axis)
            axes.append(axis / np.linalg.norm(axis))
            points.append(placement[:3, 3])
    prismatic = tuple(joint.prismatic for joint in robot.moving)
    return ArmGeometry(np.array(axes), np.array(points), prismatic, placement)


def common_point(axes: Array, points: Array) -> tuple[Array, float]:
    """Return the (3,) point nearest to several lines, and its greatest distance from one [m].

    The sum of squared distances is least where Σ (I - aᵢaᵢᵀ)(x - pᵢ) = 0. Parallel lines have no
    single such point; the one of least norm is returned.

    Args:
        axes: (k, 3) unit directions.
        points: (k, 3) a point on each line [m].
    """
    across = np.eye(3) - axes[:, :, np.newaxis] * axes[:, np.newaxis, :]
    right = np.einsum("kij,kj->i", across, points)
    point = np.linalg.lstsq(across.sum(axis=0), right, rcond=None)[0]
    distances = np.linalg.norm(np.einsum("kij,kj->ki", across, point - points), axis=1)
    return point, float(distances.max())


def rotation_about(axis: Array, angle: float) -> Array:
    """Return the (3, 3) rotation by an angle [rad] about a unit axis, by Rodrigues' formula."""
    x, y, z = axis.tolist()
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    rotation: Array = np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * (cross @ cross)
    return rotation


def inverse(placement: Array) -> Array:
    """Return the inverse of a (4, 4) placement."""
    result = np.eye(4)
    result[:3, :3] = placement[:3, :3].T
    result[:3, 3] = -placement[:3, :3].T @ placement[:3, 3]
    return result


def _base_in_root(robot: SerialRobot) -> Array:
    placement = np.eye(4)
    for joint in robot.joints:
        if robot.base_frame.parent == joint.parent:
            break
        placement = placement @ _matrix(joint.origin)
    return placement @ _matrix(robot.base_frame)


def _matrix(placement: Placement) -> Array:
    return Pose.from_rpy(placement.xyz, placement.rpy).to_matrix()


FREE = 1e-9
"""Below this [m, or no unit for a sine], an angle is undetermined and its preferred value kept."""


def turn_into_plane(
    x: float, y: float, beside: float, preferred: float
) -> tuple[float, tuple[tuple[float, float], tuple[float, float]]]:
    """Return the rotations about z after which a plane's points (s, beside) cover a point.

    Solves Rz(angle) (s, beside) = (x, y) for the angle and s.

    Args:
        x: first coordinate of the point [m].
        y: second coordinate of the point [m].
        beside: distance of the plane from the axis [m], with its sign.
        preferred: the angle used where the point lies on the axis and every angle is a solution
            [rad].

    Returns:
        The gap [m], 0 unless the point is nearer to the axis than the plane; and the two (angle
        [rad], s [m]), the one with s not negative first.
    """
    squared = x * x + y * y
    rest = squared - beside * beside
    if squared < FREE * FREE:
        gap = abs(beside)
        return gap, ((preferred, 0.0), (preferred + math.pi, 0.0))
    bearing = math.atan2(y, x)
    if rest <= 0.0:
        side = math.atan2(beside, 0.0)
        return abs(beside) - math.sqrt(squared), ((bearing - side, 0.0), (bearing - side, 0.0))
    s = math.sqrt(rest)
    return 0.0, ((bearing - math.atan2(beside, s), s), (bearing - math.atan2(beside, -s), -s))


def two_links(
    x: float, z: float, first: float, second: float
) -> tuple[float, tuple[tuple[float, float], ...]]:
    """Return the angles at which two links reach from the origin to a point of their plane.

    Angles count from z towards x, as a rotation about y does.

    Args:
        x: coordinate of the point [m].
        z: coordinate of the point [m].
        first: length of the first link [m].
        second: length of the second link [m].

    Returns:
        The gap [m], 0 where the point is in reach; and (angle of the first link [rad], angle from
        the first link to the second [rad]): two, the one with the positive bend first, or one where
        the links are straight or folded.
    """
    squared = x * x + z * z
    cosine = (squared - first * first - second * second) / (2.0 * first * second)
    direction = math.atan2(x, z)
    if cosine >= 1.0:
        return math.sqrt(squared) - first - second, ((direction, 0.0),)
    if cosine <= -1.0:
        gap = abs(first - second) - math.sqrt(squared)
        return gap, ((direction if first >= second else direction + math.pi, math.pi),)
    # The sine by both factors: 1 - cosine² would lose half the digits where the arm is straight.
    sine = math.sqrt((1.0 - cosine) * (1.0 + cosine))
    bend = math.atan2(sine, cosine)
    lead = math.atan2(second * sine, first + second * cosine)
    return 0.0, ((direction - lead, bend), (direction + lead, -bend))


def zyz_angles(
    a: float,
    b: float,
    c: float,
    d: float,
    e: float,
    f: float,
    g: float,
    h: float,
    i: float,
    preferred: float,
) -> tuple[float, float, float]:
    """Return a rotation, by rows (a, b, c), (d, e, f), (g, h, i), as angles of Rz(α) Ry(β) Rz(γ).

    Where sin β vanishes only α ± γ is determined: α keeps its preferred value [rad]. The elements
    come one by one, as packing and unpacking rows would cost more than the arc tangents.

    Returns:
        (α, β, γ) [rad] with β from 0 to π. The other answer is (α + π, -β, γ + π).
    """
    sine = math.sqrt(c * c + f * f)
    if sine > _WELL_CONDITIONED:
        return math.atan2(f, c), math.atan2(sine, i), math.atan2(h, -g)
    # The sum α ± γ is well determined though each of them is not: γ is what α leaves.
    alpha = preferred if sine < FREE else math.atan2(f, c)
    cosine_alpha, sine_alpha = math.cos(alpha), math.sin(alpha)
    beta = math.atan2(cosine_alpha * c + sine_alpha * f, i)
    gamma = math.atan2(cosine_alpha * d - sine_alpha * a, cosine_alpha * e - sine_alpha * b)
    return alpha, beta, gamma


_WELL_CONDITIONED = 1e-4  # sine above which the direct formulas keep twelve digits


EXACT = 1e-4
"""Tolerance of parallel, perpendicular and crossing axes [m or rad], corrected by polishing."""

_NO_LENGTH = 1e-6  # m


@dataclass(frozen=True, slots=True, eq=False)
class OrthoParallelBase:
    """Arm up to a point carried by its forearm, in the arm's own frame.

    Attributes:
        frame: (4, 4) placement of the arm's frame in the base frame.
        offset: distance of axis 2 from axis 1 along x [m].
        beside: distance of the forearm's end from the plane of axis 1 along y [m].
        upper_arm: length from axis 2 to axis 3 [m].
        upper_arm_angle: its angle from z towards x at zero [rad].
        forearm: length from axis 3 to the forearm's end [m].
        fold: angle from upper arm to forearm at zero [rad].
        sign2: 1 if joint 2 rotates positively about y, else -1.
        sign3: the same of joint 3.
    """

    frame: Array
    offset: float
    beside: float
    upper_arm: float
    upper_arm_angle: float
    forearm: float
    fold: float
    sign2: float
    sign3: float


def ortho_parallel_base(
    geometry: ArmGeometry, forearm_end: Array, forward: Array
) -> OrthoParallelBase | None:
    """Return the first three axes if they are of this kind, else None.

    Args:
        geometry: the arm; its first three joints revolute.
        forearm_end: (3,) the point that the third joint carries, in the base frame at zero [m].
        forward: (3,) a point in front of the arm at zero, which sets the direction of x [m].
    """
    first, second, third = geometry.axes[:3]
    if abs(float(first @ second)) > EXACT or not parallel(second, third):
        return None
    point1, point2, point3 = geometry.points[:3]
    origin = point1 + first * float((point2 - point1) @ first)
    y = second - first * float(first @ second)
    y /= np.linalg.norm(y)
    ahead = float((forward - origin) @ np.cross(y, first))
    if abs(ahead) <= EXACT:
        ahead = float((point2 - origin) @ np.cross(y, first))
    if ahead < -EXACT:
        y = -y
    frame = np.eye(4)
    frame[:3, :3] = np.column_stack((np.cross(y, first), y, first))
    frame[:3, 3] = origin
    shoulder, elbow, end = (np.stack((point2, point3, forearm_end)) - origin) @ frame[:3, :3]
    upper_arm = math.hypot(elbow[0] - shoulder[0], elbow[2] - shoulder[2])
    forearm = math.hypot(end[0] - elbow[0], end[2] - elbow[2])
    if min(upper_arm, forearm) < _NO_LENGTH:
        return None
    upper_arm_angle = math.atan2(elbow[0] - shoulder[0], elbow[2] - shoulder[2])
    return OrthoParallelBase(
        frame=frame,
        offset=float(shoulder[0]),
        beside=float(end[1]),
        upper_arm=upper_arm,
        upper_arm_angle=upper_arm_angle,
        forearm=forearm,
        fold=math.atan2(end[0] - elbow[0], end[2] - elbow[2]) - upper_arm_angle,
        sign2=math.copysign(1.0, float(second @ y)),
        sign3=math.copysign(1.0, float(third @ y)),
    )


def parallel(first: Array, second: Array) -> bool:
    """Return True if two unit vectors point along one line, either way."""
    return float(np.linalg.norm(np.cross(first, second))) <= EXACT


def perpendicular(first: Array, second: Array) -> bool:
    """Return True if two unit vectors are at a right angle."""
    return abs(float(first @ second)) <= EXACT
