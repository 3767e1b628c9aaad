"""Forward kinematics from a robot file's Denavit–Hartenberg table.

Owns the standard convention: tool = base · ∏ Rz(theta) Tz(d) Tx(a) Rx(alpha) · tool (J. Denavit and
R. S. Hartenberg, *A Kinematic Notation for Lower-Pair Mechanisms*, 1955, in the form of R. P. Paul,
*Robot Manipulators*, 1981). It shares nothing with the chain's kinematics, so that each can be
checked against the other. numpy only.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ..description.schema import DhRow, DhTable, Placement, Variable
from ..errors import NotFinite, WrongJointCount
from ..pose import Array, Pose


def dh_forward(table: DhTable, moving: Sequence[float]) -> Pose:
    """Return the tool's pose in the root link's frame.

    Args:
        table: the rows, one per joint that is not fixed.
        moving: (r,) chain-side position of each of these [rad or m], dependent ones included.

    Raises:
        WrongJointCount: not one value per row.
        NotFinite: a value is infinite or not a number.
    """
    placement = _frames(table, moving)[-1] @ _matrix(table.tool)
    return Pose.from_matrix(placement[:3, :3], placement[:3, 3])


def dh_frames(table: DhTable, moving: Sequence[float]) -> tuple[Pose, ...]:
    """Return the table's frames in the root link's frame.

    Args:
        table: the rows, one per joint that is not fixed.
        moving: (r,) chain-side position of each of these [rad or m], dependent ones included.

    Returns:
        Frame 0, whose z is joint 1's axis, and the frame at the end of each row.

    Raises:
        WrongJointCount: not one value per row.
        NotFinite: a value is infinite or not a number.
    """
    frames = _frames(table, moving)
    return tuple(Pose.from_matrix(frame[:3, :3], frame[:3, 3]) for frame in frames)


def _frames(table: DhTable, moving: Sequence[float]) -> list[Array]:
    if len(moving) != len(table.rows):
        raise WrongJointCount(len(moving), len(table.rows))
    frames = [_matrix(table.base)]
    for index, (row, value) in enumerate(zip(table.rows, moving, strict=True)):
        if not math.isfinite(value):
            raise NotFinite("the joint position", index)
        frames.append(frames[-1] @ _row(row, value))
    return frames


def _row(row: DhRow, value: float) -> Array:
    angle_moves = row.variable is Variable.THETA
    theta = row.theta_offset + (value if angle_moves else 0.0)
    d = row.d + (0.0 if angle_moves else value)
    return dh_matrix(theta, d, row.a, row.alpha)


def dh_matrix(theta: float, d: float, a: float, alpha: float) -> Array:
    """Return Rz(theta) Tz(d) Tx(a) Rx(alpha), (4, 4) [rad, m]."""
    ct, st, ca, sa = math.cos(theta), math.sin(theta), math.cos(alpha), math.sin(alpha)
    return np.array(
        [
            [ct, -st * ca, st * sa, a * ct],
            [st, ct * ca, -ct * sa, a * st],
            [0.0, sa, ca, d],
            [0.0, 0.0, 0.0, 1.0],
        ]
    )


def _matrix(placement: Placement) -> Array:
    return Pose.from_rpy(placement.xyz, placement.rpy).to_matrix()
