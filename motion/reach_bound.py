"""A ball, or a ball along a track, that holds every place that an arm's tool can be at.

Owns the bound by which a target far out of reach is refused without a search. From the first joint
that turns on, the way to the tool is a chain of rigid links; whatever the joints do, it is no
longer than their lengths together, and what sliding joints between them add (the triangle
inequality). A rail in front of it carries the ball along. Knows no orientation and no search: what
lies inside may be out of reach all the same.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from .kinematics import Array, Kinematics


@dataclass(frozen=True, slots=True, eq=False)
class ReachBound:
    """A ball whose centre slides along a track.

    Attributes:
        foot: (3,) the centre with the rail at its least position, in the base frame [m].
        track: (3,) from there to where the rail ends [m]; zero without a rail.
        radius: of the ball [m], infinite where no bound is known.
    """

    foot: Array
    track: Array
    radius: float

    def beyond(self, position: Sequence[float] | Array) -> float:
        """Return how far a (3,) place in the base frame is outside [m]; inside, 0 or less."""
        away = np.asarray(position) - self.foot
        if squared := float(self.track.dot(self.track)):
            away -= min(max(float(away.dot(self.track)) / squared, 0.0), 1.0) * self.track
        return math.hypot(*away.tolist()) - self.radius


def reach_bound(kinematics: Kinematics) -> ReachBound:
    """Return the bound of a robot."""
    chain = kinematics.robot.moving
    least, most = np.zeros((2, kinematics.dof))
    if chain[0].name == kinematics.robot.driven[0].name and chain[0].prismatic:
        least[0], most[0] = kinematics.lower[0], kinematics.upper[0]
        chain = chain[1:]
    if (
        not chain
        or chain[0].prismatic
        or any(joint.prismatic and joint.dependent for joint in chain)
    ):
        return ReachBound(np.zeros(3), np.zeros(3), math.inf)
    foot, end = (kinematics.forward(at, link=chain[0].child).position for at in (least, most))
    places = [kinematics.forward(least, link=joint.child).position for joint in chain]
    places.append(kinematics.forward(least).position)
    radius = sum(math.dist(*pair) for pair in pairwise(places))
    radius += sum(max(-joint.lower, joint.upper) for joint in chain if joint.prismatic)
    return ReachBound(foot, end - foot, radius)
