"""Speed limits of points of the arm and of the tool's rotation, and their speeds along a path.

Owns the choice of the points that reduced speed limits (the tool centre point and the elbow) and
the derivative of a point's place by the path parameter. Knows no time and no timing:
`parameterization` turns these derivatives into bounds on the path velocity. Points come as
callables of joint positions, so neither pinocchio nor a robot is needed here. Places are in the
base frame [m]; joint vectors are controller-side driven joints in file order [rad or m]; s is the
path parameter of `joint_curves`.

Speed of a point: with p(q) its place and q(s) the path, the chain rule gives dp/ds = (∂p/∂q) q'(s)
and |v| = |dp/ds| · ds/dt. A limit V on |v| bounds ds/dt by V / |dp/ds| at each s, the form of a
velocity limit in time-optimal path following (Bobrow, Dubowsky and Gibson, "Time-Optimal Control of
Robotic Manipulators Along Specified Paths", IJRR 4(3), 1985).

The rotation is a point too, in the nine dimensions of rotation matrices. With dR/dt = [ω]× R (Lynch
and Park, Modern Robotics, section 3.2.2), and because a rotation changes no Frobenius norm and that
of [ω]× is √2 |ω|, ‖dR/dt‖ = √2 |ω|: R/√2 moves at the speed |ω|.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias
from weakref import WeakKeyDictionary

import numpy as np

from ..errors import BadArgument
from ..pose import Array
from .joint_curves import Path

if TYPE_CHECKING:
    from ..kinematics.serial import Kinematics

PointPosition: TypeAlias = Callable[[Array], Array]
"""From (m, n) joint positions to the places of a point in a frame at rest, (m, 3) [m]; or to other
values that move with the joints, (m, k) in a unit of their own."""

REDUCED_SPEED = 0.25
"""Greatest speed of the tool in manual reduced speed, by ISO 10218-1:2011, 5.6.2 [m/s]."""

_JOINT_STEP = 1e-5  # h of the central difference, rad or m: error of order h², about 1e-10 of p
_PARALLEL = 1e-6  # sine of the angle between axes that count as parallel
_APART = 1e-3  # m, between parallel axes that are not one

_elbows: WeakKeyDictionary[Kinematics, str | None] = WeakKeyDictionary()


@dataclass(frozen=True, slots=True)
class ToolSpeedLimit:
    """Speed limit of a point of the arm, or of the tool's rotation.

    Attributes:
        name: name of the point in a certificate or a refusal.
        position: place of the point as a function of the joints.
        limit: its greatest speed, in `unit`.
        unit: m/s, or rad/s for the rotation.
    """

    name: str
    position: PointPosition
    limit: float
    unit: str = "m/s"

    def __post_init__(self) -> None:
        if not (math.isfinite(self.limit) and self.limit > 0.0):
            accepted = f"more than 0 {self.unit}"
            raise BadArgument(f"speed limit of the {self.name}", self.limit, accepted)

    def slope(self, path: Path, s: Array) -> Array:
        """Return the distance that the point moves per unit of the path parameter.

        This is the derivative of p at q(s) along the direction d = q'(s), as the central difference
        (p(q + h d) - p(q - h d)) / 2h with d scaled so that no joint steps farther than h. It is
        smooth wherever q' is continuous, knots included.

        Returns:
            (m,) |dp/ds|: `unit` times seconds, [m] or [rad], per unit of s.
        """
        joints, direction = path.evaluate(s), path.evaluate(s, 1)
        length = np.abs(direction).max(axis=1, keepdims=True)
        step = direction * (_JOINT_STEP / np.where(length > 0.0, length, 1.0))
        shift = self.position(joints + step) - self.position(joints - step)
        slope: Array = np.linalg.norm(shift, axis=1) * length[:, 0] / (2.0 * _JOINT_STEP)
        return slope


def speed_ratios(points: Sequence[ToolSpeedLimit], path: Path, s: Array) -> Array:
    """Return the ratios of points' speeds to their limits at path velocity ds/dt = 1.

    Ratio times path velocity is the share of the limit that is used, so 1 / ratio is the greatest
    path velocity that a point allows.

    Args:
        points: k limits.
        s: path positions, of any shape.

    Returns:
        The shape of s with a last axis of k: |dp/ds| over limit [s per unit of s], 0 or more.
    """
    ratios = [point.slope(path, s.ravel()).reshape(s.shape) / point.limit for point in points]
    return np.stack(ratios, axis=-1)


def reduced_speed(
    kinematics: Kinematics, limit: float = REDUCED_SPEED, *, tool: Sequence[float] = (0.0, 0.0, 0.0)
) -> tuple[ToolSpeedLimit, ...]:
    """Return the limits of reduced speed: for the tool centre point, and for an elbow.

    Args:
        limit: greatest speed of either point [m/s].
        tool: (3,) the tool centre point in the frame of the tool link [m].

    Returns:
        One limit, or two for an arm with an elbow; see `elbow_link`.

    Raises:
        BadArgument: the limit is not more than 0, or the tool is not three finite numbers.
    """
    points = [ToolSpeedLimit("tool", tool_point(kinematics, tool), limit)]
    elbow = elbow_link(kinematics)
    if elbow is not None:
        points.append(ToolSpeedLimit("elbow", link_point(kinematics, elbow), limit))
    return tuple(points)


def rotation_speed(kinematics: Kinematics, limit: float) -> ToolSpeedLimit:
    """Return a limit of the tool's rotation speed, for use beside those of `reduced_speed`.

    Args:
        limit: greatest rotation speed |ω| of the tool link relative to the base [rad/s].

    Returns:
        A limit whose point is the (m, 9) elements of R/√2; see the module docstring.

    Raises:
        BadArgument: the limit is not more than 0.
    """

    def turn(joint_positions: Array) -> Array:
        rotations = kinematics.places(joint_positions).rotation
        flat: Array = rotations.reshape(-1, 9) / math.sqrt(2.0)
        return flat

    return ToolSpeedLimit("tool's turn", turn, limit, "rad/s")


def tool_point(kinematics: Kinematics, offset: Sequence[float] = (0.0, 0.0, 0.0)) -> PointPosition:
    """Return the map from (m, n) joint positions to (m, 3) places p + R · offset in the base [m].

    Args:
        offset: (3,) the point in the frame of the tool link [m].

    Raises:
        BadArgument: the offset is not three finite numbers.
    """
    fixed = np.array(offset, dtype=np.float64)
    if fixed.shape != (3,) or not np.isfinite(fixed).all():
        raise BadArgument("tool", list(offset), "three finite numbers of metres")

    def position(joint_positions: Array) -> Array:
        places = kinematics.places(joint_positions)
        point: Array = places.position + places.rotation @ fixed
        return point

    return position


def link_point(kinematics: Kinematics, link: str) -> PointPosition:
    """Return the map from (m, n) joint positions to (m, 3) places of a link's origin [m].

    Raises:
        FrameUnknown: the robot has no such link.
    """
    kinematics.forward(kinematics.robot.home_position, link=link)

    def position(joint_positions: Array) -> Array:
        return kinematics.places(joint_positions, link).position

    return position


def elbow_link(kinematics: Kinematics) -> str | None:
    """Return the link whose frame's origin is the elbow, None for an arm without one; found once.

    The elbow is on the first revolute joint whose axis is parallel to an earlier joint's and apart
    from it: joint 3 of the usual six axes, 4 of a seven-axis arm whose joint 3 is a roll or whose
    first axis is a rail, 2 of a SCARA. Its child link's frame has its origin on that axis, where
    upper arm and forearm meet. Two axes count as parallel where the sine of the angle between them
    is below 1e-6 with all joints at 0, and as apart from 1 mm on.
    """
    if kinematics not in _elbows:
        _elbows[kinematics] = _found_elbow(kinematics)
    return _elbows[kinematics]


def _found_elbow(kinematics: Kinematics) -> str | None:
    standing = np.zeros(kinematics.dof)
    shoulders: list[tuple[Array, Array]] = []
    for joint in kinematics.robot.driven:
        if joint.prismatic:
            continue
        pose = kinematics.forward(standing, link=joint.child)
        axis = pose.rotation @ (np.array(joint.axis) / np.linalg.norm(joint.axis))
        for other, origin in shoulders:
            parallel = np.linalg.norm(np.cross(axis, other)) < _PARALLEL
            if parallel and np.linalg.norm(np.cross(pose.position - origin, axis)) > _APART:
                return joint.child
        shoulders.append((axis, pose.position))
    return None
