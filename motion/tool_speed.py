"""Speed limits of points of the arm and of the tool's turn, and how fast each runs along a path.

Owns the choice of the points that reduced speed watches (the tool centre point and the elbow) and
the derivative of a point's place by the path parameter. Knows no time and no timing: `timing` turns
these derivatives into bounds on the path velocity, since |v| = |dp/ds| · ds/dt. Points come as
callables of joint positions, so neither pinocchio nor a robot is needed here.

The turn is a point too, in the nine dimensions of rotation matrices: from dR/dt = [ω]× R follows
‖dR/dt‖ = √2 |ω| in the Frobenius norm, so R/√2 moves at the speed |ω|.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from .errors import BadArgument
from .joint_curves import Path
from .trajectory import Array

if TYPE_CHECKING:
    from .kinematics import Kinematics

PointPosition: TypeAlias = Callable[[Array], Array]
"""From (m, n) joint positions to the places of a point in a frame at rest, (m, 3) [m]; or to what
else moves with the joints, (m, k) in a unit of its own."""

REDUCED_SPEED = 0.25
"""Greatest speed of the tool under manual reduced speed, by ISO 10218-1 [m/s]."""

_JOINT_STEP = 1e-5  # rad or m; the error of the central difference is of its square
_PARALLEL = 1e-6  # sine of the angle between axes that count as parallel
_APART = 1e-3  # m, between parallel axes that are not one


@dataclass(frozen=True, slots=True)
class ToolSpeedLimit:
    """How fast a point of the arm may be, or the tool may turn.

    Attributes:
        name: what the point is called in a certificate or a refusal.
        position: where the point is.
        limit: its greatest speed, in `unit`.
        unit: m/s, or rad/s of a turn.
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
        """Return the (m,) |dp/ds| at path positions s (m,) [m or rad per unit of s].

        By the chain rule this is the derivative of p along the direction dq/ds at q(s), taken as a
        central difference. So it is smooth wherever dq/ds is continuous, knots included.
        """
        joints, direction = path.evaluate(s), path.evaluate(s, 1)
        length = np.abs(direction).max(axis=1, keepdims=True)
        step = direction * (_JOINT_STEP / np.where(length > 0.0, length, 1.0))
        shift = self.position(joints + step) - self.position(joints - step)
        slope: Array = np.linalg.norm(shift, axis=1) * length[:, 0] / (2.0 * _JOINT_STEP)
        return slope


def speed_ratios(points: Sequence[ToolSpeedLimit], path: Path, s: Array) -> Array:
    """Return the ratios of points' speeds to their limits at path velocity 1.

    Args:
        points: k limits.
        path: what is run along.
        s: path positions, of any shape.

    Returns:
        The shape of s, and k.
    """
    ratios = [point.slope(path, s.ravel()).reshape(s.shape) / point.limit for point in points]
    return np.stack(ratios, axis=-1)


def reduced_speed(
    kinematics: Kinematics,
    limit: float = REDUCED_SPEED,
    *,
    tool: Sequence[float] = (0.0, 0.0, 0.0),
) -> tuple[ToolSpeedLimit, ...]:
    """Return the limits of reduced speed: on the tool centre point, and on the elbow if any.

    Args:
        kinematics: the robot.
        limit: greatest speed of either point [m/s].
        tool: (3,) the tool centre point in the frame of the tool link [m].

    Raises:
        BadArgument: the limit is not more than 0, or the tool is not three finite numbers.
    """
    points = [ToolSpeedLimit("tool", tool_point(kinematics, tool), limit)]
    elbow = elbow_link(kinematics)
    if elbow is not None:
        points.append(ToolSpeedLimit("elbow", link_point(kinematics, elbow), limit))
    return tuple(points)


def rotation_speed(kinematics: Kinematics, limit: float) -> ToolSpeedLimit:
    """Return a limit on how fast the tool turns, to be kept beside those of `reduced_speed`.

    Args:
        kinematics: the robot.
        limit: greatest rotation speed [rad/s].

    Raises:
        BadArgument: the limit is not more than 0.
    """

    def turn(joint_positions: Array) -> Array:
        rotations = kinematics.places(joint_positions).rotation
        flat: Array = rotations.reshape(-1, 9) / math.sqrt(2.0)
        return flat

    return ToolSpeedLimit("tool's turn", turn, limit, "rad/s")


def tool_point(kinematics: Kinematics, offset: Sequence[float] = (0.0, 0.0, 0.0)) -> PointPosition:
    """Return where a point fixed to the tool link is, in the base frame.

    Args:
        kinematics: the robot.
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
    """Return where the origin of a link's frame is, in the base frame.

    Raises:
        FrameUnknown: the robot has no such link.
    """
    kinematics.forward(kinematics.robot.home_position, link=link)

    def position(joint_positions: Array) -> Array:
        return kinematics.places(joint_positions, link).position

    return position


def elbow_link(kinematics: Kinematics) -> str | None:
    """Return the link whose frame's origin is the elbow, None for an arm that has none.

    The elbow is on the first joint that turns about an axis parallel to an earlier joint's and
    apart from it: joint 3 of the usual six axes, 4 of a seven-axis arm whose joint 3 is a roll or
    whose first axis is a rail, 2 of a SCARA. Its child link's frame has its origin on that axis,
    where upper arm and forearm meet.
    """
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
