"""Jog protocol of a robot, serial or parallel: what the jog mathematics asks of a mechanism.

Positions are (n,) controller-side [rad or m] as lists; poses are of the tool centre point in the
base frame; a rate is a derivative by the path parameter σ, which has the unit of a second.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple, Protocol

from ..description.limits import JointLimits
from ..pose import Array
from .jog_commands import JogCause, JogEscape


class Posture(NamedTuple):
    """Use of a limit that belongs to no single joint.

    Attributes:
        use: 0 to 1; more is beyond the limit.
        cause: the limit, with its numbers.
    """

    use: float
    cause: JogCause


class Footing(NamedTuple):
    """A joint position that puts the tool at a pose, with the rates that lead on from there.

    Attributes:
        position: (n,) [rad or m].
        rate: (n,) by the path parameter [rad/s or m/s].
        condition: condition number of the Jacobian with lengths in units of `JogArm.length`.
    """

    position: list[float]
    rate: list[float]
    condition: float


class JogArm(Protocol):
    """The mechanism of one robot with one tool, for one thread."""

    @property
    def limits(self) -> JointLimits:
        """Limits of the joint vector."""

    @property
    def length(self) -> float:
        """Length that makes the Jacobian free of units [m]."""

    @property
    def rigid(self) -> bool:
        """True if each joint alone moves everything beyond it as one body, about one axis."""

    def place(self, position: Sequence[float]) -> tuple[Array, Array]:
        """Return the (3, 3) rotation and (3,) position [m] of the tool centre point."""

    def follow(
        self, seed: Sequence[float], rotation: Array, point: Array, twist: Array
    ) -> Footing | None:
        """Return the joint position near a seed that puts the tool at a pose, or None.

        Args:
            seed: (n,) within a few hundredths of a radian.
            rotation: (3, 3) of the tool.
            point: (3,) of the tool centre point [m].
            twist: (6,) [v; ω] of the tool by the path parameter.
        """

    def forbids(self, position: Sequence[float], twist: Array) -> JogCause | None:
        """Return why the arm has too few axes to move its tool along a twist; None if it can.

        Args:
            position: (n,) where it stands.
            twist: (6,) [v; ω] of the tool.
        """

    def point_speeds(
        self, position: Sequence[float], velocity: Sequence[float] | Array
    ) -> tuple[float, float]:
        """Return the speeds of tool centre point and elbow [m/s] at joint position and velocity.

        An arm without an elbow has it at rest.
        """

    def elbow_speed(
        self, position: Sequence[float], velocity: Sequence[float], enough: float = 0.0
    ) -> float:
        """Return the speed of the elbow alone [m/s]; its limit is the tool's.

        Args:
            position: (n,) [rad or m].
            velocity: (n,) [rad/s or m/s].
            enough: a speed that counts as slow [m/s]. If the elbow is proven not to exceed it, the
                bound may be returned instead of the speed.
        """

    def posture(self, position: Sequence[float]) -> Posture | None:
        """Return the most used of the limits besides those of the joints; None if there is none."""

    def gains(self, position: Sequence[float]) -> list[float]:
        """Return the singular values of the Jacobian at a joint position, the greatest first."""

    def condition(self, position: Sequence[float]) -> float:
        """Return the condition number at a joint position."""

    def way_out(self, position: Sequence[float]) -> JogEscape:
        """Return the joint direction that leads away from singularity and workspace border."""
