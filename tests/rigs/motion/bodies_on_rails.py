"""Bodies whose distances are plain numbers: what stands in for a collision model in exact tests.

Each of two joints is a slide in metres. A body of the robot goes along with both: it nears what
stands on the first rail by a metre with each metre of the first joint, and by half of one with each
of the second, as `sweep` says. The distances themselves are functions that a test writes down.
"""

from collections.abc import Callable, Iterable, Sequence
from types import SimpleNamespace
from typing import cast

import numpy as np

from openpendant.motion.pose import Array
from openpendant.motion.scene.collision import CollisionModel

Distance = Callable[[float, float], float]
"""From the places of both joints to the distance of a pair of bodies [m]."""


def standing_at(place: float) -> Distance:
    """Return the distance from a body that stands on the first rail."""
    return lambda first, second: abs(place - first - 0.5 * second)


def always(distance: float) -> Distance:
    """Return the distance of bodies that no joint moves towards each other."""
    return lambda first, second: distance


class BodiesOnRails:
    """Pairs of bodies, and how often their distances were asked for.

    Attributes:
        looked_at: the pairs of each look.
    """

    def __init__(self, *distances: Distance, gain: float = 1.0, joints: int = 2) -> None:
        """Make one pair for each distance.

        Args:
            distances: of the pairs.
            gain: what a metre of a joint moves the model's joint by.
            joints: how many there are; those after the second move no body.
        """
        self._distances = distances
        self._gain = gain
        self.pairs = [("robot", f"body {number}") for number in range(len(distances))]
        self.sweep: Array = np.zeros((len(distances), joints))
        self.sweep[:, :2] = 1.0, 0.5
        self.scene = SimpleNamespace(objects=())
        self.kinematics = SimpleNamespace(dof=joints)
        self.looked_at: list[list[int]] = []

    @property
    def model(self) -> CollisionModel:
        """These bodies, to who takes a collision model."""
        return cast(CollisionModel, self)

    def model_positions(self, positions: Array) -> Array:
        return self._gain * positions

    def model_rates(self, rates: Array) -> Array:
        return self._gain * rates

    def clearances(self, position: Array) -> Array:
        return np.array(self.clearances_of(range(len(self.pairs)), position))

    def clearances_of(self, pairs: Iterable[int], position: Sequence[float] | Array) -> list[float]:
        asked = list(pairs)
        self.looked_at.append(asked)
        first, second, *_ = (self._gain * float(each) for each in position)
        return [self._distances[pair](first, second) for pair in asked]
