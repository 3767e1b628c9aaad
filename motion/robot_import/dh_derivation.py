"""Derivation of a standard Denavit–Hartenberg table from a chain of joints, and its residual.

Owns the construction: frame i has its z along joint i+1, its x along the common normal from
joint i's axis. Source: J. Denavit, R. S. Hartenberg, "A kinematic notation for lower-pair
mechanisms based on matrices", J. Appl. Mech. 22 (1955); J. J. Craig, "Introduction to Robotics",
ch. 3, for parallel and meeting axes. numpy only; shares nothing with `serial`.

Base and tool of the table are free placements, so in exact numbers every chain has a table. In
practice axes that are parallel except for rounding have none: their common normal lies kilometres
away. Those count as parallel, and the residual shows the error.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..description.rules import MAX_LENGTH
from ..description.schema import DhRow, DhTable, JointType, Variable
from ..kinematics.dh import dh_forward, dh_matrix
from ..pose import Array, Pose
from .imported_chain import ImportedJoint, to_matrix, to_placement

# Sines of the angle between two axes up to which they count as parallel, tried in sequence.
_PARALLEL = (1e-12, 1e-9, 1e-6, 1e-4)
_MEETING = 1e-12  # m: closer axes meet
_SAMPLES = 50
_NEAT = 1e-12  # rad: an angle this near to a multiple of π/2 is written as that
_DIGITS = 12  # of a length [m]


@dataclass(frozen=True, slots=True)
class DerivedTable:
    """Table, and the greatest difference of its forward kinematics from the chain's."""

    table: DhTable
    position_residual: float
    rotation_residual: float

    @property
    def residual(self) -> float:
        """The greater of the two residuals [m, rad]."""
        return max(self.position_residual, self.rotation_residual)


def derive_table(joints: tuple[ImportedJoint, ...]) -> DerivedTable | None:
    """Return the table of a chain, a row per moving joint; None if its lengths fit no table."""
    axes = _axes_at_zero(joints)
    for parallel in _PARALLEL:
        table = _table(joints, axes, parallel)
        if table is not None:
            return DerivedTable(table, *table_residual(joints, table))
    return None


def table_residual(joints: tuple[ImportedJoint, ...], table: DhTable) -> tuple[float, float]:
    """Return the greatest distance [m] and angle [rad] from the chain at random positions."""
    random = np.random.default_rng(0)
    position = rotation = 0.0
    for _ in range(_SAMPLES):
        values = random.uniform(-math.pi, math.pi, len(table.rows))
        chain, by_table = chain_pose(joints, values), dh_forward(table, values.tolist())
        position = max(position, chain.position_distance(by_table))
        rotation = max(rotation, chain.rotation_distance(by_table))
    return position, rotation


def chain_pose(joints: tuple[ImportedJoint, ...], moving: Array) -> Pose:
    """Return the tip's pose in the root link's frame [m].

    Args:
        joints: root to tip.
        moving: position of each joint that is not fixed [rad or m].
    """
    placement = np.eye(4)
    values = iter(moving.tolist())
    for joint in joints:
        placement = placement @ to_matrix(joint.origin)
        if joint.axis is not None:
            placement = placement @ _motion(joint, next(values))
    return Pose.from_matrix(placement[:3, :3], placement[:3, 3])


def _motion(joint: ImportedJoint, value: float) -> Array:
    axis = np.array(joint.axis)
    motion = np.eye(4)
    if joint.type is JointType.PRISMATIC:
        motion[:3, 3] = value * axis
        return motion
    # Rodrigues: R = I + sin(q) [a]× + (1 - cos(q)) [a]×²
    x, y, z = axis.tolist()
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    motion[:3, :3] += math.sin(value) * cross + (1.0 - math.cos(value)) * cross @ cross
    return motion


def _axes_at_zero(joints: tuple[ImportedJoint, ...]) -> list[tuple[Array, Array]]:
    # (point, direction) of each moving joint's axis in the root frame, all joints at zero.
    axes = []
    placement = np.eye(4)
    for joint in joints:
        placement = placement @ to_matrix(joint.origin)
        if joint.axis is not None:
            axes.append((placement[:3, 3].copy(), placement[:3, :3] @ np.array(joint.axis)))
    return axes


def _table(
    joints: tuple[ImportedJoint, ...], axes: list[tuple[Array, Array]], parallel: float
) -> DhTable | None:
    moving = [joint for joint in joints if joint.axis is not None]
    tip = chain_pose(joints, np.zeros(len(moving))).to_matrix()
    frame = _first_frame(*axes[0])
    base = to_placement(frame)
    rows = []
    # The last row has no axis after it; with the tool's z its values are often round.
    for joint, (point, direction) in zip(moving, [*axes[1:], _last_axis(axes, tip)], strict=True):
        theta, d, a, alpha = _row(frame, point, direction, parallel)
        theta, d, a, alpha = _neat(theta), round(d, _DIGITS), round(a, _DIGITS), _neat(alpha)
        if max(abs(d), abs(a)) > MAX_LENGTH:
            return None
        variable = Variable.D if joint.type is JointType.PRISMATIC else Variable.THETA
        rows.append(
            DhRow(joint=joint.name, theta_offset=theta, d=d, a=a, alpha=alpha, variable=variable)
        )
        frame = frame @ dh_matrix(theta, d, a, alpha)
    tool = to_placement(np.linalg.inv(frame) @ tip)
    return DhTable(convention="standard", base=base, rows=tuple(rows), tool=tool)


def _first_frame(point: Array, direction: Array) -> Array:
    # At the axis's point nearest to the root, with x turned as little as can be: the root's own
    # frame where joint 1 turns about its z.
    frame = np.eye(4)
    frame[:3, 3] = point - (point @ direction) * direction
    x = frame[:3, 0] - direction[0] * direction
    if float(np.linalg.norm(x)) < 0.5:
        x = frame[:3, 1] - direction[1] * direction
    x /= np.linalg.norm(x)
    frame[:3, :3] = np.column_stack((x, np.cross(direction, x), direction))
    return frame


def _last_axis(axes: list[tuple[Array, Array]], tip: Array) -> tuple[Array, Array]:
    point, direction = axes[-1]
    tool_point, tool_z = tip[:3, 3], tip[:3, 2]
    offset = tool_point - point
    off_axis = offset - (offset @ direction) * direction
    if float(np.linalg.norm(off_axis)) < _NEAT:
        return tool_point, tool_z if abs(float(tool_z @ direction)) > 1.0 - _NEAT else direction
    return point, direction


def _row(
    frame: Array, point: Array, direction: Array, parallel: float
) -> tuple[float, float, float, float]:
    """Return theta, d, a, alpha from a frame to the next axis; (3,) point and direction."""
    x, y, z = frame[:3, 0], frame[:3, 1], frame[:3, 2]
    offset = point - frame[:3, 3]
    normal = np.cross(z, direction)
    sine = float(np.linalg.norm(normal))
    if sine < parallel:
        # Every common normal is as short; that through the next joint's own point keeps d its.
        d = float(offset @ z)
        across = offset - d * z
        a = float(np.linalg.norm(across))
        along = across / a if a > _MEETING else x
        a = a if a > _MEETING else 0.0
    else:
        normal /= sine
        # Where the next axis comes nearest to z: offset + t·direction = d·z + a·normal.
        t = float((offset @ z) * (z @ direction) - offset @ direction) / sine**2
        d = float((offset + t * direction) @ z)
        a = float(offset @ normal)
        # Meeting axes leave the sign of x free; that nearer to the old x keeps theta small.
        flip = a < -_MEETING or (abs(a) <= _MEETING and float(normal @ x) < -_NEAT)
        along, a = (-normal, -a) if flip else (normal, a)
        a = a if abs(a) > _MEETING else 0.0
    theta = math.atan2(float(along @ y), float(along @ x))
    alpha = math.atan2(float(np.cross(z, direction) @ along), float(z @ direction))
    return theta, d, a, alpha


def _neat(value: float) -> float:
    for neat in (0.0, math.pi / 2.0, -math.pi / 2.0, math.pi, -math.pi):
        if abs(value - neat) < _NEAT:
            return neat
    return value
