"""Workspace of a Stewart platform: strokes, anchor cones, workspace sum, singularity.

Owns the limits that belong to a pose, each with its number:

- stroke: every leg between its least and greatest length;
- base cone, platform cone: the joint at either end of a leg lets it swing away from its direction
  at home by at most `anchor_cone_rad`, seen from the base at the lower and from the platform at the
  upper anchor;
- workspace: the sum of |coordinate| / bound over x, y, z about home, roll, pitch and yaw is at most
  1. Inside it the legs have one answer only, see `platform`.

Knows the leg geometry, and no path.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from ...description.limits import JointLimits
from ...description.robot import ParallelRobot
from ...errors import PlatformLimit
from ...orientation import roll_pitch_yaw
from ...pose import Array, Pose
from .legs import Legs

ROUNDING = 1e-9
"""Greatest excess over a limit that counts as rounding [1, m or rad]."""


class PlatformRule(StrEnum):
    """Limit that a pose can break."""

    STROKE = "stroke"
    BASE_CONE = "base cone"
    PLATFORM_CONE = "platform cone"
    WORKSPACE = "workspace sum"


@dataclass(frozen=True, slots=True, eq=False)
class Holding:
    """Stiffness of the legs' hold on the platform, as its distance from singularity.

    The leg Jacobian is taken with rotations measured at the platform's anchor circle, so that all
    its numbers are ratios of lengths. At a singularity `least` is 0: the legs, though locked, let
    the platform move along `loosest`.

    Attributes:
        least: least singular value: least speed of the legs per unit of platform motion.
        condition: greatest singular value over least, 1 or more.
        loosest: (6,) unit twist [v; ω times platform radius] that the legs hold least.
    """

    least: float
    condition: float
    loosest: Array


class PlatformWorkspace:
    """Limits of one platform.

    Attributes:
        bounds: (6,) of x, y, z [m] and roll, pitch, yaw [rad] about home, each alone.
        cone: greatest swing of a leg at an anchor [rad].

    Poses are of the platform in the base; `fraction` is the place on a path, 0 to 1, for refusals.
    """

    def __init__(self, robot: ParallelRobot, legs: Legs, limits: JointLimits) -> None:
        self.legs, self.limits = legs, limits
        workspace = robot.workspace
        self.bounds: Array = np.array(
            [workspace.x, workspace.y, workspace.z, workspace.roll, workspace.pitch, workspace.yaw]
        )
        self.bounds.flags.writeable = False
        self.cone = robot.leg.anchor_cone_rad
        self._radius = robot.platform_radius
        self._home_directions = self._directions(legs.home)

    def coordinates(self, pose: Pose) -> Array:
        """Return x, y, z about home [m] and roll, pitch, yaw [rad] of a pose in the base, (6,)."""
        shift = pose.position - self.legs.home.position
        return np.concatenate((shift, roll_pitch_yaw(pose.rotation)))

    def pose(self, coordinates: Array) -> Pose:
        """Return the pose in the base of (6,) coordinates about home."""
        return Pose.from_rpy(self.legs.home.position + coordinates[:3], coordinates[3:])

    def usage(self, pose: Pose) -> float:
        """Return the sum of |coordinate| / bound: 0 at home, 1 on the border."""
        return float((np.abs(self.coordinates(pose)) / self.bounds).sum())

    def swings(self, pose: Pose) -> tuple[Array, Array]:
        """Return each leg's angle from its direction at home [rad], at base and platform: (6,)."""
        directions = self._directions(pose)
        return (
            _angles(directions, self._home_directions),
            _angles(directions @ pose.rotation, self._home_directions),
        )

    def check(self, pose: Pose, fraction: float | None = None) -> Array:
        """Return the (6,) leg lengths of a pose that breaks no limit, or raise `PlatformLimit`."""
        limits = self.limits
        lengths = self.legs.lengths(pose)
        inside: Array = np.clip(lengths, limits.lower, limits.upper)
        excess = np.abs(lengths - inside)
        worst = int(np.argmax(excess))
        if excess[worst] > ROUNDING:
            length, limit = float(lengths[worst]), float(inside[worst])
            name = limits.names[worst]
            raise PlatformLimit(PlatformRule.STROKE, name, length, limit, "m", worst, fraction)
        self.check_posture(pose, fraction)
        return inside

    def check_posture(self, pose: Pose, fraction: float | None = None) -> None:
        """Check cones and workspace, which no leg's length shows, or raise `PlatformLimit`."""
        rules = (PlatformRule.BASE_CONE, PlatformRule.PLATFORM_CONE)
        for rule, swings in zip(rules, self.swings(pose), strict=True):
            worst = int(np.argmax(swings))
            if swings[worst] > self.cone + ROUNDING:
                swing, name = float(swings[worst]), self.limits.names[worst]
                raise PlatformLimit(rule, name, swing, self.cone, "rad", worst, fraction)
        self.check_usage(pose, ROUNDING, fraction)

    def check_usage(self, pose: Pose, slack: float, fraction: float | None = None) -> None:
        """Check the workspace rule alone, with some slack.

        Args:
            slack: greatest excess of the sum of |coordinate| / bound over 1.

        Raises:
            PlatformLimit: the sum is greater than 1 and the slack.
        """
        usage = self.usage(pose)
        if not usage <= 1.0 + slack:
            raise PlatformLimit(PlatformRule.WORKSPACE, "", usage, 1.0, "", -1, fraction)

    def holding(self, pose: Pose) -> Holding:
        """Return the distance of a pose from singularity."""
        jacobian = self.legs.jacobian(pose)
        jacobian[:, 3:] /= self._radius
        _, singular, right = np.linalg.svd(jacobian)
        least = float(singular[-1])
        condition = float(singular[0]) / least if least > 0.0 else math.inf
        return Holding(least, condition, right[-1])

    def _directions(self, pose: Pose) -> Array:
        vectors = self.legs.vectors(pose.rotation, pose.position)
        directions: Array = vectors / np.linalg.norm(vectors, axis=1)[:, np.newaxis]
        return directions


def _angles(first: Array, second: Array) -> Array:
    """Return the (m,) angles [rad] between rows (m, 3) of unit length; exact for small ones too."""
    apart = np.linalg.norm(first - second, axis=1)
    angles: Array = 2.0 * np.arctan2(apart, np.linalg.norm(first + second, axis=1))
    return angles
