"""Tool path of a jog: a straight line, an even rotation or a screw, and the bend between two.

Owns the pose as a function of the path parameter σ, one step at a time. Steps are exact where the
twist is constant, so a line is kept from its start however long it is. With base or user axes the
tool centre point goes straight while the tool rotates about fixed axes; with the tool's own axes,
which move with it, both together are a screw. A new direction is blended in: over a length of σ the
twist changes linearly from the old to the new one, which for two lines is a parabola.

σ has the unit of a second: at dσ/dt = 1 the tool has the full speeds of the caps. Base frame.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from ..pose import Array

_STILL = 1e-12


@dataclass(frozen=True, slots=True, eq=False)
class JogTwist:
    """Direction of the tool at full speed.

    Attributes:
        linear: (3,) of the tool centre point [m/s].
        angular: (3,) [rad/s].
        of_tool: True if both are along the tool's own axes, else along the base's.
    """

    linear: Array
    angular: Array
    of_tool: bool = False

    def is_like(self, other: JogTwist) -> bool:
        """Return True if another twist has the same direction and the same speeds."""
        return (
            self.of_tool == other.of_tool
            and np.array_equal(self.linear, other.linear)
            and np.array_equal(self.angular, other.angular)
        )

    def reversed(self) -> JogTwist:
        """Return the opposite direction."""
        return JogTwist(-self.linear, -self.angular, self.of_tool)

    def in_base(self, rotation: Array) -> Array:
        """Return the (6,) twist [v; ω] along the base's axes, for a (3, 3) tool rotation."""
        twist = np.empty(6)
        twist[:3] = rotation @ self.linear if self.of_tool else self.linear
        twist[3:] = rotation @ self.angular if self.of_tool else self.angular
        return twist


@dataclass(frozen=True, slots=True, eq=False)
class ToolPath:
    """Pose and the path that leads on from it; a value, so a step that is too long can be retried.

    Attributes:
        rotation: (3, 3) of the tool.
        point: (3,) of the tool centre point [m].
        target: the twist after the bend.
        before: (6,) the twist that the bend starts with; None without a bend.
        bend: length of the bend by σ.
        gone: how much of the bend lies behind, by σ.
    """

    rotation: Array
    point: Array
    target: JogTwist
    before: Array | None = None
    bend: float = 0.0
    gone: float = 0.0

    @property
    def left(self) -> float:
        """Rest of the bend by σ; infinite after it, where a step may have any length."""
        return math.inf if self.before is None else self.bend - self.gone

    def twist(self) -> Array:
        """Return the (6,) twist [v; ω] here, by σ."""
        return self._blended(0.0)

    def advanced(self, step: float) -> ToolPath:
        """Return the path at σ further on; the step is at most `left`."""
        if self.before is None:
            return self._along(step)
        # The twist is linear in σ here, so its value in the middle of the step is its mean over it.
        mean = self._blended(0.5 * step)
        rotation = turned(mean[3:] * step) @ self.rotation
        point = self.point + mean[:3] * step
        if self.left - step <= _STILL:
            return ToolPath(rotation, point, self.target)
        return replace(self, rotation=rotation, point=point, gone=self.gone + step)

    def _along(self, step: float) -> ToolPath:
        target = self.target
        if not target.angular.any():
            linear = self.rotation @ target.linear if target.of_tool else target.linear
            return ToolPath(self.rotation, self.point + step * linear, target)
        turn = turned(target.angular * step)
        if not target.of_tool:
            return ToolPath(turn @ self.rotation, self.point + step * target.linear, target)
        shift = _screw_shift(target.linear * step, target.angular * step)
        return ToolPath(self.rotation @ turn, self.point + self.rotation @ shift, target)

    def _blended(self, ahead: float) -> Array:
        target = self.target.in_base(self.rotation)
        if self.before is None:
            return target
        share = (self.gone + ahead) / self.bend
        return (1.0 - share) * self.before + share * target


def turned(vector: Array) -> Array:
    """Return the (3, 3) rotation of a (3,) rotation vector, by Rodrigues' formula."""
    x, y, z = vector.tolist()
    angle = math.sqrt(x * x + y * y + z * z)
    # The limits of sin φ/φ and (1 - cos φ)/φ²: their next terms are below 1e-12, and 0/0 is
    # avoided.
    if angle < 1e-6:
        first, second = 1.0, 0.5
    else:
        first, second = math.sin(angle) / angle, (1.0 - math.cos(angle)) / (angle * angle)
    xx, yy, zz = second * x * x, second * y * y, second * z * z
    xy, xz, yz = second * x * y, second * x * z, second * y * z
    x, y, z = first * x, first * y, first * z
    return np.array(
        (
            (1.0 - yy - zz, xy - z, xz + y),
            (xy + z, 1.0 - xx - zz, yz - x),
            (xz - y, yz + x, 1.0 - xx - yy),
        )
    )


def _screw_shift(linear: Array, angular: Array) -> Array:
    """Return how far a screw motion moves its origin, along its axes at the start.

    The left Jacobian of SO(3) times v: v + (1 - cos φ)/φ² ω × v + (φ - sin φ)/φ³ ω × (ω × v).
    """
    angle = math.sqrt(float(angular @ angular))
    # The limits of both factors: (φ - sin φ)/φ³ loses its digits to cancellation.
    if angle < 1e-4:
        first, second = 0.5, 1.0 / 6.0
    else:
        first = (1.0 - math.cos(angle)) / (angle * angle)
        second = (angle - math.sin(angle)) / (angle * angle * angle)
    once = np.cross(angular, linear)
    shift: Array = linear + first * once + second * np.cross(angular, once)
    return shift
