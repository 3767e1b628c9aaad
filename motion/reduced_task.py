"""What an arm of fewer than six axes can do: the direction that its tool always keeps.

Owns the test whether a robot holds one direction of its tool along one direction of its base, as
a SCARA and a palletiser do, and how far a pose tilts out of that. Such an arm reaches x, y, z and
yaw only. Knows no search.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from .closed_form import arm_geometry
from .closed_form.geometry import rotation_about
from .kinematics import Array, Kinematics

_SAMPLES = 6
_KEPT = 1e-9  # rad


@dataclass(frozen=True, slots=True, eq=False)
class KeptDirection:
    """A direction that stays the same in the tool and in the base.

    Attributes:
        in_base: (3,) unit vector.
        in_tool: (3,) unit vector, the same direction.
    """

    in_base: Array
    in_tool: Array

    def tilt(self, rotation: Array) -> float:
        """Return how far a (3, 3) tool rotation turns the direction away [rad]."""
        x, y, z = rotation.dot(self.in_tool).tolist()
        u, v, w = self.in_base.tolist()
        across = math.hypot(y * w - z * v, z * u - x * w, x * v - y * u)
        return math.atan2(across, x * u + y * v + z * w)

    def levelled(self, rotation: Array) -> Array:
        """Return the (3, 3) rotation nearest to one that keeps the direction."""
        wanted = rotation @ self.in_tool
        axis = np.cross(wanted, self.in_base)
        length = float(np.linalg.norm(axis))
        if length < _KEPT:
            # Upright already, or upside down, where any axis across will do.
            axis = np.cross(wanted, np.eye(3)[int(np.argmin(np.abs(wanted)))])
            length = float(np.linalg.norm(axis))
        level: Array = rotation_about(axis / length, self.tilt(rotation)) @ rotation
        return level


def kept_direction(kinematics: Kinematics) -> KeptDirection | None:
    """Return the direction of its first revolute axis if an arm's tool keeps it, else None.

    Whatever keeps it, parallel axes or levelling rods, a handful of joint positions shows it.
    """
    if kinematics.dof >= 6:
        return None
    geometry = arm_geometry(kinematics.robot)
    turning = [index for index, slides in enumerate(geometry.prismatic) if not slides]
    if not turning:
        return None
    in_base = geometry.axes[turning[0]]
    random = np.random.default_rng(0)
    samples = random.uniform(kinematics.lower, kinematics.upper, (_SAMPLES, kinematics.dof))
    seen = [kinematics.place(sample)[0].T @ in_base for sample in samples]
    if max(float(np.linalg.norm(direction - seen[0])) for direction in seen) > _KEPT:
        return None
    return KeptDirection(in_base, seen[0])
