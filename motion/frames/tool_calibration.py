"""Tool calibration: a tool's centre point and directions, from several touches of one fixed point.

Owns the least-squares problem, the rules when its poses are too similar to solve it, and the
residual. Knows no robot and no tree: flange poses are in the base frame [m], the tool found is in
the flange.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from ..errors import BadArgument, PoorGeometry
from ..pose import Array, Pose

LEAST_POSES = 4

LEAST_TURN = math.radians(10.0)
"""Least rotation between two flange poses [rad]; with less a touch adds nothing to the other."""

LEAST_SPREAD = 0.1
"""Least singular value of the problem, as `ToolCentre.spread`."""

GREATEST_RESIDUAL = 0.005
"""Default greatest distance of a touch from the fixed point that is accepted [m]."""

LEAST_DRAW = 0.01
"""Least distance by which the tool is moved away to show a direction [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class ToolCentre:
    """Tool centre point (TCP), and how well the poses determine it.

    Attributes:
        position: (3,) the TCP in the flange [m].
        fixed_point: (3,) the point that was touched, in the base [m].
        residuals: for each pose the distance of its TCP from the fixed point [m].
        spread: least singular value of the problem over √poses, 0 to 1: motion of a pose's TCP per
            metre of error of the TCP, in the direction where it is least.
    """

    position: Array
    fixed_point: Array
    residuals: tuple[float, ...]
    spread: float

    @property
    def max_residual(self) -> float:
        """Greatest residual [m]."""
        return max(self.residuals)

    @property
    def uncertainty(self) -> float:
        """Standard error of the TCP in the direction that is determined worst [m].

        The variance of a touch is estimated from the residuals, which have 3 n - 6 degrees of
        freedom; the covariance of a least-squares answer is that times (AᵀA)⁻¹.
        """
        count = len(self.residuals)
        squares = math.fsum(residual * residual for residual in self.residuals)
        return math.sqrt(squares / (3 * count - 6) / count) / self.spread


def tool_centre(
    flange_poses: Sequence[Pose], *, greatest_residual: float = GREATEST_RESIDUAL
) -> ToolCentre:
    """Return the TCP from flange poses in each of which it touches the same fixed point.

    With R, p a flange pose, t the TCP in the flange and c the fixed point, R t + p = c for every
    pose. Subtracting means over the poses removes c: (R - mean R) t = -(p - mean p), which is
    solved for t by least squares, as in fitting the centre of a sphere.

    Args:
        flange_poses: four or more, in the base frame, each rotated by 10° or more from every other,
            and not all about one axis.
        greatest_residual: greatest accepted residual of a touch [m].

    Raises:
        BadArgument: fewer than four poses, or a residual of 0 or less.
        PoorGeometry: two poses are too similar, all rotate about one axis, or a touch is too far
            off.
    """
    if len(flange_poses) < LEAST_POSES:
        raise BadArgument("flange poses", len(flange_poses), f"{LEAST_POSES} or more")
    if not greatest_residual > 0.0:
        raise BadArgument("greatest_residual", greatest_residual, "more than 0")
    _check_turns(flange_poses)
    rotations = np.array([pose.rotation for pose in flange_poses])
    positions = np.array([pose.position for pose in flange_poses])
    turned = (rotations - rotations.mean(axis=0)).reshape(-1, 3)
    shifted = (positions - positions.mean(axis=0)).ravel()
    left, singular, right = np.linalg.svd(turned, full_matrices=False)
    spread = float(singular[-1]) / math.sqrt(len(flange_poses))
    if not spread >= LEAST_SPREAD:
        axis = ", ".join(f"{value:.2f}" for value in right[-1])
        what = f"the spread of the poses, which turn about almost one axis ({axis} of the flange),"
        raise PoorGeometry(what, spread, LEAST_SPREAD, "")
    tcp: Array = right.T @ ((left.T @ -shifted) / singular)
    touches = rotations @ tcp + positions
    fixed_point: Array = touches.mean(axis=0)
    residuals = np.linalg.norm(touches - fixed_point, axis=1)
    worst = int(np.argmax(residuals))
    if not residuals[worst] <= greatest_residual:
        what = f"the distance of the touch in pose {worst + 1} from the point that fits best"
        raise PoorGeometry(what, float(residuals[worst]), greatest_residual, "m", least=False)
    return ToolCentre(tcp, fixed_point, tuple(residuals.tolist()), spread)


def tool_orientation(
    tcp: Sequence[float] | Array, touching: Pose, along_z: Pose, along_x: Pose | None = None
) -> Pose:
    """Return the tool in the flange: its TCP, with z and x shown by moving the tool away.

    The tool touches a fixed point; then the flange is moved to where that point lies on the tool's
    +z axis, and, for the three-point method, to where it lies in the tool's xz plane on the side of
    +x. Without the last, x is as near as possible to the flange's x (or its y where z is nearer to
    x than 45°).

    Args:
        tcp: (3,) the TCP in the flange [m], as of `tool_centre`.
        touching: the flange where the TCP touches the fixed point, in the base.
        along_z: the flange where the fixed point lies on the tool's +z axis.
        along_x: the flange where it lies in the xz plane with x > 0; None for two points.

    Raises:
        PoorGeometry: the tool was moved away by less than 10 mm, or along x almost as along z.
        BadArgument, NotFinite: the TCP is not three finite values.
    """
    centre = Pose(np.asarray(tcp, dtype=np.float64), Pose.identity().quaternion)
    fixed_point = touching.compose(centre).position
    z = _shown(fixed_point, along_z, centre, "along z")
    if along_x is None:
        x = np.eye(3)[0] if abs(z[0]) < math.sqrt(0.5) else np.eye(3)[1]
    else:
        x = _shown(fixed_point, along_x, centre, "along x")
    across = x - (x @ z) * z
    sine = float(np.linalg.norm(across))
    if sine < math.sin(LEAST_TURN):
        what = "the angle between the directions shown for z and x"
        raise PoorGeometry(what, math.asin(min(sine, 1.0)), LEAST_TURN, "rad")
    x = across / sine
    return Pose.from_matrix(np.column_stack((x, np.cross(z, x), z)), centre.position)


def _check_turns(poses: Sequence[Pose]) -> None:
    turns = {
        (first, second): poses[first].rotation_distance(poses[second])
        for first, second in combinations(range(len(poses)), 2)
    }
    (first, second), smallest = min(turns.items(), key=lambda item: item[1])
    if not smallest >= LEAST_TURN:
        what = f"the smallest turn between two poses ({first + 1} and {second + 1})"
        raise PoorGeometry(what, smallest, LEAST_TURN, "rad")


def _shown(fixed_point: Array, flange: Pose, centre: Pose, which: str) -> Array:
    """Return the unit direction, in the flange, from the TCP to the fixed point."""
    at = Pose(fixed_point, centre.quaternion)
    direction = flange.inverse().compose(at).position - centre.position
    distance = float(np.linalg.norm(direction))
    if not distance >= LEAST_DRAW:
        raise PoorGeometry(f"the distance drawn away {which}", distance, LEAST_DRAW, "m")
    unit: Array = direction / distance
    return unit
