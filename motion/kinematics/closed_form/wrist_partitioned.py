"""Closed form of an arm whose last three axes meet in one point, and of an arm on a linear axis.

Owns recognition and solution of the first family: axes 2 and 3 parallel and across axis 1, with any
offsets; axis 4 across axis 3, 5 across 4 and 6 across 5. By Pieper's argument (1968) the wrist
centre, where the last three axes meet, depends on joints 1 to 3 only and the remaining rotation on
joints 4 to 6 only; lengths and angles as of Brandstötter, Angerer and Hofbaur (2014). With y and z
of the arm's frame, and q̂ a joint with its sign and zero offset applied,

    Rz(q₁) Ry(q̂₂ + q̂₃) Rz(q̂₄) Ry(q̂₅) Rz(q₆) = M,    M = left · target · right.

Owns also the seventh joint in front of an arm of any family: its position is a free choice, so it
gets the preferred value and the arm is solved for the rest. Knows no limits.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...pose import Array
from .geometry import (
    EXACT,
    ArmGeometry,
    Branches,
    ClosedForm,
    Measures,
    OrthoParallelBase,
    Position,
    common_point,
    inverse,
    ortho_parallel_base,
    perpendicular,
    rotation_about,
    turn_into_plane,
    two_links,
    wrapped,
    zyz_angles,
)


@dataclass(frozen=True, slots=True, eq=False)
class LinearAxis:
    """Prismatic joint, then an arm with a closed form.

    Attributes:
        arm: the arm, in the base frame, the linear axis at zero.
        direction: (3,) unit direction of the linear axis in the base frame.
        free_joint: the linear axis.
    """

    arm: ClosedForm
    direction: Array
    free_joint: int | None = 0

    def branches(self, target: Array, preferred: Sequence[float]) -> Branches:
        """Return all answers for a pose with the linear axis as preferred; see `ClosedForm`."""
        slide = preferred[0]
        moved = target.copy()
        moved[:3, 3] -= slide * self.direction
        positions, gaps = self.arm.branches(moved, preferred[1:])
        return Branches([(slide, *position) for position in positions], gaps)

    def measures(self, position: Sequence[float]) -> Measures:
        """Return the arm's distances from singularity; see `ClosedForm`."""
        return self.arm.measures(position[1:])


@dataclass(frozen=True, slots=True, eq=False)
class WristPartitioned:
    """Six revolute joints with a spherical wrist.

    Attributes:
        base: joints 1 to 3 up to the wrist centre.
        left: (4, 4) base frame in the arm's frame.
        right: (4, 4) the wrist's own frame in the tool frame, its origin the wrist centre.
        tilt: angle of axis 4 from z about y at zero [rad].
        zero4: angle of axis 5 from y about axis 4 at zero [rad].
        zero5: angle of axis 6 from axis 4 about axis 5 at zero [rad].
        free_joint: none.
    """

    base: OrthoParallelBase
    left: Array
    right: Array
    tilt: float
    zero4: float
    zero5: float
    free_joint: int | None = None

    def branches(self, target: Array, preferred: Sequence[float]) -> Branches:
        """Return all joint positions that reach a pose; see `ClosedForm`."""
        arm = self.base
        # One product gives the rotation M and, in its last column, the wrist centre.
        product = self.left.dot(target).dot(self.right)
        (a, b, c, x), (d, e, f, y), (g, h, i, z), _ = product.tolist()
        kept, zero4, zero5 = preferred[3] + self.zero4, self.zero4, self.zero5
        positions: list[Position] = []
        gaps: list[float] = []
        shoulder_gap, shoulders = turn_into_plane(x, y, arm.beside, preferred[0])
        for q1, s in shoulders:
            c1, s1 = math.cos(q1), math.sin(q1)
            ra, rb, rc = c1 * a + s1 * d, c1 * b + s1 * e, c1 * c + s1 * f
            rd, re, rf = c1 * d - s1 * a, c1 * e - s1 * b, c1 * f - s1 * c
            elbow_gap, elbows = two_links(s - arm.offset, z, arm.upper_arm, arm.forearm)
            gap = shoulder_gap + elbow_gap
            for lift, bend in elbows:
                q2 = lift - arm.upper_arm_angle
                q3 = bend - arm.fold
                pitch = q2 + q3 + self.tilt
                cp, sp = math.cos(pitch), math.sin(pitch)
                pa, pb, pc = cp * ra - sp * g, cp * rb - sp * h, cp * rc - sp * i
                pg, ph, pi = sp * ra + cp * g, sp * rb + cp * h, sp * rc + cp * i
                q4, q5, q6 = zyz_angles(pa, pb, pc, rd, re, rf, pg, ph, pi, kept)
                q2 *= arm.sign2
                q3 *= arm.sign3
                positions += (
                    (q1, q2, q3, q4 - zero4, q5 - zero5, q6),
                    (q1, q2, q3, q4 + math.pi - zero4, -q5 - zero5, q6 + math.pi),
                )
                gaps += (gap, gap)
        return Branches(positions, gaps)

    def measures(self, position: Sequence[float]) -> Measures:
        """Return the three distances from singularity; see `ClosedForm`."""
        arm = self.base
        lift = arm.upper_arm_angle + arm.sign2 * position[1]
        bend = arm.fold + arm.sign3 * position[2]
        shoulder = arm.offset + arm.upper_arm * math.sin(lift) + arm.forearm * math.sin(lift + bend)
        wrist = wrapped(position[4] + self.zero5)
        if math.cos(self.zero5) < 0.0:
            # The axes 4 and 6 point opposite ways at zero; the joint's own sign is kept.
            wrist = wrapped(position[4] + self.zero5 - math.pi)
        return Measures(shoulder, math.copysign(1.0, shoulder) * wrapped(bend), wrist)


def recognise(geometry: ArmGeometry) -> WristPartitioned | None:
    """Return the closed form if the arm is of this family."""
    if geometry.prismatic != (False,) * 6:
        return None
    centre, miss = common_point(geometry.axes[3:], geometry.points[3:])
    base = ortho_parallel_base(geometry, centre, centre) if miss <= EXACT else None
    if base is None:
        return None
    axis4, axis5, axis6 = geometry.axes[3:] @ base.frame[:3, :3]
    y = np.array([0.0, 1.0, 0.0])
    pairs = ((axis4, y), (axis5, axis4), (axis6, axis5))
    if not all(perpendicular(one, other) for one, other in pairs):
        return None
    tilt = math.atan2(axis4[0], axis4[2])
    zero4 = math.atan2(float(np.cross(y, axis5) @ axis4), float(y @ axis5))
    zero5 = math.atan2(float(np.cross(axis4, axis6) @ axis5), float(axis4 @ axis6))
    left = inverse(base.frame)
    wrist = np.eye(4)
    wrist[:3, :3] = (
        base.frame[:3, :3]
        @ rotation_about(y, tilt)
        @ rotation_about(np.array([0.0, 0.0, 1.0]), zero4)
        @ rotation_about(y, zero5)
    )
    wrist[:3, 3] = centre
    return WristPartitioned(base, left, inverse(geometry.tool) @ wrist, tilt, zero4, zero5)
