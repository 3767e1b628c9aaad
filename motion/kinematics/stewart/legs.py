"""Legs of a Stewart platform between their anchors: lengths, rates and accelerations.

Owns the geometry in one direction, from the platform's placement to its legs, which needs no
search. Formulas: Merlet, Parallel Robots, chapters 3 and 5; with a_i an anchor in the platform, b_i
in the base, R, p the platform's placement and u_i the direction of leg i from the base:

    l_i = |p + R a_i - b_i|                    u_i = (p + R a_i - b_i) / l_i
    dl_i/dt = u_i · v + (R a_i × u_i) · ω      a row [u_i, R a_i × u_i] of the leg Jacobian

Base frame throughout [m, rad, s]; rotations are (3, 3), positions (3,), twists (6,) [v; ω] with v
of the platform's origin, accelerations (6,) [v̇; ω̇]. Knows no limits.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ...description.robot import ParallelRobot
from ...orientation import angular_velocity_of_rpy_rates, roll_pitch_yaw
from ...pose import Array, Pose


class LegMotion(NamedTuple):
    """Motion of the legs; each array is (6,)."""

    length: Array
    rate: Array
    acceleration: Array


@dataclass(frozen=True, slots=True, eq=False)
class Legs:
    """Anchors of six legs.

    Attributes:
        base: (6, 3) anchors on the base, in the base frame [m].
        platform: (6, 3) anchors on the platform, in the platform frame [m].
        home: the platform's placement at home.
    """

    base: Array
    platform: Array
    home: Pose

    @classmethod
    def of_robot(cls, robot: ParallelRobot) -> Legs:
        """Return the legs of a robot file."""
        base = np.array([anchor.xyz for anchor in robot.base_anchors])
        platform = np.array([anchor.xyz for anchor in robot.platform_anchors])
        for array in (base, platform):
            array.flags.writeable = False
        home = Pose.from_values((0.0, 0.0, robot.home_height), (0.0, 0.0, 0.0, 1.0))
        return cls(base, platform, home)

    def vectors(self, rotation: Array, position: Array) -> Array:
        """Return the (6, 3) vectors from base anchor to platform anchor."""
        legs: Array = position + self.platform @ rotation.T - self.base
        return legs

    def lengths(self, pose: Pose) -> Array:
        """Return the (6,) leg lengths that hold the platform at a pose: the inverse kinematics."""
        lengths: Array = np.linalg.norm(self.vectors(pose.rotation, pose.position), axis=1)
        return lengths

    def linearise(self, rotation: Array, position: Array) -> tuple[Array, Array]:
        """Return the (6,) lengths and the (6, 6) leg Jacobian, twist to leg rates."""
        arms = self.platform @ rotation.T
        legs = position + arms - self.base
        lengths = np.sqrt(np.einsum("ij,ij->i", legs, legs))
        directions = legs / lengths[:, np.newaxis]
        jacobian = np.empty((len(legs), 6))
        jacobian[:, :3] = directions
        # The rows of arms × directions, written out: np.cross takes three times as long.
        (ax, ay, az), (ux, uy, uz) = arms.T, directions.T
        jacobian[:, 3] = ay * uz - az * uy
        jacobian[:, 4] = az * ux - ax * uz
        jacobian[:, 5] = ax * uy - ay * ux
        return lengths, jacobian

    def jacobian(self, pose: Pose) -> Array:
        """Return the (6, 6) leg Jacobian at a pose: leg rates = J [v; ω]."""
        return self.linearise(pose.rotation, pose.position)[1]

    def rpy_jacobian(self, pose: Pose) -> Array:
        """Return the (6, 6) Jacobian by the rates of x, y, z, roll, pitch and yaw.

        It differs from `jacobian`: of the rates of roll, pitch and yaw only that of yaw is a
        component of ω.
        """
        jacobian = self.jacobian(pose)
        jacobian[:, 3:] = jacobian[:, 3:] @ angular_velocity_of_rpy_rates(
            roll_pitch_yaw(pose.rotation)
        )
        return jacobian

    def motion(self, pose: Pose, twist: Array, acceleration: Array) -> LegMotion:
        """Return lengths, rates and accelerations of the legs while the platform moves.

        With c = p + R a - b and d a dot for the time derivative, l l' = c · c' gives
        l'' = (c' · c' + c · c'' - l'²) / l.
        """
        rotation = pose.rotation
        arms = self.platform @ rotation.T
        legs = self.vectors(rotation, pose.position)
        spin = np.cross(twist[3:], arms)
        velocity = twist[:3] + spin
        gain = acceleration[:3] + np.cross(acceleration[3:], arms) + np.cross(twist[3:], spin)
        return leg_motion(legs, velocity, gain)


def leg_motion(legs: Array, first: Array, second: Array) -> LegMotion:
    """Return lengths and their derivatives of vectors (..., 3) with the first two derivatives."""
    length = np.linalg.norm(legs, axis=-1)
    rate = np.einsum("...k,...k->...", legs, first) / length
    square = np.einsum("...k,...k->...", first, first)
    bend = np.einsum("...k,...k->...", legs, second)
    return LegMotion(length, rate, (square + bend - rate * rate) / length)
