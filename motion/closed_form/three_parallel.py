"""Closed form of an arm with three parallel axes, 2, 3 and 4, as of Universal Robots.

Owns recognition and solution of that family: axes 2, 3 and 4 parallel and across axis 1, axis 5
across 4, axis 6 across 5 and crossing it. Turns about the parallel axes leave a point's distance
along them alone, which gives joint 1 first, from the point where axes 5 and 6 cross (Hawkins:
Analytic Inverse Kinematics for the Universal Robots, 2013). Knows no limits.

With y and z of the arm's frame, and q̂ a joint with its sign and zero offset applied,

    Rz(q₁) Ry(q̂₂ + q̂₃ + q̂₄) Rz(q̂₅) Ry(q₆) = M,    M = left · target · right.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..pose import Array
from .branch import FULL_TURN, Branch, Measures, wrapped
from .geometry import ArmGeometry, common_point, inverse, rotation_about
from .ortho_parallel import EXACT, OrthoParallelBase, ortho_parallel_base, parallel, perpendicular
from .subproblems import FREE, Matrix3, turn_into_plane, two_links, zyz_angles

_PITCHES = 24  # tried where any pitch would do but the preferred one is out of reach


@dataclass(frozen=True, slots=True, eq=False)
class ThreeParallel:
    """Six revolute joints, the second, third and fourth parallel.

    Attributes:
        base: joints 1 to 3 up to axis 4; its `beside` is that of the crossing of axes 5 and 6.
        left: (4, 4) base frame in the arm's frame.
        right: (4, 4) the hand's own frame in the tool frame, its origin where 5 and 6 cross.
        hand: length from axis 4 to that crossing in the plane of the arm [m].
        hand_angle: its angle from z towards x at zero [rad].
        sign4: 1 if joint 4 turns positively about y, else -1.
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

    def branches(self, target: Array, preferred: Sequence[float]) -> list[Branch]:
        """Find every way to reach a pose; see `ClosedForm`."""
        arm = self.base
        (a, b, c, x), (d, e, f, y), (g, h, i, z), _ = (self.left @ target @ self.right).tolist()
        kept = self._pitch(preferred) + self.tilt
        gap, shoulders = turn_into_plane(x, y, arm.beside, preferred[0])
        found = []
        for q1, s in shoulders:
            c1, s1 = math.cos(q1), math.sin(q1)
            # Axes renamed (x, y, z → -x, z, y), so that Ry Rz Ry reads as Rz Ry Rz.
            remaining = (
                (c1 * a + s1 * d, -c1 * c - s1 * f, -c1 * b - s1 * e),
                (-g, i, h),
                (s1 * a - c1 * d, c1 * f - s1 * c, c1 * e - s1 * b),
            )
            here: list[Branch] = []
            for wrist in zyz_angles(remaining, kept):
                here += self._lifted(q1, s, z, wrist, gap)
            if _stretched(remaining) and all(branch.gap > 0.0 for branch in here):
                here += self._with_another_pitch(q1, s, z, remaining, kept, gap)
            found += here
        return found

    def measures(self, position: Sequence[float]) -> Measures:
        """Measure the three distances from singularity; see `ClosedForm`."""
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
    ) -> list[Branch]:
        """Place axis 4 by joints 2 and 3, where the wrist angles leave it."""
        arm = self.base
        pitch = wrist[0] - self.tilt
        direction = self.hand_angle + pitch
        elbow_gap, elbows = two_links(
            s - self.hand * math.sin(direction) - arm.offset,
            z - self.hand * math.cos(direction),
            arm.upper_arm,
            arm.forearm,
        )
        found = []
        for lift, bend in elbows:
            q2 = lift - arm.upper_arm_angle
            q3 = bend - arm.fold
            q4 = self.sign4 * (pitch - q2 - q3)
            position = (q1, arm.sign2 * q2, arm.sign3 * q3, q4, wrist[1] - self.zero5, wrist[2])
            found.append(Branch(position, gap + elbow_gap))
        return found

    def _with_another_pitch(
        self,
        q1: float,
        s: float,
        z: float,
        remaining: Matrix3,
        kept: float,
        gap: float,
    ) -> list[Branch]:
        """Where axes 4 and 6 are parallel, any pitch gives the same rotation: find one in reach."""
        # Outwards from the preferred one: +1, -1, +2, -2, …
        for step in range(2, _PITCHES + 1):
            turn = (step // 2) * FULL_TURN / _PITCHES * (1.0 if step % 2 else -1.0)
            here: list[Branch] = []
            for wrist in zyz_angles(remaining, kept + turn):
                here += self._lifted(q1, s, z, wrist, gap)
            if any(branch.gap <= 0.0 for branch in here):
                return here
        return []


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


def _stretched(rotation: Matrix3) -> bool:
    return math.hypot(rotation[0][2], rotation[1][2]) < FREE
