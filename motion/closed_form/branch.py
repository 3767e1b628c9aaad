"""What a closed form answers with, and what every closed form can be asked.

Owns the words shared by the families: branches, and the three measures whose signs are an arm's
configuration and whose zeros are its singularities.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple, Protocol, TypeAlias

from ..pose import Array

FULL_TURN = 2.0 * math.pi

Position: TypeAlias = tuple[float, ...]
"""Chain-side joint position [rad or m], each angle in any turn."""


class Branches(NamedTuple):
    """The ways to reach a pose, or to come nearest to it; two lists of the same length.

    Attributes:
        positions: the joint position of each branch.
        gaps: how far the wrist of each stays from where the pose needs it [m]; 0 if it gets there.
    """

    positions: list[Position]
    gaps: list[float]

    def within(self, gap: float) -> list[Position]:
        """Return the positions of the branches that miss the pose by a gap [m] at most."""
        if max(self.gaps, default=0.0) <= gap:
            return self.positions
        return [self.positions[index] for index, miss in enumerate(self.gaps) if miss <= gap]


class Measures(NamedTuple):
    """Three lengths and angles whose product is the Jacobian's determinant, up to a factor.

    Attributes:
        shoulder: how far the wrist stands in front of axis 1 [m]; behind it, negative.
        elbow: the bend from upper arm to forearm [rad], 0 if straight, ±π if folded; positive
            where the elbow is above the line from shoulder to wrist in the frame of axis 1.
        wrist: angle of the wrist's middle joint from where its outer axes are parallel [rad].
    """

    shoulder: float
    elbow: float
    wrist: float


class ClosedForm(Protocol):
    """Inverse kinematics by formulas, without limits; all values chain-side.

    Attributes:
        free_joint: index of the joint whose position is a free choice in any pose; None without
            a spare joint.
    """

    @property
    def free_joint(self) -> int | None:
        """Index of the joint whose position is a free choice; None without a spare joint."""
        ...

    def branches(self, target: Array, preferred: Sequence[float]) -> Branches:
        """Find every way to reach a pose, at most eight.

        Args:
            target: (4, 4) wanted tool placement in the base frame.
            preferred: values that the free joint, and undetermined joints, keep [rad or m].

        Returns:
            The branches; where the pose is out of reach, nearest misses with their gaps.
        """
        ...

    def measures(self, position: Sequence[float]) -> Measures:
        """Measure how far a joint position is from each singularity, and on which side."""
        ...


def wrapped(angle: float) -> float:
    """Return the same direction as an angle from -π to π [rad]."""
    return math.remainder(angle, FULL_TURN)
