"""Closed form of an arm carried by a linear axis.

Owns the seventh joint in front of an arm of another family: its position is a free choice, so it
is taken as preferred and the arm solved for what remains. Knows no limits.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ..pose import Array
from .branch import Branches, ClosedForm, Measures


@dataclass(frozen=True, slots=True, eq=False)
class LinearAxis:
    """A prismatic joint, then an arm with a closed form.

    Attributes:
        arm: the arm, in the base frame, the linear axis at zero.
        direction: (3,) unit direction of the linear axis in the base frame.
        free_joint: the linear axis.
    """

    arm: ClosedForm
    direction: Array
    free_joint: int | None = 0

    def branches(self, target: Array, preferred: Sequence[float]) -> Branches:
        """Find every way to reach a pose with the linear axis as preferred; see `ClosedForm`."""
        slide = preferred[0]
        moved = target.copy()
        moved[:3, 3] -= slide * self.direction
        positions, gaps = self.arm.branches(moved, preferred[1:])
        return Branches([(slide, *position) for position in positions], gaps)

    def measures(self, position: Sequence[float]) -> Measures:
        """Measure the arm's distances from singularity; see `ClosedForm`."""
        return self.arm.measures(position[1:])
