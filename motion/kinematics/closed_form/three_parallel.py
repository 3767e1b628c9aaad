"""Closed form of an arm with three parallel axes, 2, 3 and 4, as of Universal Robots.

Owns recognition and solution of that family: axes 2, 3 and 4 parallel and across axis 1, axis 5
across 4, axis 6 across 5 and crossing it. Rotations about the parallel axes do not change a point's
coordinate along them, which gives joint 1 first, from the point where axes 5 and 6 cross (Hawkins:
Analytic Inverse Kinematics for the Universal Robots, 2013). Knows no limits.

With y and z of the arm's frame, and q̂ a joint with its sign and zero offset applied,

    Rz(q₁) Ry(q̂₂ + q̂₃ + q̂₄) Rz(q̂₅) Ry(q₆) = M,    M = left · target · right.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from ...pose import Array
from .geometry import (
    EXACT,
    FREE,
    FULL_TURN,
    ArmGeometry,
    Branches,
    Measures,
    OrthoParallelBase,
    Position,
    common_point,
    inverse,
    ortho_parallel_base,
    parallel,
    perpendicular,
    rotation_about,
    turn_into_plane,
    two_links,
    wrapped,
    zyz_angles,
)

_PITCHES = 24  # tried where every pitch is possible but the preferred one is out of reach


_Rotation: TypeAlias = tuple[float, float, float, float, float, float, float, float, float]
_Lifted: TypeAlias = tuple[list[Position], list[float]]
"""Positions and gaps, as of `Branches`."""


@dataclass(frozen=True, slots=True, eq=False)
class ThreeParallel:
    """Six revolute joints, the second, third and fourth parallel.

    Attributes:
        base: joints 1 to 3 up to axis 4; its `beside` is that of the crossing of axes 5 and 6.
        left: (4, 4) base frame in the arm's frame.
        right: (4, 4) the hand's own frame in the tool frame, its origin where 5 and 6 cross.
        hand: length from axis 4 to that crossing in the plane of the arm [m].
        hand_angle: its angle from z towards x at zero [rad].
        sign4: 1 if joint 4 rotates positively about y, else -1.
        tilt: angle of axis 5 from z about y at zero [rad].
        zero5: angle of axis 6 from y about axis 5 at zero [rad].
        free_joint: none.
    """

    base: OrthoParallelBase
    left: Array
    right: Array
    hand: float
    hand_angle: float
    sign4: float
    tilt: float
    zero5: float
    free_joint: int | None = None

    def branches(self, target: Array, preferred: Sequence[float]) -> Branches:
        """Return all joint positions that reach a pose; see `ClosedForm`."""
        product = self.left.dot(target).dot(self.right)
        (a, b, c, x), (d, e, f, y), (g, h, i, z), _ = product.tolist()
        kept = self._pitch(preferred) + self.tilt
        positions: list[Position] = []
        gaps: list[float] = []
        gap, shoulders = turn_into_plane(x, y, self.base.beside, preferred[0])
        for q1, s in shoulders:
            c1, s1 = math.cos(q1), math.sin(q1)
            # Axes renamed (x, y, z → -x, z, y), so that Ry Rz Ry reads as Rz Ry Rz.
            ra, rb, rc = c1 * a + s1 * d, -c1 * c - s1 * f, -c1 * b - s1 * e
            rg, rh, ri = s1 * a - c1 * d, c1 * f - s1 * c, c1 * e - s1 * b
            remaining = (ra, rb, rc, -g, i, h, rg, rh, ri)
            here, misses = self._lifted(q1, s, z, zyz_angles(*remaining, kept), gap)
            if math.hypot(rc, h) < FREE and min(misses) > 0.0:
                # Axes 4 and 6 are parallel, so any pitch gives the same rotation.
                more, more_misses = self._with_another_pitch(q1, s, z, remaining, kept, gap)
                here += more
                misses += more_misses
            positions += here
            gaps += misses
        return Branches(positions, gaps)

    def measures(self, position: Sequence[float]) -> Measures:
        """Return the three distances from singularity; see `ClosedForm`."""
        arm = self.base
        lift = arm.upper_arm_angle + arm.sign2 * position[1]
        bend = arm.fold + arm.sign3 * position[2]
        shoulder = (
            arm.offset
            + arm.upper_arm * math.sin(lift)
            + arm.forearm * math.sin(lift + bend)
            + self.hand * math.sin(self.hand_angle + self._pitch(position))
        )
        wrist = wrapped(position[4] + self.zero5)
        if math.cos(self.zero5) < 0.0:
            wrist = wrapped(position[4] + self.zero5 - math.pi)
        return Measures(shoulder, math.copysign(1.0, shoulder) * wrapped(bend), wrist)

    def _pitch(self, position: Sequence[float]) -> float:
        arm = self.base
        return arm.sign2 * position[1] + arm.sign3 * position[2] + self.sign4 * position[3]

    def _lifted(
        self, q1: float, s: float, z: float, wrist: tuple[float, float, float], gap: float
    ) -> _Lifted:
        """Place axis 4 by joints 2 and 3, where either answer for the wrist angles puts it."""
        arm = self.base
        alpha, beta, gamma = wrist
        upper_arm, forearm = arm.upper_arm, arm.forearm
        upper_arm_angle, fold, sign2, sign3 = arm.upper_arm_angle, arm.fold, arm.sign2, arm.sign3
        positions: list[Position] = []
        gaps: list[float] = []
        for pitch, q5, q6 in (
            (alpha - self.tilt, beta - self.zero5, gamma),
            (alpha - self.tilt + math.pi, -beta - self.zero5, gamma + math.pi),
        ):
            direction = self.hand_angle + pitch
            along = s - self.hand * math.sin(direction) - arm.offset
            up = z - self.hand * math.cos(direction)
            elbow_gap, elbows = two_links(along, up, upper_arm, forearm)
            for lift, bend in elbows:
                q2 = lift - upper_arm_angle
                q3 = bend - fold
                q4 = self.sign4 * (pitch - q2 - q3)
                positions.append((q1, sign2 * q2, sign3 * q3, q4, q5, q6))
                gaps.append(gap + elbow_gap)
        return positions, gaps

    def _with_another_pitch(
        self, q1: float, s: float, z: float, remaining: _Rotation, kept: float, gap: float
    ) -> _Lifted:
        """Return a pitch in reach, where every pitch gives the same rotation; none if none is."""
        # Outwards from the preferred one: +1, -1, +2, -2, …
        for step in range(2, _PITCHES + 1):
            turn = (step // 2) * FULL_TURN / _PITCHES * (1.0 if step % 2 else -1.0)
            here = self._lifted(q1, s, z, zyz_angles(*remaining, kept + turn), gap)
            if min(here[1]) <= 0.0:
                return here
        return [], []


def recognise(geometry: ArmGeometry) -> ThreeParallel | None:
    """Return the closed form if the arm is of this family."""
    if geometry.prismatic != (False,) * 6 or not parallel(geometry.axes[2], geometry.axes[3]):
        return None
    crossing, miss = common_point(geometry.axes[4:], geometry.points[4:])
    if miss > EXACT or not perpendicular(geometry.axes[4], geometry.axes[5]):
        return None
    # Joints 2 to 4 do not change where along y a point is, so axis 4 is met beside the crossing.
    axis4 = geometry.axes[3]
    wrist = geometry.points[3] + axis4 * float((crossing - geometry.points[3]) @ axis4)
    base = ortho_parallel_base(geometry, wrist, crossing)
    if base is None:
        return None
    to_arm = base.frame[:3, :3].T
    axis4, axis5, axis6 = geometry.axes[3:] @ base.frame[:3, :3]
    y, z = np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0])
    if not perpendicular(axis5, y):
        return None
    tilt = math.atan2(axis5[0], axis5[2])
    zero5 = math.atan2(float(np.cross(y, axis6) @ axis5), float(y @ axis6))
    along, _, up = to_arm @ (crossing - wrist)
    hand_frame = np.eye(4)
    hand_frame[:3, :3] = base.frame[:3, :3] @ rotation_about(y, tilt) @ rotation_about(z, zero5)
    hand_frame[:3, 3] = crossing
    return ThreeParallel(
        base,
        inverse(base.frame),
        inverse(geometry.tool) @ hand_frame,
        hand=math.hypot(along, up),
        hand_angle=math.atan2(along, up),
        sign4=math.copysign(1.0, float(axis4 @ y)),
        tilt=tilt,
        zero5=zero5,
    )
