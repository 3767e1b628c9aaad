"""Forward kinematics from a robot file's Denavit–Hartenberg table.

Owns the standard convention: tool = base · ∏ Rz(theta) Tz(d) Tx(a) Rx(alpha) · tool. It shares
nothing with the chain's kinematics, so that each can be checked against the other. numpy only.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from .errors import NotFinite, WrongJointCount
from .pose import Array, Pose
from .robot_schema import DhRow, DhTable, Placement, Variable


def dh_forward(table: DhTable, moving: Sequence[float]) -> Pose:
    """Compute the tool's pose in the root link's frame.

    Args:
        table: the rows, one per joint that is not fixed.
        moving: chain-side position of each of these joints [rad or m], dependent ones included.

    Raises:
        WrongJointCount: not one value per row.
        NotFinite: a value is infinite or not a number.
    """
    if len(moving) != len(table.rows):
        raise WrongJointCount(len(moving), len(table.rows))
    placement = _matrix(table.base)
    for index, (row, value) in enumerate(zip(table.rows, moving, strict=True)):
        if not math.isfinite(value):
            raise NotFinite("the joint position", index)
        placement = placement @ _row(row, value)
    placement = placement @ _matrix(table.tool)
    return Pose.from_matrix(placement[:3, :3], placement[:3, 3])


def _row(row: DhRow, value: float) -> Array:
    angle_moves = row.variable is Variable.THETA
    theta = row.theta_offset + (value if angle_moves else 0.0)
    d = row.d + (0.0 if angle_moves else value)
    ct, st, ca, sa = math.cos(theta), math.sin(theta), math.cos(row.alpha), math.sin(row.alpha)
    return np.array(
        [
            [ct, -st * ca, st * sa, row.a * ct],
            [st, ct * ca, -ct * sa, row.a * st],
            [0.0, sa, ca, d],
            [0.0, 0.0, 0.0, 1.0],
        ]
    )


def _matrix(placement: Placement) -> Array:
    return Pose.from_rpy(placement.xyz, placement.rpy).to_matrix()
