"""What a jog needs of a robot, serial or parallel, as a protocol.

Owns the words between the mathematics of motion and the mechanisms, and the choice of who fulfils
them. Positions are (n,) controller-side [rad or m] as lists; poses are of the tool centre point in
the base frame; a rate is a derivative by the path parameter σ, which has the unit of a second.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple, Protocol

from ..limits import JointLimits
from ..pose import Array
from .reasons import JogCause, Retreat


class Posture(NamedTuple):
    """How far a limit that belongs to no single joint is used.

    Attributes:
        use: 0 to 1; more is beyond.
        cause: which limit, with its numbers.
    """

    use: float
    cause: JogCause


class Footing(NamedTuple):
    """A joint position that puts the tool at a pose, and how it goes on from there.

    Attributes:
        position: (n,) [rad or m].
        rate: (n,) by the path parameter [rad/s or m/s].
        condition: condition number of the Jacobian with lengths in `JogArm.length`.
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
        """The length that makes the Jacobian free of units [m]."""

    @property
    def rigid(self) -> bool:
        """Whether one joint by itself moves all beyond it as one body, about one axis."""

    def place(self, position: Sequence[float]) -> tuple[Array, Array]:
        """Return the (3, 3) rotation and (3,) position [m] of the tool centre point."""

    def follow(
        self, seed: Sequence[float], rotation: Array, point: Array, twist: Array
    ) -> Footing | None:
        """Return the joint position near a seed that puts the tool at a pose; None without one.

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
            position: (n,) where it is.
            velocity: (n,) of it.
            enough: a speed that is slow [m/s]. Where the elbow surely has no more, what it is at
                most may be returned instead of its speed.
        """

    def posture(self, position: Sequence[float]) -> Posture | None:
        """Return the limit beside those of the joints that is used most; None if there is none."""

    def gains(self, position: Sequence[float]) -> list[float]:
        """Return the singular values of the Jacobian at a joint position, the greatest first."""

    def condition(self, position: Sequence[float]) -> float:
        """Return the condition number at a joint position."""

    def way_out(self, position: Sequence[float]) -> Retreat:
        """Return which joint direction leads away from singularity and border."""
